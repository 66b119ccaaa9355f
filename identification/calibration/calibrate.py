"""Parameters of any model from measured series: declared ones, FMUs of this suite and of others.

from identification import calibrate
found = calibrate("forced_stick_slip", ["run.csv"], free=["a0", "a1", "a3"])
print(found.summary())
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from identification.calibration.conclude import Concluded, conclude
from identification.calibration.log import LogLike, ModelLog, model_log, rows_of
from identification.calibration.problem import IDEAL, SENSED, SegmentProblem, Sensor, whole
from identification.calibration.result import CalibratedValue, Calibration, LocalMinimum, SeriesResidual
from identification.calibration.search import GUESSES, STARTS, Minimum, Plan, Progress, noise_of, search
from identification.calibration.subject import subject_of
from identification.calibration.unknowns import Bounds, Free, free_parameters
from identification.calibration.untold import words
from identification.inference.lmfit_exchange import Solved
from identification.inference.problem import Unknown, solve
from identification.inference.uncertainty import autocorrelation

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model

WITHIN = 1.1  # times the least misfit: minima that are listed
DELAY = 0.02  # of a log: the longest delay that is tried, to either side, unless stated


@dataclass(frozen=True)
class Settings:
    """What is known and how it is searched, beside model, logs and what is free.

    parameters: values held, first values of those that are free, and start states; starts: states whose start is sought
    (default: all that ``parameters`` do not hold); bounds, priors (value, standard deviation): by name; sensors: by
    variable; sensed: constants of sensors that are sought, (variable, "gain", "offset" or "delay"); noise: standard
    deviation by variable; each: parameters that every log has a value of its own for; columns, inputs, hold, events: as
    in `log.model_log`; guesses, attempts: scored, and searched from; segments: of each log; seed: of the guesses.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    starts: Sequence[str] | None = None
    bounds: Mapping[str, Bounds] = field(default_factory=dict)
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    sensed: Sequence[tuple[str, str]] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    each: Sequence[str] = ()
    columns: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    hold: Sequence[str] = ()
    events: Mapping[str, str] = field(default_factory=dict)
    held_out: Sequence[LogLike] = ()
    guesses: int = GUESSES
    attempts: int = STARTS
    segments: int | None = None
    seed: int = 0


@one_blas_thread()
def calibrate(
    model: Model | Fmu,
    logs: LogLike | Sequence[LogLike],
    *,
    free: Sequence[str],
    settings: Settings | None = None,
    progress: Progress | None = None,
    **more: object,
) -> Calibration:
    """Find parameters of a model, and the start states of its logs, by least squares.

    Args:
        model: a name, a file, a declaration, or an FMU of anybody.
        logs: one or several files, tables, data frames or arrays by name, see `log.model_log`.
        free: parameters that are sought.
        settings: what else is known; each of its fields may be given as an argument of its own instead.
        progress: called with the fraction done.

    Raises:
        StickslipError: a name that is none, a log that does not fit the model, a parameter without effect, more
            unknowns than samples, first values outside their bounds; all of that before any search.
    """
    said = replace(settings or Settings(), **more)  # type: ignore[arg-type]  # fields of it, by name
    fmu = model if isinstance(model, Fmu) else load(model)
    read = [_log(log, fmu, said, f"log {number + 1}") for number, log in enumerate(_several(logs))]
    problem, sought = problem_of(fmu, read, list(free), said)
    _check_count(problem)
    plan = Plan(said.guesses, said.attempts, said.segments, said.seed, progress or (lambda _: None))
    minima = search(problem, sought, plan)
    concluded = conclude(minima[0])
    held_out = [_log(log, fmu, said, f"held out {n + 1}") for n, log in enumerate(said.held_out)]
    others = [line for log in held_out for line in held_out_residuals(concluded, log)]
    named = model if isinstance(model, str) else ""
    return _result(fmu, concluded, minima, sought, _said(concluded, minima), others, named)


def _several(logs: LogLike | Sequence[LogLike]) -> Sequence[LogLike]:
    return logs if isinstance(logs, list | tuple) else [logs]  # type: ignore[list-item]


def _log(source: LogLike, fmu: Fmu, said: Settings, name: str) -> ModelLog:
    return model_log(
        source, fmu, columns=said.columns, inputs=said.inputs, hold=said.hold, events=said.events, name=name
    )


