"""Crossings of the diagonal by a function of one variable: what it may meet on the way, and what it may cost."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fmu_models.sections.diagonal import find_crossings

SLOPES = st.floats(-3.0, 3.0).filter(lambda s: abs(s - 1) > 0.05)


@settings(max_examples=200, deadline=None)
@given(st.floats(-0.9, 0.9), SLOPES, SLOPES, st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
@example(0.0, 0.0, 0.0, 1.5, 1.0)  # a fixed point at an end of the interval is one
@example(0.0, 0.0, 0.0, -1.0, 0.5)
def test_two_lines_and_a_jump(place, left_slope, right_slope, left, right):
    """Every fixed point of either line on its side, and the jump, which crosses or not."""
    if abs(left - right) < 0.05 or min(abs(left - place), abs(right - place)) < 1e-6:
        return

    def function(x: float) -> float:
        return left + left_slope * (x - place) if x <= place else right + right_slope * (x - place)

    expected = []
    for value, slope, side in ((left, left_slope, -1), (right, right_slope, 1)):
        root = place + (value - place) / (1 - slope)
        if 0 < abs(abs(root) - 1) < 1e-9:
            return  # rounding decides on which side of the end it lies
        if -1 <= root <= 1 and (root - place) * side > 0:
            expected.append((root, slope))
    found = find_crossings(function, -1.0, 1.0)
    assert [p.x for p in found.fixed_points] == pytest.approx([root for root, _ in expected], abs=1e-11)
    (jump,) = found.jumps
    assert jump.x == pytest.approx(place, abs=1e-12)
    assert (jump.left, jump.right) == pytest.approx((left, right), abs=1e-11)
    assert jump.crosses_diagonal == ((left - place) * (right - place) < 0)
    assert found.evaluations < 600
    for point, (root, slope) in zip(found.fixed_points, expected, strict=True):
        if abs(root - place) > 1e-6 and 1 - abs(root) > 1e-6:
            assert point.slope == pytest.approx(slope, abs=1e-6)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-0.95, 0.95), min_size=1, max_size=5, unique=True), st.floats(0.3, 5.0))
def test_all_roots_of_a_polynomial(places, size):
    places = sorted(places)
    if any(b - a < 0.02 for a, b in itertools.pairwise(places)):
        return
    found = find_crossings(lambda x: x + size * math.prod(x - place for place in places), -1.0, 1.0)
    assert [point.x for point in found.fixed_points] == pytest.approx(places, abs=1e-9)
    assert not found.jumps


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_two_fixed_points_close_together(gap):
    """x^2 - gap^2/4 touches the diagonal almost: both are found below the spacing of the samples."""
    found = find_crossings(lambda x: x + (x - 0.1234) ** 2 - gap**2 / 4, -1.0, 1.0)
    assert [p.x for p in found.fixed_points] == pytest.approx([0.1234 - gap / 2, 0.1234 + gap / 2], abs=1e-3 * gap)
    assert [p.slope for p in found.fixed_points] == pytest.approx([1 - gap, 1 + gap], abs=1e-3 * gap)
    assert [p.stable for p in found.fixed_points] == [True, False]


@pytest.mark.parametrize("places", [(0.1001, 0.1002, 0.1003), (0.1001, 0.10012, 0.1003), (0.1001, 0.10028, 0.1003)])
def test_three_fixed_points_between_two_samples(places):
    found = find_crossings(lambda x: x + 20 * math.prod(x - place for place in places), -2.0, 1.0)
    assert [point.x for point in found.fixed_points] == pytest.approx(places, abs=1e-8)


@pytest.mark.parametrize("slope", [30.0, 300.0, 1e4, 1e5])
@pytest.mark.parametrize("beside", [-3e-14, -3e-16, -1e-16, 1e-16, 3e-16, 3e-15, 3e-14])
def test_a_steep_fixed_point_a_rounding_beside_a_sample_is_one(slope, beside):
    for sample in np.linspace(0.0, 1.0, 200)[[20, 140]]:
        place = float(sample) + beside
        (point,) = find_crossings(lambda x, place=place: x + slope * (x - place), 0.0, 1.0).fixed_points
        assert point.x == pytest.approx(place, abs=1e-12)


def test_a_touch_of_the_diagonal_is_a_fixed_point():
    found = find_crossings(lambda x: x + x**2, -1.0, 1.1)
    assert [p.x for p in found.fixed_points] == pytest.approx([0.0], abs=1e-7)


def test_fixed_points_at_the_ends_of_the_range():
    found = find_crossings(lambda x: 3 * x * (1 - x), 0.0, 2 / 3)
    assert [p.x for p in found.fixed_points] == pytest.approx([0.0, 2 / 3], abs=1e-12)
    assert [p.slope for p in found.fixed_points] == pytest.approx([3.0, -1.0], abs=1e-8)


def test_undefined_stretches_are_kept_apart():
    """sqrt has no value below zero: its fixed points are 0, at the edge, and 1; a hole of its own lies above."""

    def function(x: float) -> float:
        return math.nan if x < 0 or 1.5 < x < 1.6 else math.sqrt(x)

    found = find_crossings(function, -1.0, 2.0)
    assert found.undefined[0] == pytest.approx((-1.0, 0.0), abs=1e-11)
    assert found.undefined[1] == pytest.approx((1.5, 1.6), abs=1e-11)
    assert found.fixed_points[-1].x == pytest.approx(1.0, abs=1e-12)
    assert found.fixed_points[-1].slope == pytest.approx(0.5, abs=1e-8)
    assert not found.jumps


def test_a_function_without_any_value():
    found = find_crossings(lambda x: math.nan, 0.0, 1.0)
    assert (found.fixed_points, found.jumps, found.undefined) == ((), (), ((0.0, 1.0),))


def test_an_infinitely_deep_dip_costs_little():
    """x = -1/2 |x - 0.2|^(-1/2), without a value at the bottom: x^2 (0.2 - x) = 1/4 has one real root."""
    (root,) = (z.real for z in np.roots([1.0, -0.2, 0.0, 0.25]) if z.imag == 0)
    found = find_crossings(lambda x: -0.5 / math.sqrt(abs(x - 0.2)) if x != 0.2 else math.nan, -2.0, 1.0)
    assert [p.x for p in found.fixed_points] == pytest.approx([root], abs=1e-12)
    assert found.evaluations < 1000


def test_a_pole_is_a_jump():
    found = find_crossings(lambda x: 1 / (x - 0.3) + x if x != 0.3 else math.nan, -1.0, 1.0)
    assert not found.fixed_points
    (jump,) = found.jumps
    assert jump.x == pytest.approx(0.3, abs=1e-11)
    assert jump.crosses_diagonal


def test_a_kink_is_neither_jump_nor_twice_a_fixed_point():
    found = find_crossings(lambda x: 0.25 - 0.5 * abs(x - 0.25), -1.0, 1.0)
    assert [p.x for p in found.fixed_points] == pytest.approx([0.25], abs=1e-12)
    assert not found.jumps


def test_a_jump_onto_the_diagonal_is_a_fixed_point_and_no_crossing():
    found = find_crossings(lambda x: 0.3 if x <= 0.3 else 0.8, 0.0, 0.75)
    assert [p.x for p in found.fixed_points] == pytest.approx([0.3], abs=1e-12)
    assert not found.jump_crossings


def test_a_lone_value_inside_a_jump_does_not_make_two():
    found = find_crossings(lambda x: 0.5 * float(np.sign(x)), -1.0, 1.0)
    (jump,) = found.jumps
    assert (jump.left, jump.right, jump.crosses_diagonal) == (-0.5, 0.5, True)


@pytest.mark.parametrize("size", [1e-3, 1e-5, 1e-6])
def test_a_jump_too_small_to_stand_out_is_no_fixed_point_where_it_crosses(size):
    """f jumps by a little across the diagonal, on a steep slope on both sides."""
    found = find_crossings(lambda x: 0.2 + 4 * (x - 0.2) + (size if x > 0.2 else -size), -1.0, 1.0)
    assert not found.fixed_points
    assert [j.x for j in found.jump_crossings] == pytest.approx([0.2], abs=1e-6)


def test_a_stretch_of_fixed_points_is_one_thing():
    """As about a centre: f(x) = x for |x| < 0.3, with an error of 1e-11 to each value."""
    chance = np.random.default_rng(0)

    def function(x: float) -> float:
        return (x if abs(x) < 0.3 else 2 * x - math.copysign(0.3, x)) + 1e-11 * chance.uniform(-1, 1)

    found = find_crossings(function, -1.0, 1.0, noise=2e-11, accuracy=1e-9)
    assert len(found.stretches) == 1
    assert found.stretches[0] == pytest.approx((-0.3, 0.3), abs=1e-8)
    assert not found.fixed_points
    assert not found.jumps


def test_noise_does_not_multiply_a_fixed_point():
    chance = np.random.default_rng(0)
    found = find_crossings(
        lambda x: math.cos(x) + 1e-9 * chance.uniform(-1, 1), 0.0, 1.0, noise=1e-9, accuracy=1e-8, samples=60
    )
    (point,) = found.fixed_points
    assert point.x == pytest.approx(0.7390851332, abs=1e-8)
    assert point.slope == pytest.approx(-math.sin(0.7390851332), abs=1e-4)
    assert found.evaluations < 200


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("room", [1e-2, 1e-3, 1e-5])
def test_the_slope_is_taken_from_the_values_that_there_are(room, side):
    """sin x - sin 0.4 + 0.4 has none nearer than ``room`` to its fixed point, on one side."""

    def function(x: float) -> float:
        return math.nan if side * (x - 0.4) > room else math.sin(x) - math.sin(0.4) + 0.4

    (point,) = find_crossings(function, -1.0, 1.0).fixed_points
    assert point.x == pytest.approx(0.4, abs=1e-11)
    assert point.slope == pytest.approx(math.cos(0.4), abs=1e-6)
