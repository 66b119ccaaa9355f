"""What a branch is followed of: a periodic motion as the root of equations in unknowns z, with all derivatives exact.

    z = (x, [T,] p)      state at the strobe phase, period where nothing forces the motion, parameter
    P(x; T, p) - x = 0   and, where nothing forces it,   f(x) . dx = 0   (a step along the motion is none)

One run with tangents along x and p gives it all: end state, monodromy matrix, the derivative by p. Where p is the
frequency of the forcing, or the period is unknown, the run's start t0 and length T change too; then

    dP/dT = f(end),    dP/dt0 = f(end) - M f(start)

and whatever else depends on the start, as a miss or the time of an event, changes by its derivative along -f(start).
The cyclic word of events belongs to the motion, and so does how near it comes to having another one: the speed at which
the indicator of each event falls, and the least value of every pending indicator between events.
"""

from __future__ import annotations

import math
import weakref
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from fmu_models.analyses.fmu_sections import Strobe
from fmu_models.analyses.iteration import Iteration
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.contact_states import STICK, TOUCHING
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import engine_of

Vector = NDArray[np.float64]
Word = tuple[tuple[str, int, int], ...]

# share of the orbit's length that an event must keep from the strobe, beyond which the strobe moves to another phase
CLEAR = 0.01


def cyclic(word: Word) -> Word:
    """The rotation of a word that comes first: two words are one motion's if these are equal."""
    return min((word[i:] + word[:i] for i in range(len(word))), default=word)


@dataclass(frozen=True)
class Passing:
    """An event, or a near miss.

    Attributes:
        contact: its name.
        slot: 0 the normal indicator, 1 the tangential one; of a miss.
        side: of the margin of what sticks; of a miss.
        before, after: states of the contact; of a miss both are the present one.
        time: s, from the start of the run.
        value: speed at which the indicator falls (per s), or the least value of one that does not.
        gradient: (len(z),) derivative of that.
    """

    contact: str
    slot: int
    side: int
    before: int
    after: int
    time: float
    value: float
    gradient: Vector

    @property
    def key(self) -> tuple[str, int, int, int]:
        """What it has in common with the same one of a neighbour, but for its time."""
        return self.contact, self.slot, self.side, self.before


@dataclass(frozen=True, eq=False)
class Seen:
    """What a run over one period has shown.

    Attributes:
        residual: (n,) or, where nothing forces the motion, (n + 1,) of the equations.
        jacobian: the derivative of that by z.
        monodromy: (n, n) derivative of the end by the start.
        length: s, of the run.
        word: events on the way, one after the other.
        events, misses: with their derivatives.
        one_sided: events at one instant: the derivatives hold on one side.
    """

    residual: Vector
    jacobian: Vector
    monodromy: Vector
    length: float
    word: Word = ()
    events: tuple[Passing, ...] = ()
    misses: tuple[Passing, ...] = ()
    one_sided: bool = False