def problem_of(
    fmu: Fmu, logs: Sequence[ModelLog], free: Sequence[str], said: Settings
) -> tuple[SegmentProblem, tuple[Free, ...]]:
    """The free runs of all logs, and what is sought but start states.

    Raises:
        StickslipError: as in `calibrate`.
    """
    sought = free_parameters(fmu, free, said.parameters, said.bounds, said.priors)
    measured = list(dict.fromkeys(name for log in logs for name in log.observed))
    subject = subject_of(fmu, free, measured)
    if stray := [name for name in said.each if name not in free]:
        raise StickslipError(f"'{stray[0]}' is to have a value for each log and is not free. Add it to --free.")
    unknowns: list[Free] = []
    places: list[dict[str, int]] = [{} for _ in logs]
    for one in sought:
        name = one.unknown.name
        for number, log in enumerate(logs):
            if number == 0 or name in said.each:
                own = f"{name} [{log.name}]" if name in said.each and len(logs) > 1 else name
                unknowns.append(replace(one, unknown=replace(one.unknown, name=own)))
            places[number][name] = len(unknowns) - 1
    sensed = {}
    for name, key in said.sensed:
        sensed[name, key] = len(unknowns)
        unknowns.append(_sensor_constant(name, key, said.sensors.get(name, IDEAL), logs))
    held = {name: value for name, value in said.parameters.items() if name not in free}
    loose = _loose(subject.states, held, said.starts)
    variables = fmu.variables
    held |= {
        name: float(variables[name].start or 0.0) for name in subject.states if name not in loose and name not in held
    }
    starts = np.full((len(logs), len(subject.states)), -1)
    more, first = [], [one.first for one in unknowns]
    for number, log in enumerate(logs):
        for place, name in enumerate(subject.states):
            if name in loose:
                starts[number, place] = len(first)
                own = f"{name}(0)" + (f" [{log.name}]" if len(logs) > 1 else "")
                more.append(Unknown(own, str(variables[name].unit or "1"), description="start"))
                first.append(said.parameters.get(name, float(variables[name].start or 0.0)))
    problem = SegmentProblem(
        subject=subject,
        logs=tuple(logs),
        segments=whole(logs),
        unknowns=(*(one.unknown for one in unknowns), *more),
        first=np.array(first),
        fixed=held,
        places=tuple(places),
        starts=starts,
        noise={},
        scale=np.ones(len(subject.states)),
        noise_known=all(name in said.noise for name in measured),
        sensors=dict(said.sensors),
        sensed=sensed,
    )
    noise = {key: said.noise.get(key[1], sd) for key, sd in noise_of(problem).items()}
    return replace(problem, noise=noise), tuple(unknowns)


def _loose(states: Sequence[str], held: Mapping[str, float], asked: Sequence[str] | None) -> list[str]:
    """States whose start is sought."""
    for name in asked or ():
        if name not in states:
            raise StickslipError(f"There is no start state '{name}' to be sought.{nearest(name, states)}")
    return list(asked) if asked is not None else [name for name in states if name not in held]


def _sensor_constant(name: str, key: str, sensor: Sensor, logs: Sequence[ModelLog]) -> Free:
    if key not in SENSED or not any(name in log.measured for log in logs):
        raise StickslipError(f"A sensor is VARIABLE:{','.join(SENSED)} of a measured variable; found '{name}:{key}'.")
    first, low, high, unit = float(getattr(sensor, key)), -np.inf, np.inf, ""
    if key == "gain":
        low, high = sorted((first * np.exp(-3.5), first * np.exp(3.5)))
    elif key == "delay":
        longest = sensor.longest or DELAY * min(float(log.time[-1] - log.time[0]) for log in logs)
        low, high, unit = -longest, longest, "s"
    unknown = Unknown(f"{name} {key}", unit, low, high, f"{key} of the sensor")
    return Free(first, unknown, key == "gain")


def _check_count(problem: SegmentProblem) -> None:
    """Refuse more unknowns than samples."""
    rows, count = rows_of(problem.logs), len(problem.unknowns)
    if rows <= count:
        names = ", ".join(unknown.name for unknown in problem.unknowns)
        raise StickslipError(f"{rows} samples cannot determine the {count} unknowns {names}. Free fewer of them.")


def _said(concluded: Concluded, minima: Sequence[Minimum]) -> list[str]:
    """Warnings, after the search."""
    problem, solution = concluded.problem, concluded.solution
    notes = [problem.subject.note] if problem.subject.note else []
    met: set[str] = set()
    for number, segment in enumerate(problem.segments):
        try:
            run = problem.subject.respond(problem.stretch(number, solution.values, np.array([segment.end])))
        except StickslipError as error:
            notes.append(f"The model cannot be run with what was found ({error}). Begin with other values (--set).")
            continue
        met |= run.met
    notes += [
        f"No event of contact '{name}': its parameters are not told."
        for name in problem.subject.contacts
        if name not in met
    ]
    notes += concluded.collinearity.warnings
    for unknown, at in zip(problem.unknowns, minima[0].solution.at_bound, strict=False):
        if at:
            notes.append(f"'{unknown.name}' ended on a bound of the search: widen it, or hold the parameter.")
    horizon = minima[0].horizon
    if horizon is not None:
        notes.append(
            f"The motion is chaotic: from the same start noise grows as large as the motion within {horizon:.3g} s. "
            "Compare a free run with the log over that time only."
        )
    if minima[0].interrupted:
        notes.append("Interrupted: the best so far, not a minimum.")
    return notes


