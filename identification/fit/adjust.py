"""Constants of the rig adjusted to what the logs themselves say of them, before a fit is judged.

The slips give k/J to some 1e-5, c/J to 2e-3 and r/R to 1e-3, a free decay the first two better; stated J, k, c, R, r
are known to 1e-3 to 2e-2. So the constants are adjusted (`inference.adjustment`) and the law with them until neither
moves; what is left of their uncertainty goes together (J and k as one). Slips are not asked where the residuals show
that the model misses something: what they say of the constants is then its error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators.base import Estimate, FrictionProblem, Options
from identification.inference.adjustment import (
    UNKNOWN,
    ConstantReading,
    Contradiction,
    Pull,
    adjusted,
    contradiction,
    pull,
    widened,
)
from identification.inference.problem import Evaluation, Held, Prior, determines, information, solve
from identification.inference.whiteness import whiteness
from identification.measurement.pooled import Pool

ROUNDS = 12
NEAR = 0.05  # of the deviation of a constant: a step of it that is not worth another search
TOLERANCE = 1e-8  # relative, of these searches
EXACT = 1e-9  # relative deviation of a constant that is stated as exact
REFUSED = 0.02  # relative: R or r off by more is no uncertainty, and no widening covers it
ROUGH = 1e-5  # relative, of a search that only judges a radius
EXPLAINED = 0.25  # of what the model misses: so little is left with the radius that is right
WRONG = 4.0  # standard errors of a residual: one chance in a thousand that it occurs in any range of slip speed or log
KNOWN = 0.8  # of the deviation as stated: where that much is left, a constant is as it was stated
SURE = 1e3  # times less sure than another reading: one of two that contradict each other is left out


@dataclass(frozen=True)
class Conflict:
    """Readings of constants that contradict each other, and what each of them would make of the others: ``steps`` (by
    reading) of the logarithms of the constants, in the order of the problem's."""

    contradiction: Contradiction
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
    """R or r is not what the logs show. radii: what they ask for, in m, by name."""

    def __init__(self, message: str, radii: Mapping[str, float]) -> None:
        super().__init__(message)
        self.radii = radii


def as_stated(estimate: Estimate) -> Adjusted:
    """A fit with its constants as they are stated."""
    priors = estimate.problem.held
    return Adjusted(estimate, np.diag([(prior.standard_uncertainty / prior.value) ** 2 for prior in priors]), priors)


def adjust(ready: Pool, first: Estimate, options: Options, radii_hold: bool = False) -> Adjusted:
    """The same fit with adjusted constants. radii_hold: slips without a law do not ask for other radii (`contest`), so
    that those which a law asks for are its own error. ContradictedRadii: R or r contradicts the logs (R only where an
    encoder shows the laser's gain)."""
    try:
        # what a parameter of the law that is held misses would pass for constants that are off
        fixed = set(first.law.names) & set(first.solution.fixed)
        result = _adjusted(
            ready, first, options, slips=not fixed and first.problem.tested(first.solution), hold=radii_hold
        )
        missed = _missed(result.estimate)
        # micro-slip too shows in slips, far less than constants that are off
        if missed > WRONG and missed > 0.5 * _missed(first):
            result = _adjusted(ready, first, options, slips=False, hold=radii_hold)
    except KeyboardInterrupt:
        warning = "Interrupted: the rig constants are as stated, not adjusted to the logs."
        return as_stated(replace(first, warnings=(*first.warnings, warning)))
    return result


def _missed(estimate: Estimate) -> float:
    """How surely the residuals show that the model misses something, in standard errors."""
    evaluation = estimate.solution.evaluation
    return whiteness(evaluation, [str(number) for number in range(int(evaluation.log.max()) + 1)]).missed


