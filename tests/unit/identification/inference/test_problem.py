"""Least squares with priors, fixed unknowns and bounds, on a linear problem whose answer is known."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.inference.problem import Evaluation, FitProblem, Prior, Solution, Unknown, information, solve

pytestmark = pytest.mark.digits

RNG = np.random.default_rng(4)
DESIGN = RNG.standard_normal((60, 3))
VALUES = DESIGN @ [1.0, -2.0, 0.5] + 0.1 * RNG.standard_normal(60)
PLAIN = (Unknown("a", "1"), Unknown("b", "1"), Unknown("c/d", "1"))


@dataclass(frozen=True, eq=False)
class Line(FitProblem):
    """residual = DESIGN x - VALUES, in clusters of ten."""

    unknowns: tuple[Unknown, ...] = PLAIN
    noise_known: bool = False
    rows: np.ndarray = field(default_factory=lambda: np.arange(60))

    def start(self) -> np.ndarray:
        return np.zeros(3)

    def evaluate(self, x: np.ndarray) -> Evaluation:
        residual = DESIGN[self.rows] @ x - VALUES[self.rows]
        slip = np.full(len(self.rows), np.nan)
        return Evaluation(residual, DESIGN[self.rows], self.rows // 10, np.zeros(len(self.rows)), slip)

    def resampled(self, clusters: np.ndarray) -> Line:
        return replace(self, rows=np.concatenate([np.flatnonzero(self.rows // 10 == c) for c in clusters]))


def with_prior(value: float, deviation: float) -> Line:
    known = Unknown("b", "1", prior=Prior("b", value, "1", deviation, "a test"))
    return Line((PLAIN[0], known, PLAIN[2]))


def test_a_linear_problem_is_solved() -> None:
    found = solve(Line())
    np.testing.assert_allclose(found.values, np.linalg.lstsq(DESIGN, VALUES, rcond=None)[0], rtol=1e-9)
    assert found.converged and not any(found.at_bound)


def test_a_prior_is_one_more_row() -> None:
    problem = with_prior(3.0, 0.05)
    design = np.vstack([DESIGN, [0, 20.0, 0]])
    found = solve(problem)
    np.testing.assert_allclose(found.values, np.linalg.lstsq(design, np.append(VALUES, 60.0), rcond=None)[0], rtol=1e-9)
    # the evaluation holds the data alone, the information both
    assert len(found.evaluation.residual) == 60
    np.testing.assert_allclose(information(problem, found.evaluation), design.T @ design, rtol=1e-12)


def test_what_is_fixed_stays_and_the_others_answer() -> None:
    found = solve(with_prior(3.0, 0.05), fixed={"b": -1.5})
    rest = np.linalg.lstsq(DESIGN[:, [0, 2]], VALUES + 1.5 * DESIGN[:, 1], rcond=None)[0]
    np.testing.assert_allclose(found.values, [rest[0], -1.5, rest[1]], rtol=1e-9)
    assert found.fixed == ("b",)
    assert solve(Line(), fixed={"a": 1.0, "b": 2.0, "c/d": 3.0}).values.tolist() == [1.0, 2.0, 3.0]


def test_a_bound_holds_and_is_told() -> None:
    bounded = Line((PLAIN[0], Unknown("b", "1", minimum=-1.0, maximum=5.0), PLAIN[2]))
    found = solve(bounded)
    assert found.values[1] == pytest.approx(-1.0, abs=1e-6)
    assert found.at_bound == (False, True, False)


def test_progress_is_called_and_may_end_the_search() -> None:
    seen: list[tuple[int, float]] = []
    solve(Line(), progress=lambda count, cost: seen.append((count, cost)))
    assert [count for count, _ in seen] == list(range(1, len(seen) + 1))
    assert seen[-1][1] == pytest.approx(min(cost for _, cost in seen))

    def stop(count: int, cost: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve(Line(), progress=stop)


def test_a_step_to_where_the_model_fails_is_taken_back() -> None:
    @dataclass(frozen=True, eq=False)
    class Fenced(Line):
        """residual = atan(a - 10): from a = 13 the full step overshoots to 0.5, where there is no model."""

        unknowns: tuple[Unknown, ...] = PLAIN[:1]
        refuses: bool = False

        def evaluate(self, x: np.ndarray) -> Evaluation:
            fenced = np.inf if abs(x[0] - 10) > 3.5 else 0.0
            if fenced and self.refuses:
                raise StickslipError("There is no model.")
            residual = np.array([np.arctan(x[0] - 10) + fenced, 0.0])
            gradient = np.array([[1 / (1 + (x[0] - 10) ** 2)], [0.0]])
            return Evaluation(residual, gradient, np.zeros(2), np.zeros(2), np.full(2, np.nan))

    for refuses in (False, True):
        assert solve(Fenced(refuses=refuses), np.array([13.0])).values == pytest.approx([10.0], abs=1e-9)
    with pytest.raises(StickslipError, match="no model"):
        solve(Fenced(refuses=True), np.array([14.0]))


def test_unknown_names_and_too_few_rows_are_refused() -> None:
    with pytest.raises(StickslipError, match="no unknown 'c'"):
        solve(Line(), fixed={"c": 1.0})
    with pytest.raises(StickslipError, match="3 values cannot determine the 3 unknowns a, b, c/d"):
        solve(replace(Line(), rows=np.arange(3)))


def test_a_drawn_cluster_counts_as_often_as_it_is_drawn() -> None:
    found: Solution = solve(Line().resampled(np.array([0, 0, 3, 5])))
    rows = np.concatenate([np.arange(10), np.arange(10), np.arange(30, 40), np.arange(50, 60)])
    np.testing.assert_allclose(found.values, np.linalg.lstsq(DESIGN[rows], VALUES[rows], rcond=None)[0], rtol=1e-9)