class Problem(ABC):
    """A family of periodic motions over one parameter.

    Attributes:
        over: name of the parameter.
        size: number of unknowns.
        states: names of the numbers of x.
    """

    over: str
    states: tuple[str, ...]
    autonomous: bool = False
    phase: float = 0.0

    @property
    def size(self) -> int:
        """Number of unknowns z."""
        return len(self.states) + self.autonomous + 1

    @abstractmethod
    def see(self, z: Vector) -> Seen:
        """The run from z.

        Raises:
            StickslipError: there is none, or it has no derivative.
        """

    @abstractmethod
    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """(len(z),) by which unknowns are measured."""

    @abstractmethod
    def folded(self, times: int) -> Problem:
        """The same, of a period that is so many times as long."""

    def rephased(self, z: Vector, seen: Seen) -> tuple[Problem, Vector] | None:
        """The problem at another phase, and z there, where an event is too near to the strobe; None if none is."""
        return None

    @property
    @abstractmethod
    def turns(self) -> int:
        """Periods of the forcing in one of the motion: from so many starts it is the same motion."""

    def part(self, z: Vector, seen: Seen) -> Vector:
        """z half a period later."""
        return self.shifted(z, seen, self.phase + self.turns / 2)

    def unfolded(self, z: Vector, times: int) -> Vector:
        """z of the same motion, so many periods of it taken for one."""
        return z

    def shifted(self, z: Vector, seen: Seen, phase: float) -> Vector:
        """z of the same motion at another phase, or so many steps later."""
        return z

    def multipliers(self, monodromy: Vector) -> NDArray[np.complex128]:
        """(n,) largest first."""
        found: NDArray[np.complex128] = np.linalg.eigvals(monodromy).astype(complex)
        return found[np.lexsort((-np.real(found), -np.abs(found)))]

    def own(self, multipliers: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Those that may change: without the 1 of a motion that nothing forces."""
        return np.delete(multipliers, np.abs(multipliers - 1.0).argmin()) if self.autonomous else multipliers


@dataclass(frozen=True, eq=False)
class MapProblem(Problem):
    """Of a declared map: cycles of ``period`` points."""

    map: Iteration
    over: str = ""
    period: int = 1

    @property
    def states(self) -> tuple[str, ...]:  # type: ignore[override] # a field of others
        return self.map.states

    @cached_property
    def _by_parameter(self) -> Any:
        declared = self.map.map
        symbol = next(p for p in declared.parameters if p.name == self.over)
        rule = (declared.inverse if self.map.backward else declared.rule) or {}
        slopes = [sympy.diff(rule[x], symbol) for x in declared.states]
        return sympy.lambdify([*declared.states, *declared.parameters], slopes, "numpy")

    def see(self, z: Vector) -> Seen:
        """The images of a point, and the product of their derivatives."""
        n = len(self.states)
        at = self.map.at(**{self.over: float(z[-1])})
        x, monodromy, by_value = z[:n], np.eye(n), np.zeros(n)
        for _ in range(self.period):
            slopes = np.array([float(one) for one in self._by_parameter(*x, *at.values.values())])
            made = at.step(x[None])
            if made.why:
                raise StickslipError(f"{self.map.name} has no step from there: {next(iter(made.why.values()))}")
            monodromy, by_value = made.derivatives[0] @ monodromy, made.derivatives[0] @ by_value + slopes
            x = made.points[0]
        residual = at.difference(x - z[:n])
        return Seen(residual, np.column_stack([monodromy - np.eye(n), by_value]), monodromy, float(self.period))

    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """The box of the map."""
        return np.append(self.map.sizes(), abs(between[1] - between[0]))

    @property
    def turns(self) -> int:
        return self.period

    def shifted(self, z: Vector, seen: Seen, phase: float) -> Vector:
        x = z[None, :-1]
        for _ in range(round(phase) % self.period):
            x = self.map.at(**{self.over: float(z[-1])}).step(x, derivative=False).points
        return np.append(x[0], z[-1])

    def folded(self, times: int) -> Problem:
        """Cycles of so many times as many points."""
        return replace(self, period=self.period * times)


@dataclass(frozen=True, eq=False)
class FlowProblem(Problem):
    """Of an oscillator: periodic motions of a strobe, whose phase may be moved.

    Args:
        strobe: how many periods of the forcing there are in one of the motion, and the values of all parameters.
        phase: of the start, in periods of the forcing.
        kept: the instance of the FMU and what belongs to it, once it is there.
    """

    strobe: Strobe
    over: str = ""
    phase: float = 0.0
    kept: list[Any] = field(default_factory=list, repr=False)

    @property
    def states(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(self.strobe.fmu.states)

    @property
    def autonomous(self) -> bool:  # type: ignore[override]
        return self.strobe.autonomous

    def _run(self, x: Vector, value: float, start: float, stop: float) -> Any:
        if not self.kept:
            fmu = self.strobe.fmu
            engine, variables = engine_of(fmu), fmu.variables
            references = np.array([variables[name].valueReference for name in (*self.states, self.over)], np.uint32)
            instance = engine.take()
            made = whole_run.Differentiator(engine, instance, references, len(self.states))
            weakref.finalize(made, engine.give, instance)
            constants = {variables[name].valueReference: one for name, one in self.strobe.values.items()}
            self.kept.extend([made, references, constants])
        made, references, constants = self.kept
        request = whole_run.Request(np.array([start, stop]), references[:-1])
        initial = {**constants, **dict(zip(references.tolist(), [*x.tolist(), value], strict=True))}
        result, derivatives, event_derivatives, one_sided = made.run(request, initial, start, self.strobe.tolerance)
        return result, derivatives[1], event_derivatives, one_sided, made.passage

    def length(self, z: Vector) -> float:
        """Of the period of the motion at z, s."""
        if self.autonomous:
            return float(z[-2])
        return self.strobe.every * float(self.strobe.periods({self.over: z[-1:]}, 1)[0])

    def see(self, z: Vector) -> Seen:
        """One run with tangents along states and parameter."""
        n, value = len(self.states), float(z[-1])
        whole = self.length(z)
        if not (whole > 0.0 and math.isfinite(whole)):
            raise StickslipError(f"A period of {whole:g} s is none.")
        start = 0.0 if self.autonomous else self.phase * whole / self.strobe.every
        result, by, _, one_sided, passage = self._run(z[:n], value, start, start + whole)
        f0, f1 = passage.rates
        monodromy = by[:, :n]
        # by how much start and length change with the parameter, where that is the frequency
        rate = -1.0 / value if self.over == self.strobe.forcing else 0.0
        by_value = by[:, n] + f1 * rate * (start + whole) - (monodromy @ f0) * rate * start
        residual, jacobian = result.values[1] - z[:n], monodromy - np.eye(n)
        if self.autonomous:
            jacobian = np.vstack([np.column_stack([jacobian, f1, by_value]), np.append(f0, [0.0, 0.0])])
            residual = np.append(residual, 0.0)
        else:
            jacobian = np.column_stack([jacobian, by_value])

        def gradient(row: Vector) -> Vector:
            whole_row = np.zeros(self.size)
            whole_row[:n] = row[:n]
            whole_row[-1] = row[n] - row[:n] @ f0 * rate * start
            return whole_row

        names, rows = self.strobe.contacts, result.events
        events = tuple(
            Passing(
                names[row["contact"]], -1, 0, int(row["before"]), int(row["after"]), float(row["time"]) - start,
                float(passage.speeds[i]), gradient(passage.speed_derivatives[i]),
            )
            for i, row in enumerate(rows)
        )  # fmt: skip
        misses = tuple(
            Passing(
                names[row["contact"]], int(row["slot"]), int(row["side"]), int(row["state"]), int(row["state"]),
                float(row["time"]) - start, float(row["value"]), gradient(passage.miss_derivatives[i]),
            )
            for i, row in enumerate(passage.misses)
        )  # fmt: skip
        word = tuple((one.contact, one.before, one.after) for one in events)
        return Seen(residual, jacobian, monodromy, whole, word, events, misses, one_sided)

    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """What the states do over a period."""
        whole, point = self.length(z), np.zeros(len(self.strobe.states))
        point[: len(self.states)] = z[: len(self.states)]
        moved = self.strobe.at(**{self.over: float(z[-1])}).trajectory(point, np.linspace(0, whole, 65))
        sizes = np.array([np.ptp(moved[name]) / 2 or abs(moved[name]).max() or 1.0 for name in self.states])
        return np.array([*sizes, *([whole] if self.autonomous else []), abs(between[1] - between[0])])

    def folded(self, times: int) -> Problem:
        """So many periods of this one."""
        strobe = Strobe(
            self.strobe.fmu,
            every=self.strobe.every * times,
            forcing=self.strobe.forcing,
            period=self.strobe.period,
            autonomous=self.autonomous,
            parameters=self.strobe.values,
            tolerance=self.strobe.tolerance,
        )
        return replace(self, strobe=strobe, kept=self.kept)

    def part(self, z: Vector, seen: Seen) -> Vector:
        return self._after(z, seen.length / 2)

    def unfolded(self, z: Vector, times: int) -> Vector:
        return np.append(z[:-2], [times * z[-2], z[-1]]) if self.autonomous else z

    def _free_gaps(self, seen: Seen) -> Sequence[tuple[float, float]]:
        """Begins and lengths of the pauses between events, longest first; those in which a contact holds, sticks or
        remembers come last."""
        times = [one.time for one in seen.events]
        last = {one.contact: one.after for one in seen.events}
        gaps = []
        for i, one in enumerate(seen.events):
            last[one.contact] = one.after
            after = times[i + 1] if i + 1 < len(times) else times[0] + seen.length
            held = any(state in (STICK, TOUCHING) for state in last.values())
            gaps.append((held, times[i] - after, times[i]))
        return [(begin, -length) for _, length, begin in sorted(gaps)]

    def held_at_start(self, seen: Seen) -> bool:
        """Whether the strobe falls into a contact that closes, sticks or remembers."""
        last = {one.contact: one.after for one in seen.events}
        return any(state in (STICK, TOUCHING) for state in last.values())

    def rephased(self, z: Vector, seen: Seen) -> tuple[Problem, Vector] | None:
        near = CLEAR * seen.length
        crowded = any(one.time < near or one.time > seen.length - near for one in seen.events)
        if not crowded and not self.held_at_start(seen):
            return None
        gaps = self._free_gaps(seen)
        if not gaps:
            return None
        begin, pause = gaps[0]
        later = (begin + pause / 2) % seen.length
        if pause < 2 * near or min(later, seen.length - later) < near / 4:
            return None
        forcing = seen.length / self.strobe.every
        phase = later if self.autonomous else (self.phase + later / forcing) % self.strobe.every
        moved = replace(self, phase=0.0 if self.autonomous else phase)
        return moved, self._after(z, later)

    @property
    def turns(self) -> int:
        return 1 if self.autonomous else self.strobe.every

    def shifted(self, z: Vector, seen: Seen, phase: float) -> Vector:
        turns = (phase - self.phase) % self.strobe.every
        return self._after(z, turns * seen.length / self.strobe.every)

    def _after(self, z: Vector, later: float) -> Vector:
        """z of the same motion, so many seconds later."""
        if later == 0.0:
            return z
        n = len(self.states)
        start = 0.0 if self.autonomous else self.phase * self.length(z) / self.strobe.every
        result, *_ = self._run(z[:n], float(z[-1]), start, start + later)
        return np.append(result.values[1], z[n:])


def problem_of(system: Any, over: str) -> Problem:
    """The family that a section describes.

    Raises:
        StickslipError: another section than a strobe or a map, an FMU of others.
    """
    if isinstance(system, Iteration):
        return MapProblem(system, over)
    if not isinstance(system, Strobe):
        raise StickslipError(
            f"A branch of '{system.name}' is followed at a strobe: name what forces it, or say that nothing does and "
            "give about how long its period is (autonomous=True, period=)."
        )
    if not system.fmu.ours:
        raise StickslipError(
            f"'{system.name}' is not of this suite, and its runs carry no derivatives through events: its branches "
            "cannot be followed. 'find_bifurcations' takes it, by differences."
        )
    return FlowProblem(system, over)
