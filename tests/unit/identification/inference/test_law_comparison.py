"""Laws compared: criteria by their formulas, the effective number of observations, held-out folds, the verdict."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Curve, linear

from fmu_models.base.errors import StickslipError
from identification.inference.comparison import Comparing, compare_problems


def polynomials(noise: np.ndarray, curve: float, logs: int = 3, known: bool = False) -> dict[str, Curve]:
    """Constant, line and parabola through 1 + 2 t + curve t^2 + noise (known: of unit variance); as many clusters of
    ten values as they fill."""
    count = len(noise)
    time = np.random.default_rng(9).uniform(-1, 1, count)
    powers = time[:, None] ** np.arange(3)
    measured = powers @ np.array([1.0, 2.0, curve]) + noise
    cluster = np.repeat(np.arange(count // 10), 10)
    log = cluster * logs // (cluster[-1] + 1)
    return {
        name: replace(linear(powers[:, :degree], measured, cluster=cluster, log=log), noise_known=known)
        for degree, name in ((1, "constant"), (2, "line"), (3, "parabola"))
    }


def white(seed: int, count: int = 300) -> np.ndarray:
    return 0.5 * np.random.default_rng(seed).standard_normal(count)


def test_criteria_of_white_residuals_are_the_textbook_ones() -> None:
    problems = polynomials(white(1), 0.0)
    found = compare_problems(problems, ["a", "b", "c"])
    # colour is never less than none
    assert found.effective == pytest.approx(300, rel=0.35) and found.effective <= 300
    n = found.effective
    for one in found.scores:
        design = problems[one.law].slope(np.zeros(3))
        residual = design @ np.linalg.lstsq(design, problems[one.law].measured, rcond=None)[0]
        power = float(np.mean((residual - problems[one.law].measured) ** 2))
        k = design.shape[1] + 1
        assert one.aic == pytest.approx(n * np.log(power) + 2 * k)
        assert one.aicc == pytest.approx(one.aic + 2 * k * (k + 1) / (n - k - 1))
        assert one.bic == pytest.approx(n * np.log(power) + k * np.log(n))


def test_with_known_noise_a_sum_of_squares_is_a_likelihood() -> None:
    problems = polynomials(2 * white(1), 0.0, known=True)
    found = compare_problems(problems, "abc")
    share, sums, counts = found.effective / 300, [], []
    for one in found.scores:
        design = problems[one.law].slope(np.zeros(3))
        left = design @ np.linalg.lstsq(design, problems[one.law].measured, rcond=None)[0] - problems[one.law].measured
        sums.append(float(left @ left))
        counts.append(design.shape[1])
    # of unit variance, or of that which the best law shows where it is more
    variance = max(min(sums) / (300 - counts[int(np.argmin(sums))]), 1.0)
    for one, power, k in zip(found.scores, sums, counts, strict=True):
        assert one.aic == one.aicc == pytest.approx(share * power / variance + 2 * k)
        assert one.bic == pytest.approx(share * power / variance + k * np.log(found.effective))
    weights = np.array([one.weight for one in found.scores])
    assert weights.sum() == pytest.approx(1)
    aic = np.array([one.aic for one in found.scores])
    np.testing.assert_allclose(np.log(weights[:2] / weights[0]), -(aic[:2] - aic[0]) / 2)


def test_nothing_is_sure_above_what_is_not_the_whole_truth() -> None:
    found = compare_problems(polynomials(white(3), 0.6), "abc", options=Comparing(doubts=("Elastic.",)))
    assert found.warnings == ("Elastic.",) and found.verdict.endswith("not the whole truth, see below.")
    assert "Sure" not in found.verdict and "Likely" not in found.verdict


def test_the_true_degree_comes_first_in_nine_of_ten() -> None:
    lines = [compare_problems(polynomials(white(seed), 0.0), "abc").best.law for seed in range(30)]
    curves = [compare_problems(polynomials(white(seed), 0.6), "abc") for seed in range(30)]
    assert lines.count("line") >= 27
    assert [one.best.law for one in curves].count("parabola") == 30
    assert all(one.verdict.endswith("Sure.") for one in curves)
    (nested,) = {compare_problems(polynomials(white(2), 0.0), "abc").verdict.split(". ")[-1]}
    assert "what parabola has more gains nothing" in nested


def test_held_out_logs_are_predicted_by_the_others() -> None:
    problems = polynomials(white(3), 0.6)
    found = compare_problems(problems, "abc")
    line, total = problems["line"], 0.0
    for number in range(3):
        fitted, held = line.log != number, line.log == number
        design = line.slope(np.zeros(2))
        values = np.linalg.lstsq(design[fitted], line.measured[fitted], rcond=None)[0]
        total += float(np.sum((design[held] @ values - line.measured[held]) ** 2))
    best = problems["parabola"]
    full = best.slope(np.zeros(3))
    least = float(np.sum((full @ np.linalg.lstsq(full, best.measured, rcond=None)[0] - best.measured) ** 2))
    score = next(one for one in found.scores if one.law == "line")
    assert score.held_out == pytest.approx(np.sqrt(total / least))
    assert score.worse is not None and score.worse > 2
    assert found.best.worse == 0


def missed(problem: Curve, degree: int) -> np.ndarray:
    """Sum of squares (k,) of each cluster by the polynomial of the other logs."""
    sums = np.zeros(int(problem.cluster.max()) + 1)
    design = problem.slope(np.zeros(degree))
    for number in range(3):
        values = np.linalg.lstsq(design[problem.log != number], problem.measured[problem.log != number], rcond=None)[0]
        held = problem.log == number
        np.add.at(sums, problem.cluster[held], (design[held] @ values - problem.measured[held]) ** 2)
    return sums


@pytest.mark.parametrize("joined, curve", [(False, 2.0), (True, 0.4)])
def test_predictions_are_told_apart_by_their_scatter_from_slip_to_slip(joined: bool, curve: float) -> None:
    line, parabola = (polynomials(white(8, 120), curve)[name] for name in ("line", "parabola"))
    if joined:  # a law that sees two slips as one
        line = replace(line, cluster=np.minimum(line.cluster, 10))
    found = compare_problems({"line": line, "parabola": parabola}, "abc")
    less, more = missed(line, 2), missed(parabola, 3)
    scatter = 11 * np.var(less, ddof=1) + 12 * np.var(more, ddof=1) if joined else 12 * np.var(less - more, ddof=1)
    score = next(one for one in found.scores if one.law != found.best.law)
    sign = 1 if score.law == "line" else -1
    # and the chance of the fits themselves, which makes it less
    assert score.worse == pytest.approx(sign * (less.sum() - more.sum()) / np.sqrt(scatter), rel=0.02)


def test_coloured_residuals_count_less() -> None:
    # values of a cluster that share most of their noise: ten say little more than one
    rng = np.random.default_rng(4)
    noise = np.repeat(rng.standard_normal(60), 10) + 0.2 * rng.standard_normal(600)
    found = compare_problems(polynomials(noise, 0.0), "abc")
    assert found.effective < 350
    assert found.residuals == 600


def test_one_log_alone_is_split_in_halves() -> None:
    assert compare_problems(polynomials(white(5), 0.6, logs=1), "a").best.law == "parabola"


def test_what_cannot_be_compared() -> None:
    problems = polynomials(white(6), 0.0)
    with pytest.raises(StickslipError, match="two laws or more"):
        compare_problems({"line": problems["line"]}, "abc")
    other = polynomials(white(6, 200), 0.0)["line"]
    with pytest.raises(StickslipError, match=r"different numbers of residuals \(200, 300\)"):
        compare_problems({"line": problems["line"], "other": other}, "abc")
    short = polynomials(white(7, 20), 0.0, logs=1)
    with pytest.raises(StickslipError, match="2 slips, too few"):
        compare_problems(short, "a")


def test_a_deviation_that_there_is_not_is_none_in_plain_values() -> None:
    """Two columns that are one: neither parameter is determined."""
    problems = polynomials(white(8), 0.0)
    line = problems["line"]
    columns = line.slope(line.start())[:, [0, 1, 1]]
    made = linear(columns, line.measured, cluster=line.cluster, log=line.log)
    twice = replace(made, noise_known=line.noise_known)
    found = compare_problems({"line": line, "twice": twice}, "abc")
    plain = {one["law"]: one for one in json.loads(json.dumps(found.to_dict(), allow_nan=False))["scores"]}
    assert set(plain["twice"]["deviations"].values()) == {None}
    assert all(sd > 0 for sd in plain["line"]["deviations"].values())
