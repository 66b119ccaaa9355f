"""What a point of a section of an FMU is: its numbers, and the values that parameters have there.

A point is the states, the speeds of entry that stops remember (0 where they are free), and, unless the section is one
of time, the phase of the forcing in turns. What nothing forces has no phase.
"""

import copy
import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from fmu_models.base.arrays import Flags, Varied, Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.formula import Formula
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.flow import constants_of
from fmu_models.sections.system import SectionSystem, named_point
from fmu_models.simulation.ensemble import Where
from fmu_models.simulation.run import check_names, check_settings, check_value
from fmu_models.simulation.sections import Section

# periods, or seconds where nothing forces the motion, after which a section counts as one that is not met
PATIENCE = 1000.0


@dataclass(frozen=True)
class Begin:
    """What a motion from some states is beside them.

    Attributes:
        values: of parameters by name.
        time, latest: s, its begin and its latest end.
        section: where it ends before that.
        period: s, of the forcing; 0: its begin is no number of a point.
    """

    values: Mapping[str, float]
    time: float
    latest: float
    section: Section | None = None
    period: float = 0.0


@dataclass(frozen=True)
class SignalPeriod:
    """How often a signal repeats that a model drives itself.

    Attributes:
        period: s, of parameters.
        rates: d(log period) by parameter.
    """

    period: Formula
    rates: Mapping[str, Formula]


class FmuPoints(SectionSystem):
    """What is known of the points of an FMU before anything moves, and what a backend asks about their section.

    Without a forcing or a period, that of the signals that the model drives itself is taken, at the present parameters.

    Args:
        fmu, forcing, period, parameters: of ``FmuSection``.

    Attributes:
        tolerance: relative local error of a step.
        strobes: whether the section is one of time.
        wait: s, what counts as a period where nothing forces the motion.
        signal: what says the period, if it is a signal of the model.

    Raises:
        StickslipError: unknown names, values out of their range, a forcing without period, signals of several periods.
    """

    tolerance: float
    wait: float = 1.0
    strobes: bool = False

    def __init__(
        self, fmu: Fmu, forcing: str | None, period: float | None, parameters: Mapping[str, float] | None
    ) -> None:
        self.fmu, self.forcing, self.period = fmu, forcing, period
        self.values = _checked(fmu, self.parameters, parameters, forcing, period)
        self.signal = _common(fmu) if forcing is None and period is None else None

    @property
    def name(self) -> str:
        return str(self.fmu.description.modelName)

    @cached_property
    def columns(self) -> list[tuple[str, int]]:
        """Each number of a point and its place in a row of the engine: states, memories of all contacts, time."""
        n, contacts = len(self.fmu.states), self.contacts
        memories = [(f"{name}_memory", n + i) for i, name in enumerate(contacts) if f"{name}_memory" in self.memories]
        return [*zip(self.fmu.states, range(n), strict=True), *memories, *self._phase(n + len(contacts))]

    def _phase(self, index: int) -> list[tuple[str, int]]:
        return [("phase", index)] if self.forced else []

    @cached_property
    def memories(self) -> list[str]:
        """Names of the speeds of entry that stops remember."""
        return self.fmu.memories if self.fmu.ours else []

    @cached_property
    def states(self) -> tuple[str, ...]:  # type: ignore[override] # computed once, as all below that are cached
        return tuple(name for name, _ in self.columns)

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(self.fmu.contacts) if self.fmu.ours else ()

    @property
    def forced(self) -> bool:
        """Whether something forces the motion."""
        return self.forcing is not None or self.period is not None or self.signal is not None

    @cached_property
    def drifting(self) -> list[int]:  # type: ignore[override]
        return [self.states.index(name) for name in self.fmu.cyclic]

    @property
    def dimension(self) -> int:
        """What nothing forces has one of its states bound by the section; memories follow from the way."""
        return len(self.fmu.states) - (not self.forced)

    @cached_property
    def parameters(self) -> Sequence[str]:  # type: ignore[override]
        """Parameters and inputs."""
        return [*self.fmu.parameters, *self.fmu.inputs] if self.fmu.ours else constants_of(self.fmu)

    def check(self, name: str, values: Vector) -> None:
        """Raises StickslipError: no such parameter or input, or a value out of its range."""
        refuse_unknown(name, self.parameters, f"'{self.name}' has no parameter '{name}'.")
        for value in (np.min(values), np.max(values)):
            check_value(self.fmu, name, float(value))
        if name == self.forcing and not (np.asarray(values) > 0).all():
            raise StickslipError(
                f"'{name}' is the frequency of the forcing and must be positive, found {min(values):g}."
            )

    def unit_of(self, name: str) -> str:
        return str(getattr(self.fmu.variables.get(name), "unit", None) or "1")

    def description_of(self, name: str) -> str:
        return str(getattr(self.fmu.variables.get(name), "description", None) or "")

    def at(self, **values: float) -> Self:
        """The same points with other values of parameters or inputs."""
        for name, value in values.items():
            self.check(name, np.array([value], dtype=float))
        section = copy.copy(self)
        section.values = {**self.values, **{n: float(v) for n, v in values.items()}}
        return section

    def start(self, values: Mapping[str, float] | Sequence[float] | None = None) -> Vector:
        """(n,) states by name, in SI units; what is not given has the default of the FMU."""
        starts = [self.fmu.variables[name].start if name in self.fmu.variables else 0.0 for name in self.states]
        point = named_point(self.name, self.states, np.array([float(start or 0.0) for start in starts]), values)
        for name, value in zip(self.states, point.tolist(), strict=True):
            if name in self.fmu.variables:
                check_value(self.fmu, name, value)
        return point

    def sizes(self) -> Vector:
        """(n,) nominal values."""
        sizes = np.array([self.fmu.size_of(name) for name in self.states])
        sizes[self.drifting] = np.inf
        return sizes

    @property
    def free(self) -> Flags:
        return ~np.isin(np.arange(len(self.states)), self.drifting)

    def difference(self, points: Vector) -> Vector:
        """(..., n) as of any section; of what drifts there is none."""
        differences = super().difference(points)
        if self.drifting:
            differences = differences.copy()
            differences[..., self.drifting] = 0.0
        return differences

    @cached_property
    def turns(self) -> Vector:  # type: ignore[override]
        """The phase is one of whole turns."""
        return np.array([1.0 if name == "phase" else np.inf for name in self.states])

    def periods(self, varied: Varied, m: int) -> Vector:
        """(m,) periods of the forcing, s; 0 where nothing forces the motion."""
        if self.signal is not None:
            names = self.signal.period.names
            values = {name: varied.get(name, self.values.get(name, self.fmu.start_of(name))) for name in names}
            return np.broadcast_to(np.asarray(self.signal.period(values)), m)
        if self.forcing is None:
            return np.full(m, self.period or 0.0)
        variable = self.fmu.variables[self.forcing]
        frequency = varied.get(self.forcing, np.full(m, self.values.get(self.forcing, self.fmu.start_of(self.forcing))))
        return (2.0 * math.pi if variable.unit == "rad/s" else 1.0) / frequency

    def period_rates(self, at: Mapping[str, float]) -> Vector:
        """(k,) d(log period) by these parameters, at these values of them."""
        if self.signal is None:
            return np.array([-1.0 / value if name == self.forcing else 0.0 for name, value in at.items()])
        rates, names = self.signal.rates, self.signal.period.names
        values = {name: at.get(name, self.values.get(name, self.fmu.start_of(name))) for name in names}
        return np.array([rates[name](values) if name in rates else 0.0 for name in at], dtype=float)

    def as_run(self, point: Vector) -> dict[str, dict[str, float]]:
        """Arguments of ``simulate`` for the motion from a point (n,); its phase is left out."""
        start = dict(zip(self.states, point.tolist(), strict=True))
        states = {name: value for name, value in start.items() if name in self.fmu.states}
        return {
            **self.fmu.settings(self.values),
            "start": states | {name: start[name] for name in self.memories if start[name] != 0.0},
        }

    @abstractmethod
    def where(self) -> Where:
        """The section, as the engine is asked for it."""

    @abstractmethod
    def begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        """The motion to the next meeting from a point, as the importer is asked for it."""

    def placed(self, starts: Vector) -> Vector:
        """Starts (m, n) brought onto the section where only rounding keeps them off it, as the engine does."""
        return starts

    def repeats(self, periods: Vector) -> Vector:
        """(m,) what the engine takes for the period: that of a step of a strobe, that of the forcing of the others."""
        return periods

    def missed(self, period: float) -> str:
        """The sentence that the section is not met, and how long it was waited for."""
        waited = f"{PATIENCE:g} periods, {PATIENCE * period:.6g} s" if self.forced else f"{PATIENCE * self.wait:g} s"
        return f"the section is not met within {waited}"


