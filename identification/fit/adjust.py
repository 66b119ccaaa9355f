"""Constants of the rig adjusted to what the logs themselves say of them, before a fit is judged.

The slips give k/J to some 1e-5, c/J to 2e-3 and r/R to 1e-3, a free decay the first two better; stated J, k, c, R, r
are known to 1e-3 to 2e-2. So the constants are adjusted (`inference.adjustment`) and the law with them until neither
moves; what is left of their uncertainty goes together (J and k as one). Slips are not asked where the residuals show
that the model misses something: what they say of the constants is then its error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators.base import Estimate, FrictionProblem, Options
from identification.inference.adjustment import (
    UNKNOWN,
    Adjustment,
    Contradiction,
    Pull,
    Reading,
    adjusted,
    contradiction,
    pull,
    widened,
)
from identification.inference.problem import Evaluation, Held, Prior, determines, information, solve
from identification.inference.whiteness import whiteness
from identification.measurement.pooling import Pool

ROUNDS = 12
NEAR = 0.05  # of the deviation of a constant: a step of it that is not worth another search
TOLERANCE = 1e-8  # relative, of these searches
EXACT = 1e-9  # relative deviation of a constant that is stated as exact
REFUSED = 0.02  # relative: R or r off by more is no uncertainty, and no widening covers it
SURE = 1e3  # times less sure than another reading: one of two that contradict each other is left out


@dataclass(frozen=True)
class Conflict:
    """Readings of constants that contradict each other, and what each of them would make of the others: ``steps`` (by
    reading) of the logarithms of the constants, in the order of the problem's."""

    found: Contradiction
    steps: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Adjusted:
    """A fit with its constants adjusted. covariance: (n, n) of the logarithms of the constants held, in the order of
    the problem's; stated: these as they were."""

    estimate: Estimate
    covariance: np.ndarray
    stated: tuple[Prior, ...]
    conflicts: tuple[Conflict, ...] = ()


class ContradictedRadii(StickslipError):
    """R or r is not what the logs show."""


def as_stated(made: Estimate) -> Adjusted:
    """A fit with its constants as they are stated."""
    held = made.problem.held
    return Adjusted(made, np.diag([(one.standard_uncertainty / one.value) ** 2 for one in held]), held)


def adjust(ready: Pool, made: Estimate, options: Options) -> Adjusted:
    """The same fit with adjusted constants.

    Raises:
        ContradictedRadii: R or r contradicts the logs.
    """
    try:
        found = _adjusted(ready, made, options, slips=made.problem.tested(made.solution))
        logs = [motion.log.name for motion in ready.motions]
        white = whiteness(found.estimate.solution.evaluation, logs)
        if white.beyond or white.repeated:
            found = _adjusted(ready, made, options, slips=False)
    except KeyboardInterrupt:
        said = "Interrupted: the rig constants are as stated, not adjusted to the logs."
        return as_stated(replace(made, warnings=(*made.warnings, said)))
    return found


def _adjusted(ready: Pool, made: Estimate, options: Options, slips: bool) -> Adjusted:
    problem, x, stated = made.problem, made.solution.values, made.problem.held
    names = [one.name for one in stated]
    readings = (*(_reading(one) for one in stated), *(r for r in ready.readings if set(r.powers) <= set(names)))
    at = np.array([one.value for one in stated])
    free = np.array([unknown.name not in made.solution.fixed for unknown in problem.unknowns])
    conflicts: list[Contradiction] = []
    here = made.solution.evaluation
    for _ in range(ROUNDS):
        said, best, slope = _said(ready, problem, x, here, free, slips)
        now, held = _held(names, at, readings, said)
        sd = np.sqrt(np.diag(now.covariance))
        if np.all(np.abs(now.step) <= NEAR * sd):
            found = contradiction(names, at, readings, said, held)
            if found is None:
                break
            _check_lengths(found, stated)
            conflicts = [one for one in conflicts if one.names != found.names]
            conflicts.append(found)
            readings = widened(readings, found)
            continue
        at, x = at * np.exp(now.step), _inside(problem, x + best + slope @ now.step)
        problem = problem.with_held(_moved(problem.held, at))
        try:
            here = problem.evaluate(x)
        except StickslipError:  # the model does not follow the logs with constants that they ask for
            return as_stated(made)
    else:
        return as_stated(made)
    solution = made.solution
    if problem is not made.problem:
        fixed = options.given.fixed(problem)
        solution = solve(problem, x, fixed=fixed, tolerance=TOLERANCE)
    kept = tuple(
        replace(new, standard_uncertainty=float(value * s), stated=new.name not in held, source=_source(old, float(s)))
        for old, new, value, s in zip(stated, problem.held, at, sd, strict=True)
    )
    estimate = replace(made, problem=problem.with_held(kept), solution=solution)
    turned = tuple(Conflict(one, _steps(names, at, readings, said, held, one)) for one in conflicts)
    return Adjusted(estimate, now.covariance, stated, turned)


