"""Rigid contacts where event-driven programs fail: grazes, Zeno, starts in contact, ties, long runs, extreme scales."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy
from bounces import CHATTERING, CLOSED, OPEN
from colliding import plate
from lazy_fmu import LazyFmu
from mechanisms import LENGTH, mechanism

from fmu_models import load
from fmu_models.base.errors import StickslipError
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.run import simulate

BALL = LazyFmu("bouncing_ball")
PAIR = LazyFmu("impact_pair")
T = 2 * math.pi
SCALED = {"g": 1.0, "omega": 1.0}


@pytest.mark.parametrize("exponent", range(1, 14))
def test_no_graze_is_missed(exponent):
    """Gamma = 2, v = 1/2 from (pi - 1)/2: the gap has its minimum -d there and two zeros close to each other.

    Near pi/2 + s the gap is (1 + ...) s^2/2 - d: it is entered at s = -sqrt(2 d) and to that order.
    """
    d, begin = 10.0**-exponent, (math.pi - 1) / 2
    for side in (1, -1):
        run = simulate(
            BALL,
            begin + 2,
            start_time=begin,
            parameters={**SCALED, "A": 2.0, "e": 0.5},
            start={"x": 1.875 - side * d, "v": 0.5},
        )
        assert bool(run.impacts) == (side > 0)
        if side > 0:
            early = 0.5 - (run.impacts[0].time - begin)
            assert early == pytest.approx(math.sqrt(2 * d), rel=2 * math.sqrt(d) + 1e-3)


@pytest.mark.parametrize("e", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_nothing_falls_through_after_infinitely_many_bounces(e):
    """At rest from t1 (1 + e)/(1 - e) on, long after; t1 = sqrt(2 h0/g)."""
    end = math.sqrt(2.0) * (1 + e) / (1 - e)
    run = simulate(BALL, 10 * end, parameters={**SCALED, "A": 0.0, "e": e}, start={"x": 1.0, "v": 0.0})
    late = run.time > end + 1e-6
    assert np.abs(run["x"][late]).max() == 0.0
    assert run["table_state"][-1] == CLOSED
    assert run["x"].min() >= 0.0
    assert run.events[-1].time == pytest.approx(end, rel=1e-12)


def test_elastic_ball_never_rests():
    """e = 1: impacts at (2 k + 1) sqrt(2 h0/g), none of them the end; the height is kept."""
    run = simulate(BALL, 10000.0, parameters={**SCALED, "A": 0.0, "e": 1.0}, start={"x": 1.0, "v": 0.0})
    times = np.array([event.time for event in run.events])
    assert {(event.before, event.after) for event in run.events} == {(OPEN, OPEN)}
    assert times == pytest.approx((2 * np.arange(len(times)) + 1) * math.sqrt(2.0), rel=2e-12)
    assert len(times) == 3536
    assert run["energy"] == pytest.approx(1.0, rel=1e-11)  # of rounding, 1e-15 in each impact


def test_long_chaos_stays_above_the_table():
    """Gap >= -1e-12 over some 250 000 impacts; Gamma = 4.5, e = 0.5, with chatter and rest between the flights."""
    stop = 7e5
    samples = np.sort(np.random.default_rng(1).uniform(0.0, stop, 70_000))
    run = simulate(
        BALL,
        stop,
        parameters={**SCALED, "A": 0.9, "g": 0.2, "e": 0.5},
        start={"x": 0.0, "v": 2.0},
        output_times=samples,
    )
    assert len(run.impacts) > 240_000
    assert run["gap"].min() >= -1e-12
    assert np.isfinite(run["v"]).all()


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e5, 1e7])
@pytest.mark.parametrize("phase", [0.0, 1e3, 1e6])
def test_a_start_on_a_moving_table_is_no_penetration(offset: float, phase: float) -> None:
    """Its height, rounded once or as computed in doubles: far from time zero they differ by more than a digit."""
    fmu = BALL
    A, omega = (float(fmu.variables[name].start or 0.0) for name in ("A", "omega"))
    for share in np.linspace(0.05, 0.95, 7):
        begin = offset + float(share)
        exact = float(A * mpmath.sin(mpmath.mpf(omega) * mpmath.mpf(begin) + phase))
        for height in (exact, A * math.sin(omega * begin + phase)):
            start = {"x": height, "v": 1.0}
            simulate(fmu, begin + 0.1, start_time=begin, start=start, parameters={"phi0": phase})
        with pytest.raises(StickslipError, match="is penetrated"):
            start = {"x": exact - 1e-15 * (1.0 + omega * begin + phase), "v": 1.0}
            simulate(fmu, begin + 0.1, start_time=begin, start=start, parameters={"phi0": phase})


def test_starts_below_a_wall_are_refused():
    """With the penetration, and whose wall it is."""
    with pytest.raises(StickslipError, match=r"wall of the rigid contact 'table' is penetrated by 0\.25 at t = 0"):
        simulate(BALL, 1.0, parameters={**SCALED, "A": 0.0}, start={"x": -0.25, "v": 1.0})
    with pytest.raises(StickslipError, match=r"'right' is penetrated by 1 at"):
        simulate(PAIR, 1.0, parameters={"D": 6.0}, start={"x": 4.0})
    with pytest.raises(StickslipError, match=r"penetrated by 1e-09"):
        simulate(BALL, 1.0, parameters={**SCALED, "A": 0.0}, start={"x": -1e-9, "v": 1.0})


@pytest.mark.parametrize("e", [-0.1, 1.1])
def test_restitution_out_of_its_range_is_refused(e):
    with pytest.raises(StickslipError, match="'e'"):
        simulate(BALL, 1.0, parameters={"e": e})


@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_two_walls_at_one_instant(law, e):
    """A plate that falls flat meets the floor with both corners: one impact, vy -> -e vy without spin."""
    parameters = {"e": e, "e2": e, "mu": 0.0, "mu2": 0.0}
    run = simulate(plate(law), 2.0, start={"y": 1.0, "vy": -1.0}, parameters=parameters)
    assert [event.time for event in run.events[:2]] == pytest.approx([1.0, 1.0], rel=1e-15)
    assert run.events[0].time == run.events[1].time
    assert {event.contact for event in run.events} >= {"left", "right"}
    assert run["vy"][-1] == pytest.approx(e, abs=1e-15)
    assert run["w"][-1] == pytest.approx(0.0, abs=1e-14)
    assert sum(event.work for event in run.events) == pytest.approx(-(1 - e**2) / 2, abs=1e-15)


def test_landing_where_the_wall_lets_go():
    """Plastic impact pair with D = pi: released at pi with -1, it lands on the left wall at 2 pi, when that brakes."""
    run = simulate(PAIR, 10 * T, parameters={"D": math.pi, "e": 0.0}, start={"x": 0.0, "v": 1.0})
    late = np.array([event.time for event in run.impacts if event.time > T])
    assert late / math.pi == pytest.approx(np.round(late / math.pi), abs=1e-9)
    assert set(np.diff(np.round(late / math.pi))) == {1.0}


def test_event_at_the_end_time():
    """A run is (start, end]: the impact at t = 1 belongs to a run that ends there, and is over."""
    parameters = {"A": 0.0, "g": 2.0, "e": 0.5, "omega": 1.0}
    run = simulate(BALL, 1.0, parameters=parameters, start={"x": 1.0, "v": 0.0}, output_times=[1.0])
    assert [event.time for event in run.events] == pytest.approx([1.0], rel=1e-15)
    assert run["v"][0] == pytest.approx(1.0, rel=1e-14)
    assert run["x"][0] == pytest.approx(0.0, abs=1e-15)
    before = simulate(BALL, 1.0 - 1e-12, parameters=parameters, start={"x": 1.0, "v": 0.0})
    assert not before.events


def test_no_further_event_ends_soon():
    """Without gravity a ball flies off for good; on a table at rest it lies for good."""
    flies = simulate(
        BALL, 1e5, parameters={**SCALED, "g": 0.0, "A": 1.0}, start={"x": 5.0, "v": 1.0}, output_times=[1e5]
    )
    assert not flies.events
    assert flies["x"][0] == pytest.approx(1e5, rel=1e-4)
    lies = simulate(BALL, 1e5, parameters={**SCALED, "A": 0.0}, start={"x": 0.0, "v": 0.0}, output_times=[1e5])
    assert not lies.events
    assert (lies["x"][0], lies["table_state"][0]) == (0.0, CLOSED)


def test_phase_after_many_cycles():
    """An impact pair on its periodic motion: after 20 000 periods the time of impact is right to its last digits."""
    cycles = 20_000
    run = simulate(PAIR, cycles * T, output_times=[cycles * T])
    last = [event.time for event in run.impacts if event.contact == "right"][-1]
    with mpmath.workdps(40):
        kappa = mpmath.mpf("1.6") / mpmath.mpf("0.4")
        phi = mpmath.atan2(2, mpmath.pi * kappa) + mpmath.acos(-6 / mpmath.sqrt(4 + (mpmath.pi * kappa) ** 2))
        exact = phi + 2 * mpmath.pi * mpmath.nint((last - phi) / (2 * mpmath.pi))
        assert abs(last - exact) < 4 * np.spacing(last)


def scaled_events(fmu, omega, stop, parameters, start):
    """Events of a motion in units of 1/omega; lengths as they are."""
    parameters = {**parameters, "omega": omega}
    if "g" in parameters:
        parameters["g"] *= omega**2
    start = {"x": start["x"], "v": start["v"] * omega}
    run = simulate(fmu, stop / omega, parameters=parameters, start=start, output_times=[stop / omega])
    return [(event.contact, event.before, event.after) for event in run.events], [e.time * omega for e in run.events]


@pytest.mark.parametrize("omega", [1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9])
def test_any_time_scale(omega):
    """Stick cycle of the ball and of the impact pair, chatter and release: the same events at omega t."""
    cases = [
        (BALL, {"g": 1.0, "A": 1.2, "e": 0.2}, {"x": 0.0, "v": 1.2}),
        (BALL, {"g": 1.0, "A": 2.0, "e": 0.0}, {"x": 0.0, "v": 2.0}),
        (PAIR, {"D": 1.0, "e": 0.1}, {"x": 0.0, "v": 0.5}),
        (PAIR, {"D": 1.0, "e": 0.0}, {"x": 0.0, "v": 0.5}),
    ]
    for fmu, parameters, start in cases:
        kinds, times = scaled_events(fmu, 1.0, 5 * T - 0.5, parameters, start)
        assert (CLOSED, OPEN) in {(before, after) for _, before, after in kinds}
        scaled_kinds, scaled_times = scaled_events(fmu, omega, 5 * T - 0.5, parameters, start)
        assert scaled_kinds == kinds
        assert scaled_times == pytest.approx(times, abs=1e-11)


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_any_length_scale(scale):
    """Lengths and gravity scaled together: the same events."""
    run, scaled = (
        simulate(BALL, 5 * T, parameters={"omega": 1.0, "g": s, "A": 1.2 * s, "e": 0.2}, start={"x": 0.0, "v": 1.2 * s})
        for s in (1.0, scale)
    )
    assert [event.after for event in scaled.events] == [event.after for event in run.events]
    assert [event.time for event in scaled.events] == pytest.approx([event.time for event in run.events], abs=1e-11)


def test_chatter_has_one_end_per_series():
    """e = 0.999: 18 412 impacts, the last of them followed by the remainder of the series in closed form."""
    run = simulate(BALL, 1000.0, parameters={"A": 0.0, "g": 9.81, "e": 0.999}, start={"x": 1.0, "v": 0.0})
    assert len(run.impacts) == pytest.approx(18412, abs=10)
    assert sum(event.after == CHATTERING for event in run.events) == 1


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_crank_turns_on_past_a_wall_that_its_slider_just_reaches(restitution: float) -> None:
    """Gap and lever vanish together at the dead centre: no impulse there stops the crank, which turns as if alone."""
    angle = Coordinate("phi", "rad", "angle of the crank", velocity="Omega")
    J = Parameter("J", 1.0, "kg m2", "moment of inertia", positive=True)
    head = Impact(name="head", gap=LENGTH * (1 + sympy.sin(angle)), restitution=Newton(sympy.Float(restitution)))
    crank = load(mechanism("crank", [angle], J * angle.v**2 / 2, sympy.S.Zero, [head]))
    for start, speed in np.random.default_rng(5).uniform([-1.5, 0.5], [1.5, 3.0], (20, 2)):
        run = simulate(crank, 20.0, start={"phi": start, "Omega": -speed}, output_times=[20.0])
        assert not run.events
        assert run["phi"][-1] == pytest.approx(start - 20.0 * speed, abs=1e-12)
