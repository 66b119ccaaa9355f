"""Portrait metrics on curves whose distances are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from identification.model_check.portraits import (
    LIMITS,
    MEANING,
    PHASES,
    Portrait,
    PortraitComparison,
    Rest,
    Stick,
    aligned_rms,
    compare_motions,
    hausdorff,
    polygon_area,
    symmetric_difference,
)
from identification.model_check.processing import Processing

TURN = 2 * np.pi * np.arange(PHASES) / PHASES


def ellipse(a: float = 1.0, b: float = 1.0, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    return np.stack([x + a * np.cos(TURN), y + b * np.sin(TURN)], axis=1)


def test_area_of_an_ellipse() -> None:
    # a polygon of n corners falls short of the circle by 2 pi^2/(3 n^2) = 4e-5
    assert polygon_area(ellipse(2.0, 0.5)) == pytest.approx(np.pi, rel=1e-4)


@pytest.mark.nightly
@settings(max_examples=15, deadline=None)
@given(a=st.floats(0.3, 3), b=st.floats(0.3, 3), x=st.floats(-3, 3), y=st.floats(-3, 3))
def test_a_hole_or_two_apart_add_or_subtract(a: float, b: float, x: float, y: float) -> None:
    curve = ellipse(a, b, x, y)
    inner = 0.5 * (curve - np.array([x, y])) + np.array([x, y])
    apart = curve + np.array([10 * a, 0])
    area = np.pi * a * b
    assert symmetric_difference(curve, curve) == pytest.approx(0, abs=1e-9 * area)
    assert symmetric_difference(curve, inner) == pytest.approx(0.75 * area, rel=2e-3)
    assert symmetric_difference(curve, apart) == pytest.approx(2 * area, rel=5e-3)


@pytest.mark.parametrize("shift", [0.1, 0.5, 1.2])
def test_symmetric_difference_of_shifted_circles(shift: float) -> None:
    # two unit circles at distance d share the lens 2 acos(d/2) - d/2 sqrt(4 - d^2)
    lens = 2 * np.arccos(shift / 2) - shift / 2 * np.sqrt(4 - shift**2)
    assert symmetric_difference(ellipse(), ellipse(y=shift)) == pytest.approx(2 * (np.pi - lens), rel=2e-3)
    assert symmetric_difference(ellipse(), ellipse(x=shift)) == pytest.approx(2 * (np.pi - lens), rel=2e-3)


def test_hausdorff_of_circles() -> None:
    assert hausdorff(ellipse(), ellipse(1.3, 1.3)) == pytest.approx(0.3, abs=1e-4)
    assert hausdorff(ellipse(), ellipse(x=0.25)) == pytest.approx(0.25, abs=1e-4)
    # one spike decides it, from whichever curve it sticks out
    spiked = ellipse()
    spiked[7] *= 2
    assert hausdorff(ellipse(), spiked) == pytest.approx(1.0, abs=1e-3)
    assert hausdorff(spiked, ellipse()) == pytest.approx(1.0, abs=1e-3)


def test_aligned_rms_forgives_a_shift_of_phase_and_nothing_else() -> None:
    assert aligned_rms(ellipse(), np.roll(ellipse(), 123, axis=0)) == pytest.approx(0, abs=1e-12)
    # radius 1.1 against 1: distance 0.1, that is 0.1/sqrt 2 per coordinate
    assert aligned_rms(ellipse(), ellipse(1.1, 1.1)) == pytest.approx(0.1 / np.sqrt(2), rel=1e-9)


def cycle(scale: float = 1.0, period: float = 1.0, stick: float = 0.2) -> Portrait:
    strip = (np.arange(PHASES) < stick * PHASES).astype(float)
    return Portrait(
        angle=0.1 + 0.05 * scale * np.cos(TURN),
        speed=0.3 * scale * np.sin(TURN),
        period=period,
        amplitude=0.05 * scale,
        sticks={"disc0": Stick(stick, strip, np.array([(stick * period) ** 2]), True)},
        cycles=9,
    )


def test_verdicts_follow_the_acceptance_levels() -> None:
    same = {verdict.name: verdict for verdict in compare_motions(cycle(), cycle())}
    assert {name for name, verdict in same.items() if verdict.passed} == {"same motion", *LIMITS}
    assert same["hausdorff"].passed is None
    other = {v.name: v for v in compare_motions(cycle(), cycle(1.04, 0.98, 0.23))}
    assert other["amplitude"].value == pytest.approx(0.04)
    assert other["period"].value == pytest.approx(-0.02)
    assert other["stick fraction"].value == pytest.approx(0.03)
    assert other["area"].value == pytest.approx(1.04**2 - 1, rel=0.01)
    assert other["rms"].value == pytest.approx(0.04 / np.sqrt(2), rel=1e-6)
    failed = ["amplitude", "period", "stick fraction", "area"]
    assert [name for name, verdict in other.items() if verdict.passed is False] == failed


def test_hausdorff_alone_does_not_fail_a_comparison() -> None:
    spiked = cycle()
    angle = spiked.angle.copy()
    angle[200] += 0.05
    spiked = replace(spiked, angle=angle)
    comparison = PortraitComparison("x", {"disc0": 0.5}, cycle(), spiked, compare_motions(cycle(), spiked))
    assert comparison["hausdorff"].value > 0.5
    assert comparison.passed
    assert comparison.to_dict()["meaning"] == MEANING


def test_a_motion_without_stick_agrees_with_another_and_with_no_cycle() -> None:
    sliding = Rest(0.1, 1e-4)
    agree = compare_motions(sliding, Rest(0.102, 0.0))
    assert [(v.name, v.passed) for v in agree] == [("same motion", True), ("rest angle", None)]
    assert agree[1].value == pytest.approx(0.02)
    (only,) = compare_motions(sliding, cycle())
    assert only.passed is False
    assert only.meaning == "measured: steady sliding; model: stick on disc0"


def two(first: slice, second: slice) -> Portrait:
    """A cycle that sticks to disc 0 and disc 1 over these phases."""
    strips = {"disc0": np.zeros(PHASES), "disc1": np.zeros(PHASES)}
    strips["disc0"][first] = strips["disc1"][second] = 1.0
    return replace(cycle(), sticks={name: Stick(0.2, strip, np.array([0.01]), True) for name, strip in strips.items()})


def test_the_sequence_of_sticks_in_words() -> None:
    assert two(slice(50, 120), slice(100, 200)).words == "stick on disc0, disc0 and disc1, disc1"
    assert two(slice(50, 90), slice(100, 200)).sequence == (("disc0",), ("disc1",))
    # one that lasts over the beginning of the cycle is one; where a cycle begins does not count
    over = two(slice(350, 400), slice(100, 200))
    over.sticks["disc0"].strip[:50] = 1.0
    assert over.sequence == (("disc1",), ("disc0",))
    assert compare_motions(over, two(slice(50, 90), slice(100, 200)))[0].passed
    assert not compare_motions(over, two(slice(50, 120), slice(100, 200)))[0].passed
    # shorter than the level of acceptance: none
    assert two(slice(50, 55), slice(100, 200)).words == "stick on disc1"
    near = two(slice(50, 90), slice(100, 200))
    near = replace(near, sticks={**near.sticks, "disc0": replace(near.sticks["disc0"], real=False)})
    assert near.words == "stick on disc1"


TIME = np.arange(20_000) / 1000


PROCESSING = Processing(r=0.06, R=0.125, natural_period=0.9)


def drawn(angle: np.ndarray, drive: float = 1.0) -> Portrait | Rest:
    return PROCESSING.motion(TIME, angle, {"disc0": np.full(len(TIME), drive)})


def test_portrait_of_a_sine_is_its_ellipse() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-4, len(TIME))
    found = drawn(0.2 + 0.1 * np.sin(2 * np.pi * TIME / 1.1) + noise)
    assert isinstance(found, Portrait)
    # the smoothing takes (pi window/period)^2/10 = 1.4e-3 of the speed
    assert found.period == pytest.approx(1.1, rel=1e-4)
    assert found.amplitude == pytest.approx(0.1, rel=2e-3)
    assert np.ptp(found.speed) / 2 == pytest.approx(0.1 * 2 * np.pi / 1.1, rel=5e-3)
    assert found.cycles == 17
    # a cycle begins where the angle rises through its middle
    assert found.angle[0] == pytest.approx(0.2, abs=1e-3) and found.speed[0] > 0.9 * found.speed.max()
    assert found.angle.shape == found.speed.shape == (PHASES,)


def test_stick_fraction_counts_the_time_at_the_speed_of_the_drive() -> None:
    # a saw: rises for 0.4 s of each second at r w/R, falls back faster
    rise = 0.06 / 0.125 * 0.5
    phase = TIME % 1.0
    angle = np.where(phase < 0.4, rise * phase, rise * 0.4 * (1 - phase) / 0.6)
    found = drawn(angle, drive=0.5)
    assert isinstance(found, Portrait)
    # the corners are rounded by half the window of 41 ms each
    assert found.sticks["disc0"].fraction == pytest.approx(0.4, abs=0.03)
    assert found.sticks["disc0"].real
    # at another speed it is no stick but a near miss: 7 mm/s past the disc
    past = drawn(angle, drive=0.5 + 0.007 / 0.06)
    assert isinstance(past, Portrait)
    assert past.sticks["disc0"].fraction > 0.3 and not past.sticks["disc0"].real
    assert past.sequence == ()


def test_which_disc_touches() -> None:
    angle = np.array([-0.3, -0.1, 0.0, 0.1, 0.3])
    sequential = replace(PROCESSING, arrangement="sequential", changeover=0.1)
    assert sequential.touches("disc0", angle).tolist() == [True, True, True, False, False]
    assert sequential.touches("disc1", angle).tolist() == [False, False, False, True, True]
    overlapping = replace(PROCESSING, arrangement="overlapping", changeover=0.1)
    assert overlapping.touches("disc0", angle).tolist() == [True, True, True, True, False]
    assert overlapping.touches("disc1", angle).tolist() == [False, True, True, True, True]
    assert PROCESSING.touches("disc1", angle).all()


def test_a_motion_without_cycles_rests_or_is_too_short() -> None:
    assert drawn(np.full(len(TIME), 0.2)) == Rest(pytest.approx(0.2), pytest.approx(0.0))  # type: ignore[arg-type]
    dying = drawn(0.2 + 0.05 * np.exp(-0.3 * TIME) * np.sin(7 * TIME), drive=3.0)
    assert isinstance(dying, Rest)
    assert dying.angle == pytest.approx(0.2, abs=1e-3) and "dies out" in dying.words
    with pytest.raises(StickslipError, match="whole cycles"):
        drawn(0.1 * np.sin(2 * np.pi * TIME / 12), drive=0.0)
