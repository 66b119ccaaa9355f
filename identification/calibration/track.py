"""States of a model along a log, and parameters that change slowly, by a smoother over segments.

from identification import track
course = track("forced_stick_slip", "run.csv", drift=["a0"])
print(course.summary())
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.record import record
from fmu_models.base.shown import Pictured
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.fmu import Fmu
from identification.calibration.descent import STAGES, Progress
from identification.calibration.drifting import CHANCE, DriftProblem
from identification.calibration.follow import residuals_of
from identification.calibration.log import LogLike, ModelLog, model_log
from identification.calibration.nodes import nodes_of
from identification.calibration.pose import Settings, problem_of, with_instruments
from identification.calibration.problem import SegmentProblem
from identification.calibration.result import SeriesResidual
from identification.calibration.search import rates_of
from identification.calibration.subject import Vector
from identification.calibration.systems import opened, subject_of
from identification.inference.problem import Evaluation, solve
from identification.inference.whiteness import COLOURED

if TYPE_CHECKING:
    import pandas

    from fmu_models.codegen.package import Model
    from fmu_models.coupling.system import CoupledSystem
    from fmu_models.language.maps import Map

KIND = "stickslip track"
FIRST = 0.2  # of a parameter: its walk over the log, before anything is known
ROUGH, FINE = 1e-4, 1e-8  # relative
TOLERANCES = (ROUGH, ROUGH, ROUGH, FINE)  # of rounds of solution, noise and rates


@dataclass(frozen=True)
class Path:
    """A quantity over time. values, deviations: (n,), in its unit."""

    name: str
    unit: str
    values: tuple[float, ...]
    deviations: tuple[float, ...]


@dataclass(frozen=True)
class Drift(Path):
    """A parameter, one value from each node on. rate: of its walk, in its unit per root of a second, 0 of one that
    stays; gain: of -2 ln likelihood over one that stays, beyond 2.71 in one of twenty that do."""

    rate: float = 0.0
    gain: float = 0.0

    @property
    def constant(self) -> bool:
        """Whether the log shows no drift."""
        return self.rate == 0.0

    @property
    def sentence(self) -> str:
        """What became of it."""
        first, last = (value_with_sd(self.values[n], self.deviations[n], self.unit) for n in (0, -1))
        if self.constant:
            return f"'{self.name}' stays: {last}; a drift gains {self.gain:.1f} of -2 ln likelihood, as chance does."
        low, high = min(self.values), max(self.values)
        return (
            f"'{self.name}' drifts from {first} to {last}, between {low:.4g} and {high:.4g}; that gains "
            f"{self.gain:.1f} of -2 ln likelihood over one that stays."
        )


@dataclass(frozen=True)
class Course(Pictured):
    """States and parameters along a log. times: (n,) s, of the states; nodes: (k,) s, from which on values of the
    parameters hold; measured: (n,) by variable, empty in a course that is compared; online: estimates know the samples
    until then alone."""

    model: str
    title: str
    log: str
    times: tuple[float, ...]
    states: tuple[Path, ...]
    nodes: tuple[float, ...]
    parameters: tuple[Drift, ...]
    residuals: tuple[SeriesResidual, ...]
    measured: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False, compare=False)
    online: bool = False

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each sample: states and parameters, and their deviations as "sd ..."."""
        import pandas

        columns: dict[str, Any] = {"time": self.times}
        for path in self.states:
            columns |= {path.name: path.values, f"sd {path.name}": path.deviations}
        at = np.searchsorted(self.nodes, self.times, side="right") - 1
        for path in self.parameters:
            columns |= {path.name: np.take(path.values, at), f"sd {path.name}": np.take(path.deviations, at)}
        return pandas.DataFrame(columns)

    @property
    def sentences(self) -> list[str]:
        """What became of each parameter, and what is left."""
        coloured = [line.variable for line in self.residuals if line.chance < COLOURED]
        sentences = [path.sentence for path in self.parameters]
        if coloured:
            sentences.append(
                f"What is left of {', '.join(coloured)} is coloured: the model misses something, or the noise is not "
                "white, and deviations are too small."
            )
        return sentences

    @property
    def steps(self) -> str:
        """How it was followed."""
        return "sample by sample" if self.online else f"{len(self.nodes)} segments"

    def _heading(self) -> str:
        return f"Track: {self.title} along {self.log}, {self.steps}"

    def _contents(self) -> Mapping[str, Any]:
        ends = {
            path.name: (path.values[-1], path.deviations[-1], path.unit) for path in (*self.parameters, *self.states)
        }
        return {f"{name} at the end": value_with_sd(*end) for name, end in ends.items()}

    def to_dict(self) -> dict[str, Any]:
        """Plain values only."""
        return {"type": KIND, **record(self), "sentences": self.sentences}


