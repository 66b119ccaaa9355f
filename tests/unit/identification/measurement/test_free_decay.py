"""Free decay against the closed form of a damped oscillator."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from identification.measurement.free_decay import fit_decay

pytestmark = pytest.mark.digits

TIME = np.arange(20_000) / 1000


def swing(stiffness: float, damping: float, amplitude: float = 0.2, rest: float = 0.0) -> np.ndarray:
    """Closed form of th'' + damping th' + stiffness th = 0 from rest at ``amplitude``."""
    a = damping / 2
    w = np.sqrt(stiffness - a**2)
    return rest + amplitude * np.exp(-a * TIME) * (np.cos(w * TIME) + a / w * np.sin(w * TIME))


@settings(max_examples=20, deadline=None)
@given(
    stiffness=st.floats(10, 400),
    ratio=st.floats(0.01, 0.12),
    amplitude=st.sampled_from([-0.3, 0.05, 0.2]),
    rest=st.floats(-0.02, 0.02),
)
def test_a_clean_decay_gives_its_coefficients_back(
    stiffness: float, ratio: float, amplitude: float, rest: float
) -> None:
    damping = ratio * np.sqrt(stiffness)
    found = fit_decay(TIME, swing(stiffness, damping, amplitude, rest))
    assert found.stiffness_ratio == pytest.approx(stiffness, rel=1e-8)
    assert found.damping_ratio == pytest.approx(damping, rel=1e-7)
    assert found.rest == pytest.approx(rest, abs=1e-9)
    assert found.warnings == ()


def test_the_way_the_disc_is_let_go_does_not_matter() -> None:
    held = np.concatenate([np.full(700, 0.2), swing(47.8, 1.0)[:-700]])
    found = fit_decay(TIME, held)
    assert found.stiffness_ratio == pytest.approx(47.8, rel=1e-9)
    assert found.damping_ratio == pytest.approx(1.0, rel=1e-8)


@pytest.mark.nightly
def test_noise_stays_within_the_stated_deviations_and_the_goal() -> None:
    truth = np.array([47.81, 1.0036])
    scores = []
    for seed in range(40):
        noisy = swing(*truth) + np.random.default_rng(seed).normal(0, 0.16e-3, len(TIME))
        found = fit_decay(TIME, noisy)
        error = np.array([found.stiffness_ratio, found.damping_ratio]) - truth
        assert abs(error[0] / truth[0]) < 1e-4
        assert abs(error[1] / truth[1]) < 1e-3
        scores.append(error / [found.stiffness_ratio_deviation, found.damping_ratio_deviation])
    # the spread of 40 normal scores is known to 11 %
    assert np.std(scores, axis=0) == pytest.approx([1.0, 1.0], abs=0.35)


def test_samples_that_are_missing_are_left_out() -> None:
    angle = swing(47.8, 1.0)
    angle[3000:3200] = np.nan
    assert fit_decay(TIME, angle).stiffness_ratio == pytest.approx(47.8, rel=1e-9)


def test_dry_friction_is_noticed() -> None:
    # amplitude falling along a line, as with Coulomb friction, instead of an exponential
    angle = 0.2 * np.clip(1 - TIME / 12, 0, None) * np.cos(7 * TIME)
    found = fit_decay(TIME, angle)
    assert len(found.warnings) == 1
    assert "not viscous" in found.warnings[0]


@pytest.mark.parametrize(
    ("angle", "said"),
    [
        (0.1 * np.cos(7 * TIME), "does not decay"),
        (0.01 * np.exp(0.1 * TIME) * np.cos(7 * TIME), "does not decay"),
        (0.1 * np.exp(-4 * TIME) * np.cos(7 * TIME), "cycles"),
        (np.full_like(TIME, np.nan), "usable samples"),
    ],
)
def test_what_is_no_decay_is_refused(angle: np.ndarray, said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        fit_decay(TIME, angle, name="x")
