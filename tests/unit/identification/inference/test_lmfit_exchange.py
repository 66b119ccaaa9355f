"""lmfit in and out: bounds and held parameters in every estimator, and fits that go on in lmfit."""

from __future__ import annotations

from typing import Any

import lmfit
import numpy as np
import pytest
from linear_problem import Curve, line, linear
from machine_log import log_of, recipe_of
from recipe_fit import inverse_dynamics
from short_bench import bench
from some_nightly import some_nightly

from fmu_models.base.errors import StickslipError
from identification.estimators import ESTIMATORS
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.inference.lmfit_exchange import Solved, given
from identification.inference.problem import information, solve
from identification.inference.profile import profile
from identification.inference.uncertainty import student
from identification.measurement.pooled import Pool
from identification.measurement.recipe import read_recipe
from identification.next_step.design import design
from rig_io.bench.emulation import MicroSlip


@pytest.fixture(scope="module")
def rigid() -> Pool:
    return bench(None)


@pytest.fixture(scope="module")
def elastic() -> Pool:
    return bench(MicroSlip(2e4))


def asked(*said: tuple[str, float, bool, float, float]) -> lmfit.Parameters:
    parameters = lmfit.Parameters()
    for name, value, vary, low, high in said:
        parameters.add(name, value=value, vary=vary, min=low, max=high)
    return parameters


@pytest.mark.parametrize("estimator", some_nightly(ESTIMATORS.members(), ("savitzky-golay", "shooting", "weak-form")))
def test_a_parameter_that_is_held_stays_and_bounds_are_kept(estimator: str, request) -> None:
    ready = request.getfixturevalue("elastic" if estimator == "lugre" else "rigid")
    free = fit_friction(ready, estimator=estimator)
    wanted = asked(("p", 15.0, False, -np.inf, np.inf), ("mu_k", 0.345, True, 0.3, 0.36))
    fit = fit_friction(ready, estimator=estimator, parameters=wanted)
    assert fit.estimator == free.estimator == estimator
    assert fit["p"].value == 15.0 and fit["p"].held and fit["p"].standard_deviation == 0
    assert "p held at 15 s/m" in fit.structure
    assert 0.3 <= fit["mu_k"].value <= 0.36 and fit["mu_k"].maximum == 0.36
    # with one parameter known the others are known better
    assert 0 < fit["mu_k"].standard_deviation < free["mu_k"].standard_deviation or fit["mu_k"].at_bound
    assert fit["mu_s"].value != free["mu_s"].value
    row = fit.correlation[[q.name for q in fit.parameters].index("p")]
    assert sorted(row) == [0.0] * (len(row) - 1) + [1.0]
    assert FrictionFit.from_json(fit.to_json()) == fit
    narrow = asked(("mu_k", 0.41, True, 0.4, 0.42))
    other = fit_friction(ready, estimator=estimator, parameters=narrow)
    assert 0.4 <= other["mu_k"].value < 0.4001 and other["mu_k"].at_bound


@pytest.mark.nightly_for("weak-form")
@pytest.mark.parametrize("estimator", ["weak-form", "shooting"])
def test_a_fit_goes_on_in_lmfit(estimator: str, rigid: Pool) -> None:
    fit = fit_friction(rigid, estimator=estimator)
    minimizer, result = fit.to_lmfit()
    for q in fit.parameters:
        assert result.params[q.name].value == pytest.approx(q.value, rel=1e-4)
        assert result.params[q.name].stderr == pytest.approx(q.standard_deviation)
    assert "mu_s" in lmfit.fit_report(result) and result.covar.shape == (result.nvarys,) * 2
    again: Any = minimizer.minimize(method="least_squares")
    assert again.params["p"].value == pytest.approx(fit["p"].value, rel=1e-4)
    with pytest.raises(StickslipError, match="Fit the logs again"):
        FrictionFit.from_json(fit.to_json()).to_lmfit()


@pytest.mark.nightly
def test_a_parameter_held_in_the_fit_is_held_in_lmfit(rigid: Pool) -> None:
    fit = fit_friction(rigid, estimator="weak-form", parameters=asked(("p", 12.0, False, 0, 20)))
    _, result = fit.to_lmfit()
    assert result.var_names == ["mu_s", "mu_k"] and result.params["p"].value == 12.0
    # and known to a design
    assert list(design(fit, speeds=[0.83], loads=[4.905]).deviations) == ["mu_s", "mu_k"]


