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

from identification.disturbances.terms import terms_of
from identification.estimators.base import Estimate, Options
from identification.estimators.regression import RegressionProblem
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.causes import find_causes
from identification.fit.conclude import white_covariance
from identification.fit.parts import Cause, RivalLaw
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
ROUNDS = 3  # of law and disturbances in turn
BETTER = 10.0  # in AIC: another law is said to fit better
MODES = (NONE, AUTO, ALL)


@dataclass(frozen=True, eq=False)
class Contest:
    """The law of a fit among others on the same residuals. own: its name; lead: by which the AIC of each exceeds the
    least."""

    own: str
    fitted: Mapping[str, Rival]
    lead: Mapping[str, float]


def causes_beside_law(
    ready: Pool, law: FittableLaw, *, workers: int | None, progress: Callable[[float], None]
) -> tuple[Cause, ...]:
    """Disturbances that the logs show under the law that the weak form finds best within them, be it this or another:
    a law of the wrong form takes its leftovers for disturbances. workers, progress: as for `find_causes`.

    Raises:
        StickslipError: the logs cannot be fitted by the weak form.
    """
    laws = {name: one for name, one in slip_laws().items() if one.reference != law.reference} | {law.name: law}
    causes: tuple[Cause, ...] = ()
    tried: dict[str, tuple[Cause, ...]] = {}
    for turn in range(ROUNDS):
        weak = weak_fits(ready, laws, Options(disturbances=terms_of(ready, [cause.name for cause in causes])))
        near = _near(weak, law.name)
        under = law.name if near[law.name] < NEAR else min(near, key=lambda name: near[name])
        if under in tried:
            return tried[under]
        causes = tried[under] = find_causes(
            ready, laws[under], workers=workers, progress=lambda done, at=turn: progress((at + done) / ROUNDS)
        )
        if not causes:
            break
    return causes


def contest(
    ready: Pool, made: Estimate, mode: str, *, progress: Callable[[float], None] | None = None
) -> Contest | None:
    """The law of an estimate and those that the logs may not tell apart from it; None where that cannot be said: two
    discs, values held, a contact that does not stick, or friction by direction. mode: "auto" asks the laws that the
    weak form, which costs next to nothing, leaves within reach; "all" every law that is not far off."""
    problem, found, law = made.problem, made.solution, made.law
    if (
        isinstance(law, JointLaw)
        or not law.sticks
        or found.fixed
        or not isinstance(problem, ShootingProblem | RegressionProblem)
    ):
        return None
    laws = {name: one for name, one in slip_laws().items() if one.reference != law.reference} | {law.name: law}
    weak = weak_fits(ready, laws, Options(disturbances=problem.terms))
    near = [*_near(weak, law.name)] if mode == AUTO else list(dict.fromkeys([*not_far(weak), law.name]))
    fitted = fit_rivals(
        made, {name: laws[name] for name in near}, lambda one: weak[one.name].law_values, progress=progress
    ).fitted
    aic = criteria({name: (one.problem, one.found) for name, one in fitted.items()})
    least = min(aic.values())
    return Contest(law.name, fitted, {name: value - least for name, value in aic.items()})


def _near(weak: Mapping[str, Rival], own: str) -> dict[str, float]:
    """Laws within reach of the best, and their own, with what their AIC exceeds the least by."""
    aic = criteria({name: (one.problem, one.found) for name, one in weak.items()})
    least = min(aic.values())
    return {name: value - least for name, value in aic.items() if name == own or value < least + NEAR}


def with_spread(fit: FrictionFit, found: Contest) -> FrictionFit:
    """A fit that carries the spread over laws, and says where another fits better."""
    names = list(found.fitted)
    weights = dict(zip(names, akaike_weights(np.array([found.lead[name] for name in names])), strict=True))
    wider = WIDER_ELASTIC if fit.presliding is not None and fit.presliding.elastic else WIDER
    own = found.fitted[found.own]
    parameters, seen = [], dict[str, dict[str, float]]()
    for place, parameter in enumerate(fit.parameters):
        mine = _quantity(own, own.law, place)
        deviation = None
        if mine is not None:
            power, total = 0.0, 0.0
            for name, one in found.fitted.items():
                its = _quantity(one, own.law, place)
                if its is None:
                    continue
                total += weights[name]
                power += weights[name] * ((its[0] - mine[0]) ** 2 + max(its[1] ** 2 - mine[1] ** 2, 0.0))
                seen.setdefault(name, {})[parameter.name] = its[0]
            deviation = wider * float(np.sqrt(power / total)) if total > 0 else None
        parameters.append(replace(parameter, law_deviation=deviation))
    rivals = tuple(RivalLaw(name, float(weights[name]), float(found.lead[name]), seen.get(name, {})) for name in names)
    fit = replace(fit, parameters=tuple(parameters), rivals=rivals)
    if not (said := _said(found)):
        return fit
    kept, releases = fit.warnings, fit.breakaway
    if releases is not None:
        before, releases = releases.warnings, replace(releases, of_wrong_law=True)
        kept = tuple(one for one in kept if one not in before or one in releases.warnings)
    return replace(fit, breakaway=releases, warnings=(*kept, *said))


def _said(found: Contest) -> tuple[str, ...]:
    best = min(found.lead, key=lambda name: found.lead[name])
    ahead = found.lead[found.own]
    if ahead < BETTER:
        return ()
    return (
        f"{best} fits these logs better than {found.own} (AIC lower by {ahead:.3g}): the values of {found.own} tell "
        f"friction at the speeds seen, not beyond them. Compare with `stickslip laws`, or fit --law {best}.",
    )


def _quantity(one: Rival, law: FittableLaw, place: int) -> tuple[float, float] | None:
    """Value and deviation, if noise were white, that a law gives the quantity which is a parameter of another; None if
    it has none."""
    wanted = law.parameters[place]
    names = {(p.name, p.unit, p.description): i for i, p in enumerate(one.law.parameters)}
    mine = one.law.at_rest if law.at_rest == place else names.get((wanted.name, wanted.unit, wanted.description))
    if mine is None:
        return None
    covariance = white_covariance(one.problem, one.found)
    return float(one.found.values[mine]), float(np.sqrt(max(covariance[mine, mine], 0.0)))