def _common(fmu: Fmu) -> SignalPeriod | None:
    """How often all signals of a model repeat; None without any.

    Raises:
        StickslipError: they differ, or a period is no formula of known functions.
    """
    periods = {signal["period"]: signal["rates"] for signal in fmu.signals.values()}
    if len(periods) > 1:
        told = ", ".join(f"{name} {signal['period']}" for name, signal in fmu.signals.items())
        raise StickslipError(
            f"The signals of '{fmu.description.modelName}' have periods of their own ({told}). Give one, in s, in "
            "which all of them repeat (--period, period=)."
        )
    for period, rates in periods.items():
        return SignalPeriod(Formula.read(period), {name: Formula.read(rate) for name, rate in rates.items()})
    return None


def _checked(
    fmu: Fmu, names: Sequence[str], constants: Mapping[str, float] | None, forcing: str | None, period: float | None
) -> dict[str, float]:
    values = dict(constants or {})
    check_settings(fmu, "parameter", values, names)
    if forcing is not None:
        check_names(fmu, "parameter", {forcing: None}, names)
        frequency = values.get(forcing, fmu.start_of(forcing))
        if not frequency > 0.0:
            raise StickslipError(f"The forcing has no period: {forcing} = {frequency:g}. Choose a positive frequency.")
    if period is not None and not (math.isfinite(period) and period > 0.0):
        raise StickslipError(f"A period must be a positive number of seconds, found {period:g}.")
    if forcing is not None and period is not None:
        raise StickslipError(f"The period follows from '{forcing}'; leave out {period:g} s, or the name.")
    return values
