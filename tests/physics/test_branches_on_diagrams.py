"""Branches laid over orbit diagrams, and reduced maps: closed forms of the logistic and the Henon map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fmu_models import Crossing, Iteration, StickslipError, Strobe, branch, branches, load, orbit_diagram, reduced_map
from fmu_models.continuation.lost_motions import lost_motions
from fmu_models.continuation.step.same_motion import between
from fmu_models.maps.henon import MAP as HENON
from fmu_models.maps.logistic import MAP as LOGISTIC


@pytest.fixture(scope="module")
def doubling():
    system = Iteration.of(LOGISTIC)
    return orbit_diagram(system, "r", np.linspace(2.85, 3.5, 8), transient=300, start={"x": 0.3}, branches=4)


def test_unstable_motions_are_laid_over_a_diagram(doubling):
    """The fixed point 1 - 1/r goes on beyond its flip at 3, the motion of period 2 beyond that at 1 + sqrt 6."""
    one, two, four = doubling.branches.branches
    assert [found.every for found in (one, two, four)] == [1, 2, 4]
    assert one.points[:, 0] == pytest.approx(1.0 - 1.0 / one.values, abs=1e-12)
    assert (one.values.min(), one.values.max()) == pytest.approx((2.85, 3.5))
    assert (one.stable == (one.values < 3.0)).all()
    flips = [special.value for found in (one, two) for special in found.special if special.kind == "flip"]
    assert flips == pytest.approx([3.0, 1.0 + math.sqrt(6.0)], abs=1e-11)
    x = two.images[:, :, 0]
    assert x[1] == pytest.approx(two.values * x[0] * (1.0 - x[0]), abs=1e-12)
    assert x.sum(axis=0) == pytest.approx((two.values + 1.0) / two.values, abs=1e-12)


def test_the_picture_has_what_is_stable_and_what_is_not(doubling, tmp_path):
    axes = doubling.plot()
    lines = [one for one in axes.collections if hasattr(one, "get_segments")]
    assert len(lines) == 1 + 2 + 4
    assert {round(width, 1) for width in lines[0].get_linewidths()} == {1.6, 0.9}
    drawn = np.concatenate(lines[0].get_segments())
    assert drawn[:, 1] == pytest.approx(1.0 - 1.0 / drawn[:, 0], abs=1e-9)
    assert np.abs(drawn[:, 0] - 3.0).min() < 1e-11  # a flip lies on the line, and what is stable ends there
    said = {text.get_text() for text in axes.get_legend().get_texts()}
    assert said == {"stable", "unstable", "flip"}
    picture = replace(doubling.branches, of="multiplier").figure(tmp_path / "m.svg").read_text("utf-8")
    assert "real part of the largest multiplier" in picture


def test_branches_are_laid_over_strobes_and_maps_alone():
    support = load("discontinuous_support")
    with pytest.raises(StickslipError, match="this is one of Crossing"):
        orbit_diagram(Crossing(support, "v", forcing="omega"), "omega", [0.9, 1.0], branches=1)
    with pytest.raises(StickslipError, match="which nothing forces"):
        orbit_diagram(Strobe(support, period=1.0, autonomous=True), "omega", [0.9, 1.0], branches=1)
    with pytest.raises(StickslipError, match="none of period 1 or less was found"):
        orbit_diagram(Iteration.of(LOGISTIC), "r", [3.7, 3.71], transient=10, longest=0, branches=1)
    with pytest.raises(StickslipError, match="'multiplier' and 'period' are drawn, too"):
        branches(Iteration.of(LOGISTIC, {"r": 2.9}), "r", (2.8, 3.0), start={"x": 0.65}, of="multipliers")


def test_the_reduced_map_of_the_henon_map():
    """y = b x: x -> 1 - a x^2 + b x, whose fixed points are those of the whole map."""
    a, b = 0.9, 0.3
    found = reduced_map(
        Iteration.of(HENON, {"a": a, "b": b}), "x", np.linspace(-2, 1.5, 36), start={"x": 0.7, "y": 0.2}
    )
    assert len(found.values) == 36
    assert found.points[:, 1] == pytest.approx(b * found.values, abs=1e-12)
    assert found.images == pytest.approx(1 - a * found.values**2 + b * found.values, abs=1e-12)
    assert found.slopes == pytest.approx(b - 2 * a * found.values, abs=1e-12)
    root = math.sqrt((1 - b) ** 2 + 4 * a)
    assert found.fixed[:, 0] == pytest.approx([-(1 - b + root) / (2 * a), (root - 1 + b) / (2 * a)], abs=1e-12)
    assert found.fixed_slopes == pytest.approx(b - 2 * a * found.fixed[:, 0], abs=1e-11)
    with pytest.raises(StickslipError, match="has no state 'z'"):
        reduced_map(Iteration.of(HENON), "z", [0.0, 1.0])
    with pytest.raises(StickslipError, match="finite and ascending"):
        reduced_map(Iteration.of(HENON), "x", [1.0, 0.0])


def test_a_sweep_that_leaves_a_stable_branch_is_told():
    """The support swept down keeps the motion without contact, f0 / sqrt((k - m omega^2)^2 + (c omega)^2), to where
    that is the gap, 1.0551351; left at 1.105 for the motion in contact, it is told."""
    given = {"cs": 0.3, "ks": 10.0, "g": 4.0}
    section = Crossing(load("discontinuous_support"), "v", 0.0, -1, forcing="omega", parameters=given)
    omega = np.linspace(1.04, 1.2, 33)
    found = orbit_diagram(section, "omega", omega, direction="both", transient=400, start={"x": 0.0})
    assert lost_motions(section, found) == ()
    free = omega > 1.0551351
    assert found.shown[1, free, 0] == pytest.approx(0.5 / np.hypot(1 - omega**2, 0.05 * omega)[free], abs=1e-10)
    assert (found.shown[1, ~free, 0] > 4.0).all()
    points = found.points.copy()
    points[1, omega < 1.107] = points[0, omega < 1.107]
    (lost,) = lost_motions(section, replace(found, points=points))
    assert (lost.direction, lost.before, lost.value) == ("down", pytest.approx(1.11), pytest.approx(1.105))
    said = replace(found, lost=(lost,)).summary()
    assert "swept down: a stable branch that goes on is left between omega = 1.11 and 1.105" in said


def test_flips_and_chaos_are_no_losses(doubling):
    system = Iteration.of(LOGISTIC)
    assert lost_motions(system, doubling, longest=4) == lost_motions(system, doubling, 4, doubling.laid) == ()
    points = doubling.points.copy()
    points[0, 2:5] = 1.0 - 1.0 / doubling.values[2:5, None, None]  # the fixed point, unstable from 3 on
    assert lost_motions(system, replace(doubling, points=points), longest=4) == ()
    points[0, -2, :2] = 0.5
    lost = lost_motions(system, replace(doubling, points=points), longest=2)
    assert [one.value for one in lost] == [pytest.approx(doubling.values[-2])]
    with pytest.raises(StickslipError, match="nothing forces"):
        lost_motions(Crossing(load("discontinuous_support"), "v"), doubling)


def test_what_lies_between_two_motions_of_a_branch():
    """x = 1 - 1/r from node to node: neither what the branch has farther on, nor what is beside it."""
    nodes = branch(Iteration.of(LOGISTIC, {"r": 2.0}), "r", (1.5, 2.8), start={"x": 0.5}).nodes
    first, inside, last, beyond = nodes[1:5]
    assert between(first, last, inside.u) and between(first, last, first.u) and between(first, last, last.u)
    assert not between(first, last, beyond.u) and not between(first, last, nodes[0].u)
    beside = inside.u + np.array([1e-3, 0.0])
    assert not between(first, last, beside)
    # as far to the side as the two are from each other
    chord = last.u - first.u
    assert not between(first, last, inside.u + 1.1 * np.array([-chord[1], chord[0]]))
