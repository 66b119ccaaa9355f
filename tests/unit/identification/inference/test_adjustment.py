"""Adjustment of constants in closed form: two readings and an exact ratio, contradictions, constants nobody knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import linear

from identification.inference.adjustment import ConstantReading, Pull, adjusted, contradiction, pull, widened

pytestmark = pytest.mark.digits

NAMES = ("J", "k", "c")
AT = np.array([1.0, 48.0, 1.0])
READINGS = (
    ConstantReading("J", {"J": 1}, 1.0, 0.006),
    ConstantReading("k", {"k": 1}, 48.0, 0.008),
    ConstantReading("c", {"c": 1}, 1.0, 0.02),
)


def ratio(off: float, deviation: float = 1e-6) -> Pull:
    """Residuals that ask for ln(k/J) larger by ``off``."""
    slope = np.array([-1.0, 1.0, 0.0])
    information = np.outer(slope, slope) / deviation**2
    return Pull(information, -slope * off / deviation**2, information)


def test_an_exact_ratio_shares_its_error_by_the_deviations() -> None:
    found = adjusted(NAMES, AT, READINGS, ratio(0.01))
    # J down and k up by shares of the variances 36 and 64
    assert found.step == pytest.approx([-0.0036, 0.0064, 0.0], abs=1e-7)
    sd = 0.006 * 0.008 / 0.01
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx([sd, sd, 0.02], rel=1e-6)
    assert found.covariance[0, 1] == pytest.approx(sd**2, rel=1e-6)
    assert contradiction(NAMES, AT, READINGS, ratio(0.01)) is None


def test_a_ratio_as_a_reading_says_the_same_as_one_of_residuals() -> None:
    tied = (*READINGS, ConstantReading("k/J", {"k": 1, "J": -1}, 48.0 * np.exp(0.01), 1e-6))
    by_reading, by_residuals = (adjusted(NAMES, AT, READINGS, ratio(0.01)), adjusted(NAMES, AT, tied, Pull.nothing(3)))
    assert by_reading.step == pytest.approx(by_residuals.step, rel=1e-4)
    assert by_reading.covariance == pytest.approx(by_residuals.covariance, rel=1e-4)


def test_two_readings_that_cannot_be_told_apart_contradict_together() -> None:
    found = contradiction(NAMES, AT, READINGS, ratio(0.05))
    assert found is not None and found.names == ("J", "k")
    assert found.deviations == pytest.approx(5.0, rel=1e-4)
    assert found.others == pytest.approx([np.exp(-0.05), 48.0 * np.exp(0.05)], rel=1e-5)
    # each five times less sure: no contradiction is left, and either is within two deviations
    less = widened(READINGS, found)
    assert contradiction(NAMES, AT, less, ratio(0.05)) is None
    after = adjusted(NAMES, AT, less, ratio(0.05))
    assert np.sqrt(after.covariance[0, 0]) == pytest.approx(5 * 0.0048, rel=1e-4)


def test_a_reading_that_nothing_else_tells_of_contradicts_nothing() -> None:
    lonely = (*READINGS[:2], replace(READINGS[2], value=2.0))
    assert contradiction(NAMES, AT, lonely, ratio(0.0)) is None


def test_coloured_residuals_are_less_sure() -> None:
    one = ratio(0.0, 0.005)
    loud = replace(one, spread=4 * one.spread)
    plain, coloured = (adjusted(NAMES, AT, READINGS, said).covariance[0, 0] for said in (one, loud))
    # gain of J on the ratio, 36/125, times its deviation, .005 or twice that
    assert coloured - plain == pytest.approx((36 / 125) ** 2 * 3 * 0.005**2, rel=1e-9)


def test_a_constant_of_which_nobody_says_how_well_it_is_known_stays_and_tells_the_others_nothing() -> None:
    nobody = (READINGS[0], replace(READINGS[1], stated=False, deviation=0.3), READINGS[2])
    found = adjusted(NAMES, AT, nobody, ratio(0.05))
    assert found.step[1] == 0 and abs(found.step[0]) < 1e-4
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx([0.006, 0, 0.02], rel=1e-3)
    assert contradiction(NAMES, AT, nobody, ratio(0.05)) is None


def test_white_residuals_pull_by_what_the_fit_leaves_of_their_columns() -> None:
    count = 400
    chance = np.random.default_rng(3)
    design, columns = chance.standard_normal((count, 2)), chance.standard_normal((count, 3))
    noise = chance.standard_normal(count)
    problem, x = linear(design, noise), np.array([0.3, -0.2])
    here = problem.evaluate(x)
    said, moved, follows = pull(problem, x, here, columns, np.zeros((count, 0)), np.zeros((0, 0)))
    # least squares of each column and of the residuals by the design
    best, taken = (np.linalg.lstsq(design, part, rcond=None)[0] for part in (here.residual, columns))
    rest, left = here.residual - design @ best, columns - design @ taken
    assert moved == pytest.approx(-best, rel=1e-9) and follows == pytest.approx(-taken, rel=1e-9)
    # what counts for colour is that of chance: the deviation of a variance over 400 rows is 7 %
    colour = left.T @ left / said.information
    assert colour == pytest.approx(np.full((3, 3), colour[0, 0]), rel=1e-9) and 1.0 <= colour[0, 0] < 1.25
    assert said.score * colour[0, 0] == pytest.approx(left.T @ rest, rel=1e-9)
    assert np.diag(said.spread) == pytest.approx(np.diag(said.information), rel=0.3)


def test_residuals_that_repeat_count_once() -> None:
    """Each row five times over, which clusters say: the information is that of one of them."""
    chance = np.random.default_rng(4)
    design, columns, noise = (chance.standard_normal(shape) for shape in ((80, 1), (80, 1), 80))
    single, repeated = (
        pull(
            (problem := linear(np.repeat(design, n, axis=0), np.repeat(noise, n), cluster=np.repeat(np.arange(80), n))),
            np.zeros(1),
            problem.evaluate(np.zeros(1)),
            np.repeat(columns, n, axis=0),
            np.zeros((80 * n, 0)),
            np.zeros((0, 0)),
        )[0]
        for n in (1, 5)
    )
    assert repeated.spread == pytest.approx(single.spread, rel=0.3)
    assert repeated.information == pytest.approx(single.information, rel=0.3)
