"""Profile likelihood: exact on linear problems, one-sided and open where the data bound nothing."""

from __future__ import annotations

import numpy as np
import pytest
from linear_problem import Curve, line, linear

from fmu_models.base.errors import StickslipError
from identification.inference.problem import Prior, Unknown, information, solve
from identification.inference.profile import Interval, profile

pytestmark = pytest.mark.digits


@pytest.mark.parametrize("colour", [1.0, 4.0])
def test_of_a_linear_problem_it_is_the_interval_of_the_covariance(colour: float) -> None:
    design, measured = line(1)
    problem = linear(design, measured)
    found = solve(problem)
    covariance = colour * np.linalg.inv(design.T @ design)
    done = []
    got = profile(problem, found, covariance, ["a", "b"], quantile=1.97, progress=done.append)
    for place, one in enumerate(got.intervals):
        half = 1.97 * np.sqrt(covariance[place, place])
        assert one.sides == "two-sided" and one.kind == "profile"
        assert (one.low, one.high) == pytest.approx((found.values[place] - half, found.values[place] + half), rel=1e-6)
    assert got.lowest == pytest.approx(1, abs=1e-9)
    assert done == pytest.approx([0.25, 0.5, 0.75, 1.0])


def test_priors_belong_to_the_likelihood() -> None:
    # one value 5 +- 1 of a + b, with b known to be 2 +- 3: a = 3 +- sqrt(1 + 9)
    prior = Prior("b", 2.0, "1", 3.0, "test")
    unknowns = (Unknown("a", "1"), Unknown("b", "1", prior=prior))
    problem = linear(np.ones((4, 2)), np.full(4, 5.0), unknowns=unknowns)
    found = solve(problem)
    covariance = np.linalg.inv(information(problem, found.evaluation))
    (one,) = profile(problem, found, covariance, ["a"], quantile=1.0).intervals
    assert one.high == pytest.approx(3 + np.sqrt(1 / 4 + 9), rel=1e-4)


def rising(rate: float) -> Curve:
    """1 - exp(-k t) with one unknown k in [0, 1000], seen at t = 1..5 with noise 0.1."""
    time = np.arange(1.0, 6.0)
    return Curve(
        value=lambda x: 10 * (1 - np.exp(-x[0] * time)),
        slope=lambda x: (10 * time * np.exp(-x[0] * time))[:, None],
        measured=10 * (1 - np.exp(-rate * time)),
        unknowns=(Unknown("k", "1/s", 0.0, 1000.0),),
        begin=np.array([0.5]),
        cluster=np.arange(5),
        log=np.zeros(5, dtype=int),
    )


def test_a_likelihood_that_levels_off_is_open_on_that_side() -> None:
    # any k above some 4 gives the plateau within the noise
    problem = rising(4.0)
    found = solve(problem)
    covariance = np.linalg.inv(information(problem, found.evaluation))
    (one,) = profile(problem, found, covariance, ["k"], quantile=1.96).intervals
    assert one.high is None and one.sides == "lower bound only"
    # 10 exp(-k) summed over t is 1.96 at the end, by hand from the first two values
    assert one.low is not None
    off = 10 * (np.exp(-one.low * np.arange(1, 6)) - np.exp(-4.0 * np.arange(1, 6)))
    assert float(np.sqrt(off @ off)) == pytest.approx(1.96, rel=0.02)


def test_a_flat_direction_is_open_on_both_sides() -> None:
    # only the sum counts: each is unbounded within the bounds of the search
    unknowns = (Unknown("a", "1", -50.0, 50.0), Unknown("b", "1", -50.0, 50.0))
    problem = linear(np.ones((6, 2)), np.zeros(6), unknowns=unknowns)
    found = solve(problem)
    covariance = np.full((2, 2), np.inf)
    (one,) = profile(problem, found, covariance, ["a"], quantile=1.96).intervals
    assert one.low is None and one.high is None and one.sides == "open"


def test_the_coloured_likelihood_of_a_curve_covers_by_its_own_limit() -> None:
    problem = rising(0.3)
    found = solve(problem)
    covariance = 4 * np.linalg.inv(information(problem, found.evaluation))
    (one,) = profile(problem, found, covariance, ["k"], quantile=1.0).intervals
    for end in (one.low, one.high):
        assert end is not None
        residual = problem.evaluate(np.array([end])).residual
        # the sum of squares at the ends is that of the variance ratio
        assert float(residual @ residual) == pytest.approx(4.0, rel=0.03)
    # and the interval is no longer symmetric
    assert one.high is not None and one.low is not None
    assert one.high - found.values[0] > 1.1 * (found.values[0] - one.low)


def test_a_better_fit_on_the_way_is_noticed() -> None:
    # two minima; the search had ended in the worse one
    problem = Curve(
        value=lambda x: np.array([(x[0] ** 2 - 1) * 3, x[0] - 1.0, x[0] * 0 + 1]),
        slope=lambda x: np.array([[6 * x[0]], [1.0], [0.0]]),
        measured=np.zeros(3),
        unknowns=(Unknown("x", "1", -4.0, 4.0),),
        begin=np.array([-1.2]),
        cluster=np.arange(3),
        log=np.zeros(3, dtype=int),
    )
    found = solve(problem)
    assert found.values[0] < 0
    assert profile(problem, found, np.array([[1.0]]), ["x"], quantile=2.0).lowest < 0.9


def test_sides_and_unknown_names() -> None:
    assert Interval("a", 0.95, None, 1.0, "profile").sides == "upper bound only"
    design, measured = line(1)
    problem = linear(design, measured)
    with pytest.raises(StickslipError, match="no unknown 'z'"):
        profile(problem, solve(problem), np.eye(2), ["z"], quantile=2.0)


@pytest.mark.parametrize("side", [-1, 1])
def test_an_end_beyond_which_the_sum_soars_is_found_all_the_same(side: int) -> None:
    """|r| = sinh(3 x)/3 is 3 at the end and 1350 at the first step: a secant that keeps that point stalls."""
    problem = Curve(
        value=lambda x: np.repeat(np.sinh(3 * x) / np.sqrt(18), 2),
        slope=lambda x: np.repeat(np.cosh(3 * x) / np.sqrt(2), 2)[:, None],
        measured=np.zeros(2),
        unknowns=(Unknown("x", "1", -20.0, 20.0),),
        begin=np.array([0.1]),
        cluster=np.arange(2),
        log=np.zeros(2, dtype=int),
    )
    (one,) = profile(problem, solve(problem), np.array([[1.0]]), ["x"], quantile=3.0).intervals
    end = one.low if side < 0 else one.high
    # within a hundredth of the limit of |r|
    assert end is not None and np.sinh(3 * end) / 3 == pytest.approx(3.0 * side, rel=0.011)
