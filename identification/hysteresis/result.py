"""What is said of loops: the sliders, what they take in each cycle, and laws beside one another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fmu_models.base.errors import StickslipError, named
from fmu_models.base.shown import Pictured
from fmu_models.language.mechanism import Mechanism
from identification.calibration.result import LOOPS, CalibratedValue
from identification.hysteresis.laws import CENTER, LAWS, MEDIAN, loop_model
from identification.hysteresis.loop import LoopLog
from identification.hysteresis.spectrum import SliderSpectrum

if TYPE_CHECKING:
    import pandas

    from fmu_models.language.hysteresis.law import HysteresisLaw
    from identification.calibration.result import Calibration


@dataclass(frozen=True)
class LoopCycle:
    """What engineers print of a loop. amplitude: m, half of its way; count: cycles of about that amplitude; work: J a
    cycle; stiffness: N/m, of the line through its ends; damping_ratio: work/(2 pi stiffness amplitude^2)."""

    log: str
    amplitude: float
    count: int
    work: float
    stiffness: float
    damping_ratio: float


@dataclass(frozen=True)
class FittedLaw:
    """A law and how well it tells the force. name: as `laws.LAWS` has it; parameters: with standard deviations that
    allow for colour; left: by log, root mean square of what is left over the standard deviation of the force; held_out:
    the same of logs that took no part; notes: what the logs leave open; why: it could not be fitted; empty if it was;
    calibration: behind it, None in a result that was read back."""

    RECORD: ClassVar = ("name", "parameters", "left", "held_out", "notes", "why", "calibration", "declaration")

    name: str
    parameters: tuple[CalibratedValue, ...] = ()
    left: Mapping[str, float] = field(default_factory=dict)
    held_out: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    why: str = ""
    calibration: Calibration | None = field(default=None, repr=False, compare=False)

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return {parameter.name: parameter.value for parameter in self.parameters}

    @property
    def model_values(self) -> dict[str, float]:
        """Parameters of its model, those that were not sought too; of a law with its calibration."""
        assert self.calibration is not None
        return {**{name: self.calibration.held[name] for name in (CENTER, MEDIAN)}, **self.values}

    @property
    def declaration(self) -> str:
        """The contact as Python text, of a way x; empty if the law was not fitted."""
        if self.why:
            return ""
        rounded = {name: float(f"{value:.6g}") for name, value in self.values.items()}
        damping = f", damping={rounded['damping']}" if "damping" in rounded else ""
        return f'Hysteresis(name="joint", way=x, law={LAWS[self.name].at(rounded)!r}{damping})'

    @property
    def worst(self) -> float:
        """The largest part that is left of a log; infinite where the law could not be fitted."""
        return max(self.left.values(), default=np.inf)


@dataclass(frozen=True, eq=False)
class HysteresisFit(Pictured):
    """Loops, as sliders and by laws. logs: as they were fitted; held_out: logs that took no part; spectrum: the
    sliders; left, left_out: by log, what the sliders leave of the force over its standard deviation; cycles: by
    amplitude; laws: the best first; load: N, of which the laws' force is; None without a load; lag: s, of
    columns that sliders grow with; notes: what was done and
    what the logs leave open."""

    RECORD: ClassVar = (
        *("type=kind", "names=logs", "left", "left_out", "stiffness", "sliding_force", "spring_beside"),
        *("bounds", "stiffnesses", "cycles", "laws", "load", "lag", "notes"),
    )

    logs: tuple[LoopLog, ...]
    held_out: tuple[LoopLog, ...]
    spectrum: SliderSpectrum
    left: Mapping[str, float]
    left_out: Mapping[str, float]
    cycles: tuple[LoopCycle, ...]
    laws: tuple[FittedLaw, ...]
    load: float | None = None
    lag: float | None = None
    notes: tuple[str, ...] = ()
    kind: ClassVar[str] = LOOPS

    @property
    def names(self) -> tuple[str, ...]:
        """Of the logs."""
        return tuple(log.name for log in self.logs)

    @property
    def stiffness(self) -> float:
        """At rest, N/m (per unit of load where there is one)."""
        return self.spectrum.stiffness_at_rest()

    @property
    def sliding_force(self) -> float:
        """N (per unit of load where there is one)."""
        return self.spectrum.sliding_force()

    @property
    def spring_beside(self) -> float:
        """N/m, of what never gives way."""
        return self.spectrum.spring_beside()

    @property
    def bounds(self) -> np.ndarray:
        """(k,) m, of the sliders."""
        return self.spectrum.bound

    @property
    def stiffnesses(self) -> np.ndarray:
        """(k, factors) N/m, of the sliders."""
        return self.spectrum.stiffness

    @property
    def best(self) -> FittedLaw:
        """The law that leaves least. StickslipError: no law was fitted."""
        if not self.laws or self.laws[0].why:
            raise StickslipError("No law was fitted to these loops; their sliders are in 'spectrum'.")
        return self.laws[0]

    def law(self, name: str = "") -> HysteresisLaw:
        """A fitted law in numbers (default: the best), for Hysteresis(way=..., law=...). StickslipError: it was not
        fitted."""
        fitted = self._fitted(name)
        return LAWS[fitted.name].at(fitted.values)

    def model(self, name: str = "") -> Mechanism:
        """A law (default: the best) along a way that an input prescribes; its values are those of the fitted law.
        StickslipError: it was not fitted."""
        return loop_model(LAWS[self._fitted(name).name], rate=self.spectrum.rate)

    def _fitted(self, name: str) -> FittedLaw:
        fitted = [law for law in self.laws if not law.why]
        return named(fitted, name, f"'{name}' was not fitted to these loops.") if name else self.best

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each law."""
        import pandas

        rows = [{"law": law.name, **law.values, "left": law.worst} for law in self.laws if not law.why]
        return pandas.DataFrame(rows).set_index("law") if rows else pandas.DataFrame()

    def _heading(self) -> str:
        return f"Hysteresis of {', '.join(self.names)}: sliders leave {100 * max(self.left.values()):.3g} %"

    def _contents(self) -> dict[str, object]:
        contents: dict[str, object] = {"stiffness": self.stiffness, "sliding_force": self.sliding_force}
        return contents | {law.name: f"{100 * law.worst:.3g} % left" for law in self.laws if not law.why}


def cycles_of(log: LoopLog) -> list[LoopCycle]:
    """Cycles of a log, those of about one amplitude together."""
    turns = log.reversals[1:-1]
    cycles: list[tuple[float, float, float]] = []
    for first, middle, last in zip(turns[:-2:2], turns[1:-1:2], turns[2::2], strict=False):
        way, force = log.way[first : last + 1], log.force[first : last + 1]
        amplitude = float(np.ptp(way)) / 2
        ends = log.force[middle] - (log.force[first] + log.force[last]) / 2
        reach = log.way[middle] - (log.way[first] + log.way[last]) / 2
        cycles.append((amplitude, float(np.trapezoid(force, way)), float(ends / reach)))
    groups: list[list[tuple[float, float, float]]] = []
    for cycle in sorted(cycles):
        if groups and cycle[0] <= 1.1 * groups[-1][0][0]:
            groups[-1].append(cycle)
        else:
            groups.append([cycle])
    rows = []
    for group in groups:
        amplitude, work, stiffness = np.mean(group, axis=0).tolist()
        ratio = work / (2 * np.pi * stiffness * amplitude**2) if stiffness > 0 else np.inf
        rows.append(LoopCycle(log.name, amplitude, len(group), work, stiffness, ratio))
    return rows
