"""What is inferred from a solution: the covariances asked for, the bound, open ends in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Curve, line, linear

from fmu_models.base.errors import StickslipError
from identification.inference.choice import Inference, infer
from identification.inference.problem import Prior, Unknown, solve

pytestmark = pytest.mark.digits


def coloured_mean(colour: float, count: int = 4000) -> Curve:
    """A mean of autoregressive values in 40 clusters."""
    rng = np.random.default_rng(5)
    values, value = [], 0.0
    for kick in rng.standard_normal(count) * np.sqrt(1 - colour**2):
        value = colour * value + kick
        values.append(value)
    return linear(np.ones((count, 1)), np.array(values), cluster=np.repeat(np.arange(40), count // 40))


@pytest.mark.parametrize("covariance", ["jackknife", "hac", "bootstrap"])
def test_every_covariance_finds_the_inflation_by_colour(covariance: str) -> None:
    problem = coloured_mean(0.7)
    found = infer(problem, solve(problem), Inference(covariance, draws=300), count=1, logs=["a"])
    # variance of a mean of AR(1) values of unit variance: (1 + a)/(1 - a)/n; 40 clusters know it to 22 %
    assert found.covariance[0, 0] == pytest.approx(1.7 / 0.3 / 4000, rel=0.4)
    # which the bound, of white residuals of unit variance, does not know
    assert found.bound is not None and found.bound[0, 0] == pytest.approx(1 / 4000)


@pytest.mark.parametrize("covariance", ["jackknife", "hac", "bootstrap"])
def test_priors_pass_on_their_uncertainty(covariance: str) -> None:
    prior = Prior("b", 1.0, "1", 0.5, "test")
    unknowns = (Unknown("a", "1"), Unknown("b", "1", prior=prior))
    cluster = np.repeat(np.arange(30), 3)
    measured = 0.01 * np.random.default_rng(1).standard_normal(90)
    problem = linear(np.ones((90, 2)), measured, cluster=cluster, unknowns=unknowns)
    found = infer(problem, solve(problem), Inference(covariance, draws=300), count=1, logs=["a"])
    assert np.sqrt(found.covariance[0, 0]) == pytest.approx(0.5, rel=0.2)


def test_the_bound_is_the_inverse_information_and_absent_where_noise_is_unknown() -> None:
    design, measured = line(3)
    problem = linear(design, measured)
    found = infer(problem, solve(problem), Inference(), count=2, logs=["a"])
    assert found.bound is not None
    np.testing.assert_allclose(found.bound, np.linalg.inv(design.T @ design))
    # white residuals of unit variance: the jackknife is efficient, to what 200 values know of it
    assert np.diag(found.bound) / np.diag(found.covariance) == pytest.approx([1, 1], rel=0.3)
    unknown = replace(problem, noise_known=False)
    assert infer(unknown, solve(unknown), Inference(), count=2, logs=["a"]).bound is None


def test_instruments_add_and_widen_the_profile() -> None:
    design, measured = line(4)
    problem = linear(design, measured)
    extra = np.diag([0.04, 0.0])
    plain = infer(problem, solve(problem), Inference(profile=True), count=2, logs=["a"])
    wide = infer(problem, solve(problem), Inference(profile=True), count=2, logs=["a"], instruments=extra)
    np.testing.assert_allclose(wide.covariance, plain.covariance + extra)
    for one, place in zip(wide.intervals, range(2), strict=True):
        assert one.high is not None and one.low is not None
        # Student's quantile of 198 degrees of freedom
        assert one.high - one.low == pytest.approx(2 * 1.972 * np.sqrt(wide.covariance[place, place]), rel=1e-3)


def test_an_open_end_is_a_result_with_a_word_of_advice() -> None:
    time = np.arange(1.0, 6.0).repeat(4)
    problem = Curve(
        value=lambda x: 10 * (1 - np.exp(-x[0] * time)),
        slope=lambda x: (10 * time * np.exp(-x[0] * time))[:, None],
        measured=10 * (1 - np.exp(-4.0 * time)) + np.tile([0.5, -0.5], 10),
        unknowns=(Unknown("k", "1/s", 0.0, 1e4),),
        begin=np.array([2.0]),
        cluster=np.arange(20),
        log=np.zeros(20, dtype=int),
    )
    found = infer(problem, solve(problem), Inference(profile=True), count=1, logs=["a"])
    (one,) = found.intervals
    assert one.high is None and one.low is not None
    assert any("do not bound k from above" in said and "stickslip design" in said for said in found.warnings)


def test_what_cannot_be_asked_for() -> None:
    with pytest.raises(StickslipError, match=r"no covariance 'jacknife'\. Did you mean 'jackknife'"):
        Inference("jacknife")
    with pytest.raises(StickslipError, match="20 or more"):
        Inference("bootstrap", draws=3)
