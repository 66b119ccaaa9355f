"""What the choice of a law leaves open of the values that are fitted: their spread over laws that the logs cannot tell
apart.

    sd^2 = f^2 sum_i w_i ((q_i - q)^2 + max(s_i^2 - s^2, 0)),      w_i Akaike's weights

over the laws i that have the quantity; q its value and s its deviation, if noise were white, by the law that is fitted,
q_i and s_i by the others. The friction at zero slip speed is one quantity under whatever name; others are the same
where name, unit and meaning are. f allows for laws that are not among these (measured on emulated benches: 1.5 for
rigid contacts, 2.5 where sticks give way).

Source: Burnham & Anderson (2002), Model Selection and Multimodel Inference, section 4.3 (unconditional variance), about
the value of the law that is fitted in place of the mean.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.estimators.base import Estimate, Options
from identification.estimators.regression import RegressionProblem
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.conclude import white_covariance
from identification.fit.parts import RivalLaw
from identification.fit.result import FrictionFit
from identification.fit.rivals import Rival, fit_rivals, not_far, weak_fits
from identification.inference.comparison import akaike_weights, criteria
from identification.inference.defaults import ALL, AUTO, NONE
from identification.laws import FittableLaw, slip_laws
from identification.laws.joint_law import JointLaw
from identification.measurement.pooled import Pool

WIDER, WIDER_ELASTIC = 1.5, 2.5
# in AIC of the weak form, which knows a tenth of what shooting does: laws that are further behind are out
NEAR = 12.0
BETTER = 10.0  # in AIC: another law is said to fit better
MODES = (NONE, AUTO, ALL)


@dataclass(frozen=True, eq=False)
class Contest:
    """The law of a fit among others on the same residuals. law: its name; lead: by which the AIC of each exceeds the
    least."""

    law: str
    fitted: Mapping[str, Rival]
    lead: Mapping[str, float]


def contest(
    ready: Pool, estimate: Estimate, mode: str, *, progress: Callable[[float], None] | None = None
) -> Contest | None:
    """The law of an estimate and those that the logs may not tell apart from it; None where that cannot be said: two
    discs, values held, a contact that does not stick, or friction by direction. mode: "auto" asks the laws that the
    weak form, which costs next to nothing, leaves within reach; "all" every law that is not far off."""
    problem, solution, law = estimate.problem, estimate.solution, estimate.law
    if (
        isinstance(law, JointLaw)
        or not law.sticks
        or solution.fixed
        or not isinstance(problem, ShootingProblem | RegressionProblem)
    ):
        return None
    laws = {name: form for name, form in slip_laws().items() if form.reference != law.reference} | {law.name: law}
    weak = weak_fits(ready, laws, Options(disturbances=problem.terms))
    names = [*_contenders(weak, law.name)] if mode == AUTO else list(dict.fromkeys([*not_far(weak), law.name]))
    fitted = fit_rivals(
        estimate, {name: laws[name] for name in names}, lambda form: weak[form.name].law_values, progress=progress
    ).fitted
    aic = criteria({name: (rival.problem, rival.solution) for name, rival in fitted.items()})
    least = min(aic.values())
    return Contest(law.name, fitted, {name: value - least for name, value in aic.items()})


def _contenders(weak: Mapping[str, Rival], law: str) -> dict[str, float]:
    """Laws within reach of the best, and their own, with what their AIC exceeds the least by."""
    aic = criteria({name: (rival.problem, rival.solution) for name, rival in weak.items()})
    least = min(aic.values())
    return {name: value - least for name, value in aic.items() if name == law or value < least + NEAR}


def with_spread(fit: FrictionFit, laws: Contest) -> FrictionFit:
    """A fit that carries the spread over laws, and says where another fits better."""
    names = list(laws.fitted)
    weights = dict(zip(names, akaike_weights(np.array([laws.lead[name] for name in names])), strict=True))
    wider = WIDER_ELASTIC if fit.presliding is not None and fit.presliding.elastic else WIDER
    fitted = laws.fitted[laws.law]
    parameters, seen = [], dict[str, dict[str, float]]()
    for index, parameter in enumerate(fit.parameters):
        mine = _quantity(fitted, fitted.law, index)
        deviation = None
        if mine is not None:
            power, total = 0.0, 0.0
            for name, rival in laws.fitted.items():
                its = _quantity(rival, fitted.law, index)
                if its is None:
                    continue
                total += weights[name]
                power += weights[name] * ((its[0] - mine[0]) ** 2 + max(its[1] ** 2 - mine[1] ** 2, 0.0))
                seen.setdefault(name, {})[parameter.name] = its[0]
            deviation = wider * float(np.sqrt(power / total)) if total > 0 else None
        parameters.append(replace(parameter, law_deviation=deviation))
    rivals = tuple(RivalLaw(name, float(weights[name]), float(laws.lead[name]), seen.get(name, {})) for name in names)
    fit = replace(fit, parameters=tuple(parameters), rivals=rivals)
    if not (added := _better_law(laws)):
        return fit
    warnings, releases = fit.warnings, fit.breakaway
    if releases is not None:
        before, releases = releases.warnings, replace(releases, of_wrong_law=True)
        warnings = tuple(warning for warning in warnings if warning not in before or warning in releases.warnings)
    return replace(fit, breakaway=releases, warnings=(*warnings, *added))


def with_unexplained(fit: FrictionFit, law: FittableLaw) -> FrictionFit:
    """A fit whose slips show what nothing explains: how far its law's values are from those by the curve without a law,
    which allows for it, counts as a spread over models."""
    curve = fit.free
    if curve is None or not curve.unexplained or len(law.parameters) != len(fit.parameters):
        return fit
    from scipy.optimize import least_squares

    seen = np.array(curve.speed) >= curve.least
    speed, value, deviation = (np.array(row)[seen] for row in (curve.speed, curve.coefficient, curve.deviation))
    start = np.array([parameter.value for parameter in fit.parameters])
    low, high = (np.array(side) for side in zip(*((p.minimum, p.maximum) for p in law.parameters), strict=True))
    found = least_squares(
        lambda q: (law.value(speed, q) - value) / deviation,
        np.clip(start, low, high),
        bounds=(low, high),
        x_scale="jac",
    ).x
    parameters = tuple(
        replace(one, law_deviation=float(np.hypot(one.law_deviation or 0.0, other - one.value)))
        for one, other in zip(fit.parameters, found, strict=True)
    )
    return replace(fit, parameters=parameters)


def _better_law(laws: Contest) -> tuple[str, ...]:
    best = min(laws.lead, key=lambda name: laws.lead[name])
    ahead = laws.lead[laws.law]
    if ahead < BETTER:
        return ()
    return (
        f"{best} fits these logs better than {laws.law} (AIC lower by {ahead:.3g}): the values of {laws.law} tell "
        f"friction at the speeds seen, not beyond them. Compare with `stickslip laws`, or fit --law {best}.",
    )


def _quantity(rival: Rival, law: FittableLaw, index: int) -> tuple[float, float] | None:
    """Value and deviation, if noise were white, that a law gives the quantity which is a parameter of another; None if
    it has none."""
    target = law.parameters[index]
    names = {(p.name, p.unit, p.description): i for i, p in enumerate(rival.law.parameters)}
    mine = rival.law.at_rest if law.at_rest == index else names.get((target.name, target.unit, target.description))
    if mine is None:
        return None
    covariance = white_covariance(rival.problem, rival.solution)
    return float(rival.solution.values[mine]), float(np.sqrt(max(covariance[mine, mine], 0.0)))
