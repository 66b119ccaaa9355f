"""Newton's method from many guesses: what converges, what is lost, and what damping adds."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.sections.newton import newton


def circle_and_line(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x^2 + y^2 = 2 and x = y: solutions (1, 1) and (-1, -1); the derivative is singular at x = -y."""
    x, y = points.T
    slopes = np.stack([np.stack([2 * x, 2 * y], axis=1), np.stack([np.ones_like(x), -np.ones_like(x)], axis=1)], axis=1)
    return np.stack([x**2 + y**2 - 2, x - y], axis=1), slopes


def arctangent(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.arctan(points), (1 / (1 + points**2))[:, :, None]


def test_every_guess_finds_its_solution_to_rounding_and_lost_ones_are_left_out() -> None:
    guesses = np.array([[3.0, 1.0], [-0.2, -5.0], [1.0, -1.0], [np.nan, 0.0]])
    found = newton(circle_and_line, guesses, accuracy=1e-9, until_settled=True)
    np.testing.assert_allclose(found.points, [[1, 1], [-1, -1]], atol=1e-15)
    assert found.converged.all() and (found.misses < 1e-15).all()


def test_what_did_not_converge_says_so() -> None:
    found = newton(circle_and_line, np.array([[3.0, 1.0], [1.0, 1.0]]), accuracy=1e-9, steps=2)
    assert found.converged.tolist() == [False, True]
    assert (
        found.misses[0] == pytest.approx(np.abs(circle_and_line(found.points[:1])[0]).max()) and found.misses[0] > 1e-9
    )


def test_damping_brings_back_what_whole_steps_throw_away() -> None:
    """Whole steps for atan x = 0 diverge beyond |x| = 1.3917, where 2 x = (1 + x^2) atan x."""
    guesses = np.array([[1.3], [1.5], [3.0]])
    assert len(newton(arctangent, guesses, accuracy=1e-12).points) == 1
    damped = newton(arctangent, guesses, accuracy=1e-12, halvings=4)
    assert damped.converged.tolist() == [True, True, True]
    np.testing.assert_allclose(damped.points, 0, atol=1e-12)


def test_a_double_root_that_is_exact_stays_although_the_derivative_is_singular() -> None:
    def square(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return points**2, 2 * points[:, :, None]

    found = newton(square, np.array([[0.0]]), accuracy=1e-9, until_settled=True)
    assert found.converged.tolist() == [True] and found.points[0, 0] == 0


def test_equations_without_a_value_are_no_solution() -> None:
    def root(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """sqrt(x) + 1 has no zero; steps lead below 0, where it has no value."""
        return np.sqrt(points) + 1, 0.5 / np.sqrt(points)[:, :, None]

    assert not newton(root, np.array([[4.0]]), accuracy=1e-9, halvings=2).converged.any()