def decay(seed: int) -> Curve:
    """a exp(-b t) with noise of unknown size, 60 values: its intervals are not symmetric."""
    time = np.linspace(0, 3, 60)
    measured = 2 * np.exp(-1.5 * time) + 0.2 * np.random.default_rng(seed).standard_normal(60)
    made = linear(np.ones((60, 2)), measured)
    return Curve(
        value=lambda x: x[0] * np.exp(-x[1] * time),
        slope=lambda x: np.stack([np.exp(-x[1] * time), -x[0] * time * np.exp(-x[1] * time)], axis=1),
        measured=measured,
        unknowns=made.unknowns,
        begin=np.array([1.0, 1.0]),
        cluster=made.cluster,
        log=made.log,
        noise_known=False,
    )


def test_confidence_intervals_of_lmfit_are_our_profiles() -> None:
    problem = decay(1)
    found = solve(problem)
    residual = found.evaluation.residual
    covariance = np.linalg.inv(information(problem, found.evaluation)) * (residual @ residual) / 58
    ours = profile(problem, found, covariance, ["a", "b"], quantile=student(58, 0.95)).intervals
    theirs: Any = lmfit.conf_interval(*Solved(problem, found, covariance).to_lmfit(), sigmas=[0.95])
    for one in ours:
        (_, low), (_, best), (_, high) = theirs[one.name]
        # both search for the ends, ours to 1 % of the half-width
        assert (one.low, one.high) == pytest.approx((low, high), abs=0.02 * (high - low))
        assert best == pytest.approx(found.values[["a", "b"].index(one.name)])


def test_emcee_samples_the_same_problem() -> None:
    pytest.importorskip("emcee", reason="emcee is an extra of lmfit")
    design, measured = line(3)
    problem = linear(design, measured)
    found = solve(problem)
    covariance = np.linalg.inv(information(problem, found.evaluation))
    minimizer, result = Solved(problem, found, covariance).to_lmfit()
    drawn = minimizer.emcee(params=result.params, steps=400, burn=100, nwalkers=20, seed=1, progress=False)
    np.testing.assert_allclose(drawn.flatchain.mean(), found.values, atol=0.03)
    np.testing.assert_allclose(drawn.flatchain.std(), np.sqrt(np.diag(covariance)), rtol=0.2)


def test_machines_take_and_give_lmfit_too(tmp_path) -> None:
    recipe = read_recipe(recipe_of(tmp_path))
    log = log_of(tmp_path, noise=np.random.default_rng(1).normal(size=10_000))
    wanted = asked(("Fc", 2.5, False, -np.inf, np.inf), ("offset", 0.0, True, -0.3, 0.3))
    run = inverse_dynamics(recipe, log, parameters=wanted)
    found = {one.name: one for one in run.parameters}
    assert found["Fc"].value == 2.5 and found["Fc"].standard_deviation == 0
    assert found["offset"].value == pytest.approx(-0.3, abs=1e-6)
    said = " ".join(run.verdicts)
    assert "Fc was held at 2.5 N" in said and "offset = -0.3 N lies on a bound" in said
    _, result = run.to_lmfit()
    assert result.var_names == ["M", "Fv", "offset"]
    assert result.params["M"].stderr == pytest.approx(found["M"].standard_deviation)


def test_what_cannot_be_asked_for_is_said(rigid: Pool) -> None:
    with pytest.raises(StickslipError, match=r"no unknown 'mu_z'.* Did you mean 'mu_s'"):
        fit_friction(rigid, parameters=asked(("mu_z", 0.5, True, 0, 1)))
    with pytest.raises(StickslipError, match="bounds of 'mu_s' leave nothing"):
        fit_friction(rigid, parameters=asked(("mu_s", 12.0, True, 11, 13)))
    tied = asked(("mu_k", 0.4, True, 0, 1))
    tied.add("mu_s", expr="2*mu_k")
    with pytest.raises(StickslipError, match=r"expression '2\*mu_k'"):
        given(tied)
    with pytest.raises(StickslipError, match=r"held .* without a value"):
        given(asked(("p", -np.inf, False, -np.inf, np.inf)))
