"""What a branch of an oscillator is followed of: the periodic motions of a strobe.

The period is one segment or, where tangents grow by more than rounding bears, m of them (multiple shooting). Segment k
begins at the share s_k of the period, away from events and from what holds, and none lets tangents grow much:

    z = (x_0, ..., x_{m-1}, [q,] [T,] p)        P_k(x_k; q, T, p) - x_{k+1} = 0,   x_m = x_0

All states are unknowns, so that an error of one meets the growth of its own segment alone, and the factors of the
monodromy matrix give multipliers of any size (sections/stability.py). Where start and end of a segment move with q, T
or p, at rates a and b, the derivative of its end is that at fixed times + f(end) b - A_k f(start) a.

Source: Ascher, Mattheij, Russell, Numerical Solution of Boundary Value Problems (1995), chapter 4.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.pauses import CLEAR, clear_places, held_at_start, is_clear, pauses
from fmu_models.continuation.problem.problem import EVENT, TIE, OscillatorProblem, Passing, Problem, Seen, Vector, Word
from fmu_models.continuation.problem.runs import LARGE, Runs
from fmu_models.language.contact_kinds import CHATTERING, OPEN, STICK
from fmu_models.sections.amounts import Direction
from fmu_models.sections.strobe import HOW, Strobe, strobe_of
from fmu_models.simulation import whole_run

# a multiplier from which on the period is divided into segments; growth of tangents that one may have then, and from
# which on they are divided anew
HUGE, GROWTH, TOO_MUCH = 1e6, 1e4, 1e6
RESTS = 1e-12  # of the largest state: what moves less rests, and that is rounding


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


@dataclass(frozen=True, eq=False)
class _Segment:
    """What a run over a segment has shown.

    Attributes:
        rows: of z, where its start is.
        begin, by_begin: s, of its start, and the derivative of that by what follows the states in z.
        rates: of the states there.
    """

    rows: slice
    begin: float
    by_begin: Vector
    rates: Vector
    events: NDArray[Any]
    by_times: Vector
    passage: whole_run.Passage


@dataclass(frozen=True, eq=False)
class FlowProblem(OscillatorProblem):
    """Of an oscillator: periodic motions of a strobe, whose phase may be moved.

    Args:
        strobe: how many periods of the forcing there are in one of the motion, and the values of all parameters.
        phase: of the start, in periods of the forcing.
        cuts: where segments begin beside the first, in shares of the period of the motion.
        second: name of the other parameter of a curve.
        kept: what makes the runs, once it is there.
    """

    strobe: Strobe
    over: str = ""
    second: str = ""
    phase: float = 0.0
    cuts: tuple[float, ...] = ()
    kept: list[Runs] = field(default_factory=list, repr=False)

    @property
    def autonomous(self) -> bool:  # type: ignore[override]
        return self.strobe.autonomous

    @property
    def width(self) -> int:  # type: ignore[override]
        return (1 + len(self.cuts)) * len(self.states)

    @property
    def divisible(self) -> bool:
        """Whether the period may be divided into segments."""
        return not self.cyclic

    @property
    def neutral(self) -> int:  # type: ignore[override]
        return self.autonomous + len(self.cyclic)

    def opened(self, second: str) -> Problem:
        self.strobe.check(second, np.array([self.present(second)]) if second in self.strobe.parameters else np.zeros(1))
        return replace(self, second=second, kept=[])

    def _runs(self) -> Runs:
        """What makes the runs."""
        if not self.kept:
            self.kept.append(Runs(self.strobe, self.parameters))
        return self.kept[0]

    def _end(self, x: Vector, z: Vector, times: Sequence[float]) -> Vector:
        """(n,) states at the last of the times, without derivatives where these are dear."""
        runs, values = self._runs(), self.values(z).values()
        return runs.end(x, values, times) if runs.large else runs.differentiated(x, values, times)[0].values[1]

    def missed(self, z: Vector) -> Vector | None:
        if not self._runs().large:
            return None
        n, start, length = len(self.states), self.span(z)[0], self.length(z)
        points = z[: self.width].reshape(-1, n)
        spans = ([start + length * share for share in shares] for shares in pairwise((0.0, *self.cuts, 1.0)))
        ends = np.array([self._end(x, z, times) for x, times in zip(points, spans, strict=True)])
        residual = np.append(ends - np.roll(points, -1, axis=0), np.zeros(int(self.autonomous)))
        residual[self.cyclic] = 0.0
        return residual

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
        """One run with tangents along states and parameters, segment by segment."""
        n, width, values = len(self.states), self.width, self.values(z).values()
        length = self.length(z)
        if not (length > 0.0 and math.isfinite(length)):
            raise StickslipError(f"A period of {length:g} s is none.")
        start, _ = self.span(z)
        points = z[:width].reshape(-1, n)
        residual, jacobian = np.zeros(width + self.autonomous), np.zeros((width + self.autonomous, self.size))
        factors, segments, word, corner = [], [], [], False
        for k, shares in enumerate(pairwise((0.0, *self.cuts, 1.0))):
            begin, end = (start + length * share for share in shares)
            by_begin, by_end = self._by_instant(z, begin, shares[0]), self._by_instant(z, end, shares[1])
            result, by, by_times, one_sided, passage = self._runs().differentiated(points[k], values, (begin, end))
            f0, f1 = passage.rates
            factor, after, rows = by[1][:, :n], (k + 1) % len(points), slice(k * n, k * n + n)
            residual[rows], jacobian[rows, rows] = result.values[1] - points[after], factor
            jacobian[np.arange(k * n, k * n + n), np.arange(after * n, after * n + n)] -= 1.0
            by_rest = self._padded(by[1][:, n:]) + np.outer(f1, by_end) - np.outer(factor @ f0, by_begin)
            jacobian[rows, width:] = by_rest
            factors.append(factor)
            segments.append(_Segment(rows, begin, by_begin, f0, result.events, by_times, passage))
            columns = (result.events[name].tolist() for name in ("contact", "before", "after"))
            word += zip(*columns, strict=True)
            corner |= one_sided
        if self.cyclic:
            residual[self.cyclic], jacobian[self.cyclic] = 0.0, np.eye(self.size)[self.cyclic]
        if self.autonomous:
            jacobian[width, :n] = segments[0].rates
            jacobian[width, self.cyclic] = 0.0

        def passings() -> tuple[tuple[Passing, ...], tuple[Passing, ...]]:
            return self._passings(segments, start)

        letters = _counted(tuple((self.strobe.contacts[contact], before, after) for contact, before, after in word))
        monodromy = reduce(lambda total, factor: factor @ total, factors)
        divided = np.array(factors) if self.cuts else None
        return Seen(residual, jacobian, monodromy, length, letters, passings, corner, divided)

    def _by_instant(self, z: Vector, instant: float, share: float) -> Vector:
        """Derivative of an instant, s, at a share of the period, by what follows the states in z."""
        rates = self.strobe.period_rates(self.values(z)) * instant
        return np.insert(rates, -1, share) if self.autonomous else rates

    def _padded(self, by_parameters: Vector) -> Vector:
        """Derivatives (k, parameters) as those (k, size - width) by what follows the states in z."""
        return np.insert(by_parameters, -1, 0.0, axis=1) if self.autonomous else by_parameters

    def _passings(self, segments: Sequence[_Segment], start: float) -> tuple[tuple[Passing, ...], tuple[Passing, ...]]:
        """Events and misses of runs over segments, the first of which begins at a time."""
        n, names = len(self.states), self.strobe.contacts
        events: list[Passing] = []
        misses: list[Passing] = []
        times = [np.zeros((0, self.size))]
        for segment in segments:

            def gradients(raw: Vector, segment: _Segment = segment) -> Vector:
                by_begin = np.outer(raw[:, :n] @ segment.rates, segment.by_begin)
                padded = np.zeros((len(raw), self.size))
                padded[:, segment.rows], padded[:, self.width :] = raw[:, :n], self._padded(raw[:, n:]) - by_begin
                return padded

            passage = segment.passage
            begun = zip(segment.events, passage.speeds.tolist(), gradients(passage.speed_derivatives), strict=True)
            events += (
                Passing(
                    names[row["contact"]], EVENT, 0, int(row["before"]), int(row["after"]), float(row["time"]) - start,
                    speed, gradient,
                )
                for row, speed, gradient in begun
            )  # fmt: skip
            misses += (
                Passing(
                    names[row["contact"]], int(row["slot"]), int(row["side"]), int(row["state"]), int(row["state"]),
                    float(row["time"]) - start, float(row["value"]), gradient,
                    bool(row["slope"] != 0.0), bool(row["begins"]),
                )
                for row, gradient in zip(passage.misses, gradients(passage.miss_derivatives), strict=True)
            )  # fmt: skip
            times.append(gradients(segment.by_times))
        deciding = tuple(miss for miss in misses if _decides(miss, events))
        return tuple(events), deciding + _ties(events, np.concatenate(times))

    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """What the states do over a period."""
        length, point = self.length(z), np.zeros(len(self.strobe.states))
        point[: len(self.states)] = z[: len(self.states)]
        moved = self.strobe.at(**self.values(z)).trajectory(point, np.linspace(0, length, 65))
        values = np.array([moved[name] for name in self.states])
        swings, largest = np.ptp(values, axis=1) / 2, np.abs(values).max(axis=1)
        floor = RESTS * largest.max()
        sizes = np.where(swings > floor, swings, np.where(largest > floor, largest, 1.0))
        sizes *= math.sqrt(max(1.0, len(sizes) / LARGE))  # of many states u changes as much as of a few
        return np.array([*sizes, *([length] if self.autonomous else []), abs(between[1] - between[0])])

    def is_rigid(self, contact: str) -> bool:
        return contact in self.strobe.fmu.impacts

    def scales_like(self, scales: Vector) -> Vector:
        n, rest = len(self.states), self.size - self.width
        many, before = 1 + len(self.cuts), (len(scales) - rest) // n
        # of many segments u changes as much as of one
        return np.append(np.tile(scales[:n] * math.sqrt(many / before), many), scales[-rest:])

    def folded(self, times: int, growth: float = 1.0) -> Problem:
        """So many periods of this one, each of its own segments if there are any, or are to be."""
        divides = bool(self.cuts) or (self.divisible and growth**times > HUGE)
        starts = [(i + share) / times for i in range(times) for share in (0.0, *self.cuts)] if divides else [0.0]
        return replace(self, strobe=self.strobe.folded(times), cuts=tuple(starts[1:]), kept=self.kept)

    def told(self) -> dict[str, Any]:
        cuts = {"cuts": list(self.cuts)} if self.cuts else {}
        return {"phase": self.phase, **{name: getattr(self.strobe, name) for name in HOW}, **cuts}

    def like(self, identity: Mapping[str, Any]) -> Problem:
        strobe = strobe_of(self.strobe, **{name: identity[name] for name in HOW})
        cuts = tuple(identity.get("cuts", ()))
        return replace(self, phase=identity["phase"], cuts=cuts, strobe=strobe, kept=self.kept)

    def part(self, z: Vector, seen: Seen) -> Vector:
        return self._after(z, seen.length / 2, self.cuts)

    def unfolded(self, z: Vector, times: int) -> Vector:
        rest = self.size - self.width
        states, others = z[:-rest], z[-rest:].copy()
        if self.autonomous:
            others[-2] *= times
        return np.append(np.tile(states, self.width // len(states)), others)

    def rephased(self, z: Vector, seen: Seen, scales: Vector) -> tuple[Problem, Vector] | None:
        length, gaps = seen.length, pauses(seen.events, seen.length)
        # where a contact sticks nearly always, pauses are short
        margin = min(CLEAR * length, gaps[0][2] / 8) if gaps else 0.0
        later = self._clear_start(seen, gaps, margin)
        if seen.factors is not None:
            sizes = scales[: len(self.states)]
            grows = np.linalg.norm(seen.factors / sizes[:, None] * sizes, 2, axis=(1, 2)).max() > TOO_MUCH
            divides = grows or later or not all(is_clear(share * length, gaps, margin, length) for share in self.cuts)
        else:
            large = self.divisible and np.linalg.norm(seen.monodromy) > HUGE  # no multiplier is larger than a norm
            divides = large and np.abs(self.spectrum(seen)).max() > HUGE
        if not divides:
            return self.later(z, seen, later) if later else None
        cuts = self._divided(z, scales, later, clear_places(gaps, margin, length))
        phase = self._phase_after(later, length)
        if (phase, cuts) == (self.phase, self.cuts):
            return None
        return replace(self, phase=phase, cuts=cuts), self._after(z, later, cuts)

    def _clear_start(self, seen: Seen, gaps: Sequence[tuple[bool, float, float]], margin: float) -> float:
        """How much later, s, a period begins well away from events; 0 where it may begin where it does."""
        crowded = any(event.time < margin or event.time > seen.length - margin for event in seen.events)
        if not gaps or not (crowded or held_at_start(seen.events)):
            return 0.0
        _, pause_start, pause = gaps[0]
        later = (pause_start + pause / 2) % seen.length
        return 0.0 if min(later, seen.length - later) < margin / 4 else later

    def _divided(self, z: Vector, scales: Vector, later: float, places: Vector) -> tuple[float, ...]:
        """``cuts`` of a period that begins so much later, s, at some of these places, s after the start of z."""
        length, (start, _), n = self.length(z), self.span(z), len(self.states)
        sizes, instants = scales[:n], np.sort(later + (places - later) % length)

        def divided(begin: float, end: float) -> list[float]:
            """Places between two at which a segment is divided, each at half the growth of what it divides."""
            within = instants[(instants > begin) & (instants < end)]
            if not len(within):
                return []
            times = [start + instant for instant in (begin, *within, end)]
            _, by, *_ = self._runs().differentiated(self._state(z, begin), self.values(z).values(), times)
            growths = np.log(np.linalg.norm(by[1:, :, :n] / sizes[:, None] * sizes, 2, axis=(1, 2)))
            if growths.max() <= math.log(GROWTH):
                return []
            place = float(within[np.abs(growths[:-1] - growths.max() / 2).argmin()])
            return [*divided(begin, place), place, *divided(place, end)]

        return tuple((place - later) / length for place in divided(later, later + length))

    def later(self, z: Vector, seen: Seen, seconds: float) -> tuple[Problem, Vector]:
        share = seconds / seen.length
        # the place of a start that is near moves there, the others stay where they are
        starts = sorted((start - share) % 1.0 for start in (0.0, *self.cuts))
        cuts = tuple(starts[1:] if starts[0] < 1.0 - starts[-1] else starts[:-1])
        return replace(self, phase=self._phase_after(seconds, seen.length), cuts=cuts), self._after(z, seconds, cuts)

    def _phase_after(self, seconds: float, length: float) -> float:
        return 0.0 if self.autonomous else (self.phase + seconds / (length / self.strobe.every)) % self.strobe.every

    @property
    def turns(self) -> int:
        return 1 if self.autonomous else self.strobe.every

    @property
    def rounds(self) -> int:
        return self.strobe.every

    def shifted(self, z: Vector, seen: Seen, phase: float, like: Problem | None = None) -> Vector:
        turns = (phase - self.phase) % self.strobe.every
        cuts = like.cuts if isinstance(like, FlowProblem) else self.cuts
        return self._after(z, turns * seen.length / self.strobe.every, cuts)

    def _after(self, z: Vector, later: float, cuts: tuple[float, ...]) -> Vector:
        """z of the same motion, so many seconds later, and in these segments."""
        if later == 0.0 and cuts == self.cuts:
            return z
        length = self.length(z)
        states = [self._state(z, later + share * length) for share in (0.0, *cuts)]
        return np.concatenate([*states, z[self.width :]])

    def _state(self, z: Vector, later: float) -> Vector:
        """(n,) the state so many seconds after the start, from the segment in which that is."""
        n, length, (start, _) = len(self.states), self.length(z), self.span(z)
        begins, later = length * np.array([0.0, *self.cuts]), later % length
        k = int(np.searchsorted(begins, later, side="right")) - 1
        x = z[k * n : (k + 1) * n]
        if later == begins[k]:
            return x
        moved = self._end(x, z, (start + begins[k], start + later))
        moved[self.cyclic] = z[self.cyclic]
        return moved
