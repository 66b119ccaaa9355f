"""What a branch of an oscillator is followed of: the periodic motions of a strobe."""

import math
import weakref
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.problem import EVENT, TIE, Passing, Problem, Seen, Vector, Word
from fmu_models.language.contact_kinds import CHATTERING, OPEN, STICK, TOUCHING
from fmu_models.sections.amounts import Direction
from fmu_models.sections.strobe import HOW, Strobe, strobe_of
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import engine_of
from fmu_models.simulation.trajectory import Event

# share of the orbit's length that an event must keep from the strobe, beyond which the strobe moves to another phase;
# less where pauses are shorter
CLEAR = 0.01
RESTS = 1e-12  # of the largest state: what moves less rests, and that is rounding


def pauses(events: Sequence[Passing | Event], length: float) -> list[tuple[bool, float, float]]:
    """Pauses of a period with these events: whether a contact holds, sticks or remembers, begin and length; longest
    first, those in which one does last."""
    times = [event.time for event in events]
    last = {event.contact: event.after for event in events}
    gaps = []
    for i, event in enumerate(events):
        last[event.contact] = event.after
        after = times[i + 1] if i + 1 < len(times) else times[0] + length
        gaps.append((_held(last.values()), times[i] - after, times[i]))
    return [(holding, pause_start, -negative) for holding, negative, pause_start in sorted(gaps)]


def _ties(events: Sequence[Passing], gradients: Vector) -> tuple[Passing, ...]:
    """Times between an event and the next one, of another contact, with their derivatives."""
    instants = [i for i, event in enumerate(events) if i == 0 or event.time > events[i - 1].time]
    return tuple(
        Passing(
            events[j].contact, TIE, 0, events[j].before, events[j].after, events[j].time,
            events[j].time - events[i].time, gradients[j] - gradients[i],
        )
        for i, j in pairwise(instants)
        if events[i].contact != events[j].contact and np.isfinite(gradients[j] - gradients[i]).all()
    )  # fmt: skip


def _decides(miss: Passing, events: Sequence[Passing]) -> bool:
    """Whether what sticks would slip beyond a margin. Towards where its slip has come from it would not: that margin is
    the speed of the event, and vanishes where there is none."""
    came = [event.before for event in events if event.contact == miss.contact and event.time == miss.time]
    return not (miss.begins and miss.before == STICK and miss.side in [-side for side in came])


def _counted(word: Word) -> Word:
    """Without the impacts right before a chatter that is completed: they have no number."""
    letters: list[tuple[str, int, int]] = []
    for letter in word:
        if letter[2] == CHATTERING:
            while letters and letters[-1] == (letter[0], OPEN, OPEN):
                letters.pop()
        letters.append(letter)
    return tuple(letters)


def held_at_start(events: Sequence[Passing | Event]) -> bool:
    """Whether a period with these events begins in a contact that closes, sticks or remembers."""
    return _held({event.contact: event.after for event in events}.values())


def _held(states: Iterable[int]) -> bool:
    return any(state in (STICK, TOUCHING) for state in states)


