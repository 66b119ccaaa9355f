"""Where segments begin, and in which states: from the log where it shows them, else from the run before.

A local parabola over `HALF` samples to either side gives place and speed of a measured state; what it leaves is the
noise. A segment begins where most guesses of the parameters say that no contact has a memory or a wall is near, and of
such samples where the parabola leaves least: not at an impact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from identification.calibration.log import ModelLog
from identification.calibration.problem import SegmentProblem
from identification.calibration.segments import Segment
from identification.calibration.subject import HALF, Stretch, Window
from identification.inference.problem import SOFT, Unknown

SPREAD = 0.01  # of samples whose neighbours say nothing of them: their noise, until residuals show it
FEWEST, MOST = 16, 40  # segments of a log, twice its crossings of the mean in between
LEAST, ITERATES = 8, 4  # samples of a segment, and of one of a map
TRIED = 9  # samples of a segment's middle half, of which one becomes a node
MEDIAN = 0.6745  # of the absolute value of a normal variable
BLOCKED = 0.25  # share of the guesses that may find a node in a contact


@dataclass(frozen=True, eq=False)
class LocalMotion:
    """Parabolas about samples. value, speed: by variable, (n,) at ``rows``; left: (n,) root mean square of what they
    leave, in units of the variables' noise."""

    rows: np.ndarray
    value: Mapping[str, np.ndarray]
    speed: Mapping[str, np.ndarray]
    left: np.ndarray


