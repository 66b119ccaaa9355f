"""What the choice of a law leaves open of the values that are fitted: their spread over the laws.

The laws i that have a quantity are averaged,

    sum_i w_i N(q_i, s_i^2 + s_1^2 - t_1^2),      w_i ~ exp(-BIC_i/2)

q_1 the value of the law that is fitted and s_1 its deviation, t_1 and s_i those that the same evidence gives it and the
others (no less than t_1). An interval about q_1 that holds 95 % of this mixture is that of one normal law; what its
variance has more than s_1^2 is the spread. A law that is worse beyond doubt adds nothing, one that the logs do not tell
from the best all that it is off. Evidence are the slips by their free curve (`free_friction.evidence`). Where even the
best law misses the free curve, all deviations are larger by the root of its misfit over the degrees of freedom; where a
torque acts that nothing explains, and that may be the same in every slip, s_1 is no less than t_1; and where the law
that is fitted has other values on the curve, beyond what both leave open, all laws are off by as much.

The friction at zero slip speed is one quantity under whatever name; others are the same where name, unit and meaning
are.

Source: Hoeting, Madigan, Raftery & Volinsky (1999), Bayesian model averaging: a tutorial, Statistical Science 14, 382
(weights by BIC, section 4.1).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.fit.parts import FittedParameter, RivalLaw
from identification.fit.result import LEVEL, FrictionFit
from identification.free_friction.evidence import Evidence, SeenLaw
from identification.inference.comparison import weights_of
from identification.inference.defaults import AUTO, NONE
from identification.laws import FittableLaw, slip_laws
from identification.laws.joint_law import JointLaw

NEAR = 12.0  # in BIC: laws that are further behind are out
BETTER = 10.0  # in BIC: another law is said to fit better
MODES = (NONE, AUTO)


@dataclass(frozen=True, eq=False)
class Contest:
    """The law of a fit among others on the same evidence. law: its name; laws: by name; lead: by which the BIC of each
    exceeds the least; torn: whether a torque acts that nothing explains."""

    law: str
    laws: Mapping[str, SeenLaw]
    lead: Mapping[str, float]
    torn: bool = False


def by_curve(evidence: Evidence, law: FittableLaw, values: np.ndarray) -> Contest | None:
    """All laws by the free curve; None of a law that has no place among them. values (m,): of the law, where it is
    sought."""
    if isinstance(law, JointLaw) or not law.sticks:
        return None
    others = {name: evidence.seen(form) for name, form in slip_laws().items() if form.reference != law.reference}
    seen = others | {law.name: evidence.seen(law, values)}
    best = min(seen.values(), key=lambda one: one.misfit)
    excess = max(best.misfit / max(best.freedom, 1), 1.0)
    laws = {name: replace(one, covariance=excess * one.covariance) for name, one in seen.items()}
    price = float(np.log(evidence.samples))
    bic = {name: one.misfit / excess + price * len(one.values) for name, one in laws.items()}
    near = min(bic.values()) + NEAR
    within = {name: one for name, one in laws.items() if name == law.name or bic[name] < near}
    least = min(bic.values())
    return Contest(law.name, within, {name: bic[name] - least for name in within}, evidence.torn)


def with_spread(fit: FrictionFit, contest: Contest) -> FrictionFit:
    """A fit that carries the spread over laws, and says where another fits better."""
    names = list(contest.laws)
    weights = dict(zip(names, weights_of(np.array([contest.lead[name] for name in names])), strict=True))
    parameters, seen = [], dict[str, dict[str, float]]()
    for index, parameter in enumerate(fit.parameters):
        quantities = {name: _quantity(one, contest.laws[contest.law].law, index) for name, one in contest.laws.items()}
        present = {name: value for name, value in quantities.items() if value is not None}
        for name, (value, _) in present.items():
            seen.setdefault(name, {})[parameter.name] = value
        mine = present[contest.law]
        share = np.array([weights[name] for name in present])
        least, every = mine[1] if contest.torn else 0.0, np.array([*present.values()])
        deviation = _spread(parameter, mine, every, share / share.sum(), least) if share.any() else None
        parameters.append(replace(parameter, law_deviation=deviation))
    speeds = fit.free.speed if fit.free else np.zeros(0)
    curves = {name: tuple(one.law.value(speeds, one.values).tolist()) for name, one in contest.laws.items()}
    rivals = tuple(
        RivalLaw(name, float(weights[name]), float(contest.lead[name]), seen.get(name, {}), curves[name])
        for name in names
    )
    fit = replace(fit, parameters=tuple(parameters), rivals=rivals)
    if not (added := _better_law(contest)):
        return fit
    warnings, releases = fit.warnings, fit.breakaway
    if releases is not None:
        before, releases = releases.warnings, replace(releases, of_wrong_law=True)
        warnings = tuple(warning for warning in warnings if warning not in before or warning in releases.warnings)
    return replace(fit, breakaway=releases, warnings=(*warnings, *added))


def _spread(
    parameter: FittedParameter, mine: tuple[float, float], laws: np.ndarray, weights: np.ndarray, least: float
) -> float:
    """Deviation that the choice of the law adds. mine: value and deviation of the law that is fitted, by the evidence;
    laws (n, 2): of all; weights (n,); least: deviation that there is at least."""
    from scipy.optimize import root_scalar
    from scipy.special import ndtr, ndtri

    own = float(np.hypot(parameter.standard_deviation, parameter.scale_deviation))
    off = mine[0] - parameter.value
    off = float(np.sign(off) * np.sqrt(max(off**2 - own**2 - mine[1] ** 2, 0.0)))
    centres = laws[:, 0] - mine[0] + off
    widths = np.sqrt(max(own, least) ** 2 + np.maximum(laws[:, 1] ** 2 - mine[1] ** 2, 0.0))
    if not np.any(widths > 0):
        return float(np.sqrt(weights @ centres**2))

    def missed(reach: float) -> float:
        inside = ndtr((reach - centres) / widths) - ndtr((-reach - centres) / widths)
        return LEVEL - float(weights @ inside)

    quantile = float(ndtri(0.5 + LEVEL / 2))
    furthest = float(np.max(np.abs(centres) + 2 * quantile * widths))
    reach = root_scalar(missed, bracket=(0.0, furthest)).root
    return float(np.sqrt(max((reach / quantile) ** 2 - own**2, 0.0)))


def _better_law(contest: Contest) -> tuple[str, ...]:
    best = min(contest.lead, key=lambda name: contest.lead[name])
    ahead = contest.lead[contest.law]
    if ahead < BETTER:
        return ()
    return (
        f"{best} fits these logs better than {contest.law} (BIC lower by {ahead:.3g}): the values of {contest.law} "
        f"tell friction at the speeds seen, not beyond them. Compare with `stickslip laws`, or fit --law {best}.",
    )


def _quantity(seen: SeenLaw, law: FittableLaw, index: int) -> tuple[float, float] | None:
    """Value and deviation that a law gives the quantity which is a parameter of another; None if it has none."""
    target = law.parameters[index]
    names = {(p.name, p.unit, p.description): i for i, p in enumerate(seen.law.parameters)}
    place = seen.law.at_rest if law.at_rest == index else names.get((target.name, target.unit, target.description))
    if place is None:
        return None
    return float(seen.values[place]), float(np.sqrt(max(seen.covariance[place, place], 0.0)))
