"""One run of a case: within an allowance of engine steps, at a step tolerance, from a nudged start, in other units."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.unit_names import parse_unit
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Trajectory
from fmu_models.validation.stress.cases import Case

Scale = tuple[int, int, int]
SAMPLES = 101
# engine steps that a run of a cell may take, and a long one
ALLOWANCE, LONG_ALLOWANCE = 5 * whole_run.ALLOWANCE, 40 * whole_run.ALLOWANCE


class AllowanceSpentError(Exception):
    """A run took more steps than it may; ``reached`` is the fraction of its time that it covered."""

    def __init__(self, reached: float) -> None:
        super().__init__(reached)
        self.reached = reached


@dataclass(frozen=True)
class Mirror:
    """The signs of these parameters and inputs, and of all states, are turned; to these phases pi is added."""

    negated: frozenset[str]
    turned: frozenset[str]


@dataclass(frozen=True, eq=False)
class Trial:
    """A case, its FMU, and how long it lasts, s: less than declared if its steps are too short for that."""

    fmu: Fmu
    case: Case
    duration: float

    def times(self) -> NDArray[np.float64]:
        """(SAMPLES,) s, from the start to the end."""
        return np.linspace(self.case.begin, self.case.begin + self.duration, SAMPLES)

    def run(
        self,
        *,
        times: NDArray[np.float64] | None = None,
        tolerance: float = 1e-14,
        start: Mapping[str, float] | None = None,
        scale: Scale = (0, 0, 0),
        mirror: Mirror | None = None,
    ) -> Trajectory:
        """Simulate; values come back in the units of the case, whatever the ``scale`` (exponents of two).

        ``start`` replaces start values of the case; with a ``mirror`` states come back with their signs turned again.
        StickslipError: refused by the engine. AllowanceSpentError: too many steps.
        """
        case, fmu = self.case, self.fmu
        second = 2.0 ** scale[2]
        values = {**case.parameters, **case.start, **case.inputs, **(start or {})}
        if any(scale) or mirror:
            settable = [*fmu.parameters, *fmu.inputs, *fmu.states]
            values = {name: fmu.start_of(name) for name in settable} | values
        if mirror:
            values = {name: _mirrored(fmu, name, value, mirror) for name, value in values.items()}
        if any(scale):
            values = {name: value * factor(fmu, name, scale) for name, value in values.items()}
        times = self.times() if times is None else times
        allowance = LONG_ALLOWANCE if case.bounded else ALLOWANCE
        calls = 0

        def count(done: float) -> None:
            nonlocal calls
            calls += 1
            if calls * whole_run.ALLOWANCE > allowance and done < 1.0:
                raise AllowanceSpentError(done)

        trajectory = simulate(
            fmu,
            times[-1] * second,
            start_time=case.begin * second,
            **fmu.settings(values),
            start={name: value for name, value in values.items() if name in (*fmu.states, *fmu.memories)},
            output_times=times * second,
            tolerance=tolerance,
            progress=count,
        )
        if mirror:
            turned = {name: -column if name in fmu.states else column for name, column in trajectory.values.items()}
            trajectory = dataclasses.replace(trajectory, values=turned)
        return unscaled(fmu, trajectory, scale) if any(scale) else trajectory


def unscaled(fmu: Fmu, trajectory: Trajectory, scale: Scale) -> Trajectory:
    """A trajectory in scaled units, in the units of the model again; events keep their scaled times."""
    values = {
        name: column if name.endswith("_state") else column / factor(fmu, name, scale)
        for name, column in trajectory.values.items()
    }
    return dataclasses.replace(trajectory, time=trajectory.time / 2.0 ** scale[2], values=values)


def _mirrored(fmu: Fmu, name: str, value: float, mirror: Mirror) -> float:
    if name in mirror.turned:
        return value + math.pi
    return -value if name in mirror.negated or name in fmu.states else value


def factor(fmu: Fmu, name: str, scale: Scale) -> float:
    """By what the number of a variable grows when the units of mass, length and time shrink by powers of two."""
    powers = _powers(fmu.variables[name].unit or "1")
    return 2.0 ** sum(power * exponent for power, exponent in zip(powers, scale, strict=True))


@cache
def _powers(unit: str) -> tuple[float, float, float]:
    items: dict[str, Any] = {str(name): power for name, power in parse_unit(unit).to_base_units().unit_items()}
    kilogram, meter, second = (float(items.get(name, 0.0)) for name in ("kilogram", "meter", "second"))
    return kilogram, meter, second
