"""Tests of residuals: colour is seen and forgiven, repetition is not; false alarms as rare as stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import f

from identification.inference.problem import Evaluation
from identification.inference.whiteness import BINS, COURSE, LogResiduals, SpeedResidual, Whiteness, whiteness

pytestmark = pytest.mark.digits

CLUSTERS, ROWS = 20, 40


def evaluation(residual: np.ndarray) -> Evaluation:
    """Two logs of clusters of 40 rows; slip rises and falls within each."""
    cluster = np.repeat(np.arange(2 * CLUSTERS), ROWS)
    slip = np.tile(np.sin(np.linspace(0.1, 3.0, ROWS)), 2 * CLUSTERS)
    return Evaluation(residual, np.zeros((len(residual), 1)), cluster, (cluster >= CLUSTERS).astype(int), slip)


def noise(seed: int, colour: float = 0.0) -> np.ndarray:
    """Autoregression (n,) of the first order, a new one for each cluster."""
    kicks = np.random.default_rng(seed).standard_normal((2 * CLUSTERS, ROWS))
    values = [kicks[:, 0]]
    for place in range(1, ROWS):
        values.append(colour * values[-1] + np.sqrt(1 - colour**2) * kicks[:, place])
    return np.stack(values, axis=1).ravel()


def test_white_residuals_pass() -> None:
    found = whiteness(evaluation(noise(0)), ("slow", "fast"))
    assert [one.log for one in found.logs] == ["slow", "fast"] and len(found.speeds) == BINS
    assert found.coloured == () and found.warnings == ()
    assert all(abs(one.autocorrelation) < 0.1 for one in found.logs)


def test_colour_is_seen_but_is_no_fault_of_the_model() -> None:
    found = whiteness(evaluation(noise(1, 0.8)), ("slow", "fast"))
    assert found.coloured == ("slow", "fast")
    assert found.logs[0].autocorrelation == pytest.approx(0.8, abs=0.08)
    assert found.warnings == ()


def test_false_alarms_are_rare_whatever_the_colour() -> None:
    tests = [whiteness(evaluation(noise(seed, colour)), "ab") for colour in (0.0, 0.9) for seed in range(100)]
    # 12 ranges at 3.5 standard errors: 0.6 % of fits; courses: 0.1 %
    assert sum(bool(one.beyond) for one in tests) <= 5
    assert sum(bool(one.repeated) for one in tests) <= 2
    chance = np.array([log.colour for one in tests[:100] for log in one.logs])
    assert np.mean(chance < 0.05) == pytest.approx(0.05, abs=0.05)


def test_a_small_course_that_repeats_is_found() -> None:
    # half of the noise, in one log, where single residuals show nothing
    course = np.tile(0.5 * np.cos(np.linspace(0, np.pi, ROWS)), 2 * CLUSTERS)
    course[CLUSTERS * ROWS :] = 0
    found = whiteness(evaluation(noise(2) + course), ("slow", "fast"))
    assert found.repeated == ("slow",) and "slow take the same course" in found.warnings[-1]


def test_a_range_of_slip_speeds_that_is_missed_is_named() -> None:
    here = evaluation(noise(3))
    fast = here.slip > np.quantile(here.slip, 0.92)
    found = whiteness(evaluation(noise(3) + 0.5 * fast), ("slow", "fast"))
    (worst,) = found.beyond
    assert worst.slip == pytest.approx(float(np.mean(here.slip[fast])), rel=0.01)
    assert worst.deviations > 3.5 and worst.mean == pytest.approx(0.5, abs=0.15)
    assert f"{worst.slip:.3g} m/s" in found.warnings[0] and "stickslip laws" in found.warnings[0]


def test_what_is_missed_is_told_by_the_most_telling_test() -> None:
    # 0.0026998 is the chance of a normal variable beyond three deviations, on either side (printed tables)
    logs = (LogResiduals("a", 90, 0.0, 1.0, 0.5), LogResiduals("b", 90, 0.0, 1.0, None))
    repeats = LogResiduals("c", 90, 0.0, 1.0, 0.0026998)
    slow, fast = SpeedResidual(0.1, 0.1, 1.4), SpeedResidual(0.2, -0.3, -4.2)
    assert Whiteness((*logs, repeats), (slow,)).missed == pytest.approx(3.0, abs=1e-4)
    assert Whiteness((*logs, repeats), (slow, fast)).missed == 4.2
    assert Whiteness(logs, ()).missed == pytest.approx(0.67449, abs=1e-5)
    assert Whiteness((), ()).missed == 0.0
    assert 30 < Whiteness((replace(repeats, course=0.0),), ()).missed < 40


def test_few_clusters_are_not_judged() -> None:
    cluster = np.repeat([0, 1, 2], 30)
    here = Evaluation(noise(4)[:90], np.zeros((90, 1)), cluster, np.zeros(90, dtype=int), np.full(90, np.nan))
    found = whiteness(here, ("short",))
    assert found.logs[0].course is None and found.speeds == () and found.warnings == ()


def test_residuals_without_any_noise_do_not_divide_by_it() -> None:
    found = whiteness(evaluation(np.zeros(2 * CLUSTERS * ROWS)), ("a", "b"))
    assert found.warnings == () and found.coloured == ()


def test_the_chance_of_a_course_is_that_of_wilks_ratio() -> None:
    # noise alone, with a course that is near the border: the chance is neither 0 nor 1
    course = np.tile(0.1 * np.cos(np.linspace(0, np.pi, ROWS)), 2 * CLUSTERS)
    residual = noise(4) + course
    found = whiteness(evaluation(residual), ("slow", "fast"))
    # means of Legendre's polynomials over each cluster, by NumPy's own fit of one polynomial after the other
    place = np.linspace(-1, 1, ROWS)
    basis = np.stack([np.polynomial.Legendre.basis(degree)(place) for degree in range(COURSE)])
    for log, rows in zip(found.logs, np.split(residual.reshape(-1, ROWS), 2), strict=True):
        means = rows @ basis.T
        about = means - means.mean(axis=0)
        ratio = np.linalg.det(about.T @ about) / np.linalg.det(means.T @ means)
        # (1 - L)/L (n - p)/p is Fisher's with p and n - p degrees of freedom
        chance = f.sf((1 - ratio) / ratio * (CLUSTERS - COURSE) / COURSE, COURSE, CLUSTERS - COURSE)
        assert log.course == pytest.approx(chance, rel=1e-9) and 1e-6 < chance < 0.999
