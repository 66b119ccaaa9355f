"""Levenberg's method against closed forms, and what it costs beside a search that makes a gradient for each step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from identification.inference.levenberg import levenberg
from identification.inference.problem import SOFT, Evaluation, FitProblem, Prior, Unknown, solve

Function = Callable[[np.ndarray], np.ndarray]


@dataclass(eq=False)
class Counted(FitProblem):
    """Residuals of functions, which count how often they are called."""

    function: Function
    slopes: Function
    unknowns: tuple[Unknown, ...]  # type: ignore[override]  # stated for each problem
    noise_known: bool = True  # type: ignore[override]  # likewise
    calls: dict[str, int] = field(default_factory=lambda: {"residual": 0, "evaluate": 0})

    def start(self) -> np.ndarray:
        return np.zeros(len(self.unknowns))

    def residual(self, x: np.ndarray) -> np.ndarray:
        self.calls["residual"] += 1
        return self.function(x)

    def evaluate(self, x: np.ndarray) -> Evaluation:
        self.calls["evaluate"] += 1
        rows = self.function(x)
        log = np.zeros(len(rows), dtype=int)
        return Evaluation(rows, self.slopes(x), log, log, np.full(len(rows), np.nan))

    def resampled(self, clusters: np.ndarray) -> FitProblem:
        raise NotImplementedError


def unknowns(*bounds: tuple[float, float]) -> tuple[Unknown, ...]:
    return tuple(Unknown(f"x{place}", "", *ends) for place, ends in enumerate(bounds))


FREE = (-np.inf, np.inf)


def line(*bounds: tuple[float, float], outlier: float = 0.0) -> Counted:
    """y = 1 + 2 t at 21 points."""
    t = np.linspace(-1, 1, 21)
    terms = np.column_stack([np.ones(21), t])
    y = 1 + 2 * t
    y[3] += outlier
    return Counted(lambda x: terms @ x - y, lambda x: terms, unknowns(*bounds))


def valley(*bounds: tuple[float, float]) -> Counted:
    """Rosenbrock's, bent a hundred times as much as it is wide."""
    return Counted(
        lambda x: np.array([100 * (x[1] - x[0] ** 2), 1 - x[0], 0.0]),
        lambda x: np.array([[-200 * x[0], 100.0], [-1.0, 0.0], [0.0, 0.0]]),
        unknowns(*bounds),
    )


def test_a_line_is_found_exactly():
    found = levenberg(line(FREE, FREE), np.array([40.0, -30.0]), tolerance=1e-12, evaluations=20)
    assert found.values == pytest.approx([1, 2], abs=1e-12)
    assert found.converged and found.evaluation.sum < 1e-20


def test_bounds_hold_and_the_others_answer():
    """The offset ends on .5; the slope is its least-squares value all the same, to the root of the tolerance, since the
    columns are orthogonal."""
    found = levenberg(line((0.0, 0.5), (-5.0, 5.0)), np.array([0.2, -3.0]), tolerance=1e-12, evaluations=20)
    assert found.values == pytest.approx([0.5, 2.0], abs=1e-7)
    assert found.at_bound == (True, False)


def test_a_valley_against_a_bound():
    """Of (1 - x)^2 with y = x^2 and y <= .25: x = .5."""
    found = levenberg(valley(FREE, (-3.0, 0.25)), np.array([-1.2, 0.2]), tolerance=1e-10, evaluations=100)
    assert found.values == pytest.approx([0.5, 0.25], abs=1e-3)


def test_a_valley_costs_fewer_gradients_than_a_trust_region():
    problem, other = valley(FREE, FREE), valley(FREE, FREE)
    found = levenberg(problem, np.array([-1.2, 1.0]), tolerance=1e-10, evaluations=100)
    solve(other, np.array([-1.2, 1.0]), tolerance=1e-10)
    assert found.values == pytest.approx([1, 1], abs=1e-6)
    assert problem.calls["evaluate"] < other.calls["evaluate"]


def test_a_prior_counts_as_a_row():
    """Mean of 21 rows of deviation 1 and of a prior of deviation 1/sqrt(21): half way, to the root of rounding."""
    problem = line(FREE, FREE)
    prior = Prior("x0", 3.0, "", float(1 / np.sqrt(21)), "test")
    problem.unknowns = (Unknown("x0", "", prior=prior), problem.unknowns[1])
    found = levenberg(problem, np.zeros(2), tolerance=1e-12, evaluations=20)
    assert found.values == pytest.approx([2.0, 2.0], abs=1e-8)


def test_an_outlier_pulls_as_its_soft_loss_says():
    """At the minimum of Cauchy's loss the weighed residuals are orthogonal to the columns."""
    problem = line(FREE, FREE, outlier=300.0)
    found = levenberg(problem, np.array([4.0, 0.0]), tolerance=1e-14, evaluations=100, loss="cauchy")
    rows = problem.function(found.values)
    weighed = rows / (1 + (rows / SOFT) ** 2)
    assert problem.slopes(found.values).T @ weighed == pytest.approx([0, 0], abs=1e-5)
    assert found.values == pytest.approx([1, 2], abs=0.05)


def test_steps_to_where_nothing_can_be_computed_are_not_made():
    """log(x) = 0 from x = 8, whose first full step leads below zero."""
    problem = Counted(
        lambda x: np.array([np.log(x[0]) if x[0] > 0 else np.inf, 0.0]),
        lambda x: np.array([[1 / x[0]], [0.0]]),
        unknowns(FREE),
    )
    found = levenberg(problem, np.array([8.0]), tolerance=1e-12, evaluations=50)
    assert found.values == pytest.approx([1.0], abs=1e-9)


def test_it_ends_after_as_many_gradients_as_allowed():
    problem = valley(FREE, FREE)
    found = levenberg(problem, np.array([-1.2, 1.0]), tolerance=1e-10, evaluations=3)
    assert problem.calls["evaluate"] == 3 and not found.converged


class Coarse(Counted):
    """Whose residuals are larger where their gradient is made too, after the first time."""

    def evaluate(self, x: np.ndarray) -> Evaluation:
        here = super().evaluate(x)
        if self.calls["evaluate"] > 100:
            raise RuntimeError("goes on for ever")
        return replace(here, residual=here.residual * (1.5 if self.calls["evaluate"] > 1 else 1.0))


def test_a_loss_that_is_lower_without_its_gradient_alone_ends_the_search():
    unknowns = (Unknown("x", "1"),)
    problem = Coarse(lambda x: np.array([x[0] - 1.0, x[0] + 1.0]), lambda x: np.ones((2, 1)), unknowns)
    found = levenberg(problem, np.array([0.5]), tolerance=1e-9, evaluations=200)
    assert found.values[0] == 0.5 and problem.calls["evaluate"] < 20
