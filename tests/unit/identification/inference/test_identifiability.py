"""Collinearity: closed form for two columns at an angle, priors projected out, the direction in words."""

from __future__ import annotations

import numpy as np
import pytest
from linear_problem import linear

from identification.inference.identifiability import collinearity, of_gradient
from identification.inference.problem import Prior, Unknown, information, solve

pytestmark = pytest.mark.digits


def columns(cosine: float) -> np.ndarray:
    """Two columns of lengths 2 and 5 at an angle."""
    return np.array([[2.0, 5 * cosine], [0.0, 5 * np.sqrt(1 - cosine**2)], [0.0, 0.0]])


@pytest.mark.parametrize("cosine", [0.0, 0.9, -0.999])
def test_index_of_two_columns(cosine: float) -> None:
    made = columns(cosine)
    covariance = np.linalg.inv(made.T @ made)
    found = of_gradient(made, ["a", "b"], np.array([1.0, 1.0]), covariance)
    # the smaller eigenvalue of [[1, c], [c, 1]] is 1 - |c|
    assert found.index == pytest.approx(1 / np.sqrt(1 - abs(cosine)))
    assert found.poor == (cosine == -0.999)


def test_the_direction_is_a_move_of_one_standard_deviation() -> None:
    made = columns(0.9999)
    covariance = np.linalg.inv(made.T @ made)
    found = of_gradient(made, ["mu_k", "p"], np.array([0.35, 15.0]), covariance)
    # equal and opposite effects, 2 da = -5 db, as far as one standard deviation reaches
    move = np.array([found.direction["mu_k"], found.direction["p"]])
    assert move[0] / move[1] == pytest.approx(-5 / 2)
    assert np.linalg.norm(made @ move) == pytest.approx(1, rel=1e-6)
    assert found.percent == pytest.approx({"mu_k": 100 * move[0] / 0.35, "p": 100 * move[1] / 15})
    assert "mu_k up by" in found.words and "with p down" in found.words
    assert "cannot be told apart" in found.words and "stickslip design" in found.warnings[0]
    sharp = of_gradient(1e4 * made, ["mu_k", "p"], np.array([0.35, 15.0]), 1e-8 * covariance)
    assert sharp.words.startswith("mu_k up 1 % with p down")
    assert "logs see least" in sharp.words and sharp.warnings == ()


def test_a_parameter_without_any_effect_is_named_alone() -> None:
    made = np.array([[1.0, 0.0], [2.0, 0.0]])
    found = of_gradient(made, ["a", "b"], np.ones(2), np.diag([0.2, 1e12]))
    assert found.index >= 1e6 and list(found.direction) == ["b"]
    assert "b up by 1e+06 cannot be told apart" in found.words


def test_a_parameter_that_may_be_zero_is_told_in_its_unit() -> None:
    made = columns(0.9999)
    found = of_gradient(made, ["p", "mu_v"], np.array([15.0, 1e-6]), np.linalg.inv(made.T @ made))
    assert "mu_v up by " in found.words and "p down" in found.words and found.warnings


def test_what_a_prior_holds_does_not_count_against_the_law() -> None:
    design = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]])
    for sd, index in ((1e-6, 1.0), (1e6, 1.36)):
        held = Unknown("J", "1", prior=Prior("J", 0.0, "1", sd, "test"))
        unknowns = (Unknown("a", "1"), Unknown("b", "1"), held)
        problem = linear(design, np.array([1.0, 2.0, 3.0, -1.0]), unknowns=unknowns)
        found = solve(problem)
        covariance = np.linalg.inv(information(problem, found.evaluation))
        # held fast: columns of a and b, at right angles; left free: what remains of them beside J
        beside = design[:, :2] - np.outer(design[:, 2], design[:, 2] @ design[:, :2]) / 2
        scaled = beside / np.linalg.norm(beside, axis=0) if sd > 1 else design[:, :2] / np.sqrt(3)
        expected = 1 / np.linalg.svd(scaled, compute_uv=False)[-1]
        assert collinearity(problem, found, covariance).index == pytest.approx(expected, rel=1e-5)
        assert (expected > 1.01) == (index > 1.01)