def _result(
    fmu: Fmu,
    concluded: Concluded,
    minima: Sequence[Minimum],
    sought: Sequence[Free],
    notes: Sequence[str],
    others: Sequence[SeriesResidual],
    declaration: str,
) -> Calibration:
    problem, solution = concluded.problem, concluded.solution
    shared = problem.shared
    begins = problem.starts[[n for n, s in enumerate(problem.segments) if s.begin == problem.logs[s.log].time[0]]]
    places = [*range(shared), *(int(place) for place in begins.ravel() if place >= 0)]
    silent = {name for names in concluded.untold for name in names}
    values = []
    for place in places:
        unknown, variance = problem.unknowns[place], float(concluded.covariance[place, place])
        low, high = (float(end) if np.isfinite(end) else None for end in (unknown.minimum, unknown.maximum))
        values.append(
            CalibratedValue(
                name=unknown.name,
                unit=unknown.unit,
                value=float(solution.values[place]),
                standard_deviation=None if unknown.name in silent else float(np.sqrt(max(variance, 0.0))),
                first=sought[place].first if place < shared else float(minima[0].problem.first[place]),
                minimum=low,
                maximum=high,
                at_bound=bool(minima[0].solution.at_bound[place]),
                description=unknown.description,
            )
        )
    least = minima[0].misfit
    listed = _distinct([one for one in minima if one.misfit <= WITHIN * least])
    names = [unknown.name for unknown in problem.unknowns[:shared]]
    free_run = len(problem.segments) == len(problem.logs)
    return Calibration(
        model=str(fmu.description.modelName),
        title=str(fmu.description.description or fmu.description.modelName),
        method="free run" if free_run else f"run of {len(problem.segments)} segments that meet",
        logs=tuple(log.name for log in problem.logs),
        parameters=tuple(values[:shared]),
        starts=tuple(values[shared:]),
        covariance=tuple(tuple(float(v) for v in row[:shared]) for row in concluded.covariance[:shared]),
        directions=tuple(words(names) for names in concluded.untold),
        collinearity=concluded.collinearity,
        residuals=(*residuals_of(concluded), *others),
        minima=tuple(
            LocalMinimum(one.misfit / least, dict(zip(names, one.solution.values[:shared].tolist(), strict=True)))
            for one in listed
        ),
        freedom=rows_of(problem.logs) - len(places),
        inflation=concluded.inflation,
        horizon=minima[0].horizon,
        interrupted=minima[0].interrupted,
        warnings=tuple(notes),
        held=dict(problem.fixed),
        declaration=declaration,
        solved=Solved(problem, solution, concluded.covariance),
    )


def _distinct(minima: Sequence[Minimum]) -> list[Minimum]:
    """Without those that are one of the others."""
    kept: list[Minimum] = []
    for one in minima:
        if not any(one.near(other) for other in kept):
            kept.append(one)
    return kept


def residuals_of(concluded: Concluded) -> list[SeriesResidual]:
    """What is left, series by series."""
    problem, here = concluded.problem, concluded.solution.evaluation
    lines = []
    for number, (log, name) in enumerate(problem.series):
        rows = here.residual[here.log == number]
        filter_ = concluded.whitened.filters.get(number)
        rms = float(np.sqrt(np.mean(rows**2)) * problem.noise[log, name])
        timed = name in problem.subject.timed
        unit = "s" if timed else str(problem.subject.fmu.variables[name].unit or "1")
        neighbours = autocorrelation(rows, np.zeros(len(rows)))
        order = filter_.order if filter_ else 0
        lines.append(SeriesResidual(problem.logs[log].name, name, unit, len(rows), rms, neighbours, order))
    return lines


def held_out_residuals(concluded: Concluded, log: ModelLog) -> list[SeriesResidual]:
    """How well a log that took no part is followed, after its start states alone were found.

    Raises:
        StickslipError: it measures another variable.
    """
    problem = concluded.problem
    for name in log.measured:
        if name not in problem.subject.recorded:
            raise StickslipError(f"The log {log.name} measures '{name}', which the others do not.")
    shared = problem.shared
    names = {unknown.name: place for place, unknown in enumerate(problem.unknowns[:shared])}
    states = problem.subject.states
    begin = problem.starts[0]
    loose = [place for place in range(len(states)) if begin[place] >= 0]
    unknowns = (
        *problem.unknowns[:shared],
        *(Unknown(f"{states[place]}(0)", "") for place in loose),
    )
    starts = np.full((1, len(states)), -1)
    starts[0, loose] = shared + np.arange(len(loose))
    values = np.concatenate([concluded.solution.values[:shared], concluded.solution.values[begin[loose]]])
    other = replace(
        problem,
        logs=(log,),
        segments=whole([log]),
        unknowns=unknowns,
        first=values,
        places=problem.places[:1],
        starts=starts,
    )
    other = replace(other, noise=noise_of(other))
    held = {name: float(concluded.solution.values[place]) for name, place in names.items()}
    solution = solve(other, values, fixed=held, tolerance=1e-9, evaluations=60)
    found = replace(concluded, problem=other, solution=solution)
    return [replace(line, held_out=True, order=0) for line in residuals_of(found)]
