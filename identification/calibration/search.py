"""The search: guesses that are only scored, then the best of them robustly, with a continuity that rises, then a free
run.

A free run from a guess falls into the nearest of many minima, and a robust loss with continuity in weights does so far
less often; what decides is the scan: guesses in a box about the first values are scored by the segments' own
predictions from nodes of the data, without any optimization (Bock's multiple shooting begins at the best of these).

Where only times of events are known, as a microphone hears them, no sample shows a state that a segment could begin
with. So the first events are met from guesses of the parameters and start states, held near their first values by weak
priors that fade as more events are taken, a third more each time: what the events so far have told predicts the next
ones far better than any guess, also where the motion is chaotic.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.families.execution import Execution, Runner
from fmu_models.families.jobs import Jobs
from fmu_models.simulation.rows import RunRows
from identification.calibration.descent import ALIKE, LEFT, Minimum, Progress, begun, best_first
from identification.calibration.nodes import local_motion, nodes_of
from identification.calibration.problem import SegmentProblem
from identification.calibration.segments import whole
from identification.calibration.trials import Trials
from identification.calibration.unknowns import BOX, FreeParameter, Scaled, signs_of
from identification.calibration.untold import telling
from identification.inference.levenberg import levenberg
from identification.inference.problem import SOFT, Prior, Unknown

GUESSES = 24
DENSITY = 4.0  # points of a line for each change of the prediction by as much as the measured motion
POINTS = (6, 200)  # of a line, at least and at most
CANDIDATES = 8  # for each start, of which those are taken at which every parameter has an effect
STARTS = 3  # of the guesses, from which a search is made
SCAN = 0.3  # of the work
DOUBTFUL = 3.0  # deviations of the noise: where no search leaves less, and no two agree, more are made
MORE = 2  # times as many
LONGER = 0.75  # times as many segments, where even that leaves as much
ANEW = 3  # times that segments are parted anew at the best minimum, as long as that lowers it
TIMED = 1e-3  # of the time between events: their noise, until residuals show it
SCORED = 8  # guesses, at a time
REDRAWN = 50  # times, a guess that the model refuses
HERE = Execution(workers=1)  # in this process
SAME = 0.05  # relative: guesses whose parameters differ less are one
FIRST = 4  # events, at the begin
GROWTH = 1.3
DRAWN = 20  # times as many guesses as of measured series: one costs a run over few events
SEARCHED = 16  # times as many starts
EVALUATIONS = 15
LOST = 0.1  # of the time between events: root mean square of a part at which a start is given up
ROUGH = 1e-6  # relative


@dataclass(frozen=True, eq=False)
class Plan:
    """How it is searched. count: segments of a log; seed: of the guesses; execution: who scores and descends, and where
    that is kept."""

    guesses: int = GUESSES
    starts: int = STARTS
    segments: int | None = None
    seed: int = 0
    progress: Progress = field(default=lambda _: None)
    execution: Execution = HERE


class Search:
    """The search of a free run; its `runner` is open.

    Raises:
        StickslipError: as `Runner`.
    """

    def __init__(self, free_run: SegmentProblem, free: Sequence[FreeParameter], plan: Plan) -> None:
        self.free, self.plan = free, plan
        self.generator = np.random.default_rng(plan.seed)
        self.trials = trials = Trials(free_run)
        self.draws: list[np.ndarray] = []
        if any(log.measured for log in trials.light.logs):
            self.draws = list(self._drawn(trials.light.first))
            if trials.light.subject.states:
                few = self.draws[: max(8, len(self.draws) // 3)]
                trials.nodes = nodes_of(trials.light, few, rates_of(trials.light), plan.segments)
        how = {"guesses": plan.guesses, "starts": plan.starts, "segments": plan.segments, "seed": plan.seed}
        boxes = [(sought.unknown.name, sought.box) for sought in free]
        self.runner = Runner(trials, {"analysis": "calibrate", **how, "boxes": boxes}, plan.execution)

    def _drawn(self, first: np.ndarray) -> Iterator[np.ndarray]:
        """Guesses about the first values, these before all others; none of parameters that exclude each other.
        StickslipError: the first values are such."""
        problem = self.trials.light
        refused = refusal_of(problem, first)
        if refused and refused == refusal_of(problem, first, shown=True):
            raise StickslipError(
                f"No motion can begin with the first values ({refused}). Give others: --set NAME=VALUE."
            )
        yield first
        for _ in range(self.plan.guesses - 1):
            guess = first.copy()
            for _ in range(REDRAWN):
                guess[: len(self.free)] = [sought.spread(1, self.generator)[0] for sought in self.free]
                if refused or not refusal_of(problem, guess):
                    break
            yield guess

    def minima(self) -> tuple[Minimum, ...]:
        """Minima, the best first; as many as there are when it is interrupted. StickslipError: no guess could be run at
        all."""
        trials, plan, light = self.trials, self.plan, self.trials.light
        if not self.draws:
            met = grown(light, self.free, plan.guesses, plan.starts, self.generator)
            return self._descended([x for _, x in met])
        if trials.nodes is None:
            return self._descended(telling(self.draws, trials.posed, MORE * plan.starts, len(self.draws)))
        if plan.guesses == plan.segments == 1:  # the first values are near, and nothing is looked for elsewhere
            return self._descended([np.append(self.draws[0], trials.nodes.rolled(self.draws[0])[0])])
        scan = _Scan(self.runner, trials, self.free, self.generator)
        scan.score(self.draws, lambda done: plan.progress(SCAN * done / 2))
        scan.along_lines(lambda done: plan.progress(SCAN * (1 + done) / 2))
        rows = telling(scan.best(), trials.posed, MORE * plan.starts, CANDIDATES * plan.starts)
        return self._otherwise(self._anew(self._descended(rows)))

    def _anew(self, minima: tuple[Minimum, ...]) -> tuple[Minimum, ...]:
        """Once more from segments that are parted anew at the best minimum, as long as that lowers it: states that no
        log shows then come from better parameters, and of two searches that agree both may be wrong."""
        trials = self.trials
        assert trials.nodes is not None
        for _ in range(ANEW):
            best = minima[0]
            if best.arrived:
                break
            x = begun(best.problem, best.solution.values)
            row = np.append(x, trials.nodes.rolled(x)[0])
            minima = self._descended([row], minima)
            if minima[0].misfit > (1 - ALIKE) * best.misfit:
                break
        return minima

    def _otherwise(self, minima: tuple[Minimum, ...]) -> tuple[Minimum, ...]:
        """Those of longer segments too, where more than noise is left: a node beside an event misleads every guess. Two
        free runs that leave as much are what the model can do."""
        plan, nodes, (best, *others) = self.plan, self.trials.nodes, minima
        assert nodes is not None
        agreed = not best.problem.parted and any(best.alike(other) for other in others)
        if best.arrived or plan.segments or agreed:
            return minima
        count = max(round(LONGER * len(nodes.states) / len(self.trials.light.logs)), 1)
        plan = replace(plan, segments=count, progress=lambda _: None, execution=replace(plan.execution, store=None))
        try:
            again = Search(self.trials.free_run, self.free, plan)
            with again.runner:
                return best_first((*minima, *again.minima()))
        except KeyboardInterrupt:
            return replace(best, interrupted=True), *others

    def _descended(self, rows: Sequence[np.ndarray], before: Sequence[Minimum] = ()) -> tuple[Minimum, ...]:
        """Minima ``before``, and those from some rows, taken in order until there is nothing more to be looked for."""
        minima = list(before)

        def report(done: float) -> None:
            share = (len(minima) - len(before) + done) / len(rows)
            self.plan.progress(SCAN + (1 - SCAN) * share)

        def take(number: int, made: RunRows) -> bool:
            here = self.trials.minimum(rows[number], made)
            again = any(here.near(minimum) for minimum in minima) and here.left < LEFT
            minima.append(here)
            enough = len(minima) >= self.plan.starts and min(minimum.misfit for minimum in minima) < DOUBTFUL
            return again or here.arrived or enough

        self.trials.progress, self.trials.together = report, 1
        try:
            self.runner.each(Jobs(np.array(rows)), take, quiet=True)
        except KeyboardInterrupt:
            if not minima:
                raise
            minima[0] = replace(minima[0], interrupted=True)
        return best_first(minima)


class _Scan:
    """Guesses that were scored: (score, unknowns of the free run and start states of the segments)."""

    def __init__(
        self, runner: Runner, trials: Trials, free: Sequence[FreeParameter], generator: np.random.Generator
    ) -> None:
        self.runner, self.trials, self.free, self.generator = runner, trials, free, generator
        self.scored: list[tuple[float, np.ndarray]] = []

    def score(self, guesses: Sequence[np.ndarray], progress: Progress) -> None:
        """Score some more, in order."""

        def take(number: int, made: RunRows) -> None:
            for guess, (score, *starts) in zip(guesses[number:], made.points[:, 0], strict=False):
                self.scored.append((score, np.append(guess, starts)))
            progress((number + len(made.points)) / len(guesses))

        self.trials.together = SCORED
        self.runner.each(Jobs(np.array(guesses)), take, quiet=True)

    def along_lines(self, progress: Progress) -> None:
        """From the best guess along each parameter in turn, in points as dense as its effect asks: a frequency that is
        off by one part in a hundred has lost its phase at the end of a log."""
        problem = self.trials.light
        row = min(self.scored, key=lambda guess: guess[0])[1]
        segmented, z = self.trials.posed(row)
        x = row[: len(problem.first)]
        here = segmented.evaluate(z)
        data = here.log < len(segmented.series)
        spread = np.concatenate(
            [
                np.full(int(np.sum(here.log == n)), np.std(problem.logs[log].observed[name]) / problem.noise[log, name])
                for n, (log, name) in enumerate(segmented.series)
            ]
        )
        effects = np.sqrt(np.mean((here.gradient[data, : len(self.free)] / spread[:, None]) ** 2, axis=0))
        sizes = [one.span(value) for one, value in zip(self.free, x, strict=False)]
        counts = np.clip(DENSITY * effects * sizes, *POINTS).astype(int)
        done, total = 0, int(counts.sum())
        for place in np.argsort(-counts):
            guesses = np.tile(x, (counts[place], 1))
            guesses[:, place] = self.free[place].spread(int(counts[place]), self.generator)
            before, count = done, counts[place]
            self.score(list(guesses), lambda share, b=before, c=count: progress((b + share * c) / total))
            x = min(self.scored, key=lambda guess: guess[0])[1][: len(x)]
            done += int(count)

    def best(self) -> list[np.ndarray]:
        """Guesses with start states that differ, the best first."""
        chosen: list[np.ndarray] = []
        shared = len(self.free)
        for _, row in sorted(self.scored, key=lambda guess: guess[0]):
            if all(np.any(np.abs(row - other)[:shared] > SAME * np.abs(row)[:shared]) for other in chosen):
                chosen.append(row)
        return chosen


def noise_of(problem: SegmentProblem) -> dict[tuple[int, str], float]:
    """By log and variable, what local parabolas leave; of event times a small share of what they are apart."""
    found = {}
    for number, log in enumerate(problem.logs):
        rows = np.unique(np.linspace(0, log.time.size - 1, 200).astype(int))
        noise = local_motion(log, rows, problem.subject.half)[1] if log.measured else {}
        noise |= {name: TIMED * float(np.median(np.diff(times))) for name, times in log.events.items()}
        found |= {(number, name): sd for name, sd in noise.items()}
    return found


def refusal_of(problem: SegmentProblem, x: np.ndarray, *, shown: bool = False) -> str:
    """Why the model refuses to begin with a guess; shown: in places that the log shows, where it shows them."""
    log = problem.logs[0]
    stretch = problem.stretch(0, x, log.time[:1])
    if shown:
        sensors = {name: problem.sensor(name, x) for name in log.measured if name in stretch.start}
        places = {name: (log.measured[name][0] - one.offset) / one.gain for name, one in sensors.items()}
        stretch = replace(stretch, start={**stretch.start, **places})
    return problem.subject.refusal(stretch)


def rates_of(problem: SegmentProblem) -> dict[str, str]:
    log = problem.logs[0]
    times = np.linspace(log.time[0], min(log.time[-1], log.time[0] + 50 * float(np.median(np.diff(log.time)))), 20)[1:]
    stretch = problem.stretch(0, problem.first, times)
    try:
        return problem.subject.rates(stretch)
    except StickslipError:
        return {}


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
    ended.sort(key=lambda ending: -ending[0])
    return [(free_run, x) for _, x in ended[:starts]]


def _draw(problem: SegmentProblem, free: Sequence[FreeParameter], generator: np.random.Generator) -> np.ndarray:
    guess = problem.first.copy()
    guess[: len(free)] = [sought.spread(1, generator)[0] for sought in free]
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
