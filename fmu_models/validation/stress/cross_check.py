"""One run of the engine against a second path: the importer's methods of integration over the Model Exchange interface.

The two share how a contact changes its state; steps, event location and output are each other's strangers. What is
shared is held against the declaration itself: rates, contact states and impacts (equations.py, admissible.py,
jumps.py).

    reference    the second path at a tight tolerance
    its error    less than its distance from itself at a tolerance a thousand times looser, plus what a start moved by
                 a hundred times its tolerance makes of it, plus the shift of its events
    wrong        the engine is further from it than FACTOR times that, or contradicts the declaration

Events of the second path come late, at any tolerance: an indicator that an importer watches is shifted by a fraction
SHIFT of its scale, so that it is positive right after an event. That takes the time SHIFT scale / rate, in which the
states go the old way instead of the new one; the sum over the events, times what the motion makes of a small change, is
no error of the engine.

The comparison ends where its error has become HORIZON times the motion: beyond, neither path knows. Times close to an
event are left out: a jump that is late by little is no error of the state.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.importer.driver import Driver
from fmu_models.language.contact_kinds import AWAY, CHATTERING, CLOSED, STICK
from fmu_models.simulation.trajectory import Events, Trajectory
from fmu_models.validation.stress.cases import Case
from fmu_models.validation.stress.equations import Columns, StressEquations
from fmu_models.validation.stress.judge import ACCURATE, StressCell, StressSubject, against_declaration
from fmu_models.validation.stress.trial import AllowanceSpentError, Trial

METHOD = "dop853"
TIGHT, LOOSE = 1e-11, 1e-8  # tolerances of the second path
NUDGE = 1e-9  # of a state, or of its first change
SHIFT = 1e-10  # Tolerances.importer of the engine
MOST_EVENTS = 3000  # of a case that is compared
BESIDE = 1e-7  # of the length of a run, at most: how far from an event its indicator's rate is taken
HORIZON = 1e-3
FACTOR = 2.0
NEAR = 1e-4  # of the length of a run: times so close to an event are left out


@dataclass(eq=False)
class SecondPath:
    """The importer with the FMU of a subject, which it keeps."""

    subject: StressSubject
    _drivers: dict[float, Driver] = field(default_factory=dict)

    def run(self, trial: Trial, tolerance: float, start: dict[str, float]) -> Trajectory:
        """The run of a trial, from these start values."""
        if tolerance not in self._drivers:
            self._drivers[tolerance] = Driver(
                self.subject.fmu, method=METHOD, tolerance=tolerance, record=[], max_step=np.inf
            )
        case = trial.case
        return self._drivers[tolerance].run(
            trial.duration, parameters=case.parameters, start=start, inputs=case.inputs, output_times=trial.times()
        )


def cross_check(case: Case, second: SecondPath) -> StressCell:
    """Run a case on both paths and judge the engine's. Never raises what they say."""
    fmu = second.subject.fmu
    trial = Trial(fmu, case, case.duration)
    try:
        base = trial.run()
    except AllowanceSpentError:
        return StressCell(case, "refused", None, "", "it takes more steps than a case may")
    except StickslipError as error:
        return StressCell(case, "refused", None, "", str(error).removeprefix(f"{fmu.description.modelName}: "))
    if len(base.events) > MOST_EVENTS:
        reason = f"it has {len(base.events)} events, and every one is late on the second path"
        return StressCell(case, "refused", None, "second path", reason, 0.0)
    worst, check, count = against_declaration(trial, base, second.subject)
    message = worst.what
    reached = 1.0
    try:
        error, reason, reached = _distance(trial, base, second)
        count += 1
    except StickslipError as refusal:
        if worst.error <= ACCURATE:
            reason = str(refusal).removeprefix(f"{fmu.description.modelName}: ")
            return StressCell(case, "refused", worst.error, "second path", f"the importer: {reason}", 0.0, count)
        error, reason = 0.0, ""
    if error > max(worst.error, ACCURATE):
        worst_error, check, message = error, "second path", reason
    else:
        worst_error = max(worst.error, error)
    # what either path may be off by is taken off already
    if worst_error <= ACCURATE:
        return StressCell(case, "accurate", worst_error, check, "", reached, count)
    return StressCell(case, "failed", worst_error, check, message, reached, count)


