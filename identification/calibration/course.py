"""What a track returns: states along a log and parameters that drift, each with its deviation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.record import record
from fmu_models.base.shown import Pictured
from identification.calibration.result import SeriesResidual
from identification.inference.whiteness import COLOURED

if TYPE_CHECKING:
    import pandas

KIND = "stickslip track"


@dataclass(frozen=True)
class Path:
    """A quantity over time. values, deviations: (n,), in its unit."""

    name: str
    unit: str
    values: tuple[float, ...]
    deviations: tuple[float, ...]


@dataclass(frozen=True)
class Drift(Path):
    """A parameter, one value from each node on. rate: of its walk, in its unit per root of a second, 0 of one that
    stays; gain: of -2 ln likelihood over one that stays, beyond 2.71 in one of twenty that do."""

    rate: float = 0.0
    gain: float = 0.0

    @property
    def constant(self) -> bool:
        """Whether the log shows no drift."""
        return self.rate == 0.0

    @property
    def sentence(self) -> str:
        """What became of it."""
        first, last = (value_with_sd(self.values[n], self.deviations[n], self.unit) for n in (0, -1))
        if self.constant:
            return f"'{self.name}' stays: {first}; a drift gains {self.gain:.1f} of -2 ln likelihood, as chance does."
        low, high = min(self.values), max(self.values)
        return (
            f"'{self.name}' drifts from {first} to {last}, between {low:.4g} and {high:.4g}; that gains "
            f"{self.gain:.1f} of -2 ln likelihood over one that stays."
        )


@dataclass(frozen=True)
class Course(Pictured):
    """States and parameters along a log. times: (n,) s, of the states; nodes: (k,) s, from which on values of the
    parameters hold; measured: (n,) by variable, empty in a course that is compared."""

    model: str
    title: str
    log: str
    times: tuple[float, ...]
    states: tuple[Path, ...]
    nodes: tuple[float, ...]
    parameters: tuple[Drift, ...]
    residuals: tuple[SeriesResidual, ...]
    measured: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False, compare=False)

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each sample: states and parameters, and their deviations as "sd ..."."""
        import pandas

        columns: dict[str, Any] = {"time": self.times}
        for path in self.states:
            columns |= {path.name: path.values, f"sd {path.name}": path.deviations}
        at = np.searchsorted(self.nodes, self.times, side="right") - 1
        for path in self.parameters:
            columns |= {path.name: np.take(path.values, at), f"sd {path.name}": np.take(path.deviations, at)}
        return pandas.DataFrame(columns)

    @property
    def sentences(self) -> list[str]:
        """What became of each parameter, and what is left."""
        coloured = [line.variable for line in self.residuals if line.chance < COLOURED]
        sentences = [path.sentence for path in self.parameters]
        if coloured:
            sentences.append(
                f"What is left of {', '.join(coloured)} is coloured: the model misses something, or the noise is not "
                "white, and deviations are too small."
            )
        return sentences

    def _heading(self) -> str:
        return f"Track: {self.title} along {self.log}, {len(self.nodes)} segments"

    def _contents(self) -> Mapping[str, Any]:
        ends = {
            path.name: (path.values[-1], path.deviations[-1], path.unit) for path in (*self.parameters, *self.states)
        }
        return {f"{name} at the end": value_with_sd(*end) for name, end in ends.items()}

    def to_dict(self) -> dict[str, Any]:
        """Plain values only."""
        return {"type": KIND, **record(self), "sentences": self.sentences}
