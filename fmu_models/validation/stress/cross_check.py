"""One run of the engine against a second path: the importer's methods of integration over the Model Exchange interface.

The two share how a contact changes its state; steps, event location and output are each other's strangers. What is
shared is held against the declaration itself: rates, contact states and impacts (equations.py, admissible.py,
jumps.py).

    reference    the second path at a tight tolerance
    its error    less than its distance from itself at a tolerance a thousand times looser, plus what a start moved by
                 a hundred times its tolerance makes of it
    wrong        the engine is further from it than FACTOR times that, or contradicts the declaration

The comparison ends where a moved start has become HORIZON times the motion: beyond, neither path knows. Times close to
an event are left out: a jump shifted by the error of its time is no error of the state.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.importer.driver import Driver
from fmu_models.simulation.trajectory import Trajectory
from fmu_models.validation.stress.cases import Case
from fmu_models.validation.stress.judge import ACCURATE, FAILED, Cell, Subject, against_declaration
from fmu_models.validation.stress.random_cases import command_line
from fmu_models.validation.stress.trial import AllowanceSpentError, Trial

METHOD = "dop853"
TIGHT, LOOSE = 1e-11, 1e-8  # tolerances of the second path
NUDGE = 1e-9  # of the size of a state
HORIZON = 1e-3
FACTOR = 2.0
NEAR = 1e-4  # of the length of a run: times so close to an event are left out


@dataclass(eq=False)
class SecondPath:
    """The importer with the FMU of a subject, which it keeps."""

    subject: Subject
    _drivers: dict[float, Driver] = field(default_factory=dict)

    def run(self, trial: Trial, tolerance: float, start: dict[str, float]) -> Trajectory:
        """The run of a trial, from these start values."""
        if tolerance not in self._drivers:
            self._drivers[tolerance] = Driver(self.subject.fmu, method=METHOD, tolerance=tolerance, record=[])
        case = trial.case
        return self._drivers[tolerance].run(
            trial.duration, parameters=case.parameters, start=start, inputs=case.inputs, output_times=trial.times()
        )


def cross_check(case: Case, second: SecondPath) -> Cell:
    """Run a case on both paths and judge the engine's. Never raises what they say."""
    begin = time.perf_counter()
    fmu = second.subject.fmu

    def cell(verdict: str, error: float | None, check: str, message: str, checks: int = 0) -> Cell:
        return Cell(case, verdict, error, check, message, 1.0, checks, time.perf_counter() - begin)

    trial = Trial(fmu, case, case.duration)
    try:
        base = trial.run()
    except AllowanceSpentError:
        return cell("refused", None, "", "it takes more steps than a case may")
    except StickslipError as error:
        return cell("refused", None, "", str(error).removeprefix(f"{fmu.description.modelName}: "))
    worst, check, count = against_declaration(trial, base, second.subject)
    message = worst.what
    try:
        error, said = _distance(trial, base, second)
        count += 1
    except StickslipError as refusal:
        if worst.error <= ACCURATE:
            said = str(refusal).removeprefix(f"{fmu.description.modelName}: ")
            return cell("refused", worst.error, "second path", f"the importer: {said}", count)
        error, said = 0.0, ""
    if error > max(worst.error, ACCURATE):
        worst_error, check, message = error, "second path", said
    else:
        worst_error = max(worst.error, error)
    verdict = "accurate" if worst_error <= ACCURATE else "degraded" if worst_error <= FAILED else "failed"
    if verdict != "accurate":
        message = f"{message}; again: {command_line(case)}"
        if check == "second path":
            message += f"; the other path: --method {METHOD} --tolerance {TIGHT:g}"
    return cell(verdict, worst_error, check, message if verdict != "accurate" else "", count)


def _distance(trial: Trial, base: Trajectory, second: SecondPath) -> tuple[float, str]:
    """By how much the engine is off beyond what the second path may be, relative to the states, and where."""
    start = dict(trial.case.start)
    names = list(second.subject.equations.starts)
    reference = second.run(trial, TIGHT, start)
    others = [second.run(trial, LOOSE, start)]
    for sign in (1.0, -1.0):
        moved = {name: start[name] + sign * NUDGE * _size(reference, name) for name in names}
        try:
            others.append(second.run(trial, TIGHT, moved))
        except StickslipError:
            continue  # inside a wall
    times = base.time[: min(run.time.size for run in (reference, *others))]
    noise = np.maximum.accumulate(np.sum([_apart(reference, other, names, times.size) for other in others], axis=0))
    beyond = np.flatnonzero(noise > HORIZON)
    known = np.arange(times.size) < (beyond[0] if beyond.size else times.size)
    events = np.array([event.time for event in base.events])
    if events.size:
        near = NEAR * trial.duration
        at = np.searchsorted(events, times)
        gaps = [np.abs(times - events[np.clip(at - k, 0, events.size - 1)]) for k in (0, 1)]
        known &= np.minimum(*gaps) > near
    excess = np.where(known, _apart(reference, base, names, times.size) - FACTOR * noise, 0.0)
    at = int(excess.argmax())
    return max(0.0, float(excess[at])), f"off by {excess[at]:.1e} of the motion from the importer at {times[at]:.6g} s"


def _size(run: Trajectory, name: str) -> float:
    return float(np.abs(run[name]).max()) or 1.0


def _apart(run: Trajectory, other: Trajectory, names: list[str], n: int) -> NDArray[np.float64]:
    """(n,) largest difference of a state, relative to its largest value along the first run."""
    return np.max([np.abs(run[name][:n] - other[name][:n]) / _size(run, name) for name in names], axis=0)
