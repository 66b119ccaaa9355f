"""Where segments begin, and in which states: from the log where it shows them, else from the run before.

A local parabola over `HALF` samples to either side gives place and speed of a measured state; what it leaves is the
noise. A segment begins where most guesses of the parameters say that no contact has a memory or a wall is near, and of
such samples where the parabola leaves least: not at an impact.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.calibration.log import ModelLog
from identification.calibration.problem import Segment, SegmentProblem
from identification.calibration.subject import HALF
from identification.inference.problem import SOFT

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
    for name, measured in log.measured.items():
        values = np.empty((len(rows), 2))
        rest = np.empty(len(rows))
        for place, (row, window) in enumerate(zip(rows, windows, strict=True)):
            time = log.time[window] - log.time[row]
            terms = np.vander(time / max(np.ptp(time), np.finfo(float).tiny), order + 1, increasing=True)
            solved = np.linalg.lstsq(terms, measured[window], rcond=None)[0]
            values[place] = solved[0], solved[1] / np.ptp(time) if order else 0.0
            freedom = max(len(window) - order - 1, 1)
            rest[place] = np.sqrt(np.sum((terms @ solved - measured[window]) ** 2) / freedom)
        value[name], speed[name] = values.T
        thirds = np.abs(np.diff(measured, 3)) if len(measured) > 3 else np.array([np.inf])
        white = float(np.median(thirds)) / MEDIAN / np.sqrt(20.0)  # of a third difference: 1 + 9 + 9 + 1
        white = min(float(np.median(rest)), white) if half else SPREAD * float(np.std(measured))
        noise[name] = max(white, 1e-9 * float(np.ptp(measured)), np.finfo(float).tiny)
        left += (rest / noise[name]) ** 2
    return LocalMotion(rows, value, speed, np.sqrt(left)), noise


@dataclass(frozen=True, eq=False)
class Nodes:
    """Segments, and (segments, states) what the logs say of their start states, NaN where they say nothing."""

    segments: tuple[Segment, ...]
    states: np.ndarray


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
    return Nodes(tuple(segments), np.array(states).reshape(len(segments), len(problem.subject.states)))


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
    for guess in guesses:
        stretch = problem.stretch(number, guess, np.array([time]))
        start = dict(zip(problem.subject.states, np.where(np.isfinite(states), states, default).tolist(), strict=True))
        count += problem.subject.closed(replace(stretch, start_time=time, start=start))
    return count / len(guesses)


def defaults(problem: SegmentProblem) -> np.ndarray:
    """(states,) start values of the model."""
    variables = problem.subject.fmu.variables
    return np.array([float(variables[name].start or 0.0) for name in problem.subject.states])


def rolled(problem: SegmentProblem, x: np.ndarray, nodes: Nodes) -> tuple[np.ndarray, float]:
    """Start states (segments, states) with those that the logs do not show from the run of the segment before, and how
    badly the segments then predict their samples: sum of log(1 + (r/SOFT)^2). Nothing is optimized."""
    subject, segments = problem.subject, nodes.segments
    starts, score = nodes.states.copy(), 0.0
    state, default = defaults(problem), defaults(problem)
    for number, segment in enumerate(segments):
        fresh = number == 0 or segments[number - 1].log != segment.log
        state = default if fresh else state
        starts[number] = np.where(np.isfinite(starts[number]), starts[number], state)
        log = problem.logs[segment.log]
        inside = segment.holds(log.time)
        times = np.unique(np.append(log.time[inside], segment.end))
        start = dict(zip(subject.states, starts[number].tolist(), strict=True))
        stretch = replace(problem.stretch(segment.log, x, times), start_time=segment.begin, start=start)
        try:
            values, hits = subject.observed(stretch)
        except StickslipError:
            values, hits = None, {}
        for name, measured in log.measured.items():
            sensor, noise = problem.sensor(name, x), problem.noise[segment.log, name]
            if values is None:
                score += float(inside.sum()) * np.log1p((np.std(measured) / noise) ** 2)
                continue
            modelled = sensor.gain * values[: int(inside.sum()), subject.recorded.index(name)] + sensor.offset
            off = (np.clip(modelled, *sensor.clip) - measured[inside]) / noise
            score += float(np.sum(np.log1p((off / SOFT) ** 2)))
        for name, measured in log.events.items():
            measured, met = measured[segment.holds(measured)], hits.get(name, np.zeros(0))
            count = min(measured.size, met.size)
            off = (met[:count] - measured[:count]) / problem.noise[segment.log, name]
            apart = float(np.median(np.diff(log.events[name]))) / problem.noise[segment.log, name]
            off = np.append(off, np.full(measured.size - count, apart))
            score += float(np.sum(np.log1p((off / SOFT) ** 2)))
        state = starts[number] if values is None else values[-1, : len(subject.states)]
    return starts, score