def _adjusted(ready: Pool, first: Estimate, options: Options, slips: bool, hold: bool) -> Adjusted:
    problem, x, stated = first.problem, first.solution.values, first.problem.held
    names = [prior.name for prior in stated]
    readings = (*(_reading(prior) for prior in stated), *(r for r in ready.readings if set(r.powers) <= set(names)))
    at = np.array([prior.value for prior in stated])
    free = np.array([unknown.name not in first.solution.fixed for unknown in problem.unknowns])
    conflicts: list[Contradiction] = []
    evaluation = first.solution.evaluation
    for _ in range(ROUNDS):
        pulled, best, slope = _evidence(ready, problem, x, evaluation, free, slips)
        update = adjusted(names, at, readings, pulled)
        sd = np.sqrt(np.diag(update.covariance))
        if np.all(np.abs(update.step) <= NEAR * sd):
            clash = contradiction(names, at, readings, pulled)
            if clash is None:
                break
            if slips and _lengths(clash) and (hold or not _explained(first, clash, options)):
                return _adjusted(ready, first, options, slips=False, hold=hold)
            if off := _lengths(clash):  # not widened: a wrong lever makes the law's form wrong too
                values = {prior.name: prior.value for prior in stated}
                raise contradicted(off, values, f"{clash.deviations:.3g}", alone=len(ready.contacts) == 1)
            conflicts = [conflict for conflict in conflicts if conflict.names != clash.names]
            conflicts.append(clash)
            readings = widened(readings, clash)
            continue
        at, x = at * np.exp(update.step), np.clip(x + best + slope @ update.step, *problem.limits)
        moved = (replace(prior, value=float(value)) for prior, value in zip(problem.held, at, strict=True))
        problem = problem.with_held(tuple(moved))
        try:
            evaluation = problem.evaluate(x)
        except StickslipError:  # the model does not follow the logs with constants that they ask for
            return as_stated(first)
    else:
        return as_stated(first)
    solution = first.solution
    if problem is not first.problem:
        fixed = options.given.fixed(problem)
        solution = solve(problem, x, fixed=fixed, tolerance=TOLERANCE)
    priors = tuple(
        replace(new, standard_uncertainty=float(value * s), source=_source(old, float(s)))
        for old, new, value, s in zip(stated, problem.held, at, sd, strict=True)
    )
    estimate = replace(first, problem=problem.with_held(priors), solution=solution)
    turned = tuple(Conflict(conflict, _steps(names, at, readings, pulled, conflict)) for conflict in conflicts)
    return Adjusted(estimate, update.covariance, stated, turned)


def _reading(prior: Prior) -> ConstantReading:
    deviation = max(prior.standard_uncertainty / prior.value, EXACT) if prior.stated else UNKNOWN
    return ConstantReading(prior.name, {prior.name: 1}, prior.value, deviation, prior.stated)


def _source(stated: Prior, deviation: float) -> str:
    """Where an adjusted constant is from; one of which nothing more is known than was stated is that."""
    before = stated.standard_uncertainty / stated.value
    return stated.source if deviation >= KNOWN * before else f"{stated.source}; adjusted"


