"""Unknowns as lmfit has them: first values, bounds, what is held, and parameters that are expressions of others.

A parameter p_j = f_j(p) that is tied moves with those that are sought, dy/dp_i + sum_j dy/dp_j df_j/dp_i. The
expressions are lmfit's, and are differenced: they cost nothing beside a run.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import refuse_unknown
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.trajectory import Trajectory
from identification.calibration.subject import Response, Stretch, Subject, Vector
from identification.inference.lmfit_exchange import given
from identification.inference.problem import identifier

if TYPE_CHECKING:
    from lmfit import Parameters

STEP = 1e-6  # relative, of a difference of an expression


@dataclass(frozen=True, eq=False)
class Ties:
    """Expressions. parameters: of lmfit, without bounds; free, tied: names of the model by those of lmfit."""

    parameters: Any
    free: Mapping[str, str]
    tied: Mapping[str, str]

    def values(self, sought: Mapping[str, float]) -> dict[str, float]:
        """Of tied parameters, by name, from those that are sought."""
        for key, name in self.free.items():
            self.parameters[key].value = sought[name]
        return {name: float(self.parameters[key].value) for key, name in self.tied.items()}

    def slopes(self, sought: Mapping[str, float]) -> Vector:
        """(tied, free) derivatives of the values."""
        columns = []
        for name in self.free.values():
            step = STEP * max(abs(sought[name]), STEP)
            ends = [self.values({**sought, name: sought[name] + side * step}) for side in (-1, 1)]
            columns.append([(ends[1][tied] - ends[0][tied]) / (2 * step) for tied in self.tied.values()])
        return np.array(columns).T


def of_lmfit(fmu: Fmu, parameters: Parameters) -> tuple[list[str], dict[str, Any]]:
    """What is free, and settings, of `lmfit.Parameters` named after parameters and states of a model. StickslipError: a
    name that is none of the model, none that varies, or as `lmfit_exchange.given`."""
    names = {identifier(name): name for name in (*fmu.parameters, *fmu.states, *fmu.memories)}
    for key in parameters:
        refuse_unknown(key, names, f"'{fmu.description.modelName}' has no parameter or state '{key}'.")
    plain = given({key: one for key, one in parameters.items() if one.expr is None})
    tied = {key: names[key] for key, one in parameters.items() if one.expr is not None}
    free = {key: names[key] for key, one in parameters.items() if one.vary and key not in tied}
    starts = [name for name in free.values() if name in fmu.states]
    settings: dict[str, Any] = {
        "parameters": {names[key]: value for key, value in {**plain.first, **plain.held}.items()},
        "bounds": {name: plain.bounds[key] for key, name in free.items() if np.isfinite(plain.bounds[key]).any()},
        "starts": [*starts, *(name for name in fmu.states if identifier(name) not in parameters)],
    }
    sought = {key: name for key, name in free.items() if name not in starts}
    settings["bounds"] = {name: ends for name, ends in settings["bounds"].items() if name not in starts}
    if tied:
        unbounded = copy.deepcopy(parameters)
        for key in sought:
            unbounded[key].set(min=-np.inf, max=np.inf)
        settings["ties"] = Ties(unbounded, sought, tied)
    return list(sought.values()), settings


class TiedSubject(Subject):
    """A subject some of whose parameters are tied to those that are sought."""

    def __init__(self, subject: Subject, ties: Ties) -> None:
        self._subject, self._ties = subject, ties
        self.fmu, self.states, self.contacts = subject.fmu, subject.states, subject.contacts
        self.timed, self.recorded, self.note, self.half = subject.timed, subject.recorded, subject.note, subject.half
        self.parameters = tuple(ties.free.values())
        self.by = (*self.parameters, *subject.by[len(subject.parameters) :])

    def _whole(self, stretch: Stretch) -> Stretch:
        return replace(stretch, values={**stretch.values, **self._ties.values(stretch.values)})

    def trajectory(self, stretch: Stretch) -> Trajectory:
        return self._subject.trajectory(self._whole(stretch))

    def shown(self, stretch: Stretch) -> Response:
        return self._subject.shown(self._whole(stretch))

    def closed(self, stretch: Stretch) -> bool:
        return self._subject.closed(self._whole(stretch))

    def rate_name(self, state: str) -> str:
        return self._subject.rate_name(state)

    def respond(self, stretch: Stretch) -> Response:
        run, follow = self._subject.respond(self._whole(stretch)), self._ties.slopes(stretch.values)
        hits = {name: (times, self._folded(slopes, follow)) for name, (times, slopes) in run.hits.items()}
        return Response(run.values, self._folded(run.slopes, follow), run.met, hits)

    def _folded(self, slopes: Vector, follow: Vector) -> Vector:
        """Slopes (..., m) by what is sought, of slopes by all parameters, the tied ones behind the others."""
        free, tied = len(self.parameters), len(follow)
        return np.concatenate(
            [slopes[..., :free] + slopes[..., free : free + tied] @ follow, slopes[..., free + tied :]], axis=-1
        )
