"""A log beside a calibrated model: its start states are found anew, all else stays, and what is left is judged.

A free run over the whole log; of a chaotic motion one run after another, each no longer than the horizon and from a
start of its own, since noise at the start decides what comes later. No window joins the next.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Shown
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.fmu import Fmu
from identification.calibration.descent import STAGES
from identification.calibration.log import ModelLog
from identification.calibration.nodes import Nodes, nodes_of
from identification.calibration.pose import Settings, problem_of
from identification.calibration.problem import SegmentProblem
from identification.calibration.result import Calibration, SeriesResidual
from identification.calibration.search import rates_of
from identification.calibration.segments import Segment
from identification.inference.colour import Autoregression
from identification.inference.levenberg import levenberg
from identification.inference.problem import Evaluation, Solution, solve
from identification.inference.whiteness import colour

ROUGH, FINE = 1e-6, 1e-9  # relative, of the start states by a soft loss and by the last one
EVALUATIONS = 60


@dataclass(frozen=True, eq=False)
class FollowedLog(Shown, Recorded):
    """log: as it was compared; modelled: (n,) by variable, as its sensor would show the model, NaN where that is not
    compared; begins: s, of the runs; starts: states at the begin of the first; residuals: by series; notes: where the
    model could not be run."""

    RECORD = ("log=log.name", "begins", "starts", "residuals", "notes")

    log: ModelLog
    modelled: Mapping[str, np.ndarray]
    begins: tuple[float, ...]
    starts: Mapping[str, float]
    residuals: tuple[SeriesResidual, ...]
    notes: tuple[str, ...] = ()


@one_blas_thread()
def follow(calibration: Calibration, fmu: Fmu, log: ModelLog) -> FollowedLog:
    """The model of a calibration along a log that took part in it or not, which may measure other variables.
    StickslipError: the log has fewer samples than start states, or the model cannot be run at all."""
    begin, problem = _posed(calibration, fmu, log)
    problem, begins = _parted(problem, begin, calibration.horizon)
    solution = min((_descended(problem, x) for x in begins), key=lambda one: one.evaluation.sum)
    lines = residuals_of(problem, solution.evaluation, {})
    took_part = log.name in calibration.logs
    lines = [replace(line, held_out=not took_part) for line in lines]
    notes = []
    for number, segment in enumerate(problem.segments):
        try:
            problem.subject.shown(problem.stretch(number, solution.values, np.array([segment.end])))
        except StickslipError as error:
            notes.append(f"{log.name}: the model cannot be run from {segment.begin:g} s on ({error}).")
    starts = dict(zip((unknown.name for unknown in problem.unknowns), solution.values.tolist(), strict=True))
    first = {name: value for name, value in starts.items() if name in {f"{state}(0)" for state in fmu.states}}
    return FollowedLog(
        log=log,
        modelled=_modelled(problem, solution),
        begins=tuple(segment.begin for segment in problem.segments),
        starts=first or starts,
        residuals=tuple(lines),
        notes=tuple(notes),
    )


def _posed(calibration: Calibration, fmu: Fmu, log: ModelLog) -> tuple[np.ndarray, SegmentProblem]:
    """The free run of the log with what was found, and where its start states begin: as those of the calibration."""
    values = {**calibration.held, **calibration.values_in(log.name)}
    model_values = {name: value for name, value in values.items() if name in fmu.variables and name not in log.begun}
    noise = {series.variable: series.rms for series in calibration.residuals if not series.held_out and series.rms > 0}
    settings = Settings(parameters=model_values, sensors=calibration.sensors, noise=noise)
    problem = problem_of(fmu, [log], (), settings)[0]
    starts = calibration.values_in(log.name, starts=True)
    pairs = zip(problem.unknowns, problem.first, strict=True)
    return np.array([starts.get(unknown.name, float(first)) for unknown, first in pairs]), problem


def _parted(
    problem: SegmentProblem, begin: np.ndarray, horizon: float | None
) -> tuple[SegmentProblem, Sequence[np.ndarray]]:
    """The problem in runs no longer than the horizon, and start states to begin with: those of the calibration, and
    those of segments that were joined along the log."""
    (log,) = problem.logs
    if not log.measured or not problem.subject.states:
        return problem, [begin]
    nodes = nodes_of(problem, [begin], rates_of(problem), None)
    parted, x = nodes.placed(begin, nodes.rolled(begin)[0])
    for loss, weight, evaluations in STAGES:
        parted = replace(parted, weight=weight)
        x = levenberg(parted, x, tolerance=ROUGH, evaluations=evaluations, loss=loss).values
    joined = x[parted.starts[0][parted.starts[0] >= 0]]
    if horizon is None:
        return problem, [begin, joined]
    return _windows(problem, parted, x, joined, horizon)


def _windows(
    problem: SegmentProblem, parted: SegmentProblem, x: np.ndarray, joined: np.ndarray, horizon: float
) -> tuple[SegmentProblem, Sequence[np.ndarray]]:
    """Runs no longer than the horizon, from states of segments that were joined at x; no run meets the next."""
    (log,), chosen = problem.logs, [0]
    for number, segment in enumerate(parted.segments):
        if segment.end - parted.segments[chosen[-1]].begin > horizon and number > chosen[-1]:
            chosen.append(number)
    begins = [parted.segments[number].begin for number in chosen]
    step = float(np.median(np.diff(log.time)))
    # each run ends before the first sample of the next
    ends = [*(begin - step / 2 for begin in begins[1:]), float(log.time[-1])]
    held = [problem.fixed.get(name, 0.0) for name in problem.subject.states]
    states = np.array([np.where(parted.starts[n] >= 0, x[parted.starts[n]], held) for n in chosen])
    segments = [Segment(0, begin, end, True) for begin, end in zip(begins, ends, strict=True)]
    alone, start = Nodes.of(problem, segments, states).placed(joined, states)
    return alone, [start]


def _descended(problem: SegmentProblem, begin: np.ndarray) -> Solution:
    soft = solve(problem, begin, tolerance=ROUGH, evaluations=EVALUATIONS, loss="cauchy")
    return solve(problem, soft.values, tolerance=FINE, evaluations=EVALUATIONS)


def _modelled(problem: SegmentProblem, solution: Solution) -> dict[str, np.ndarray]:
    """What the sensors would show (n,), by variable."""
    (log,), here = problem.logs, solution.evaluation
    modelled = {}
    for number, (_, name) in enumerate(problem.series):
        if name in log.measured:
            kept = problem.kept(0, name)
            values = np.full(log.time.size, np.nan)
            values[kept] = log.measured[name][kept] + problem.noise[0, name] * here.residual[here.log == number]
            modelled[name] = values
    return modelled


def residuals_of(
    problem: SegmentProblem, here: Evaluation, filters: Mapping[int, Autoregression]
) -> list[SeriesResidual]:
    """What is left, series by series. filters: that whiten it, by the number of the series."""
    lines = []
    for number, (log, name) in enumerate(problem.series):
        rows = here.residual[here.log == number]
        rms = float(np.sqrt(np.mean(rows**2)) * problem.noise[log, name])
        timed = name in problem.subject.timed
        spread = 0.0 if timed else float(np.std(problem.logs[log].measured[name]))
        neighbours, chance = colour(rows, np.zeros(len(rows)))
        lines.append(
            SeriesResidual(
                log=problem.logs[log].name,
                variable=name,
                unit="s" if timed else str(problem.subject.fmu.variables[name].unit or "1"),
                samples=len(rows),
                rms=rms,
                share=rms / spread if spread else None,
                autocorrelation=neighbours,
                chance=chance,
                order=filters[number].order if number in filters else 0,
            )
        )
    return lines