@one_blas_thread()
def track(
    model: Model | Fmu | CoupledSystem | Map,
    log: LogLike,
    *,
    drift: Sequence[str] = (),
    states: Sequence[str] | None = None,
    settings: Settings | None = None,
    progress: Progress | None = None,
    **more: object,
) -> Course:
    """Follow states and slowly changing parameters along a log.

    Args:
        model: as in `calibrate`; an FMU of anybody must show its states (Model Exchange).
        log: a file, a table, a data frame or arrays by name, see `log.model_log`.
        drift: parameters that walk from segment to segment; they begin at ``parameters`` or their default.
        states: states and outputs whose course is wanted; all states if None.
        settings: what else is known, as in `calibrate`; each of its fields may be given as an argument of its own.
        progress: called with the fraction done.

    Raises:
        StickslipError: a name that is none, a log that does not fit the model or has fewer samples than there are
            unknowns, an FMU that is co-simulated.
    """
    on_progress = progress or (lambda _: None)
    free_run, said, wanted = posed(model, log, drift, states, settings, more)
    begun, x = _begun(free_run, len(drift), said)
    smoothed, x, gains = _smoothed(begun, x, free_run.noise_known, on_progress)
    return _course(free_run, smoothed, x, gains, wanted)


def posed(
    model: Model | Fmu | CoupledSystem | Map,
    log: LogLike,
    drift: Sequence[str],
    states: Sequence[str] | None,
    settings: Settings | None,
    more: Mapping[str, object],
) -> tuple[SegmentProblem, Settings, list[str]]:
    """The free run of a log, what is known of it, and whose courses are wanted; arguments and errors as in `track`."""
    said = replace(settings or Settings(), **more)  # type: ignore[arg-type]  # fields of it, by name
    fmu = opened(model)
    read = model_log(log, fmu, columns=said.columns, inputs=said.inputs, hold=said.hold, events=said.events, name="log")
    said = with_instruments(said, [read])
    _check(said, read)
    free_run, _ = problem_of(fmu, [read], list(drift), said)
    if not free_run.subject.states:
        raise StickslipError(
            f"'{fmu.description.modelName}' is co-simulated and does not show its states: there is nothing to track. "
            "Take its Model Exchange form."
        )
    wanted = list(states) if states is not None else list(free_run.subject.states)
    for name in wanted:
        if name not in (*free_run.subject.states, *fmu.outputs):
            raise StickslipError(f"There is no state or output '{name}'.{nearest(name, fmu.states)}")
    subject = subject_of(fmu, drift, [*read.observed, *(name for name in wanted if name not in read.observed)])
    return replace(free_run, subject=subject), said, wanted


def _check(said: Settings, log: ModelLog) -> None:
    """Refuse what a calibration takes and a track does not."""
    if said.sensed:
        raise StickslipError(f"A track finds no constants of sensors, such as '{':'.join(said.sensed[0])}'.")
    if said.priors or said.each or said.held_out:
        raise StickslipError("A track takes one log and no priors. Calibrate with these, and set what was found.")
    if log.events:
        raise StickslipError("A track follows samples, not times of events. Leave those out.")


def _begun(free_run: SegmentProblem, count: int, said: Settings) -> tuple[DriftProblem, np.ndarray]:
    """Segments with values of their own, each a log of its own, and where the search begins."""
    (log,) = free_run.logs
    nodes = nodes_of(free_run, [free_run.first], rates_of(free_run), said.segments)
    problem, x = nodes.placed(free_run.first, nodes.rolled(free_run.first)[0])
    number = len(problem.segments)
    walks = np.arange(count * number).reshape(count, number)
    walking = [
        replace(unknown, name=f"{unknown.name} at {segment.begin:g} s")
        for unknown in problem.unknowns[:count]
        for segment in problem.segments
    ]
    names = [unknown.name for unknown in problem.unknowns[:count]]
    pieces = []
    for n, inside in enumerate(segment.holds(log.time) for segment in problem.segments):
        measured = {name: values[inside] for name, values in log.measured.items()}
        pieces.append(ModelLog(f"{log.name} {n}", log.time[inside], measured, log.inputs))
    segments = tuple(replace(segment, log=n) for n, segment in enumerate(problem.segments))
    starts = np.where(problem.starts >= 0, problem.starts + walks.size - count, -1)
    parted = replace(
        problem,
        logs=tuple(pieces),
        segments=segments,
        unknowns=(*walking, *problem.unknowns[count:]),
        first=np.concatenate([np.repeat(x[:count], number), x[count:]]),
        places=tuple({name: int(walks[row, n]) for row, name in enumerate(names)} for n in range(number)),
        starts=starts,
        noise={(n, name): free_run.noise[0, name] for n in range(number) for name in log.observed},
    )
    begins = np.array([segment.begin for segment in segments])
    span = float(np.ptp(log.time))
    rates = FIRST * np.maximum(np.abs(x[:count]), 1e-9) / np.sqrt(span)
    return DriftProblem(parted, walks, np.diff(begins), rates), parted.first


