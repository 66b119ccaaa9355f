"""Whether a cell of the grid is right, and how that is known.

Checks against the declaration itself, at many instants of the run:
    equations    rates as the declaration has them under the forces reported (equations.py)
    states       contact states that are possible where they are reported (admissible.py)
    events       continuity, and the law of impact (jumps.py)
    energy       balance of energy and powers (balance.py)
Checks of the run against itself:
    tolerance    a step tolerance a thousand times smaller
    sampling     other output times
    units        units of mass, length and time changed by powers of two: the very same digits are expected
    mirror       where the declaration is odd, all signs turned (invariants.py)
    determinant  areas of start states shrink by e squared in an impact (invariants.py)
A motion that is sensitive proves nothing by differing from itself. What a start moved by 1e-12 makes of it is measured;
a difference then counts as the change of start that explains it, up to where that motion has moved by 1e-3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.trajectory import Trajectory
from fmu_models.validation.stress import balance
from fmu_models.validation.stress.admissible import contradictions
from fmu_models.validation.stress.cases import Case
from fmu_models.validation.stress.equations import StressEquations, StressFindings
from fmu_models.validation.stress.invariants import Invariants, determinant, invariants
from fmu_models.validation.stress.jumps import around, chosen, jumps
from fmu_models.validation.stress.roles import Model
from fmu_models.validation.stress.trial import AllowanceSpentError, Trial

ACCURATE, FAILED = 1e-8, 1e-5
TIGHT = 1e-17
UNITS = (20, -24, 16)
NUDGE = 2.0**-40  # 1e-12
HORIZON = 1e-3
SLOW = 1e-3  # of a turn
LEAST = 1e-9  # of the time declared: shorter runs tell nothing

VERDICTS = ("accurate", "degraded", "refused", "failed")


@dataclass(frozen=True)
class StressCell:
    """What became of a case.

    Attributes:
        case: the case.
        verdict: one of VERDICTS.
        error: largest relative error found; None where nothing ran.
        check: which check found it.
        message: in words: what was found, or why the case was refused.
        reached: fraction of the declared time that the allowance of steps covers.
        checks: number of checks that could be made.
        seconds: it took.
    """

    case: Case
    verdict: str
    error: float | None
    check: str
    message: str
    reached: float = 1.0
    checks: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class StressSubject:
    """What is judged: an FMU, and the equations and promises of the declaration that it should be."""

    fmu: Fmu
    equations: StressEquations
    promised: Invariants

    @classmethod
    def of(cls, model: Model, fmu: Fmu) -> StressSubject:
        """The FMU against that declaration."""
        return cls(fmu, StressEquations(model), invariants(model))


def judge(case: Case, subject: StressSubject) -> StressCell:
    """Run a case as often as its checks need, and judge it. Never raises what the engine says."""
    fmu = subject.fmu
    trial = Trial(fmu, case, case.duration)
    try:
        while True:
            try:
                base = trial.run(scale=case.scale or (0, 0, 0))
                break
            except AllowanceSpentError as spent:
                # half of what was reached, so that the runs of the checks, which may take more steps, get through
                shorter = trial.duration * (0.5 * spent.reached if spent.reached > 0 else 0.5 / len(trial.times()))
                if shorter < LEAST * case.duration:
                    raise StickslipError("its steps are so short that no part of it worth judging is reached") from None
                trial = Trial(fmu, case, shorter)
    except StickslipError as error:
        return StressCell(case, "refused", None, "", str(error).removeprefix(f"{fmu.description.modelName}: "))
    reached = trial.duration / case.duration
    worst, check, count, notes = _worst(_checks(trial, base, subject))
    verdict = "accurate" if worst.error <= ACCURATE else "degraded" if worst.error <= FAILED else "failed"
    message = worst.what if verdict != "accurate" else "; ".join(notes)
    return StressCell(case, verdict, worst.error, check, message, reached, count)


def against_declaration(trial: Trial, base: Trajectory, subject: StressSubject) -> tuple[StressFindings, str, int]:
    """What a run contradicts most in its declaration, by which check, and the number of checks: those that need no
    other motion to compare with."""
    worst, check, count, _ = _worst(_declared(trial, base, _detail(trial, base), subject))
    return worst, check, count


Checks = Iterator[tuple[str, Callable[[], StressFindings | None]]]


def _worst(checks: Checks) -> tuple[StressFindings, str, int, list[str]]:
    """The largest finding and its check, the number of checks that could be made, and why others could not."""
    worst, check, count, notes = StressFindings(0.0, ""), "", 0, []
    for name, find in checks:
        try:
            findings = find()
        except StickslipError as error:
            notes.append(f"{name}: {error}")
            continue
        except AllowanceSpentError:
            continue
        if findings is None:
            continue
        count += 1
        if not findings.error <= worst.error:
            worst, check = findings, name
    return worst, check, count, notes


def _detail(trial: Trial, base: Trajectory) -> Trajectory | None:
    """The run once more with times around its events and at the nodes of its pieces; None if it is refused so."""
    groups, pieces = chosen(base), balance.stretches(base)
    closer = [around(base, groups)] if groups else []
    closer += [balance.nodes(pieces)] if pieces else []
    try:
        return trial.run(times=np.unique(np.concatenate([base.time, *closer])))
    except (StickslipError, AllowanceSpentError):
        return None


def _declared(trial: Trial, base: Trajectory, detail: Trajectory | None, subject: StressSubject) -> Checks:
    """The checks against the declaration, of the run and of its details."""
    parameters, equations = trial.case.parameters, subject.equations
    for run in (base, detail):
        if run is not None:
            columns = _columns(run)
            yield "equations", partial(equations.residual, columns, parameters)
            yield "states", partial(contradictions, equations, columns, parameters)
    if detail is not None:
        yield "events", lambda: jumps(equations, detail, chosen(base), parameters)


def _checks(trial: Trial, base: Trajectory, subject: StressSubject) -> Checks:
    """The checks of a run by name, each to be called once."""
    case, equations, promised = trial.case, subject.equations, subject.promised
    yield "finite", lambda: _finite(base)
    if case.scale:
        yield (
            "units",
            lambda: StressFindings(_largest(_difference(base, Trial(trial.fmu, case, trial.duration).run())), ""),
        )
        return
    detail = None if case.bounded else _detail(trial, base)
    yield from _declared(trial, base, detail, subject)
    if case.bounded:
        return
    if equations.has_energy:
        yield "energy", lambda: _energy(trial, base, equations)
    sensitivity = _Sensitivity(trial, base)
    if detail is not None:
        rows = np.searchsorted(detail.time, base.time)
        yield "sampling", lambda: sensitivity.judge(_difference(base, detail, rows))
    yield "tolerance", lambda: sensitivity.judge(_difference(base, trial.run(tolerance=TIGHT)))
    if equations.has_units:
        yield "units", lambda: sensitivity.judge(_difference(base, trial.run(scale=UNITS)))
    if promised.mirror and not _stands_still(trial, promised, equations):
        yield "mirror", lambda: sensitivity.judge(_difference(base, trial.run(mirror=promised.mirror)))
    divergence = promised.divergence
    if divergence is not None:
        yield "determinant", lambda: determinant(trial, base, equations, divergence)


def _stands_still(trial: Trial, promised: Invariants, equations: StressEquations) -> bool:
    """Whether a drive is so slow that pi added to its phase, rounded, is all that is left of its motion."""
    if promised.mirror is None or not promised.mirror.turned:
        return False
    rates = [trial.case.parameters.get(name, equations.parameters[name]) for name in promised.frequencies]
    return any(abs(rate) * trial.duration < SLOW for rate in rates)


def _columns(trajectory: Trajectory) -> dict[str, NDArray]:
    return dict(trajectory.values) | {"time": trajectory.time}


def _finite(trajectory: Trajectory) -> StressFindings:
    bad = [name for name, column in trajectory.values.items() if not np.isfinite(column).all()]
    states = [name for name in bad if f"der({name})" in trajectory.values]
    return StressFindings(np.inf if states else 0.0, f"{', '.join(states)} not finite")


def _energy(trial: Trial, base: Trajectory, equations: StressEquations) -> StressFindings | None:
    gross = equations.energy_size(_columns(base), trial.case.parameters)
    residual, judged = balance.imbalance(lambda times: trial.run(times=times), base, gross)
    return residual if judged else None


def _difference(base: Trajectory, second: Trajectory, rows: NDArray | None = None) -> NDArray[np.float64]:
    """(n,) largest difference of a state at each sample of ``base``, relative to the largest value of that state."""
    names = [name for name in base.values if f"der({name})" in base.values]
    worst = np.zeros(base.time.size)
    for name in names:
        values = second[name] if rows is None else second[name][rows]
        size = max(float(np.abs(base[name]).max()), float(np.abs(values).max()))
        if size > 0:
            worst = np.maximum(worst, np.abs(base[name] - values) / size)
    return worst


def _largest(differences: NDArray[np.float64]) -> float:
    """The largest but for the tenth that stands closest to jumps, where a shift of time by rounding is all one sees."""
    return float(np.quantile(differences, 0.9)) if differences.size else 0.0


class _Sensitivity:
    """What a small change of the start makes of a motion, measured when first asked for."""

    def __init__(self, trial: Trial, base: Trajectory) -> None:
        self.trial, self.base = trial, base

    @cached_property
    def noise(self) -> NDArray[np.float64]:
        noise = np.zeros(self.base.time.size)
        for sign in (1.0, -1.0):
            start = {
                name: float(self.base[name][0]) + sign * NUDGE * float(np.abs(self.base[name]).max())
                for name in self.trial.fmu.states
            }
            try:
                moved = self.trial.run(start=start)
            except (StickslipError, AllowanceSpentError):
                continue
            noise = np.maximum(noise, _difference(self.base, moved))
        return noise

    def judge(self, differences: NDArray[np.float64]) -> StressFindings | None:
        """What the differences prove; None if the motion is too sensitive for them to prove anything."""
        if _largest(differences) <= ACCURATE:
            return StressFindings(_largest(differences), "differs from itself")
        noise = self.noise
        beyond = np.flatnonzero(noise > HORIZON)
        until = int(beyond[0]) if beyond.size else noise.size
        if until < 5:
            return None
        growth = np.maximum(np.maximum.accumulate(noise[:until]) / NUDGE, 1.0)
        excess = differences[:until] / growth
        return StressFindings(
            _largest(excess), f"differs from itself from {self.base.time[int(excess.argmax())]:.6g} s on"
        )
