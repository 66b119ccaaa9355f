"""From a problem and its solution to a result: standard deviations, sensitivities, warnings; for all estimators.

To first order a change dx of something taken as given moves the estimate by  dq = -(A'A + P)^-1 A' (dr/dx) dx,  with
r(x) the whitened residual and P the precision of the priors. The same formula serves the laser's gain and delay, where
they are taken as given (their covariance joins the noise), and the constants of the rig (their uncertainty is reported
apart).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError
from fmu_models.language.laws import LAWS
from identification.estimators import lugre, shooting
from identification.estimators.base import FrictionProblem, FrictionRows
from identification.estimators.regression import RegressionProblem
from identification.estimators.releases import Breakaway, Fitted, breakaway
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.adjust import Adjusted, Conflict
from identification.fit.parts import Constant, FittedParameter, StatedConstant
from identification.fit.result import FrictionFit
from identification.fit.summaries import bins, sensors, summaries
from identification.inference.choice import Inference, Inferred, coloured_covariance, infer
from identification.inference.lmfit_exchange import Solved
from identification.inference.problem import FitProblem, Solution, among, determines, information, prior_rows, searched
from identification.inference.uncertainty import autocorrelation, correlation
from identification.laws import FittableLaw
from identification.laws.joint_law import JointLaw
from identification.measurement.pooled import Pool
from identification.measurement.presliding import PreSliding, presliding
from rig_io.logs.log import RIG_UNITS

FEW_SEGMENTS = 10  # fewer independent slips leave the standard deviations themselves uncertain by a quarter
UNSEEN = 0.5  # of the range of friction: where more lies below all slip speeds seen, friction at rest is not known
STIFFNESS = "sigma0"  # of bristles, N/m
# relative, of a stiffness by cycles: the softest (2e4 N/m) is found 3.4 % too large, for slips see micro-slip too
FOLLOWED = 0.025


def conclude(
    ready: Pool,
    solved: Adjusted,
    settings: Inference,
    *,
    progress: Callable[[float], None] | None = None,
    warnings: tuple[str, ...] = (),
    sticks: bool = True,
) -> FrictionFit:
    """Say how well a solution is known; ``progress`` is told the fraction done; warnings: after those of the estimator;
    sticks: whether they are asked too. StickslipError: the logs do not determine the parameters one by one, or as in
    `infer`."""
    estimate = solved.estimate
    estimator, problem, solution, law = estimate.estimator, estimate.problem, estimate.solution, estimate.law
    searched_problem, at_searched, free = searched(problem, solution)
    count = len(law.parameters)
    _check_determined(searched_problem, at_searched, law)
    shifts = _shifts(problem, solution, searched_problem, at_searched, free)
    of_law = int(np.count_nonzero(free[:count]))
    inference = infer(
        searched_problem,
        at_searched,
        settings,
        count=of_law,
        logs=[motion.log.name for motion in ready.motions],
        instruments=_instruments(ready, shifts, free),
        tested=problem.tested(solution),
        progress=progress,
    )
    white = among(white_covariance(searched_problem, at_searched), free)
    covariance = among(inference.covariance, free)
    elastic, releases = _in_stick(ready, solved, inference, covariance, shifts) if sticks else (None, None)
    constants, scale = _constants(solved, shifts)
    loose = np.diag(solved.covariance) > 0
    contradictions = tuple(side for conflict in solved.conflicts for side in _sides(solved, conflict, shifts))
    bound = None if inference.bound is None else among(inference.bound, free)
    unknowns = _parameters(problem, solution, (covariance, white, bound), scale)
    parameters = unknowns[:count]
    held = [f"{one.name} held at {one.value:g} {one.unit}" for one in unknowns if one.held]
    many = {one.name for one in problem.unknowns if one.prior is not None and one.prior.many}
    nuisance = tuple(one for one in unknowns[count:] if one.name not in many)
    rows = problem.rows(solution.values)
    segments = len(np.unique(solution.evaluation.cluster))
    return FrictionFit(
        estimator=estimator.name,
        law=law.name,
        structure=(*estimator.structure, *ready.assumed, *held),
        contacts=ready.contacts,
        materials=tuple(ready.materials),
        parameters=parameters,
        correlation=_correlations(inference.covariance[:of_law, :of_law], free[:count]),
        constants=constants,
        constants_correlation=_correlations(solved.covariance[np.ix_(loose, loose)], loose),
        contradictions=contradictions,
        logs=summaries(ready, rows),
        bins=tuple(b for number, contact in enumerate(ready.contacts) for b in bins(rows, number, contact)),
        sensors=sensors(ready),
        segments=segments,
        values=len(solution.evaluation.residual),
        rms_residual=problem.rms(solution.values),
        residual_unit=problem.residual_unit,
        autocorrelation=autocorrelation(solution.evaluation.residual, solution.evaluation.cluster),
        converged=solution.converged,
        message=solution.message,
        warnings=(
            *estimate.warnings,
            *warnings,
            *ready.warnings,
            *_contradicting(contradictions, solved),
            *_warnings(law, solution, parameters, segments),
            *_unseen(law, solution.values[:count], rows),
            *inference.warnings,
            *(elastic.warnings if elastic else ()),
            *(releases.warnings if releases else ()),
        ),
        nuisance=nuisance,
        covariance=settings.covariance,
        intervals=inference.intervals,
        collinearity=inference.collinearity,
        whiteness=inference.whiteness,
        presliding=elastic,
        breakaway=releases,
        declaration="" if law.reference in LAWS.members() else law.reference,
        solved=Solved(problem, solution, covariance),
    )


def _instruments(ready: Pool, shifts: Mapping[str, np.ndarray], free: np.ndarray) -> np.ndarray | float:
    """Covariance that sensors taken as given bring, of the unknowns that are searched, (m, m); 0 where none is."""
    covariance: np.ndarray | float = 0.0
    if "gain" in shifts:
        by_sensor = np.stack([shifts["gain"][free], shifts["delay"][free]], axis=1)
        covariance = by_sensor @ ready.sensors.covariance @ by_sensor.T
    if "lines" in shifts:
        covariance = covariance + shifts["lines"][free] @ shifts["lines"][free].T
    return covariance


def _in_stick(
    ready: Pool, solved: Adjusted, inference: Inferred, covariance: np.ndarray, shifts: Mapping[str, np.ndarray]
) -> tuple[PreSliding | None, Breakaway | None]:
    """What sticks say beside the slips: how they give way, and the level at which they let go."""
    estimate = solved.estimate
    problem, values, law = estimate.problem, estimate.solution.values, estimate.law
    # the force of a stick on one of two discs holds that of the other
    if not estimate.estimator.rigid or len(ready.contacts) != 1:
        return None, None
    elastic = presliding(ready, float(law.value(np.zeros(1), values[: len(law.parameters)])[0]))
    if elastic is not None and elastic.elastic:
        elastic = _followed(solved, elastic)
    gives_way = elastic is not None and elastic.elastic
    if gives_way or not isinstance(problem, RegressionProblem | ShootingProblem) or problem.terms:
        return elastic, None
    names = tuple(unknown.name for unknown in problem.unknowns)
    moves = _by_logarithm(solved, shifts)
    releases = breakaway(ready, law, Fitted(names, values, covariance, problem.held, solved.covariance, moves))
    if releases is not None and inference.whiteness is not None:
        releases = replace(releases, of_wrong_law=bool(inference.whiteness.beyond))
    return elastic, releases


def _followed(solved: Adjusted, elastic: PreSliding) -> PreSliding:
    """The stiffness of bristles in the LuGre model that follows some cycles of the logs, ringing and inertia in it;
    that of the sticks where there is none."""
    estimate = solved.estimate
    slips, x = estimate.problem, estimate.solution.values
    if estimate.estimator.name != shooting.ESTIMATOR.name or estimate.solution.fixed:
        return elastic
    if not isinstance(slips, ShootingProblem) or slips.terms:
        return elastic
    fit = lugre.in_stick(slips, x, 1 / elastic.compliance)
    if fit is None:
        return elastic
    reduced, seen, free = searched(*fit)
    covariance = coloured_covariance(reduced, seen, "jackknife")
    index = [unknown.name for unknown in reduced.unknowns].index(STIFFNESS)
    shifts = _shifts(fit[0], fit[1], reduced, seen, free)
    by = _by_logarithm(solved, shifts)[fit[0].law.names.index(STIFFNESS)]
    stiffness = float(seen.values[index])
    noise, scale = np.sqrt(covariance[index, index]), np.sqrt(by @ solved.covariance @ by)
    compliance, per = 1 / stiffness, 1 / stiffness**2
    deviations, cycles = (float(noise) * per, float(scale) * per), len(fit[0].segments)
    unknown = any(slope for prior, slope in zip(estimate.problem.held, by, strict=True) if not prior.stated)
    return PreSliding(compliance, *deviations, cycles, FOLLOWED * compliance, unknown)


def _unseen(law: FittableLaw, q: np.ndarray, rows: FrictionRows) -> tuple[str, ...]:
    """What to say where the law changes most at slip speeds below all that were seen."""
    if isinstance(law, JointLaw) or law.directed or law.at_rest is None:
        return ()
    least, greatest = float(np.abs(rows.least).min()), float(np.abs(rows.greatest).max())
    course = law.value(np.array([0.0, *np.linspace(least, greatest, 50)]), q)
    static, slow = course[:2]
    if not abs(static - slow) > UNSEEN * np.ptp(course) > 0:
        return ()
    return (
        f"The law goes from {static:.4g} to {slow:.4g} below {least:.3g} m/s, the smallest slip speed in the logs: "
        f"{law.names[law.at_rest]} is no measurement but what the form of the law makes of the rest. Record at lower "
        "drive speeds, or take the level at which sticks let go.",
    )


def _correlations(covariance: np.ndarray, free: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """Correlations of all parameters (m,), from the covariance of those searched; a held one goes with no other."""
    matrix = among(correlation(covariance), free) + np.diag((~free).astype(float))
    return tuple(tuple(float(x) for x in row) for row in matrix)


def _finite(bound: float) -> float | None:
    return bound if np.isfinite(bound) else None


def _check_determined(problem: FitProblem, solution: Solution, law: FittableLaw) -> None:
    if not determines(information(problem, solution.evaluation)):
        names = [unknown.name for unknown in problem.unknowns if unknown.name in law.names]
        values = ", ".join(f"{name} = {value:.4g}" for name, value in zip(names, solution.values, strict=False))
        raise StickslipError(
            f"The logs do not determine {', '.join(names)} of '{law.name}' one by one (found {values}): friction "
            "hardly changes over the slip speeds in them. Pool logs at more drive speeds, or take a simpler law."
        )


def _parameters(
    problem: FrictionProblem,
    solution: Solution,
    covariances: tuple[np.ndarray, np.ndarray, np.ndarray | None],
    scale: np.ndarray,
) -> tuple[FittedParameter, ...]:
    """All unknowns. covariances (m, m): stated, as if residuals were white, and the Cramer-Rao bound."""
    deviation, plain, bound = (
        None if covariance is None else np.sqrt(np.diag(covariance)) for covariance in covariances
    )
    assert deviation is not None and plain is not None
    return tuple(
        FittedParameter(
            name=spec.name,
            value=float(solution.values[i]),
            unit=spec.unit,
            standard_deviation=float(deviation[i]),
            plain_deviation=float(plain[i]),
            scale_deviation=float(scale[i]),
            minimum=float(solution.values[i]) if spec.name in solution.fixed else _finite(spec.minimum),
            maximum=float(solution.values[i]) if spec.name in solution.fixed else _finite(spec.maximum),
            at_bound=solution.at_bound[i],
            description=spec.description,
            bound=None if bound is None else float(bound[i]),
        )
        for i, spec in enumerate(problem.unknowns)
    )


def white_covariance(problem: FitProblem, solution: Solution) -> np.ndarray:
    """Covariance (m, m) as if residuals were white: of unit variance where the noise is known (then it is the bound of
    Cramer and Rao), otherwise of the variance that they show."""
    inverse = np.linalg.inv(information(problem, solution.evaluation))
    if problem.noise_known:
        return inverse
    evaluation = solution.evaluation
    return inverse * evaluation.sum / (len(evaluation.residual) - evaluation.eliminated - len(solution.values))


def _shifts(
    problem: FrictionProblem, solution: Solution, reduced: FitProblem, seen: Solution, free: np.ndarray
) -> dict[str, np.ndarray]:
    """First-order shifts of the estimate (m,), or (m, k), by what is taken as given, per its unit; reduced, seen: the
    problem and solution of the unknowns that are ``free`` (m,)."""
    # as least squares, whose condition is the root of that of the normal equations
    roots = prior_rows(reduced)
    stacked = np.vstack([seen.evaluation.gradient, roots])
    shifts = {}
    for name, slope in problem.by_held(solution.values).items():
        shift = np.zeros((len(free), *slope.shape[1:]))
        zeros = np.zeros((len(roots), *slope.shape[1:]))
        shift[free] = -np.linalg.lstsq(stacked, np.concatenate([slope, zeros]), rcond=None)[0]
        shifts[name] = shift
    return shifts


def _constants(solved: Adjusted, shifts: Mapping[str, np.ndarray]) -> tuple[tuple[Constant, ...], np.ndarray]:
    """Constants with the sensitivities of the parameters, and the standard deviations (m,) that they pass on."""
    estimate = solved.estimate
    values, names = estimate.solution.values, [parameter.name for parameter in estimate.law.parameters]
    constants = []
    for prior, before in zip(estimate.problem.held, solved.stated, strict=True):
        relative = {
            name: float(s * prior.value / v) if v else None
            for name, s, v in zip(names, shifts[prior.name], values, strict=False)
        }
        of_prior = (prior.name, prior.value, prior.unit, prior.standard_uncertainty, prior.source)
        known = before.standard_uncertainty if before.stated else None
        constants.append(Constant(*of_prior, relative, prior.stated, before.value, known))
    moves = _by_logarithm(solved, shifts)
    power = np.einsum("ij,jk,ik->i", moves, solved.covariance, moves)
    return tuple(constants), np.sqrt(np.maximum(power, 0.0))


def _by_logarithm(solved: Adjusted, shifts: Mapping[str, np.ndarray]) -> np.ndarray:
    """Shifts (m, n) of the unknowns by the logarithms of the constants."""
    priors = solved.estimate.problem.held
    return np.stack([shifts[prior.name] * prior.value for prior in priors], axis=1)


def _sides(solved: Adjusted, conflict: Conflict, shifts: Mapping[str, np.ndarray]) -> Iterator[StatedConstant]:
    """What each of the readings that contradict each other would make of the law."""
    moves, estimate, clash = _by_logarithm(solved, shifts), solved.estimate, conflict.contradiction
    units = {prior.name: prior.unit for prior in estimate.problem.held}
    for name, value, expected, step in zip(clash.names, clash.values, clash.others, conflict.steps, strict=True):
        law = estimate.solution.values + moves @ step
        parameters = {p.name: float(q) for p, q in zip(estimate.law.parameters, law, strict=False)}
        unit = units.get(name) or RIG_UNITS[name]
        yield StatedConstant(name, value, unit, expected, clash.deviations, clash.names, parameters)


def _contradicting(readings: Sequence[StatedConstant], solved: Adjusted) -> Iterator[str]:
    """Sentences on constants that contradict each other."""
    for together in dict.fromkeys(reading.together for reading in readings):
        mine = [reading for reading in readings if reading.together == together]
        stated = " and ".join(f"{reading.name} = {reading.value:.4g} {reading.unit}" for reading in mine)
        verb = "agree" if len(mine) > 1 else "agrees"
        sides = "; ".join(reading.sentence for reading in mine)
        doubt = "Which of them is wrong cannot be known" if len(mine) > 1 else "It may be wrong, or the others"
        yield (
            f"Rig constants contradict each other: {stated} dis{verb} with all else that is known by "
            f"{mine[0].deviations:.2g} standard deviations. {doubt}: {sides}. What disagrees was "
            "taken as that many times less sure, so that the intervals hold it. Measure again."
        )


def _warnings(
    law: FittableLaw, solution: Solution, parameters: tuple[FittedParameter, ...], segments: int
) -> tuple[str, ...]:
    warnings = list(law.warnings(solution.values[: len(law.parameters)]))
    if not solution.converged:
        warnings.append(f"The search did not converge: {solution.message}. The values are its last ones.")
    for parameter in parameters:
        if parameter.at_bound and parameter.minimum is not None and parameter.maximum is not None:
            warnings.append(
                f"{parameter.name} = {parameter.value:g} {parameter.unit} lies on a bound of the search "
                f"[{parameter.minimum:g}, {parameter.maximum:g}]: the data ask for a value beyond "
                "it, and its standard deviation says nothing."
            )
        elif parameter.standard_deviation > 0.5 * abs(parameter.value):
            warnings.append(
                f"{parameter.name} is hardly determined: "
                f"{value_with_sd(parameter.value, parameter.standard_deviation, parameter.unit)}. Pool logs at more "
                "drive speeds."
            )
    if segments < FEW_SEGMENTS:
        warnings.append(
            f"Only {segments} slip segments: the standard deviations are themselves uncertain. Record longer."
        )
    return tuple(warnings)
