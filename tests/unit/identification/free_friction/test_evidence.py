"""What the free curve says of laws, against closed forms and against those laws shot at the motion itself."""

from __future__ import annotations

import numpy as np
import pytest
from foreign_bench import foreign_logs
from oracle.bench import Bench

from identification.estimators import shooting
from identification.estimators.base import Options
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.law_spread import by_curve
from identification.fit.rivals import fit_rivals, weak_fits
from identification.free_friction.contest import contest
from identification.free_friction.evidence import Evidence
from identification.free_friction.result import COEFFICIENTS, SpeedBasis
from identification.laws import find_law
from identification.measurement.pooling import pool

TRUTH = np.array([0.65, 0.35, 15.0])


def test_the_values_of_a_law_are_those_of_weighted_least_squares() -> None:
    """Coulomb+viscous is linear in its parameters: the normal equations are solved by hand."""
    rng, basis = np.random.default_rng(1), SpeedBasis(0.2)
    law, speeds = find_law("Coulomb+viscous"), np.linspace(0, 0.2, 400)
    root = rng.normal(size=(COEFFICIENTS, COEFFICIENTS))
    target = root @ np.sort(rng.uniform(0.3, 0.6, COEFFICIENTS))  # friction rises: no parameter is at its bound
    seen = Evidence(basis, root, target, speeds, 1000).seen(law)
    columns = np.stack([np.linalg.lstsq(basis.weights(speeds), row, rcond=None)[0] for row in (1 + 0 * speeds, speeds)])
    design = root @ columns.T
    values, (misfit,), *_ = np.linalg.lstsq(design, target, rcond=None)
    np.testing.assert_allclose(seen.values, values, rtol=1e-6)
    assert seen.misfit == pytest.approx(misfit, rel=1e-9)
    np.testing.assert_allclose(seen.covariance, np.linalg.inv(design.T @ design), rtol=1e-6)
    assert seen.freedom == COEFFICIENTS - 2


@pytest.mark.nightly
def test_laws_have_on_the_curve_the_values_that_shooting_gives_them() -> None:
    ready = pool(foreign_logs(Bench(lambda speed: 0.3 / (1 + 15 * speed) + 0.35), 3, (0.41, 0.83)))
    estimate = shooting.estimate(ready, find_law("Conti"), Options())
    problem = estimate.problem
    assert isinstance(problem, ShootingProblem)
    laws = {name: find_law(name) for name in ("Conti", "Conti+viscous", "Tustin")}
    weak = weak_fits(ready, laws, Options())
    shot = fit_rivals(estimate, laws, lambda law: weak[law.name].law_values).fitted
    verdict = contest(ready, problem.segments, problem.noise_known, ())
    assert verdict is not None
    curve = by_curve(verdict.evidence, find_law("Conti"), estimate.solution.values[:3])
    assert curve is not None and curve.laws.keys() == {"Conti", "Conti+viscous"}
    for name, seen in curve.laws.items():
        deviation = np.sqrt(np.diag(seen.covariance))
        # the constants of the rig move the curve with them, by what is known of them
        assert np.all(np.abs(seen.values - shot[name].law_values) < deviation)
    samples = len(estimate.solution.evaluation.residual)
    lead = samples * np.log(shot["Conti+viscous"].sum / shot["Conti"].sum) + np.log(samples)
    assert curve.lead["Conti+viscous"] == pytest.approx(lead, abs=1.5)
    conti, other = (verdict.evidence.seen(find_law(name)) for name in ("Conti", "Tustin"))
    assert conti.misfit < 3 * conti.freedom
    assert other.misfit - conti.misfit == pytest.approx(shot["Tustin"].sum - shot["Conti"].sum, rel=0.2)
    assert np.all(np.abs(conti.values - TRUTH) < 3 * np.sqrt(np.diag(conti.covariance)))