@dataclass(frozen=True, eq=False)
class FlowProblem(Problem):
    """Of an oscillator: periodic motions of a strobe, whose phase may be moved.

    Args:
        strobe: how many periods of the forcing there are in one of the motion, and the values of all parameters.
        phase: of the start, in periods of the forcing.
        second: name of the other parameter of a curve.
        kept: the instance of the FMU and what belongs to it, once it is there.
    """

    strobe: Strobe
    over: str = ""
    second: str = ""
    phase: float = 0.0
    kept: list[Any] = field(default_factory=list, repr=False)

    @property
    def states(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(self.strobe.fmu.states)

    @property
    def autonomous(self) -> bool:  # type: ignore[override]
        return self.strobe.autonomous

    @cached_property
    def cyclic(self) -> list[int]:
        """Places of the states upon which nothing depends."""
        return [self.states.index(name) for name in self.strobe.fmu.cyclic]

    @property
    def neutral(self) -> int:  # type: ignore[override]
        return self.autonomous + len(self.cyclic)

    @property
    def system(self) -> Strobe:
        return self.strobe

    def opened(self, second: str) -> Problem:
        self.strobe.check(second, np.array([self.present(second)]) if second in self.strobe.parameters else np.zeros(1))
        return replace(self, second=second, kept=[])

    def present(self, name: str) -> float:
        value = self.strobe.values.get(name)
        return self.strobe.fmu.start_of(name) if value is None else float(value)

    def _run(
        self, z: Vector, start: float, stop: float
    ) -> tuple[whole_run.Result, Vector, Vector, bool, whole_run.Passage]:
        if not self.kept:
            fmu = self.strobe.fmu
            engine, variables, names = engine_of(fmu), fmu.variables, (*self.states, *self.parameters)
            references = np.array([variables[name].valueReference for name in names], np.uint32)
            instance = engine.take()
            differentiator = whole_run.Differentiator(engine, instance, references, len(self.states))
            weakref.finalize(differentiator, engine.give, instance)
            constants = {variables[name].valueReference: value for name, value in self.strobe.values.items()}
            self.kept.extend([differentiator, references, constants])
        differentiator, references, constants = self.kept
        request = whole_run.Request(np.array([start, stop]), references[: len(self.states)])
        inputs = [*z[: len(self.states)].tolist(), *self.values(z).values()]
        initial = {**constants, **dict(zip(references.tolist(), inputs, strict=True))}
        result, by, by_times, one_sided = differentiator.run(request, initial, start, self.strobe.tolerance)
        return result, by[1], by_times, one_sided, differentiator.passage

    def length(self, z: Vector) -> float:
        """Of the period of the motion at z, s."""
        if self.autonomous:
            return float(z[-2])
        with np.errstate(divide="ignore"):  # a guess may be of no frequency, which has no motion
            periods = self.strobe.periods({name: np.array([value]) for name, value in self.values(z).items()}, 1)
        return self.strobe.every * float(periods[0])

    def span(self, z: Vector) -> tuple[float, float]:
        """Begin and end of the run from z, s."""
        length = self.length(z)
        start = 0.0 if self.autonomous else self.phase * length / self.strobe.every
        return start, start + length

    def as_run(self, z: Vector) -> dict[str, Any]:
        """Arguments of ``simulate`` for the run from z."""
        start = dict(zip(self.states, z.tolist(), strict=False))
        return {**self.strobe.fmu.settings({**self.strobe.values, **self.values(z)}), "start": start}

    def direction(self, z: Vector, change: Vector) -> Direction:
        """A change of z as one of the run."""
        begin, end = self.span(z)
        by = dict(zip(self.states, change.tolist(), strict=False)) | self.values(change)
        if self.autonomous:
            return Direction(by, 0.0, float(change[-2]))
        values = self.values(z)
        stretch = float(self.strobe.period_rates(values) @ [by[name] for name in values])
        return Direction(by, begin * stretch, end * stretch)

    def see(self, z: Vector) -> Seen:
        """One run with tangents along states and parameters."""
        n = len(self.states)
        length = self.length(z)
        if not (length > 0.0 and math.isfinite(length)):
            raise StickslipError(f"A period of {length:g} s is none.")
        start, _ = self.span(z)
        result, by, by_times, one_sided, passage = self._run(z, start, start + length)
        f0, f1 = passage.rates
        monodromy = by[:, :n]
        # by how much start and length change with a parameter that moves the period
        rates = self.strobe.period_rates(self.values(z))
        by_values = by[:, n:] + f1[:, None] * (rates * (start + length)) - (monodromy @ f0)[:, None] * (rates * start)
        residual, jacobian = result.values[1] - z[:n], np.zeros((n + self.autonomous, self.size))
        jacobian[:n, :n] = monodromy
        jacobian.flat[: n * self.size : self.size + 1] -= 1.0
        if self.cyclic:
            residual[self.cyclic], by_values[self.cyclic], jacobian[self.cyclic, :n] = 0.0, 0.0, np.eye(n)[self.cyclic]
        jacobian[:n, n : n + len(rates) - 1], jacobian[:n, -1] = by_values[:, :-1], by_values[:, -1]
        if self.autonomous:
            f0[self.cyclic] = f1[self.cyclic] = 0.0
            jacobian[:n, -2], jacobian[n, :n] = f1, f0
            residual = np.append(residual, 0.0)

        names, columns = self.strobe.contacts, (result.events[name].tolist() for name in ("contact", "before", "after"))
        word = _counted(tuple((names[contact], before, after) for contact, before, after in zip(*columns, strict=True)))

        def passings() -> tuple[tuple[Passing, ...], tuple[Passing, ...]]:
            return self._passings(result.events, by_times, passage, start, (f0, rates))

        return Seen(residual, jacobian, monodromy, length, word, passings, one_sided)

    def _passings(
        self,
        rows: NDArray[Any],
        by_times: Vector,
        passage: whole_run.Passage,
        start: float,
        moving: tuple[Vector, Vector],
    ) -> tuple[tuple[Passing, ...], tuple[Passing, ...]]:
        """Events and misses of a run that starts at a time, the start moved by parameters so: rates there, and by how
        much."""
        n, names = len(self.states), self.strobe.contacts
        f0, rates = moving

        def gradients(raw: Vector) -> Vector:
            padded = np.zeros((len(raw), self.size))
            padded[:, :n] = raw[:, :n]
            by_parameters = raw[:, n:] - (raw[:, :n] @ f0)[:, None] * rates * start
            padded[:, -1] = by_parameters[:, -1]
            if self.second:
                padded[:, n] = by_parameters[:, 0]
            return padded

        begun = zip(rows, passage.speeds.tolist(), gradients(passage.speed_derivatives), strict=True)
        events = tuple(
            Passing(
                names[row["contact"]], EVENT, 0, int(row["before"]), int(row["after"]), float(row["time"]) - start,
                speed, gradient,
            )
            for row, speed, gradient in begun
        )  # fmt: skip
        misses = tuple(
            Passing(
                names[row["contact"]], int(row["slot"]), int(row["side"]), int(row["state"]), int(row["state"]),
                float(row["time"]) - start, float(row["value"]), gradient,
                bool(row["slope"] != 0.0), bool(row["begins"]),
            )
            for row, gradient in zip(passage.misses, gradients(passage.miss_derivatives), strict=True)
        )  # fmt: skip
        misses = tuple(miss for miss in misses if _decides(miss, events))
        return events, misses + _ties(events, gradients(by_times))

    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """What the states do over a period."""
        length, point = self.length(z), np.zeros(len(self.strobe.states))
        point[: len(self.states)] = z[: len(self.states)]
        moved = self.strobe.at(**self.values(z)).trajectory(point, np.linspace(0, length, 65))
        values = np.array([moved[name] for name in self.states])
        swings, largest = np.ptp(values, axis=1) / 2, np.abs(values).max(axis=1)
        rest = RESTS * largest.max()
        sizes = np.where(swings > rest, swings, np.where(largest > rest, largest, 1.0))
        return np.array([*sizes, *([length] if self.autonomous else []), abs(between[1] - between[0])])

    def is_rigid(self, contact: str) -> bool:
        return contact in self.strobe.fmu.impacts

    def folded(self, times: int) -> Problem:
        """So many periods of this one."""
        return replace(self, strobe=self.strobe.folded(times), kept=self.kept)

    def told(self) -> dict[str, Any]:
        return {"phase": self.phase, **{name: getattr(self.strobe, name) for name in HOW}}

    def like(self, identity: Mapping[str, Any]) -> Problem:
        strobe = strobe_of(self.strobe, **{name: identity[name] for name in HOW})
        return replace(self, phase=identity["phase"], strobe=strobe, kept=self.kept)

    def part(self, z: Vector, seen: Seen) -> Vector:
        return self._after(z, seen.length / 2)

    def unfolded(self, z: Vector, times: int) -> Vector:
        return np.append(z[:-2], [times * z[-2], z[-1]]) if self.autonomous else z

    def rephased(self, z: Vector, seen: Seen) -> tuple[Problem, Vector] | None:
        gaps = pauses(seen.events, seen.length)
        if not gaps:
            return None
        _, pause_start, pause = gaps[0]
        margin = min(CLEAR * seen.length, pause / 8)  # where a contact sticks nearly always, pauses are short
        crowded = any(event.time < margin or event.time > seen.length - margin for event in seen.events)
        if not crowded and not held_at_start(seen.events):
            return None
        later = (pause_start + pause / 2) % seen.length
        if min(later, seen.length - later) < margin / 4:
            return None
        return self.later(z, seen, later)

    def later(self, z: Vector, seen: Seen, seconds: float) -> tuple[Problem, Vector]:
        forcing = seen.length / self.strobe.every
        phase = seconds if self.autonomous else (self.phase + seconds / forcing) % self.strobe.every
        return replace(self, phase=0.0 if self.autonomous else phase), self._after(z, seconds)

    @property
    def turns(self) -> int:
        return 1 if self.autonomous else self.strobe.every

    @property
    def rounds(self) -> int:
        return self.strobe.every

    def shifted(self, z: Vector, seen: Seen, phase: float) -> Vector:
        turns = (phase - self.phase) % self.strobe.every
        return self._after(z, turns * seen.length / self.strobe.every)

    def _after(self, z: Vector, later: float) -> Vector:
        """z of the same motion, so many seconds later."""
        if later == 0.0:
            return z
        n = len(self.states)
        start, _ = self.span(z)
        result, *_ = self._run(z, start, start + later)
        moved = np.append(result.values[1], z[n:])
        moved[self.cyclic] = z[self.cyclic]
        return moved
