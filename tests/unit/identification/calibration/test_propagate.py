"""Numbers from calibrated parameters, against linear propagation and a motion whose exponents are known."""

from dataclasses import replace

import numpy as np
import pytest
from made_fit import made_fit
from scipy.stats import norm

from fmu_models import StickslipError, Strobe, load, lyapunov
from identification import Calibration, propagate
from identification.calibration.result import CalibratedValue
from identification.fit.parts import Constant
from identification.fit.result import FrictionFit
from identification.inference.identifiability import Collinearity
from identification.model_check.bifurcations import deviations

SPREAD = np.array([[4e-4, 3e-4], [3e-4, 9e-4]])


def uncertain_fit() -> FrictionFit:
    """The constant moves the first two parameters as much as itself."""
    fit, share = made_fit(), 0.02
    parameters = tuple(
        replace(q, standard_deviation=0.01 * q.value, scale_deviation=share * q.value * (q.name != "p"), minimum=0.0)
        for q in fit.parameters
    )
    inertia = Constant("J", 0.0548, "kg*m^2", share * 0.0548, "log", {"mu_s": 1.0, "mu_k": 1.0, "p": None})
    correlation = ((1.0, 0.5, 0.4), (0.5, 1.0, 0.3), (0.4, 0.3, 1.0))
    return replace(fit, parameters=parameters, constants=(inertia,), correlation=correlation)


@pytest.fixture
def calibration() -> Calibration:
    values = zip(("c", "k"), (0.3, 1.0), np.sqrt(np.diag(SPREAD)), strict=True)
    parameters = tuple(CalibratedValue(name, "1", value, float(sd), value) for name, value, sd in values)
    covariance = tuple(tuple(map(float, row)) for row in SPREAD)
    return Calibration(
        *("support", "support", "test", ("log",), parameters, (), covariance, ()),
        *(Collinearity(1.0, {}, {}), (), (), 100, 1.0),
    )


def test_a_linear_number_has_the_interval_of_linear_propagation(calibration):
    found = propagate(calibration, lambda p: 2 * p["c"] - p["k"], draws=4000)
    slope = np.array([2.0, -1.0])
    half = float(norm.ppf(0.975) * np.sqrt(slope @ SPREAD @ slope))
    assert found.value == pytest.approx(-0.4)
    assert found.interval == pytest.approx([-0.4 - half, -0.4 + half], abs=0.1 * half)


def test_a_fitted_law_and_its_rig_vary_together():
    """Against the deviations that follow from differences of whole fits, and the total ones of the fit itself."""
    fit = uncertain_fit()
    found = propagate(fit, lambda p: np.array([p["mu_s"], p["mu_k"], 100 * p["mu_s"] * p["J"] / p["p"]]), draws=8000)
    noise, scale = deviations(fit, lambda f: 100 * f["mu_s"].value * f.constant("J").value / f["p"].value)
    expected = [fit["mu_s"].total_deviation, fit["mu_k"].total_deviation, float(np.hypot(noise, scale))]
    assert found.samples.std(axis=0) == pytest.approx(expected, rel=0.03)
    assert found.value == pytest.approx([0.65, 0.35, 100 * 0.65 * 0.0548 / 15])
    together = np.corrcoef(found.samples[:, :2].T)[0, 1]
    share = [fit[name].scale_deviation / fit[name].total_deviation for name in ("mu_s", "mu_k")]
    assert together == pytest.approx(0.5 * np.sqrt(np.prod(1 - np.square(share))) + np.prod(share), abs=0.03)
    held = replace(fit["p"], standard_deviation=0.0, minimum=15.0, maximum=15.0)
    sure = propagate(replace(fit, parameters=(*fit.parameters[:2], held)), lambda p: p["p"], draws=20)
    assert (sure.samples == 15.0).all()


def test_exponents_of_a_linear_oscillator_follow_its_damping(calibration):
    """Without contact both are -c/(2 m), whatever the stiffness."""
    model = load("discontinuous_support")
    far = {"g": 1e3, "m": 1.0, "f0": 0.5, "omega": 1.0}

    def exponent(values):
        return lyapunov(Strobe(model, forcing="omega", parameters=far | dict(values)), periods=64, transient=8).per_time

    found = propagate(calibration, exponent, draws=24)
    assert found.value.sum() == pytest.approx(-0.3, rel=1e-6)
    assert found.interval.shape == (2, 2)
    width = np.ptp(np.quantile(found.samples.sum(axis=1), (0.16, 0.84)))
    assert width == pytest.approx(2 * np.sqrt(SPREAD[0, 0]), rel=0.5)


def test_what_cannot_be_told_is_refused(calibration):
    def lost(values):
        if values["c"] != 0.3:
            raise StickslipError("lost")
        return 1.0

    with pytest.raises(StickslipError, match="could not be computed"):
        propagate(calibration, lost, draws=20)
    with pytest.raises(StickslipError, match="at least 20"):
        propagate(calibration, lambda p: p["c"], draws=5)
    bare = replace(calibration.parameters[0], standard_deviation=None)
    with pytest.raises(StickslipError, match="do not tell c"):
        propagate(replace(calibration, parameters=(bare, calibration.parameters[1])), lambda p: p["k"])
