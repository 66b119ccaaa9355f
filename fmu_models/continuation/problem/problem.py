"""What a branch is followed of: a periodic motion as the root of equations in unknowns z, with all derivatives exact.

    z = (x, [q,] [T,] p) state at the strobe phase, second parameter of a curve, period where nothing forces the motion,
                         parameter
    P(x; T, p) - x = 0   and, where nothing forces it,   f(x) . dx = 0   (a step along the motion is none)

A coordinate upon which nothing depends need not come back, as the height of what falls on and on: instead of its
equation it stays where it is at the strobe.

One run with tangents along x, q and p gives it all: end state, monodromy matrix, the derivative by p. Where p is the
frequency of the forcing, or the period is unknown, the run's start t0 and length T change too; then

    dP/dT = f(end),    dP/dt0 = f(end) - M f(start)

and whatever else depends on the start, as a miss or the time of an event, changes by its derivative along -f(start).
The cyclic word of events belongs to the motion, and so does how near it comes to having another one: the speed at which
the indicator of each event falls, and the least value of every pending indicator between events.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fmu_models.base.arrays import Complex, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.sections.stability import product_eigenvalues
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem

Word = tuple[tuple[str, int, int], ...]


EVENT, TIE = -1, 2  # slots of passings that are those of no indicator: an event, the time between two of them
MANY = 300  # pairs of multipliers
SAME_TIME = 0.1  # of the period: a passing of a neighbour that is further from this in time is another one


def cyclic(word: Word) -> Word:
    """The rotation of a word that comes first: two words are one motion's if these are equal."""
    return min((word[i:] + word[:i] for i in range(len(word))), default=word)


def product_of_pairs(factors: Complex) -> Complex:
    """(...) of factors (k, ...); of many each is brought nearer to 1 in size, for a product that is too small for a
    number has no sign."""
    return np.prod(factors / np.maximum(np.abs(factors), 0.1) if len(factors) > MANY else factors, axis=0)


@dataclass(frozen=True)
class Passing:
    """An event, or a near miss.

    Attributes:
        contact: its name.
        slot: 0 the normal indicator, 1 the tangential one, ``TIE`` the time since an event of another contact; of a
            miss. Of an event ``EVENT``.
        side: of the margin of what sticks; of a miss.
        before, after: states of the contact; of a miss both are the present one.
        time: s, from the start of the run.
        value: speed at which the indicator falls (per s), or the least value of one that does not.
        gradient: (len(z),) derivative of that.
        turned: of a miss: an event of another contact turns what fell.
        begins: of a miss: the force, or the acceleration, with which a state begins after an impact without rebound;
            the acceleration of a slip that begins at an event, or the margin of what sticks after one.
    """

    contact: str
    slot: int
    side: int
    before: int
    after: int
    time: float
    value: float
    gradient: Vector
    turned: bool = False
    begins: bool = False

    @property
    def key(self) -> tuple[str, int, int, int, bool]:
        """What it has in common with the same one of a neighbour, but for its time."""
        return self.contact, self.slot, self.side, self.before, self.begins

    def size(self, scales: Vector) -> float:
        """How much the value changes by a unit of u."""
        return float(np.linalg.norm(self.gradient * scales)) or 1.0

    def far_speed(self, scales: Vector) -> float:
        """What the speed of an event becomes a unit of u away, its square growing as it does here."""
        return float(np.sqrt(2.0 * self.value * self.size(scales)))

    def begun_in(self, passings: Sequence[Passing]) -> list[Passing]:
        """Those of the same contact that begin in the same state."""
        return [event for event in passings if event.contact == self.contact and event.before == self.before]


