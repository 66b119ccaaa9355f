"""Two linear domains against closed forms: periods, matrix exponentials and saltation matrices."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from closed_form import root
from scipy.linalg import expm

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

FREE = {"d": 0.0, "w1": 0.0, "w2": 0.0, "b1": 0.0, "b2": 0.0, "Q1": 0.0, "Q2": 0.0}


@cache
def fmu() -> Fmu:
    return Fmu.open(built("two_domain_oscillator"))


def periods(parameters: dict[str, float], start: dict[str, float], stop: float) -> np.ndarray:
    """Times between crossings to the right."""
    events = simulate(fmu(), stop, parameters={**FREE, **parameters}, start=start).events
    return np.diff([event.time for event in events if event.after == 1])


@pytest.mark.parametrize(
    ("g1", "g2", "v0", "X_s"), [(1.0, 2.0, 1.0, 0.0), (1e-3, 1e3, 5.0, 0.0), (0.3, 0.7, 2.0, -4.0)]
)
def test_opposite_constant_fields_have_the_period_of_two_parabolas(g1, g2, v0, X_s):
    """T = 2 v0 (1/g1 + 1/g2)."""
    period = 2 * v0 * (1 / g1 + 1 / g2)
    found = periods({"b1": g1, "b2": -g2, "X_s": X_s}, {"x": X_s, "v": v0}, 6.5 * period)
    assert len(found) >= 5
    assert found == pytest.approx(period, rel=1e-12)


@pytest.mark.parametrize(("w1", "w2"), [(1.0, 1.7), (1e-3, 1e3), (2.0, 2.0)])
def test_two_undamped_springs_have_the_period_of_two_half_swings(w1, w2):
    """T = pi/w1 + pi/w2, whatever the amplitude."""
    period = np.pi / w1 + np.pi / w2
    for amplitude in (1e-6, 1.0, 1e6):
        found = periods({"w1": w1, "w2": w2}, {"x": 0.0, "v": amplitude}, 6.5 * period)
        assert len(found) >= 5
        assert found == pytest.approx(period, rel=1e-12)


def test_derivative_across_the_switch_is_the_saltation_matrix():
    """S = 1 + (f+ - f-) n^T/(n^T f-), n = (1, 0): [[1, 0], [jump of the acceleration/v, 1]]."""
    d, w1, w2, b1, b2, X_s = 0.1, 1.0, 1.7, 0.5, -0.8, 0.2
    A1 = np.array([[0.0, 1.0], [-(w1**2), -2 * d]])
    A2 = np.array([[0.0, 1.0], [-(w2**2), -2 * d]])
    rest1, start = np.array([b1 / w1**2, 0.0]), np.array([-0.5, 1.2])

    def left(t: float) -> np.ndarray:
        return rest1 + expm(t * A1) @ (start - rest1)

    crossing = root(lambda t: left(t)[0] - X_s, 0.0, 1.0)
    x, v = left(crossing)
    jump = (b2 - w2**2 * x) - (b1 - w1**2 * x)
    saltation = np.array([[1.0, 0.0], [jump / v, 1.0]])
    parameters = {**FREE, "d": d, "w1": w1, "w2": w2, "b1": b1, "b2": b2, "X_s": X_s}
    end = crossing + 0.3
    found = flow_derivative(fmu(), end, start={"x": -0.5, "v": 1.2}, parameters=parameters)
    derived = expm(-0.3 * A2) @ found.by_start @ expm(-crossing * A1)
    assert derived == pytest.approx(saltation, abs=1e-12)


@pytest.mark.parametrize("stop", [3.0, 30.0, 300.0])
def test_every_switch_keeps_areas(stop):
    """det S = 1, so the determinant is that of the damping, exp(-2 d t), whatever was crossed; forced by default."""
    assert len(simulate(fmu(), stop).events) > stop / 3 - 1
    found = flow_derivative(fmu(), stop, parameters={"d": 0.01})
    assert np.linalg.det(found.by_start) == pytest.approx(np.exp(-0.02 * stop), rel=1e-8)


def test_one_domain_on_both_sides_is_the_linear_oscillator():
    """x = A cos(W t) + B sin(W t) + decaying part; the switch changes nothing."""
    d, w, Q, W = 0.05, 1.3, 0.7, 2.0
    parameters = {"d": d, "w1": w, "w2": w, "b1": 0.0, "b2": 0.0, "Q1": Q, "Q2": Q, "W": W}
    a, b = w**2 - W**2, 2 * d * W
    A, B = Q * a / (a**2 + b**2), Q * b / (a**2 + b**2)
    run = simulate(fmu(), 50.0, parameters=parameters, start={"x": A, "v": B * W})
    assert len(run.events) > 20
    assert run["x"] == pytest.approx(A * np.cos(W * run.time) + B * np.sin(W * run.time), abs=1e-11)


def test_touching_the_switch_without_crossing_leaves_the_motion_alone():
    """The same constant field b = 1 on both sides: x = (t - 1)^2/2 touches X_s = 0 at t = 1."""
    run = simulate(fmu(), 3.0, parameters={**FREE, "b1": 1.0, "b2": 1.0}, start={"x": 0.5, "v": -1.0})
    assert run["x"] == pytest.approx((run.time - 1) ** 2 / 2, abs=1e-12)


@pytest.mark.parametrize(("v", "state"), [(1.0, 1), (-1.0, -1)])
def test_a_start_on_the_switch_goes_where_its_velocity_points(v, state):
    run = simulate(fmu(), 0.5, start={"x": 0.0, "v": v})
    assert run["side_state"][0] == state
    assert not any(event.time < 0.1 for event in run.events)


def test_a_start_at_rest_between_fields_that_part_leaves():
    run = simulate(fmu(), 2.0, parameters={**FREE, "b1": -1.0, "b2": 1.0}, start={"x": 0.0, "v": 0.0})
    assert np.abs(run["x"]) == pytest.approx(run.time**2 / 2, abs=1e-14)


def test_a_start_at_rest_between_fields_that_meet_is_refused():
    """Both fields push onto the switch, but its rate is the velocity: no flow along it can be derived."""
    with pytest.raises(StickslipError, match=r"contact 'side' keeps switching at t = 0: .* not determined"):
        simulate(fmu(), 2.0, parameters={**FREE, "b1": 1.0, "b2": -1.0}, start={"x": 0.0, "v": 0.0})


def test_damping_between_fields_that_meet_shrinks_the_speed_at_the_switch():
    """Flight with x'' = -g - 2 d v from v to -v': a tau (1 + e) = 1 - e, e = exp(-2 d tau) per side; here d small."""
    d, g = 1e-3, 1.0
    found = periods({"d": d, "b1": g, "b2": -g}, {"x": 0.0, "v": 1.0}, 200.0)
    # to first order in d a flight from v lands with v - 4 d v^2/(3 g) and takes 2 v/g - 4 d v^2/(3 g^2)
    ratio = found[1:] / found[:-1]
    mean = 0.5 * (found[1:] + found[:-1])
    assert (ratio < 1).all()
    assert 1 - ratio == pytest.approx(d * mean * 2 / 3, rel=0.01)