def _evidence(
    ready: Pool, problem: FrictionProblem, x: np.ndarray, evaluation: Evaluation, free: np.ndarray, slips: bool
) -> tuple[Pull, np.ndarray, np.ndarray]:
    """What the slips, if asked, say of the constants; how x (m,), of which some are free (m,), moves to its best (m,),
    and with the logarithms of the constants (m, n)."""
    reduced = problem if free.all() else Held(problem, x, free)
    evaluation = replace(evaluation, gradient=evaluation.gradient[:, free])
    best, slope = np.zeros(len(x)), np.zeros((len(x), len(problem.held)))
    if not determines(information(reduced, evaluation)):
        return Pull.nothing(len(problem.held)), best, slope
    by = problem.by_held(x)
    columns = np.stack([by[prior.name] * prior.value for prior in problem.held], axis=1)
    measured = np.diag(ready.sensors.covariance) > 0
    instruments = [index for index, name in enumerate(("gain", "delay")) if name in by and measured[index]]
    beside = np.zeros((len(columns), 0))
    if instruments:
        beside = np.stack([by[("gain", "delay")[instrument]] for instrument in instruments], axis=1)
    covariance = ready.sensors.covariance[np.ix_(instruments, instruments)]
    if "R" in by and ready.laser_alone:
        # such a laser shows R times the angle with a gain of its own: slips tell R only by how sin bends, and so by
        # whatever else bends what is seen
        column = [prior.name for prior in problem.held].index("R")
        beside = np.column_stack([beside, columns[:, column]])
        columns[:, column] = 0.0
        spread = _reading(problem.held[column]).deviation ** 2
        covariance = np.block([[covariance, np.zeros((len(covariance), 1))], [np.zeros(len(covariance)), spread]])
    pulled, best[free], slope[free] = pull(reduced, x[free], evaluation, columns, beside, np.linalg.inv(covariance))
    return pulled if slips else Pull.nothing(len(problem.held)), best, slope


def _steps(
    names: Sequence[str], at: np.ndarray, readings: Sequence[ConstantReading], pulled: Pull, conflict: Contradiction
) -> tuple[np.ndarray, ...]:
    """How the constants would move if each of the readings that contradict each other were right."""

    def if_right(right: str, reading: ConstantReading) -> ConstantReading:
        if reading.name not in conflict.names:
            return reading
        sure, loose = reading.deviation / conflict.deviations, SURE * reading.deviation
        return replace(reading, deviation=sure if reading.name == right else loose)

    others = [[if_right(right, reading) for reading in readings] for right in conflict.names]
    return tuple(adjusted(names, at, judged, pulled).step for judged in others)


def _lengths(clash: Contradiction) -> dict[str, float]:
    """R or r as all else asks for them, where one of them is off by more than its measurement can be."""
    sides = zip(clash.names, clash.values, clash.others, strict=True)
    off = {name: (value, radius) for name, value, radius in sides if name in ("R", "r")}
    refused = any(abs(radius / value - 1) >= REFUSED for value, radius in off.values())
    return {name: radius for name, (_, radius) in off.items()} if refused else {}


def _explained(first: Estimate, clash: Contradiction, options: Options) -> bool:
    """Whether what the model misses goes with a radius that the logs ask for. A law of the wrong form, or a
    disturbance, asks for one too, and misses as much with it."""
    before = _missed(first)
    for name, radius in _lengths(clash).items():
        priors = tuple(replace(prior, value=radius) if prior.name == name else prior for prior in first.problem.held)
        moved = first.problem.with_held(priors)
        try:
            x = solve(moved, first.solution.values, fixed=options.given.fixed(moved), tolerance=ROUGH).values
            solution = replace(first.solution, values=x, evaluation=moved.evaluate(x))
        except StickslipError:
            continue
        if _missed(replace(first, problem=moved, solution=solution)) < max(WRONG, EXPLAINED * before):
            return True
    return False


def contradicted(
    off: Mapping[str, float], values: Mapping[str, float], deviations: str, alone: bool
) -> ContradictedRadii:
    """The refusal of radii that are off. off: what the logs ask for, m; values: as stated; alone: of one driving disc,
    whose disturbances can be estimated."""
    demands = " or ".join(f"{name} = {radius:.4g} m instead of {values[name]:.4g}" for name, radius in off.items())
    advice = (
        " A disturbance of the bench may look the same, as wear does: --disturbances auto seeks one, "
        "--disturbances NAME takes it for granted."
    )
    return ContradictedRadii(
        f"The radii R = {values['R']:.4g} m and r = {values['r']:.4g} m contradict the logs by "
        f"{deviations} standard deviations: the motion asks for {demands}. Measure both again, and check the "
        f"calibration of the laser and of the encoders.{advice if alone else ''}",
        off,
    )
