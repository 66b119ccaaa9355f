"""The search where only times of events are known, as a microphone hears them: runs over few events first, then more.

No sample shows a state that a segment could begin with. So the first events are met from guesses of the parameters and
start states, held near their first values by weak priors that fade as more events are taken, a third more each time:
what the events so far have told predicts the next ones far better than any guess, also where the motion is chaotic.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.calibration.problem import SegmentProblem, whole
from identification.calibration.unknowns import BOX, FreeParameter, Scaled
from identification.inference.levenberg import levenberg
from identification.inference.problem import SOFT, Prior, Unknown

FIRST = 4  # events, at the begin
GROWTH = 1.3
DRAWN = 20  # times as many guesses as of measured series: one costs a run over few events
SEARCHED = 16  # times as many starts
EVALUATIONS = 15
LOST = 0.1  # of the time between events: root mean square of a part at which a start is given up
ROUGH = 1e-6  # relative


def grown(
    free_run: SegmentProblem, free: Sequence[FreeParameter], count: int, starts: int, generator: np.random.Generator
) -> list[tuple[SegmentProblem, np.ndarray]]:
    """Free runs with unknowns that meet all events, from the best of ``count`` guesses, up to ``starts`` of them; those
    that come furthest where none meets all."""
    most = max(times.size for log in free_run.logs for times in log.events.values())
    counts = [FIRST]
    while counts[-1] < most:
        counts.append(min(max(int(counts[-1] * GROWTH), counts[-1] + 1), most))
    guesses = [free_run.first, *(_draw(free_run, free, generator) for _ in range(DRAWN * count - 1))]
    first = _part(free_run, counts[min(2, len(counts) - 1)])
    guesses.sort(key=lambda x: float(np.sum(np.log1p((first.evaluate(x).residual / SOFT) ** 2))))
    ended: list[tuple[int, np.ndarray]] = []
    for x in guesses[: SEARCHED * starts]:
        reached = 0
        for reached in counts:
            part = _part(free_run, reached)
            scaled = Scaled(part, signs_of(part))
            x = scaled.natural(levenberg(scaled, scaled.scaled(x), tolerance=ROUGH, evaluations=EVALUATIONS).values)
            if _missed(part, x) > LOST:
                break
        else:
            reached = most + 1
        ended.append((reached, x))
        if sum(end > most for end, _ in ended) == starts:
            break
    ended.sort(key=lambda one: -one[0])
    return [(free_run, x) for _, x in ended[:starts]]


def signs_of(problem: SegmentProblem) -> np.ndarray:
    """(m,) sign of the unknowns that are sought by their logarithms: those whose bounds lie on one side of zero."""
    low, high = problem.limits
    one_sided = np.isfinite(low) & np.isfinite(high) & (np.sign(low) * np.sign(high) > 0)
    return np.where(one_sided, np.sign(low), 0.0)


def _draw(problem: SegmentProblem, free: Sequence[FreeParameter], generator: np.random.Generator) -> np.ndarray:
    guess = problem.first.copy()
    guess[: len(free)] = [one.spread(1, generator)[0] for one in free]
    guess[len(free) :] *= np.exp(BOX / 2 * generator.uniform(-1, 1, len(guess) - len(free)))
    return guess


def _part(problem: SegmentProblem, count: int) -> SegmentProblem:
    """The first ``count`` events of each log, with weak priors."""
    logs = []
    for log in problem.logs:
        times = np.sort(np.concatenate(list(log.events.values())))
        end = float(times[count - 1] + times[count]) / 2 if count < times.size else float(log.time[-1])
        logs.append(log.until(end))
    unknowns = tuple(_weak(one, value) for one, value in zip(problem.unknowns, problem.first, strict=True))
    return replace(problem, logs=tuple(logs), segments=whole(logs), unknowns=unknowns)


def _weak(unknown: Unknown, value: float) -> Unknown:
    if unknown.prior is not None:
        return unknown
    size = BOX if unknown.unit == "rad" else BOX * max(abs(value), 1e-3)
    return replace(unknown, prior=Prior(unknown.name, float(value), unknown.unit, size, "first value"))


def _missed(problem: SegmentProblem, x: np.ndarray) -> float:
    """Root mean square of the residuals, relative to the time between events."""
    here, squares = problem.evaluate(x), []
    for number, (log, name) in enumerate(problem.series):
        apart = float(np.median(np.diff(problem.logs[log].events[name])))
        squares.append(float(np.mean((here.residual[here.log == number] * problem.noise[log, name] / apart) ** 2)))
    return float(np.sqrt(np.mean(squares)))