def _reading(prior: Prior) -> Reading:
    deviation = max(prior.standard_uncertainty / prior.value, EXACT) if prior.stated else UNKNOWN
    return Reading(prior.name, {prior.name: 1}, prior.value, deviation, prior.stated)


def _source(stated: Prior, deviation: float) -> str:
    """Where an adjusted constant is from; one of which nothing more is known than was stated is that."""
    before = stated.standard_uncertainty / stated.value
    return stated.source if stated.stated and deviation > 0.99 * before else f"{stated.source}; adjusted"


def _held(
    names: Sequence[str], at: np.ndarray, readings: Sequence[Reading], said: Pull
) -> tuple[Adjustment, tuple[str, ...]]:
    """The adjustment, and the constants that had to be held for it: nobody says how well they are known."""
    held: tuple[str, ...] = ()
    while True:
        found = adjusted(names, at, readings, said, held)
        if not found.open:
            return found, held
        held = (*held, found.open[0])


def _moved(held: Sequence[Prior], at: np.ndarray) -> tuple[Prior, ...]:
    return tuple(replace(one, value=float(value)) for one, value in zip(held, at, strict=True))


def _inside(problem: FrictionProblem, x: np.ndarray) -> np.ndarray:
    """Within the bounds of the search (m,)."""
    return np.clip(x, [one.minimum for one in problem.unknowns], [one.maximum for one in problem.unknowns])


def _said(
    ready: Pool, problem: FrictionProblem, x: np.ndarray, here: Evaluation, free: np.ndarray, slips: bool
) -> tuple[Pull, np.ndarray, np.ndarray]:
    """What the slips, if asked, say of the constants; how x (m,), of which some are free (m,), moves to its best (m,),
    and with the logarithms of the constants (m, n)."""
    rest = problem if free.all() else Held(problem, x, free)
    here = replace(here, gradient=here.gradient[:, free])
    best, slope = np.zeros(len(x)), np.zeros((len(x), len(problem.held)))
    if not determines(information(rest, here)):
        return Pull.nothing(len(problem.held)), best, slope
    by = problem.by_held(x)
    columns = np.stack([by[one.name] * one.value for one in problem.held], axis=1)
    known = np.diag(ready.sensors.covariance) > 0
    instruments = [place for place, name in enumerate(("gain", "delay")) if name in by and known[place]]
    beside = np.zeros((len(columns), 0))
    if instruments:
        beside = np.stack([by[("gain", "delay")[place]] for place in instruments], axis=1)
    covariance = ready.sensors.covariance[np.ix_(instruments, instruments)]
    said, best[free], slope[free] = pull(rest, x[free], here, columns, beside, np.linalg.inv(covariance))
    return said if slips else Pull.nothing(len(problem.held)), best, slope


def _steps(
    names: Sequence[str],
    at: np.ndarray,
    readings: Sequence[Reading],
    said: Pull,
    held: Sequence[str],
    conflict: Contradiction,
) -> tuple[np.ndarray, ...]:
    """How the constants would move if each of the readings that contradict each other were right."""
    steps = []
    for right in conflict.names:
        others = [
            replace(
                one,
                deviation=one.deviation / conflict.deviations if one.name == right else SURE * one.deviation,
            )
            if one.name in conflict.names
            else one
            for one in readings
        ]
        steps.append(adjusted(names, at, others, said, held).step)
    return tuple(steps)


def _check_lengths(found: Contradiction, stated: Sequence[Prior]) -> None:
    """R and r that contradict the logs are not widened: a wrong lever makes the law's form wrong too."""
    sides = zip(found.names, found.values, found.others, strict=True)
    off = [(name, value, other) for name, value, other in sides if name in ("R", "r")]
    if all(abs(other / value - 1) < REFUSED for _, value, other in off):
        return
    values = {one.name: one.value for one in stated}
    shown = " or ".join(f"{name} = {other:.4g} m instead of {value:.4g}" for name, value, other in off)
    raise ContradictedRadii(
        f"The radii R = {values['R']:.4g} m and r = {values['r']:.4g} m contradict the logs by "
        f"{found.deviations:.3g} standard deviations: the motion asks for {shown}. Measure both again, and check the "
        "calibration of the laser and of the encoders."
    )
