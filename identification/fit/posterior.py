"""The posterior of a fit: law, disturbances, sensors and constants of the rig together, by Markov chains.

The constants, which a fit takes as given and adds to its deviations to first order, are unknowns here, with what is
stated of them as priors; so the posterior holds what the intervals of a fit hold (noise, colour of the residuals,
instruments, constants) without taking any of it as linear.
"""

from collections.abc import Callable
from dataclasses import replace

from fmu_models.base.errors import StickslipError
from fmu_models.base.threads import one_blas_thread
from identification.disturbances.terms import terms_of
from identification.estimators import ESTIMATORS
from identification.estimators.base import Options
from identification.fit.result import FrictionFit
from identification.inference.choice import coloured_covariance
from identification.inference.defaults import SEED
from identification.inference.posterior import STEPS, Posterior, Target, load_emcee, sample
from identification.inference.problem import identifier, searched
from identification.laws import find_law
from identification.laws.joint_law import sought_law
from identification.measurement.pooled import Pool

ABLE = ("shooting", "whole-cycle")  # estimators that take constants up beside the law


@one_blas_thread()
def posterior(
    ready: Pool,
    fit: FrictionFit,
    *,
    seed: int = SEED,
    steps: int = STEPS,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Posterior:
    """Sample what a fit of these logs leaves open. ready: what it was made of; workers: threads of one evaluation;
    others as in `inference.posterior.sample`.

    Raises:
        StickslipError: an estimator without a model of the sensors, unknowns that are held, or chains that have not
            converged.
    """
    check_samplable(fit.estimator)
    return sample(target_of(ready, fit, workers), seed=seed, steps=steps, progress=progress)


def target_of(ready: Pool, fit: FrictionFit, workers: int | None = None) -> Target:
    """The posterior of a fit, with its constants among the unknowns."""
    loose = tuple(prior.name for prior in ready.priors if prior.standard_uncertainty > 0)
    first = {identifier(parameter.name): parameter.value for parameter in (*fit.parameters, *fit.nuisance)}
    options = Options(
        nuisance=loose,
        disturbances=terms_of(ready, [cause.name for cause in fit.causes]),
        given=replace(fit.given, first=first),
        workers=workers,
    )
    law = options.bounded(sought_law(find_law(fit.law_reference), ready.contacts, ready.arrangement))
    estimate = ESTIMATORS.load(fit.estimator).estimate(ready, law, options)
    problem, solution = estimate.problem, estimate.solution
    # of the unknowns without a prior, the others held, and wide enough for coloured residuals
    fixed = {u.name: value for u, value in zip(problem.unknowns, solution.values, strict=True) if u.prior is not None}
    reduced, seen, _ = searched(problem, replace(solution, fixed=tuple(fixed)))
    covariance = coloured_covariance(reduced, seen, "jackknife")
    names = [unknown.name for unknown in problem.unknowns]
    readings = [reading for reading in ready.readings if set(reading.powers) <= set(names)]
    return Target(problem, solution, covariance, readings)


def check_samplable(estimator: str) -> None:
    """Whether there is a posterior of fits by this estimator, here, before the work. StickslipError: it has none, or
    emcee is not installed."""
    if estimator not in ABLE:
        raise StickslipError(
            f"The estimator '{estimator}' has no likelihood of what the sensors show. A posterior is sampled by "
            f"{' or '.join(ABLE)}: choose one of them with --estimator."
        )
    load_emcee()