def _distance(trial: Trial, base: Trajectory, second: SecondPath) -> tuple[float, str, float]:
    """By how much the engine is off beyond what the second path may be, relative to the states, where, and the share
    of the run in which that can be told."""
    start = dict(trial.case.start)
    names = list(second.subject.equations.starts)
    reference = second.run(trial, TIGHT, start)
    loose = second.run(trial, LOOSE, start)
    others = []
    for sign in (1.0, -1.0):
        # not of its size along the run, which where a motion explodes says nothing of the start
        moved = {
            name: start[name] + sign * NUDGE * max(abs(start[name]), abs(float(reference[name][1]) - start[name]))
            for name in names
        }
        try:
            others.append(second.run(trial, TIGHT, moved))
        except StickslipError:
            continue  # inside a wall
    times = base.time[: min(run.time.size for run in (reference, loose, *others))]
    spread = np.maximum.accumulate(
        np.sum([_apart(reference, run, names, times.size) for run in others] or [np.zeros(times.size)], axis=0)
    )
    late = _shifts(trial, base, second.subject.equations, times) * np.maximum(spread / NUDGE, 1.0)
    noise = np.maximum.accumulate(_apart(reference, loose, names, times.size)) + spread + late
    beyond = np.flatnonzero(noise > HORIZON)
    certain = np.arange(times.size) < (beyond[0] if beyond.size else times.size)
    events = np.array([event.time for event in base.events])
    if events.size:
        resolution = NEAR * trial.duration
        at = np.searchsorted(events, times)
        gaps = [np.abs(times - events[np.clip(at - k, 0, events.size - 1)]) for k in (0, 1)]
        certain &= np.minimum(*gaps) > resolution
    excess = np.where(certain, _apart(reference, base, names, times.size) - FACTOR * noise, 0.0)
    at = int(excess.argmax())
    reached = float(np.count_nonzero(noise <= HORIZON)) / base.time.size
    return (
        max(0.0, float(excess[at])),
        f"off by {excess[at]:.1e} of the motion from the importer at {times[at]:.6g} s",
        reached,
    )


def _shifts(
    trial: Trial, base: Trajectory, equations: StressEquations, times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n,) sum over the events until each time of what their shift does to the states, relative to these."""
    rows, contacts = _rows(base)
    rows = rows[(rows["time"] > base.time[0]) & (rows["time"] < base.time[-1])]
    if not rows.size:
        return np.zeros(times.size)
    at = np.unique(rows["time"])
    gaps = np.diff(np.concatenate([base.time[:1], at, base.time[-1:]]))
    beside = np.minimum(BESIDE * trial.duration, 0.1 * np.minimum(gaps[:-1], gaps[1:]))
    around = trial.run(times=np.unique(np.concatenate([at - 2 * beside, at - beside, at + beside])))
    columns = dict(around.values) | {"time": around.time}
    with np.errstate(all="ignore"):
        environment = equations.environment(columns, trial.case.parameters)
        rates = np.array([around[f"der({name})"] / _size(base, name) for name in equations.starts])
        before = np.searchsorted(around.time, at) - 1
        turn = np.abs(rates[:, np.minimum(before + 1, around.time.size - 1)] - rates[:, before]).max(axis=0)
        moved = np.zeros(at.size)
        for number, contact in enumerate(equations.system.contacts):
            mine = rows[[contacts[i] == contact.name for i in rows["contact"]]]
            for row in mine:
                k = int(np.searchsorted(at, row["time"]))
                indicator = _indicator(equations, number, row, columns, environment)
                if indicator is None:
                    continue
                value, scale = indicator
                last = before[k]
                rate = abs(value[last] - value[last - 1]) / (around.time[last] - around.time[last - 1])
                moved[k] += SHIFT * scale[last] / rate * turn[k]
    total = np.cumsum(np.where(np.isfinite(moved), moved, np.inf))
    until = np.searchsorted(at, times, side="right")
    return np.concatenate([[0.0], total])[until]


def _rows(run: Trajectory) -> tuple[NDArray[Any], tuple[str, ...]]:
    """The events of a run of the engine as an array, and the names of the contacts by number."""
    assert isinstance(run.events, Events)
    return run.events.rows, run.events.contacts


def _indicator(
    equations: StressEquations, number: int, row: np.void, columns: Columns, environment: list[Any]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """(n,) what an event is the zero of, and its scale: the force that holds, the place, or the slip speed. None where
    a sliding motion ends: there the fields before and after are the same."""
    contact = equations.system.contacts[number]
    shape = columns["time"].shape
    force = columns.get(f"{contact.name}_force")
    if row["before"] in (STICK, CHATTERING) or (contact.kind.impulsive and row["before"] == CLOSED):
        return None if force is None else (np.abs(force), np.full(shape, np.abs(force).max()))
    if contact.depth is not None and AWAY in (row["before"], row["after"]):
        value, scale = equations.place(number, environment, "depth")
        return np.broadcast_to(value, shape), np.broadcast_to(scale, shape)
    value, scale = equations.place(number, environment, "slip")
    return np.broadcast_to(value, shape), np.broadcast_to(scale, shape)


def _size(run: Trajectory, name: str) -> float:
    return float(np.abs(run[name]).max()) or 1.0


def _apart(run: Trajectory, second: Trajectory, names: list[str], n: int) -> NDArray[np.float64]:
    """(n,) largest difference of a state, relative to its largest value along the first run."""
    return np.max([np.abs(run[name][:n] - second[name][:n]) / _size(run, name) for name in names], axis=0)
