"""Parameters of any model from measured series: declared ones, FMUs of this suite and of others.

from identification import calibrate
found = calibrate("forced_stick_slip", ["run.csv"], free=["a0", "a1", "a3"])
print(found.summary())
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.threads import one_blas_thread
from fmu_models.families.execution import Execution
from fmu_models.fmu.fmu import Fmu
from identification.calibration.conclude import Concluded, conclude
from identification.calibration.descent import Minimum, Progress
from identification.calibration.follow import follow, residuals_of
from identification.calibration.log import LogLike, ModelLog, Reading, model_log, rows_of
from identification.calibration.pose import Settings, problem_of, with_instruments
from identification.calibration.result import CalibratedValue, Calibration, LocalMinimum
from identification.calibration.search import HERE, Plan, Search
from identification.calibration.segments import IDEAL
from identification.calibration.systems import opened
from identification.calibration.ties import of_lmfit
from identification.calibration.unknowns import FreeParameter
from identification.calibration.untold import words
from identification.inference.lmfit_exchange import Solved

if TYPE_CHECKING:
    from lmfit import Parameters

    from fmu_models.codegen.package import Model
    from fmu_models.coupling.system import CoupledSystem
    from fmu_models.language.maps import Map

WITHIN = 1.1  # times the least misfit: minima that are listed


@one_blas_thread()
def calibrate(
    model: Model | Fmu | CoupledSystem | Map,
    logs: LogLike | Sequence[LogLike],
    *,
    free: Sequence[str] | Parameters,
    settings: Settings | None = None,
    execution: Execution = HERE,
    progress: Progress | None = None,
    **more: object,
) -> Calibration:
    """Find parameters of a model, and the start states of its logs, by least squares.

    Args:
        model: a name, a file, a declaration, an FMU of anybody, a coupled system (its .toml, .ssd or .ssp), or a map,
            whose logs number the iterates as time.
        logs: one or several files, tables, data frames or arrays by name, see `log.model_log`.
        free: parameters that are sought; or `lmfit.Parameters`, whose values, bounds, held ones and expressions are
            taken, and in which a state is one whose start is sought.
        settings: what else is known; each of its fields may be given as an argument of its own instead.
        execution: who scores guesses and descends from them, processes or a cluster, and where that is kept, so that an
            interrupted search goes on from there. Values do not depend on it.
        progress: called with the fraction done.

    Raises:
        StickslipError: as `Runner`; a name that is none, a log that does not fit the model, a parameter without
            effect, more unknowns than samples, first values outside their bounds; all of that before any search.
    """
    said = replace(settings or Settings(), **more)  # type: ignore[arg-type]  # fields of it, by name
    fmu = opened(model)
    if isinstance(free, Mapping):
        free, taken = of_lmfit(fmu, free)
        taken |= {name: {**getattr(said, name), **taken[name]} for name in ("parameters", "bounds")}
        said = replace(said, **taken)
    if not free:
        raise StickslipError("Name at least one parameter that is sought: --free k,c.")
    several: Sequence[LogLike] = logs if isinstance(logs, list | tuple) else [logs]  # type: ignore[list-item]
    read = [_log(log, fmu, said, f"log {number + 1}") for number, log in enumerate(several)]
    said = with_instruments(said, read)
    problem, sought = problem_of(fmu, read, list(free), said)
    rows, count = rows_of(problem.logs), len(problem.unknowns)
    if rows <= count:
        names = ", ".join(unknown.name for unknown in problem.unknowns)
        raise StickslipError(f"{rows} samples cannot determine the {count} unknowns {names}. Free fewer of them.")
    plan = Plan(said.guesses, said.attempts, said.segments, said.seed, progress or (lambda _: None), execution)
    searched = Search(problem, sought, plan)
    with searched.runner:
        minima = searched.minima()
    concluded = conclude(minima[0])
    held_out = [_log(log, fmu, said, f"held out {n + 1}") for n, log in enumerate(said.held_out)]
    named = model if isinstance(model, str) else ""
    notes = _said(concluded, minima)
    if minima[0].interrupted:
        how = " Go on: --resume (in Python resume=True)." if execution.store else ""
        notes.append(f"Interrupted: the best so far, not a minimum.{how}")
    found = replace(_result(fmu, concluded, minima, sought, notes, named), reading=_reading(said, read))
    if not found.interrupted:
        searched.runner.finish(found)
    if said.ties:
        found = replace(found, held={**found.held, **said.ties.values(found.values)})
    followed = [follow(found, fmu, log) for log in held_out]
    return replace(found, residuals=(*found.residuals, *(line for log in followed for line in log.residuals)))


def _reading(said: Settings, logs: Sequence[ModelLog]) -> Reading:
    """How logs to come are to be read as these were."""
    inputs = dict.fromkeys(name for log in logs for name in log.inputs)
    constants = {name: logs[0].inputs.get(name) for name in inputs if name in said.inputs}
    driven = {name: float(value) if isinstance(value := constants.get(name), float | int) else None for name in inputs}
    return Reading(dict(said.columns), driven, tuple(said.hold), dict(said.events))


def _log(source: LogLike, fmu: Fmu, said: Settings, name: str) -> ModelLog:
    return model_log(
        source, fmu, columns=said.columns, inputs=said.inputs, hold=said.hold, events=said.events, name=name
    )


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
    return notes


def _result(
    fmu: Fmu,
    concluded: Concluded,
    minima: Sequence[Minimum],
    sought: Sequence[FreeParameter],
    notes: Sequence[str],
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
    listed = _distinct([minimum for minimum in minima if minimum.misfit <= WITHIN * least])
    names = [unknown.name for unknown in problem.unknowns[:shared]]
    sensors = {name: problem.sensor(name, solution.values) for log in problem.logs for name in log.measured}
    return Calibration(
        model=str(fmu.description.modelName),
        title=str(fmu.description.description or fmu.description.modelName),
        method=f"run of {len(problem.segments)} segments that meet" if problem.parted else "free run",
        logs=tuple(log.name for log in problem.logs),
        parameters=tuple(values[:shared]),
        starts=tuple(values[shared:]),
        covariance=tuple(tuple(float(v) for v in row[:shared]) for row in concluded.covariance[:shared]),
        directions=tuple(words(names) for names in concluded.untold),
        collinearity=concluded.collinearity,
        residuals=tuple(residuals_of(problem, solution.evaluation, concluded.whitened.filters)),
        minima=tuple(
            LocalMinimum(
                minimum.misfit / least
                if least
                else 1.0,  # that of a model that follows its logs to the last digit is 0
                dict(zip(names, minimum.solution.values[:shared].tolist(), strict=True)),
            )
            for minimum in listed
        ),
        freedom=rows_of(problem.logs) - len(places),
        inflation=concluded.inflation,
        horizon=minima[0].horizon,
        interrupted=minima[0].interrupted,
        warnings=tuple(notes),
        held=dict(problem.fixed),
        sensors={name: sensor for name, sensor in sensors.items() if sensor != IDEAL},
        declaration=declaration,
        solved=Solved(problem, solution, concluded.covariance),
    )


def _distinct(minima: Sequence[Minimum]) -> list[Minimum]:
    """Without those that are one of the others."""
    kept: list[Minimum] = []
    for minimum in minima:
        if not any(minimum.near(other) for other in kept):
            kept.append(minimum)
    return kept