def _smoothed(
    problem: DriftProblem, x: np.ndarray, noise_known: bool, told: Progress
) -> tuple[DriftProblem, np.ndarray, np.ndarray]:
    """The solution with the noise that it leaves and the rates that it makes likeliest, and what these gain."""
    for number, (loss, weight, evaluations) in enumerate(STAGES):
        problem = replace(problem, problem=replace(problem.problem, weight=weight))
        x = solve(problem, x, tolerance=ROUGH, evaluations=evaluations, loss=loss).values
        told(0.6 * (number + 1) / len(STAGES))
    gains = np.zeros(len(problem.walks))
    for number, tolerance in enumerate(TOLERANCES):
        if not noise_known:
            problem = _weighed(problem, x)
        if gains.size:
            problem, gains = problem.with_likeliest_rates(x)
        x = solve(problem, x, tolerance=tolerance, evaluations=40).values
        told(0.6 + 0.4 * (number + 1) / len(TOLERANCES))
    return problem, x, gains


def _weighed(problem: DriftProblem, x: np.ndarray) -> DriftProblem:
    """With the noise that the residuals show, one for each variable; unknowns count as far as the log tells them."""
    inner, here = problem.problem, problem.evaluate(x)
    data = here.log < len(inner.series)
    slopes = here.gradient[data]
    leverage = float(np.sum((slopes @ problem.covariance(x)) * slopes)) / int(data.sum())
    noise = dict(inner.noise)
    for name in {name for _, name in inner.series}:
        numbers = [n for n, (_, variable) in enumerate(inner.series) if variable == name]
        power = float(np.mean(here.residual[np.isin(here.log, numbers)] ** 2)) / max(1 - leverage, 0.1)
        noise |= {key: sd * float(np.sqrt(power)) for key, sd in inner.noise.items() if key[1] == name}
    return replace(problem, problem=replace(inner, noise=noise))


def _course(
    free_run: SegmentProblem, smoothed: DriftProblem, x: np.ndarray, gains: np.ndarray, wanted: Sequence[str]
) -> Course:
    problem, subject = smoothed.problem, free_run.subject
    covariance, columns = smoothed.covariance(x), [subject.recorded.index(name) for name in wanted]
    values, deviations = [], []
    for number, piece in enumerate(problem.logs):
        times = np.unique(np.append(piece.time, problem.segments[number].end))
        run = subject.respond(problem.stretch(number, x, times))
        at = np.searchsorted(times, piece.time)
        places = problem.differentiated(number)
        used = np.flatnonzero(places >= 0)
        slopes = run.slopes[at][:, columns][:, :, used]
        block = covariance[np.ix_(places[used], places[used])]
        values.append(run.values[at][:, columns])
        deviations.append(np.sqrt(np.maximum(np.einsum("nkp,pq,nkq->nk", slopes, block, slopes), 0.0)))
    every = np.vstack(values), np.vstack(deviations)
    paths = {name: (every[0][:, n], every[1][:, n]) for n, name in enumerate(wanted)}
    # within a segment the walk goes on, by a sixth of its length on average about its mean
    lengths = np.append(smoothed.spans, problem.segments[-1].end - problem.segments[-1].begin)
    walks = {}
    for row, name in enumerate(subject.parameters):
        places, gain = smoothed.walks[row], float(gains[row])
        rate = float(smoothed.rates[row]) if gain > CHANCE else 0.0
        walks[name] = x[places], np.sqrt(np.diag(covariance)[places] + rate**2 * lengths / 6), rate, gain
    here, rows = problem.evaluate(x), []
    for _, name in free_run.series:
        parts = [n for n, (_, variable) in enumerate(problem.series) if variable == name]
        rows.append(here.residual[np.isin(here.log, parts)])
    noise = {(0, name): problem.noise[0, name] for _, name in free_run.series}
    nodes = [segment.begin for segment in problem.segments]
    return course_of(replace(free_run, noise=noise), paths, walks, nodes, rows)


def course_of(
    free_run: SegmentProblem,
    paths: Mapping[str, tuple[Vector, Vector]],
    walks: Mapping[str, tuple[Vector, Vector, float, float]],
    nodes: Sequence[float],
    rows: Sequence[Vector],
    *,
    online: bool = False,
) -> Course:
    """A course along the log of a free run. paths: values and deviations (n,) by state; walks: the same (k,) of
    parameters, their rates and gains; nodes: (k,) s; rows: residuals over the noise, by series."""
    (log,), fmu = free_run.logs, free_run.subject.fmu

    def path(name: str, values: Vector, deviations: Vector) -> tuple[str, str, tuple[float, ...], tuple[float, ...]]:
        return name, str(fmu.variables[name].unit or "1"), tuple(values.tolist()), tuple(deviations.tolist())

    numbers = np.repeat(np.arange(len(rows)), [len(row) for row in rows])
    residual = np.concatenate(rows)
    left = Evaluation(residual, np.zeros((len(residual), 0)), numbers, numbers, np.full(len(residual), np.nan))
    return Course(
        model=str(fmu.description.modelName),
        title=str(fmu.description.description or fmu.description.modelName),
        log=log.name,
        times=tuple(log.time.tolist()),
        states=tuple(Path(*path(name, *pair)) for name, pair in paths.items()),
        nodes=tuple(nodes),
        parameters=tuple(Drift(*path(name, *walk[:2]), rate=walk[2], gain=walk[3]) for name, walk in walks.items()),
        residuals=tuple(residuals_of(free_run, left, {})),
        measured=dict(log.measured),
        online=online,
    )
