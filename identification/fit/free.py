"""Friction as a curve through values (law ``free``): the fit is the curve of the slips, and what is known of it.

Slips alone leave values of the curve open where they are few; what is assumed of its smoothness beforehand and what
releases of sticks say hold them (`free_friction.curve`). So values and deviations are those of the curve, and the model
is run with them for what else a fit says.
"""

from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators.base import Estimate, Options
from identification.estimators.shooting import ESTIMATOR, slip_shooting
from identification.estimators.shooting_problem import shooting_problem
from identification.fit.adjust import as_stated
from identification.fit.causes import causes_of, terms_found
from identification.fit.conclude import conclude
from identification.fit.result import FrictionFit
from identification.fit.stages import Stages
from identification.free_friction.contest import contest
from identification.free_friction.result import BENDS, COEFFICIENTS, FreeFriction
from identification.inference.choice import Inference
from identification.inference.problem import Solution, at_bounds
from identification.inference.uncertainty import correlation
from identification.laws import FittableLaw
from identification.measurement.pooled import Pool


def fit_free(
    ready: Pool, law: FittableLaw, options: Options, inference: Inference, named: tuple[str, ...] | None, stages: Stages
) -> FrictionFit:
    """The curve of the slips as a fit. named: disturbances beside it; None: those that the slips show. StickslipError:
    slips do not tell a curve, or `law` or constants were to be found otherwise."""
    if options.nuisance or options.given.held or options.given.bounds:
        raise StickslipError(
            f"The law '{law.name}' takes its values from the curve of the slips: nothing is held or estimated beside "
            "it. Leave --free and parameters out, or take a law of some form."
        )
    segments, noise_known = slip_shooting(ready)
    verdict = contest(ready, segments, noise_known, named)
    stages.of("search")(1.0)
    if verdict is None:
        raise StickslipError(
            f"These logs do not tell the law '{law.name}': it needs slips of one driving disc, which some "
            "friction follows. Take a law of some form: stickslip laws LOGS lists them."
        )
    curve, causes = verdict.curve, causes_of(verdict, ready)
    options = replace(options, disturbances=terms_found(ready, causes))
    values = np.array([*curve.values, curve.greatest])
    sure = 1 / np.sqrt(curve.form_covariance[0][0])
    law = replace(law, beforehand=np.pad(np.vstack([BENDS, sure * np.eye(1, COEFFICIENTS)]), ((0, 0), (0, 1))))
    problem = shooting_problem(ready, law, segments, values, options, noise_known)
    stated = problem.held
    problem = problem.with_held(tuple(replace(constant, value=curve.constants[constant.name]) for constant in stated))
    x = problem.start()
    bounds = tuple(bool(at) for at in at_bounds(problem, x))
    solution = Solution(x, problem.evaluate(x), True, "the curve of the slips", bounds, (law.spans,))
    solved = replace(as_stated(Estimate(ESTIMATOR, law, problem, solution)), stated=stated)
    fit = conclude(ready, solved, inference, progress=stages.of("end"))
    return with_curve(replace(fit, free=curve, causes=causes), curve)


def with_curve(fit: FrictionFit, curve: FreeFriction) -> FrictionFit:
    """A fit of the law `free` with what is known of the curve in place of what slips alone leave open."""
    form, whole = np.array(curve.form_covariance), np.diag(np.array(curve.covariance))
    deviations = np.sqrt(np.diag(form)), np.sqrt(np.maximum(whole - np.diag(form), 0.0))
    parameters = tuple(
        replace(
            one, standard_deviation=float(own), plain_deviation=float(own), scale_deviation=float(scale), bound=None
        )
        for one, own, scale in zip(fit.parameters, *deviations, strict=False)
    )
    rows = (*map(tuple, np.pad(correlation(form), (0, 1)).tolist()),)
    rows = (*rows[:-1], (*rows[-1][:-1], 1.0))
    return replace(fit, parameters=(*parameters, fit.parameters[-1]), correlation=rows, collinearity=None)