@dataclass(frozen=True, eq=False)
class Seen:
    """What a run over one period has shown.

    Attributes:
        residual: (n,) or, where nothing forces the motion, (n + 1,) of the equations.
        jacobian: the derivative of that by z.
        monodromy: (n, n) derivative of the end by the start.
        length: s, of the run.
        word: events on the way, one after the other.
        passings: gives events and misses, with their derivatives.
        one_sided: events at one instant: the derivatives hold on one side.
        factors: (m, n, n) derivatives of the ends of m segments by their starts, whose product the monodromy matrix is,
            the first one rightmost; None where there is one segment.
    """

    residual: Vector
    jacobian: Vector
    monodromy: Vector
    length: float
    word: Word = ()
    passings: Callable[[], tuple[tuple[Passing, ...], tuple[Passing, ...]]] = lambda: ((), ())
    one_sided: bool = False
    factors: Vector | None = None

    @property
    def width(self) -> int:
        """Number of unknowns that are states: at the starts of all segments."""
        return len(self.monodromy) * (1 if self.factors is None else len(self.factors))

    @cached_property
    def _told(self) -> tuple[tuple[Passing, ...], tuple[Passing, ...]]:
        return self.passings()  # most runs of Newton's method are not asked for them

    def match(self, like: Passing, time: float | None = None) -> Passing | None:
        """The same event or miss as that of another run, nearest around the period to a time, or to that of the other
        one; None if there is none."""
        passings, instant = self.events if like.slot == EVENT else self.misses, like.time if time is None else time
        same = [passing for passing in passings if passing.key == like.key]

        def apart(passing: Passing) -> float:
            turn = abs(passing.time - instant) / self.length % 1.0
            return min(turn, 1.0 - turn)

        closest = min(same, key=apart, default=None)
        return closest if closest is not None and apart(closest) <= SAME_TIME else None

    @property
    def events(self) -> tuple[Passing, ...]:
        """In order of time."""
        return self._told[0]

    @property
    def misses(self) -> tuple[Passing, ...]:
        """Least values of pending indicators, and what else may become an event."""
        return self._told[1]


def range_of(over: str, between: tuple[float, float]) -> tuple[float, float]:
    """The least and the largest value of a parameter. StickslipError: they are no range."""
    low, high = sorted(float(bound) for bound in between)
    if not low < high or not np.isfinite([low, high]).all():
        raise StickslipError(f"A branch needs a range of '{over}', from one finite value to another, found {between}.")
    return low, high


