"""All crossings of a level by a state, of one motion."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.sections import Section, SectionFollower


@dataclass(frozen=True, eq=False)
class Crossed:
    """times: (n,) s; states: per state (n,) in its unit; contacts: per contact (n,) its states."""

    times: NDArray[np.float64]
    states: Mapping[str, NDArray[np.float64]]
    contacts: Mapping[str, NDArray[np.int8]]

    def __len__(self) -> int:
        return self.times.size


def crossings(
    fmu: Fmu,
    state: str,
    *,
    level: float = 0.0,
    direction: int = 1,
    stop_time: float,
    most: int | None = None,
    start_time: float = 0.0,
    start: Mapping[str, float] | None = None,
    **run: Any,
) -> Crossed:
    """Those up to a time, or the first ``most``; run: parameters, inputs, tolerance of ``SectionFollower``."""
    follower = SectionFollower(fmu, Section(state, level, direction), **run)
    points = list(itertools.islice(follower.follow(start or {}, stop_time, start_time=start_time), most))
    return Crossed(
        np.array([point.time for point in points]),
        {name: np.array([point.states[name] for point in points]) for name in fmu.states},
        {name: np.array([point.contacts[name] for point in points], dtype=np.int8) for name in fmu.contacts},
    )
