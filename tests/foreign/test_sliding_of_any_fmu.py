"""Motions along the surface of an indicator for which the FMU has no state: the mean of the fields on both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest
from models import Models
from numpy.polynomial import Polynomial
from scipy.optimize import root_scalar

from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any

METHODS = ("dopri5", "dop853", "stiff", "auto")


def arrival(a: float) -> float:
    """Of x' = -1 + a cos t at zero, from 1."""
    return root_scalar(lambda t: 1 - t + a * math.sin(t), bracket=(0.5, 3.0), xtol=1e-14).root


@pytest.mark.parametrize("method", METHODS)
def test_relay_slides_for_good(model: Models, method: str) -> None:
    run = simulate_any(model("relay"), 20.0, method=method)
    (event,) = run.events
    assert event.kind == "slide"
    assert event.time == pytest.approx(arrival(0.3), abs=1e-7)
    assert np.abs(run["x"][run.time > event.time]).max() < 1e-9
    # the derivative recorded is that of the motion, not of one side
    assert np.abs(run["der(x)"][run.time > event.time]).max() < 1e-9
    assert "1 sliding motion" in run.method


def test_relay_leaves_the_surface_where_one_side_turns_away(model: Models) -> None:
    run = simulate_any(model("relay"), 5.4, tolerance=1e-10, parameters={"a": 1.5})
    kinds = [event.kind for event in run.events]
    assert kinds == ["slide", "leave", "slide"]
    # 1.5 |cos t| reaches 1 downwards
    leave = math.acos(-2 / 3)
    assert run.events[1].time == pytest.approx(leave, abs=1e-8)
    back = root_scalar(lambda t: t - leave + 1.5 * (math.sin(t) - math.sin(leave)), bracket=(4.0, 5.4)).root
    assert run.events[2].time == pytest.approx(back, abs=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_sliding_along_a_curve(model: Models, method: str) -> None:
    run = simulate_any(model("circle"), 5.0, method=method, tolerance=1e-9)
    after = run.time > run.events[0].time
    assert run.events[0].time == pytest.approx(math.log(2), abs=1e-7)
    assert np.abs(np.hypot(run["x"], run["y"])[after] - 1).max() < 1e-8
    # angle 2 t from the start, before and on the circle
    assert np.abs(run["x"] - np.cos(2 * run.time) * np.maximum(1.0, 2 * np.exp(-run.time))).max() < 1e-6


def test_a_block_sticks_to_its_belt_until_the_spring_pulls_it_off(model: Models) -> None:
    run = simulate_any(model("block"), 4.0, tolerance=1e-10)
    stick, leave = run.events
    assert (stick.kind, leave.kind) == ("slide", "leave")
    # from rest: x = 1 - cos t reaches the belt's speed 1/2 at pi/6; then it is carried to x = 1
    assert stick.time == pytest.approx(math.pi / 6, abs=1e-8)
    assert leave.time == pytest.approx(math.pi / 6 + 2 * math.cos(math.pi / 6), abs=1e-8)
    on_belt = (run.time > stick.time) & (run.time < leave.time)
    assert np.abs(run["v"][on_belt] - 0.5).max() < 1e-10
    late = run.time[-1] - leave.time
    assert run["x"][-1] == pytest.approx(1 + 0.5 * math.sin(late), abs=1e-7)


@pytest.mark.parametrize("name", ["toggle", "nudge"])
def test_chattering_that_is_no_sliding_is_told(model: Models, name: str) -> None:
    with pytest.raises(MotionError, match=r"indicator 0.*depends on x.* at t = 1 s \(chattering\)") as caught:
        simulate_any(model(name), 5.0)
    assert caught.value.kind == "chattering"
    assert caught.value.time == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("method", ["stiff", "auto"])
def test_a_jump_that_nobody_announces_is_no_hang(model: Models, method: str) -> None:
    with pytest.raises(MotionError, match=r"event indicator.*[Ll]oosen the tolerance"):
        simulate_any(model("silent_relay"), 20.0, method=method, tolerance=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_bar_sticks_in_both_contacts(model: Models, method: str) -> None:
    """In closed form: a moment of sliding, contact 2 sticks, both do, contact 1 lets go, contact 2 does."""
    mu_1, mu_2, pull, twist, arm = 1.0, 0.5, 0.8, 0.1, 2.0
    run = simulate_any(
        model("bar"), 3.7, method=method, tolerance=1e-9, parameters={"arm": arm}, start={"w": 0.0}, record=[]
    )
    sliding_v = Polynomial([1.0, -(mu_1 + mu_2), pull / 2])
    sliding_w = 2 * Polynomial([0.0, -(mu_1 - arm * mu_2), twist / 2])
    stick_2 = min((sliding_v - arm * sliding_w).roots())
    # while contact 2 sticks: v' = arm w' gives its force
    force_2 = Polynomial([(2 * arm - 1) * mu_1, pull - 2 * arm * twist]) / (1 + 2 * arm**2)
    carried = (Polynomial([-mu_1, pull]) - force_2).integ()
    braking = carried - carried(stick_2) + sliding_v(stick_2)
    stick_1 = min(root for root in braking.roots() if root > stick_2)
    # at rest the loads alone give both forces: F1 + F2 = pull t, F1 - arm F2 = twist t
    slip_1 = mu_1 * (1 + arm) / (arm * pull + twist)
    assert [(event.kind, event.indicator) for event in run.events] == [("slide", 1), ("slide", 0), ("leave", 0)]
    assert [event.time for event in run.events] == pytest.approx([stick_2, stick_1, slip_1], abs=1e-8)
    v = np.select(
        [run.time < stick_2, run.time < stick_1, run.time < slip_1],
        [sliding_v(run.time), braking(run.time), 0.0],
        carried(run.time) - carried(slip_1),
    )
    assert np.abs(run["v"] - v).max() < 1e-8
    assert np.abs(run["w"] - np.where(run.time < stick_2, sliding_w(run.time), v / arm)).max() < 1e-8
    assert run.method.endswith("2 sliding motions by the convex mean of the fields, along 2 surfaces at once")


def test_two_contacts_stick_in_the_same_instant_and_let_go_in_another(model: Models) -> None:
    equal = {"mu_1": 0.75, "mu_2": 0.75, "twist": 0.0}
    run = simulate_any(model("bar"), 3.0, tolerance=1e-9, parameters=equal, start={"w": 0.0}, record=[])
    still, go = (1.5 - math.sqrt(1.5**2 - 1.6)) / 0.8, 1.5 / 0.8
    v = np.where(run.time < still, 1 - 1.5 * run.time + 0.4 * run.time**2, 0.4 * np.maximum(run.time - go, 0) ** 2)
    assert np.abs(run["v"] - v).max() < 1e-8
    assert np.abs(run["w"]).max() < 1e-9


def test_the_mean_of_fields_that_are_no_sum_is_told_to_be_a_convention(model: Models) -> None:
    run = simulate_any(model("cross"), 2.0)
    # the means 1/2 of sgn(x) and -1/4 of sgn(y), taken as independent; before, x falls to zero at 0.6 along y = 0
    assert run["w"][-1] == pytest.approx(0.16 + (0.6 - 0.16) * -0.25 + (2.0 - 0.6) * 0.5 * -0.25, abs=1e-8)
    assert "the mean is a convention there" in run.method


def test_a_corner_is_reached_and_kept(model: Models) -> None:
    run = simulate_any(model("corner"), 5.0)
    assert [event.time for event in run.events] == pytest.approx([1.0, 2.0], abs=1e-9)
    assert (run["x"][-1], run["y"][-1]) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_two_surfaces_that_are_no_motion_are_told(model: Models) -> None:
    with pytest.raises(
        MotionError, match=r"indicator 1.*depends on y.*chatters at t = 2 s.*surface of event indicator 0.*cannot"
    ):
        simulate_any(model("hook"), 5.0)


def test_more_surfaces_than_are_computed_are_told(model: Models) -> None:
    with pytest.raises(MotionError, match=r"indicator 4.*at t = 5 s.*along 4 surfaces.*many at once"):
        simulate_any(model("relays"), 6.0)