class Problem(ABC):
    """A family of periodic motions over one parameter.

    Attributes:
        over: name of the parameter.
        second: name of the second one; "" for a branch.
        size: number of unknowns.
        states: names of the numbers of x.
        still: motions are equilibria, and what is seen as their monodromy matrix is the derivative of their rates.
        neutral: how many multipliers are 1 of every motion: of a step along one that nothing forces, of a coordinate
            upon which nothing depends.
    """

    over: str
    states: tuple[str, ...]
    second: str = ""
    autonomous: bool = False
    still: bool = False
    neutral: int = 0
    phase: float = 0.0

    @property
    def width(self) -> int:
        """Number of unknowns that are states, with which z begins."""
        return len(self.states)

    @property
    def second_index(self) -> int:
        """Place of the second parameter in z, from its end."""
        return -2 - self.autonomous

    @property
    def size(self) -> int:
        """Number of unknowns z."""
        return self.width + self.autonomous + len(self.parameters)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names, as they come in z."""
        return (self.second, self.over) if self.second else (self.over,)

    def values(self, z: Vector) -> dict[str, float]:
        """Of the parameters."""
        last = {self.over: float(z[-1])}
        return {self.second: float(z[self.second_index]), **last} if self.second else last

    @property
    @abstractmethod
    def system(self) -> SectionSystem:
        """Whose motions they are."""

    @property
    def name(self) -> str:
        """Of the model."""
        return self.system.name

    @property
    def units(self) -> dict[str, str]:
        """Of states and parameters."""
        return self.system.units(*self.states, *self.parameters)

    @abstractmethod
    def opened(self, second: str) -> Problem:
        """The same over two parameters. StickslipError: no such parameter."""

    @abstractmethod
    def present(self, name: str) -> float:
        """The value of a parameter that is not an unknown."""

    def value_within(self, between: tuple[float, float]) -> float:
        """The present value of the parameter. StickslipError: it is out of a range."""
        value = self.present(self.over)
        if not between[0] <= value <= between[1]:
            raise StickslipError(
                f"The start has {self.over} = {value:g}, which is not between {between[0]:g} and {between[1]:g}. Set "
                "it to a value in that range."
            )
        return value

    @abstractmethod
    def see(self, z: Vector) -> Seen:
        """The run from z. StickslipError: there is none, or it has no derivative."""

    def missed(self, z: Vector) -> Vector | None:
        """The residual at z alone, where that costs far less than its derivatives; else None. StickslipError: there is
        no run."""
        return None

    def how(self, z: Vector, seen: Seen) -> str:
        """Where motions and derivatives come from, where that is not a matter of course, and how near they are."""
        return ""

    @abstractmethod
    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """(len(z),) by which unknowns are measured."""

    def is_rigid(self, contact: str) -> bool:
        """Whether a contact impacts."""
        return False

    def scales_like(self, scales: Vector) -> Vector:
        """Those of z, from those of the same family at another phase or of other segments."""
        return scales

    @abstractmethod
    def folded(self, times: int, growth: float = 1.0) -> Problem:
        """The same, of a period that is so many times as long, tangents growing so much in one of them."""

    def told(self) -> dict[str, Any]:
        """What tells this one from others of the same family, if there are others."""
        return {}

    def like(self, identity: Mapping[str, Any]) -> Problem:
        """The one of the family that was told."""
        return self

    def rephased(self, z: Vector, seen: Seen, scales: Vector) -> tuple[Problem, Vector] | None:
        """The problem at another phase or of other segments, and z there, where an event is too near to the start of
        one, or tangents grow too much on the way; None where neither is so."""
        return None

    def later(self, z: Vector, seen: Seen, seconds: float) -> tuple[Problem, Vector]:
        """The problem that begins so much later, and z there."""
        return self, z

    @property
    def turns(self) -> int:
        """Periods of the forcing in one of the motion: from so many starts it is the same motion."""
        return 1

    @property
    def rounds(self) -> int:
        """Periods of the forcing in one of the motion; of a cycle its turns, 2 where it came from one at a flip."""
        return self.turns

    def part(self, z: Vector, seen: Seen) -> Vector:
        """z half a period later."""
        return self.shifted(z, seen, self.phase + self.turns / 2)

    def unfolded(self, z: Vector, times: int) -> Vector:
        """z of the motion of which so many periods are taken for one, from that of one period."""
        return z

    def shifted(self, z: Vector, seen: Seen, phase: float, like: Problem | None = None) -> Vector:
        """z of the same motion at another phase, or so many steps later, in the segments of another problem."""
        return z

    def beside(self, z: Vector, other: Vector) -> Vector:
        """z with angles by as many whole turns away from their own value as bring it nearest to another motion."""
        return z

    def multipliers(self, monodromy: Vector) -> Complex:
        """(n,) largest first."""
        eigenvalues: Complex = np.linalg.eigvals(monodromy).astype(complex)
        return eigenvalues[np.lexsort((-np.real(eigenvalues), -np.abs(eigenvalues)))]

    def spectrum(self, seen: Seen) -> Complex:
        """(n,) multipliers of a run, largest first; of one in segments also those that rounding of their product would
        hide."""
        return self.multipliers(seen.monodromy) if seen.factors is None else product_eigenvalues(seen.factors)

    def own(self, multipliers: Complex) -> Complex:
        """(..., n - neutral): those that may change."""
        indices = np.sort(np.argsort(np.abs(multipliers - 1.0), axis=-1)[..., self.neutral :], axis=-1)
        return np.take_along_axis(multipliers, indices, axis=-1)


class OscillatorProblem(Problem):
    """Of an oscillator, with values of parameters and inputs that are not at their default."""

    strobe: Strobe

    @property
    def states(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(self.strobe.fmu.states)

    @property
    def cyclic(self) -> list[int]:
        """Places of the states upon which nothing depends; of an FMU of others, which tells none, none."""
        return self.strobe.drifting if self.strobe.fmu.ours else []

    @property
    def system(self) -> Strobe:
        return self.strobe

    def present(self, name: str) -> float:
        value = self.strobe.values.get(name)
        return self.strobe.fmu.start_of(name) if value is None else float(value)
