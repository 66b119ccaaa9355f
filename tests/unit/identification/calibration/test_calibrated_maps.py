"""Calibration of maps from their iterates."""

from __future__ import annotations

import numpy as np
import pytest
from known_deviation import deviation

from fmu_models.base.errors import StickslipError
from fmu_models.maps import MAPS
from fmu_models.sections.iteration import Iteration, iterate
from identification.calibration.calibrate import calibrate
from identification.calibration.subject import Stretch, Window
from identification.calibration.systems import SystemFmu, subject_of

NOISE = 0.005


def log_of(name: str, start: list[float], values: dict[str, float], count: int = 61) -> dict[str, np.ndarray]:
    declared = MAPS.load(name)
    points = iterate(Iteration.of(declared, values), start, count + 99)[100:]
    noise = NOISE * np.random.default_rng(1).normal(size=points.shape)
    return {
        "time": np.arange(float(count)),
        **dict(zip((x.name for x in declared.states), (points + noise).T, strict=True)),
    }


@pytest.mark.nightly_for("henon-start1-truth1-first1")
@pytest.mark.parametrize(
    ("name", "start", "truth", "first"),
    [("logistic", [0.1], {"r": 3.8}, {"r": 3.0}), ("henon", [0.1, 0.1], {"a": 1.4, "b": 0.3}, {"a": 1.0, "b": 0.4})],
)
def test_a_chaotic_map_is_found_from_its_iterates(name, start, truth, first):
    """Joined segments: a free run would lose the log after ten iterates, which is said."""
    found = calibrate(name, log_of(name, start, truth), free=list(truth), parameters=first)
    for parameter, value in truth.items():
        assert abs(found[parameter].value - value) < 4 * deviation(found[parameter])
        assert deviation(found[parameter]) < 0.01 * value
    assert all(line.rms == pytest.approx(NOISE, rel=0.25) for line in found.residuals)
    assert found.horizon is not None and 3 < found.horizon < 30


def test_slopes_of_iterates_are_closed_forms():
    """Of x2 = r x1 (1 - x1), x1 = r x0 (1 - x0), from the second iterate of the log on."""
    subject = subject_of(SystemFmu.of_map(MAPS.load("logistic")), ["r"], ["x"])
    r, x0 = 3.2, 0.3
    x1 = r * x0 * (1 - x0)
    slopes = r * (1 - 2 * x1) * np.array([x0 * (1 - x0), r * (1 - 2 * x0)]) + np.array([x1 * (1 - x1), 0.0])
    response = subject.respond(Stretch(Window(5.0, np.array([6.0, 7.0]), {}), {"r": r}, {"x": x0}))
    assert response.values[:, 0] == pytest.approx([x1, r * x1 * (1 - x1)], rel=1e-14)
    assert response.slopes[1, 0] == pytest.approx(slopes, rel=1e-8)


def test_times_between_iterates_are_refused():
    log = log_of("logistic", [0.1], {"r": 3.8})
    with pytest.raises(StickslipError, match=r"whole numbers; found 0\.5 in sample 2"):
        calibrate("logistic", {**log, "time": log["time"] / 2}, free=["r"])


def test_a_map_that_leaves_every_bound_is_a_bad_guess():
    subject = subject_of(SystemFmu.of_map(MAPS.load("logistic")), ["r"], ["x"])
    with pytest.raises(StickslipError, match="leave every bound"):
        subject.shown(Stretch(Window(0.0, np.array([40.0]), {}), {"r": 3.2}, {"x": -2.0}))