def local_motion(log: ModelLog, rows: np.ndarray, half: int = HALF) -> tuple[LocalMotion, dict[str, float]]:
    """Parabolas about samples ``rows``, and the noise of each variable by what most of them leave. half: samples to
    either side that one joins; where it is 0 the samples themselves, and a small share of their spread as noise."""
    value, speed, noise = {}, {}, {}
    left = np.zeros(len(rows))
    half = min(half, (log.time.size - 1) // 2)
    windows = np.clip(rows, half, log.time.size - 1 - half)[:, None] + np.arange(-half, half + 1)
    order = min(2, 2 * half)
    times = log.time[windows] - log.time[rows][:, None]
    length = np.maximum(np.ptp(times, axis=1), np.finfo(float).tiny)
    terms = (times / length[:, None])[..., None] ** np.arange(order + 1)
    inverse = np.linalg.pinv(terms)
    for name, measured in log.measured.items():
        solved = (inverse @ measured[windows, None])[..., 0]
        value[name], speed[name] = solved[:, 0], solved[:, 1] / length if order else np.zeros(len(rows))
        off = (terms @ solved[..., None])[..., 0] - measured[windows]
        rest = np.sqrt(np.sum(off**2, axis=1) / max(windows.shape[1] - order - 1, 1))
        thirds = np.abs(np.diff(measured, 3)) if len(measured) > 3 else np.array([np.inf])
        white = float(np.median(thirds)) / MEDIAN / np.sqrt(20.0)  # of a third difference: 1 + 9 + 9 + 1
        white = min(float(np.median(rest)), white) if half else SPREAD * float(np.std(measured))
        noise[name] = max(white, 1e-9 * float(np.ptp(measured)), np.finfo(float).tiny)
        left += (rest / noise[name]) ** 2
    return LocalMotion(rows, value, speed, np.sqrt(left)), noise


@dataclass(frozen=True, eq=False)
class Nodes:
    """Where segments begin. problem: over the segments, whose unknowns are those that all share, then start states;
    states: (segments, states) what the logs say of these, NaN where they say nothing."""

    problem: SegmentProblem
    states: np.ndarray

    @classmethod
    def of(cls, free_run: SegmentProblem, segments: Sequence[Segment], states: np.ndarray) -> Nodes:
        """A free run cut into segments."""
        unknowns, places = list(free_run.unknowns[: free_run.shared]), np.full(states.shape, -1)
        for number, segment in enumerate(segments):
            begins = number == 0 or segments[number - 1].log != segment.log
            for place, name in enumerate(free_run.subject.states):
                if not begins or free_run.starts[segment.log, place] >= 0:
                    places[number, place] = len(unknowns)
                    unknowns.append(Unknown(f"{name}({segment.begin:g})", ""))
        return cls(replace(free_run, segments=tuple(segments), unknowns=tuple(unknowns), starts=places), states)

    def placed(self, x: np.ndarray, states: np.ndarray) -> tuple[SegmentProblem, np.ndarray]:
        """The problem and its unknowns, from a guess x of the free run and start states (segments, states)."""
        scale = np.std(states, axis=0)
        scale = np.where(scale > 0, scale, np.maximum(np.abs(states).max(axis=0), 1e-9))
        first = self._unknowns(x, states)
        return replace(self.problem, first=first, scale=scale), first

    def _unknowns(self, x: np.ndarray, states: np.ndarray) -> np.ndarray:
        return np.append(x[: self.problem.shared], states[self.problem.starts >= 0])

    def rolled(self, x: np.ndarray) -> tuple[np.ndarray, float]:
        """Start states (segments, states) with those that the logs do not show from the run of the segment before, and
        how badly the segments then predict their samples: sum of log(1 + (r/SOFT)^2). Nothing is optimized."""
        problem, readings, runs = self.problem, self.problem.readings(x), []
        values = [problem.parameters(log, x) for log in range(len(problem.logs))]
        starts, state, default = self.states.copy(), np.zeros(0), defaults(problem)
        for number, segment in enumerate(problem.segments):
            if number == 0 or problem.segments[number - 1].log != segment.log:
                state = default
            starts[number] = np.where(np.isfinite(starts[number]), starts[number], state)
            start = dict(zip(problem.subject.states, starts[number].tolist(), strict=True))
            run = problem.response(Stretch(readings.windows[number], values[segment.log], start))
            state = starts[number] if run is None else run.values[-1, : len(default)]
            runs.append(run)
        here = problem.compared(self._unknowns(x, starts), readings, runs)
        return starts, float(np.sum(np.log1p((here.residual[here.log < len(problem.series)] / SOFT) ** 2)))


def nodes_of(
    problem: SegmentProblem, guesses: Sequence[np.ndarray], rates: Mapping[str, str], count: int | None
) -> Nodes:
    """Segments of the logs of a free run ``problem``. guesses: of its unknowns; rates: as in `Subject.rates`; count: of
    each log, or as its crossings of the mean ask."""
    segments: list[Segment] = []
    states: list[np.ndarray] = []
    half = problem.subject.half
    for number, log in enumerate(problem.logs):
        least = LEAST if half else ITERATES
        wanted = count or (_count(log) if half else log.time.size)
        edges = np.linspace(0, log.time.size - 1, min(wanted, max(log.time.size // least, 1)) + 1)
        spread = [
            np.linspace(0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high, TRIED) for low, high in pairwise(edges)
        ]
        rows = [np.array([0]), *(np.unique(np.round(part).astype(int)) for part in spread[1:])]
        chosen = [(0, _shown(problem, log, local_motion(log, rows[0], half)[0], rates, guesses[0])[0])]
        for part in rows[1:]:
            motion, _ = local_motion(log, part, half)
            shown = _shown(problem, log, motion, rates, guesses[0])
            blocked = np.array(
                [_blocked(problem, number, log, row, at, guesses) for row, at in zip(part, shown, strict=True)]
            )
            best = int(np.lexsort((motion.left, np.maximum(blocked, BLOCKED)))[0])
            if blocked[best] <= 2 * BLOCKED:
                chosen.append((int(part[best]), shown[best]))
        begins = [float(log.time[row]) for row, _ in chosen]
        ends = [*begins[1:], float(log.time[-1])]
        segments += [Segment(number, begin, end, end == ends[-1]) for begin, end in zip(begins, ends, strict=True)]
        states += [state for _, state in chosen]
    return Nodes.of(problem, segments, np.array(states).reshape(len(segments), len(problem.subject.states)))


def _count(log: ModelLog) -> int:
    sides = (np.sign(values - np.mean(values)) for values in log.measured.values())
    crossings = max((int(np.count_nonzero(np.diff(side[side != 0]))) for side in sides), default=0)
    return int(np.clip(2 * crossings, FEWEST, MOST))


def _shown(
    problem: SegmentProblem, log: ModelLog, motion: LocalMotion, rates: Mapping[str, str], x: np.ndarray
) -> np.ndarray:
    """(n, states) what the parabolas say of the states."""
    states = problem.subject.states
    found = np.full((len(motion.rows), len(states)), np.nan)
    for name in log.measured:
        sensor = problem.sensor(name, x)
        if rates.get(name) in states:
            found[:, states.index(rates[name])] = motion.speed[name] / sensor.gain
    for name in log.measured:
        sensor = problem.sensor(name, x)
        if name in states:
            found[:, states.index(name)] = (motion.value[name] - sensor.offset) / sensor.gain
    return found


def _blocked(
    problem: SegmentProblem, number: int, log: ModelLog, row: int, states: np.ndarray, guesses: Sequence[np.ndarray]
) -> float:
    """Share of the guesses with which no motion can begin in these states."""
    count = 0
    default = defaults(problem)
    time = float(log.time[row])
    window = Window(time, np.array([time]), log.inputs)
    for guess in guesses:
        start = dict(zip(problem.subject.states, np.where(np.isfinite(states), states, default).tolist(), strict=True))
        count += problem.subject.closed(Stretch(window, problem.parameters(number, guess), start))
    return count / len(guesses)


def defaults(problem: SegmentProblem) -> np.ndarray:
    """(states,) start values of the model."""
    return np.array([problem.subject.fmu.start_of(name) for name in problem.subject.states])
