"""What every analysis knows of a system: its state at a section, and the step from there to the next meeting with it.

    step: point -> next point, derivative of that by the point, events on the way, time that passed

A declared map is one (the section is every step), and so is an oscillator seen once per period (``Strobe``), where a
state crosses a level (``Crossing``), at the impacts of a contact (``Impacts``), or by a return map. Whoever writes
another one gives ``step`` and gets ``run`` for it, step by step; the FMUs of this suite make whole families of runs in
one call of their engine.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.arrays import Flags, Varied, Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.families import stepwise
from fmu_models.families.execution import Execution, Runner
from fmu_models.families.jobs import Jobs, reason
from fmu_models.families.stepwise import Step
from fmu_models.simulation.rows import RunRows


class Units(dict[str, str]):
    """Units of quantities by name, and what a picture says of them.

    descriptions: by name; contacts: names, in the order in which the words n-p-q of motions count them.
    """

    def __init__(self, units: Mapping[str, str], descriptions: Mapping[str, str], contacts: tuple[str, ...]) -> None:
        super().__init__(units)
        self.descriptions, self.contacts = descriptions, contacts


class SectionSystem(Shown, ABC):
    """A system seen at a section.

    Attributes:
        values: parameters that are not at their default.
        dimension: of the space of differences that a step may keep: n, or less where the numbers of a point are bound.
        unit: of the time that a step takes: "s" or "1".
        autonomous: nothing forces the motion and its time is no part of the point, though the section is one of time:
            one of the exponents is zero.
        together: runs that are best made by one call, since they go step by step together.
        pace: steps in the time that a run of the engine's series takes for one.
    """

    values: Mapping[str, float]
    unit: str = "s"
    autonomous: bool = False
    together: int = 4096
    alone = False  # threads may share it
    pace: int = 1

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the model."""

    @property
    @abstractmethod
    def states(self) -> tuple[str, ...]:
        """Names of the numbers of a point."""

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of those whose events are counted on the way."""
        return ()

    @property
    def dimension(self) -> int:
        """See the class."""
        return len(self.states)

    def unit_of(self, name: str) -> str:
        """Unit of a state, parameter or input; "1" where it has none."""
        return "1"

    def description_of(self, name: str) -> str:
        """What a state, parameter or input is; empty where nothing says so."""
        return ""

    def units(self, *names: str) -> Units:
        """Units of quantities, and what a picture says of them."""
        described = {name: self.description_of(name) for name in names}
        return Units({name: self.unit_of(name) for name in names}, described, tuple(self.contacts))

    @property
    @abstractmethod
    def parameters(self) -> Sequence[str]:
        """Names of all parameters."""

    @abstractmethod
    def at(self, **values: float) -> Self:
        """The same system with other values of parameters.

        Raises:
            StickslipError: an unknown name or a value out of its range.
        """

    @abstractmethod
    def check(self, name: str, values: Vector) -> None:
        """Raises StickslipError: no such parameter, or one of the values (m,) is none that it can have."""

    @abstractmethod
    def start(self, values: Mapping[str, float] | Sequence[float] | None = None) -> Vector:
        """(n,) a point; what is not given has its default.

        Raises:
            StickslipError: unknown names, a value out of its range.
        """

    @abstractmethod
    def step(self, points: Vector, varied: Varied | None = None, *, derivative: bool = True) -> Step:
        """One step of points (m, n); varied: values (m,) of parameters by name."""

    @property
    def how(self) -> str:
        """Where steps and their derivatives come from, in words, where that is not a matter of course."""
        return ""

    def along(self, points: Vector, varied: Varied | None = None) -> Vector:
        """(m, n) the direction of the motion at points (m, n), of what is autonomous."""
        raise StickslipError(f"{self.name} has no direction of its motion: a step of it is no part of a flow.")

    def run(self, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
        """The rows of some jobs; ends soon where ``stop`` (1,) is set."""
        return stepwise.run(self, jobs, stop)

    def make(
        self, jobs: Jobs, *, workers: int | None = None, progress: Callable[[float], Any] = lambda fraction: None
    ) -> RunRows:
        """The rows of all jobs, by threads, in memory; see ``runner`` for the rest."""
        return Runner(self, execution=Execution(workers=workers), progress=progress).make(jobs)

    def motion(
        self,
        start: Mapping[str, float] | Sequence[float] | None,
        transient: int,
        steps: int,
        progress: Callable[[float], Any] = lambda fraction: None,
    ) -> RunRows:
        """The rows of one motion, a step each.

        Raises:
            StickslipError: unknown states or values out of their range, or the motion ends before; says why.
        """
        rows = self.make(Jobs(self.start(start)[None], transient=transient, rows=steps), progress=progress)
        if rows.filled[0] < steps:
            why = f"the motion ends after {rows.steps[0]} steps: {reason(rows, 0)}"
            raise StickslipError(f"{self.name}: {why}. Start elsewhere.")
        return rows

    def identity(self) -> dict[str, Any]:
        """The identity of this system among all others, as JSON: a store keeps it.

        Raises:
            StickslipError: it depends on something that has no name.
        """
        plain = {name: value for name, value in vars(self).items() if isinstance(value, str | int | float | None)}
        return {"section": type(self).__name__, "model": self.name, **plain, "parameters": dict(self.values)}

    @property
    def drifting(self) -> list[int]:
        """Numbers of a point upon which nothing depends, as a height is that only falls: none is far from another, and
        a step of the others does not change by them."""
        return []

    @property
    def free(self) -> Flags:
        """(n,) numbers by which points may differ: none that drifts, and not the one that names the section."""
        return np.ones(len(self.states), bool)

    @property
    def driven(self) -> list[int]:
        """Numbers of a point that are phases which turn by themselves, as a forcing of a second frequency has one."""
        return []

    @property
    def turns(self) -> Vector:
        """(n,) after how much of itself each number of a point is the same; infinite of what is no angle or phase."""
        return np.full(len(self.states), np.inf)

    def wrapped(self, points: Vector) -> Vector:
        """(..., n) angles and phases brought within their period."""
        turns = self.turns
        if np.isinf(turns).all():
            return points
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(turns), np.mod(points, np.where(np.isfinite(turns), turns, 1.0)), points)

    def difference(self, points: Vector) -> Vector:
        """(..., n) the shortest difference that one of points stands for."""
        turns = self.turns
        if np.isinf(turns).all():
            return points
        period = np.where(np.isfinite(turns), turns, 1.0)
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(turns), points - np.round(points / period) * period, points)

    def sizes(self) -> Vector:
        """(n,) typical size of each number of a point; infinite for one that only drifts and makes no difference."""
        return np.ones(len(self.states))

    def log_volumes(self, points: Vector) -> Vector | None:
        """(m,) logarithm of what a step makes of a small volume, by itself and not by the growth of differences; None
        where it is not known."""
        return None

    def _contents(self) -> dict[str, object]:
        return {"model": self.name, "states": self.states, **self.values}


def named_point(
    name: str, states: Sequence[str], defaults: Vector, values: Mapping[str, float] | Sequence[float] | None
) -> Vector:
    """(n,) a point from a mapping by name or from all its numbers.

    Raises:
        StickslipError: unknown names, or another number of numbers.
    """
    if values is None:
        return defaults.copy()
    if isinstance(values, Mapping):
        point = defaults.copy()
        for state, value in values.items():
            refuse_unknown(state, states, f"{name} has no state '{state}'.")
            point[list(states).index(state)] = float(value)
    else:
        point = np.array(values, dtype=float)
    if point.shape != (len(states),) or not np.isfinite(point).all():
        raise StickslipError(f"{name} starts at {len(states)} finite numbers ({', '.join(states)}), found {values}.")
    return point


def ascending(name: str, ends: Sequence[float]) -> tuple[float, float]:
    """Both ends of the range of a state or parameter. StickslipError: they are not two finite numbers that ascend."""
    if len(ends) != 2 or not (np.isfinite(ends).all() and ends[0] < ends[1]):
        raise StickslipError(f"The range of '{name}' must be two ascending numbers, found {list(ends)}.")
    return ends[0], ends[1]


def listed(name: str, values: ArrayLike) -> Vector:
    """(m,) values of a state or parameter. StickslipError: they are no list of finite numbers."""
    numbers = np.atleast_1d(np.asarray(values, dtype=float))
    if numbers.ndim != 1 or not numbers.size or not np.isfinite(numbers).all():
        raise StickslipError(f"The values of '{name}' must be a list of finite numbers, found shape {numbers.shape}.")
    return numbers
