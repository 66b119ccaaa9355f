"""Descents: segments that come together from one guess, then the free run that begins as they do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.calibration.log import ModelLog
from identification.calibration.nodes import Nodes
from identification.calibration.problem import SegmentProblem
from identification.calibration.segments import Segment
from identification.calibration.unknowns import Scaled, signs_of
from identification.calibration.untold import CERTAIN, column_norms
from identification.inference.levenberg import levenberg
from identification.inference.problem import SOFT, FitProblem, Solution

WHITE = 1.2  # mean square of the residuals, in units of the noise, at which a search has arrived
STAGES = (("cauchy", 3.0, 15), ("cauchy", 30.0, 15), ("linear", 1e3, 15), ("linear", 1e5, 40))
POLISHED = 3  # stages, after which a free run is tried
SLOW = 3e-3  # relative, of a soft loss, whose end is no end
ROUGH = 1e-4  # of the other stages
FINE = 1e-7  # of the free run
SEARCHED = 2000  # samples of a log in the search; the last step takes all
POLISH = 60  # evaluations of the free run
FOLLOWS = 1.05  # times the misfit of segments: a free run that leaves more has not followed the log
LEFT = 0.5  # of what is measured: a search that leaves more has not arrived
OUTLIER = 10.0  # times the median residual
DRAWS = 40  # beside a solution of a soft loss
ALIKE, FAR = 1e-3, 0.25  # relative: misfits and parameters of minima that are one

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where one start led to. problem: the free run, or segments of a chaotic motion, with its solution; horizon: s
    over which a free run says something, None for ever; interrupted: by the user, on the way."""

    problem: SegmentProblem
    solution: Solution
    horizon: float | None
    interrupted: bool = False

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals in units of the noise, those of continuity left out."""
        here = self.solution.evaluation
        return float(np.sqrt(np.mean(here.residual[here.log < len(self.problem.series)] ** 2)))

    @property
    def left(self) -> float:
        """Root mean square of the residuals in standard deviations of what is measured."""
        series, here = self.problem.series, self.solution.evaluation
        shares = [
            np.mean(here.residual[here.log == number] ** 2) * (self.problem.noise[log, name] / spread) ** 2
            for number, (log, name) in enumerate(series)
            if (spread := float(np.std(self.problem.logs[log].observed[name]))) > 0
        ]
        return float(np.sqrt(np.mean(shares))) if shares else 0.0

    @property
    def arrived(self) -> bool:
        """Whether there is nothing more to be looked for: the residuals are the noise, or the user wants no more."""
        return self.interrupted or self.misfit**2 < WHITE

    def alike(self, other: Minimum) -> bool:
        """Whether both leave as much."""
        return abs(self.misfit - other.misfit) <= ALIKE * min(self.misfit, other.misfit)

    def near(self, other: Minimum) -> bool:
        """Whether it is the same as another one: as good, and not far off along what the logs tell least."""
        shared = self.problem.shared
        mine, others = self.solution.values[:shared], other.solution.values[:shared]
        apart = np.abs(mine - others) / np.maximum(np.maximum(np.abs(mine), np.abs(others)), 1e-300)
        return self.alike(other) and bool(np.all(apart <= FAR))


def best_first(minima: Sequence[Minimum]) -> tuple[Minimum, ...]:
    """By their misfit; an interrupt of one search is one of all."""
    ordered = sorted(minima, key=lambda minimum: minimum.misfit)
    ordered[0] = replace(ordered[0], interrupted=any(minimum.interrupted for minimum in minima))
    return tuple(ordered)


def between_events(problem: SegmentProblem, x: np.ndarray) -> tuple[SegmentProblem, np.ndarray]:
    """The problem over segments of one event each, begun on the free run at x; the free run where it ends early."""
    segments: list[Segment] = []
    states: list[np.ndarray] = []
    for number, log in enumerate(problem.logs):
        times = np.sort(np.concatenate(list(log.events.values())))
        nodes = np.concatenate([[log.time[0]], (times[1:] + times[:-1]) / 2])
        try:
            run = problem.subject.shown(problem.stretch(number, x, nodes)).values
        except StickslipError:
            return problem, x
        ends = [*nodes[1:].tolist(), float(log.time[-1])]
        segments += [Segment(number, *pair, pair[1] == ends[-1]) for pair in zip(nodes.tolist(), ends, strict=True)]
        states += list(run[:, : len(problem.subject.states)])
    return Nodes.of(problem, segments, np.array(states)).placed(x, np.array(states))


def thinned(problem: SegmentProblem) -> SegmentProblem:
    """With at most `SEARCHED` samples of each log."""
    return with_logs(problem, tuple(log.every(max(-(-log.time.size // SEARCHED), 1)) for log in problem.logs))


def with_logs(problem: SegmentProblem, logs: tuple[ModelLog, ...]) -> SegmentProblem:
    """The problem with other samples of the same logs, whose ends may move."""
    segments = [
        replace(segment, end=float(logs[segment.log].time[-1])) if segment.last else segment
        for segment in problem.segments
    ]
    return replace(problem, logs=logs, segments=tuple(segments))


def descend(problem: SegmentProblem, x: np.ndarray, free_run: SegmentProblem, progress: Progress) -> Minimum:
    """From one guess to a minimum: segments that come together, then the free run; where that does not follow them they
    are joined closer, and stay the result if the motion is chaotic. An interrupt ends it where it is."""
    horizon, free, stages = None, None, STAGES if problem.parted else STAGES[:1]
    try:
        for place, (loss, weight, evaluations) in enumerate(stages):
            problem = replace(problem, weight=weight)
            scaled = Scaled(problem, signs_of(problem))
            tolerance = ROUGH if loss == "linear" else SLOW
            ended = levenberg(scaled, scaled.scaled(x), tolerance=tolerance, evaluations=evaluations, loss=loss)
            x = scaled.natural(ended.values)
            progress((place + 1) / (len(STAGES) + 1))
            if place + 1 in (POLISHED, len(stages)):
                horizon = _horizon(problem, x)
                misfit = Minimum(problem, ended, horizon).misfit
                if free is None or misfit < (1 - ALIKE) * free.misfit:
                    free = _polished(problem, x, free_run, horizon)
                if not problem.parted or free.misfit < FOLLOWS * misfit:
                    return free
    except KeyboardInterrupt:
        joined = Solution(x, problem.evaluate(x), True, "segments joined", (False,) * len(x))
        return Minimum(problem, joined, horizon, True)
    whole_logs = with_logs(problem, free_run.logs)
    joined = Minimum(whole_logs, levenberg(whole_logs, x, tolerance=ROUGH, evaluations=POLISH), horizon)
    return joined if free is None or horizon is not None or joined.misfit < LEFT * free.misfit else free


def _polished(problem: SegmentProblem, x: np.ndarray, free_run: SegmentProblem, horizon: float | None) -> Minimum:
    """The free run that begins as the segments do; once more from where a soft loss leads to, if single samples are far
    off: of a variable that jumps, those on the wrong side of the jump."""
    begin = begun(problem, x)
    scaled = Scaled(free_run, signs_of(free_run))

    def descended(begin: np.ndarray) -> Minimum:
        solution = levenberg(scaled, begin, tolerance=FINE, evaluations=POLISH)
        values = scaled.natural(solution.values)
        return Minimum(free_run, replace(solution, values=values, evaluation=free_run.evaluate(values)), horizon)

    minimum = descended(scaled.scaled(begin))
    residual = np.abs(minimum.solution.evaluation.residual)
    if minimum.misfit**2 > WHITE and np.max(residual) > OUTLIER * np.median(residual):
        soft = levenberg(scaled, scaled.scaled(begin), tolerance=ROUGH, evaluations=POLISH, loss="cauchy")
        return min(minimum, descended(_across(scaled, soft)), key=lambda one: one.misfit)
    return minimum


def _across(problem: FitProblem, soft: Solution) -> np.ndarray:
    """The best of unknowns (m,) drawn from what a soft loss leaves open: a sample on the wrong side of a jump is a wall
    to every descent, and within deviations of the other samples it is behind one."""
    here = soft.evaluation
    weights = 1 / np.sqrt(1 + (here.residual / SOFT) ** 2)
    slopes = weights[:, None] * here.gradient
    norms = column_norms(slopes)
    _, singular, right = np.linalg.svd(slopes / norms, full_matrices=False)
    spread = np.sqrt(np.mean((weights * here.residual) ** 2)) / np.maximum(singular, CERTAIN * singular[0])
    normal = np.random.default_rng(0).normal(size=(DRAWS, len(singular)))
    draws = np.clip(soft.values + (normal * spread) @ right / norms, *problem.limits)
    return min((soft.values, *draws), key=lambda x: float(np.sum(problem.residual(x) ** 2)))


def begun(problem: SegmentProblem, x: np.ndarray) -> np.ndarray:
    """The unknowns of the free run that begins as the segments do."""
    begins = [n for n, one in enumerate(problem.segments) if n == 0 or problem.segments[n - 1].log != one.log]
    places = problem.starts[begins]
    return np.concatenate([x[: problem.shared], x[places[places >= 0]]])


def _horizon(problem: SegmentProblem, x: np.ndarray) -> float | None:
    """s after which noise has grown as large as the motion, where it is so at the end of a log; else None."""
    if not problem.parted:
        return None
    least = min(
        sd / max(float(np.std(problem.logs[n].observed[name])), 1e-300) for (n, name), sd in problem.noise.items()
    )
    try:
        tangents = problem.tangents(x)
    except StickslipError:
        return None
    growth, beyond = np.eye(len(problem.scale)), None
    for number, (segment, tangent) in enumerate(zip(problem.segments, tangents, strict=True)):
        if number and problem.segments[number - 1].log != segment.log:
            growth, beyond = np.eye(len(problem.scale)), None
        growth = tangent @ growth
        large = float(np.linalg.norm(growth, 2)) * least > 1
        if large and beyond is None:
            beyond = segment.end - float(problem.logs[segment.log].time[0])
        if segment.last and large:
            return beyond
    return None
