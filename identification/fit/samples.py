"""Friction as it was measured, disc by disc, for figures: local values, not those of the estimator."""

from dataclasses import replace

import numpy as np

from identification.disturbances.terms import undisturbed
from identification.estimators.savitzky_golay import FrictionSamples, friction_samples
from identification.fit.causes import terms_found
from identification.fit.result import FrictionFit
from identification.laws import find_law
from identification.laws.joint_law import JointLaw, sought_law
from identification.measurement.pooled import Pool


def samples_by_disc(fit: FrictionFit, ready: Pool) -> dict[str, FrictionSamples]:
    """Friction coefficient against slip speed on each driving disc.

    Of one disc: at every sample, from the motion alone, without what the disturbances that were found changed. Of two:
    averages over windows in which it touches, with the fitted friction of the other taken off, and what the law's bend
    within a window adds to its value at the mean slip speed.

    Raises:
        StickslipError: no slip of the logs holds a window.
    """
    ready = ready.with_constants({constant.name: constant.value for constant in (*fit.constants, *fit.nuisance)})
    law = sought_law(find_law(fit.law_reference), ready.contacts, ready.arrangement)
    if not isinstance(law, JointLaw):
        samples = _undisturbed(fit, ready)
        assert samples.sign is not None
        return {ready.contacts[0]: replace(samples, slip=law.along(samples.slip, samples.sign))}
    from identification.estimators.two_discs import joint_rows

    rows = joint_rows(ready, law, fit.law_values)
    by_disc = {}
    for number, contact in enumerate(ready.contacts):
        mine = rows.disc == number
        friction = law.single.value(rows.speed[mine], fit.law_values[law.of_disc(number)])
        by_disc[contact] = FrictionSamples(
            slip=rows.speed[mine],
            coefficient=rows.measured[mine] - rows.fitted[mine] + friction,
            cluster=rows.cluster[mine],
            log=rows.log[mine],
            weight=np.ones(np.count_nonzero(mine)),
        )
    return by_disc


def _undisturbed(fit: FrictionFit, ready: Pool) -> FrictionSamples:
    """Friction on one disc as the law alone would have it."""
    samples = friction_samples(ready)
    terms = terms_found(ready, fit.causes)
    if not terms:
        return samples
    assert samples.where is not None and samples.sign is not None
    nuisance = {parameter.name: parameter.value for parameter in fit.nuisance}
    values = np.array([nuisance[term.name] for term in terms])
    friction = undisturbed(terms, values, samples.coefficient, samples.sign, samples.where, ready.values)
    return replace(samples, coefficient=friction)
