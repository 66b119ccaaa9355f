"""The ball on a vibrating table against closed forms, with g = omega = 1 and the table at Gamma sin(theta).

An impact takes v to -e v + (1 + e) Gamma cos(theta). Between two impacts at theta and theta + D the height is
Gamma sin(theta) + v D - D^2/2.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from bounces import CHATTERING, CLOSED, OPEN, at_impacts, fly, predicted_map
from closed_form import root
from lazy_fmu import LazyFmu

from fmu_models.sections.orbits import find_orbit, orbit_at
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

pytestmark = pytest.mark.digits

BALL = LazyFmu("bouncing_ball")
T = 2 * math.pi


def scaled(gamma, e):
    return {"g": 1.0, "omega": 1.0, "A": gamma, "e": e}


def bounce(stop, gamma, e, x=0.0, v=0.0, **run):
    return simulate(BALL, stop, parameters=scaled(gamma, e), start={"x": x, "v": v}, **run)


def saddle_node(e, n=1):
    """Least Gamma of motions with one impact in n periods."""
    return n * math.pi * (1 - e) / (1 + e)


def flip(e, n=1):
    """Gamma at which the stable one of them doubles its period."""
    return math.hypot(saddle_node(e, n), 2 * (1 + e**2) / (1 + e) ** 2)


def trace(gamma, e, phi):
    """Of the derivative of the map over one impact."""
    return 1 + e**2 - (1 + e) ** 2 * gamma * math.sin(phi)


def highest_point(gamma, phi, n=1):
    """Time and state half-way between two impacts of the motion that meets the table at phi with v = n pi after."""
    half = n * math.pi
    return phi + half, {"x": gamma * math.sin(phi) + half**2 / 2, "v": 0.0}


@pytest.mark.parametrize(
    ("side", "phase", "multipliers"),
    [(1, 0.51016360854330479, None), (-1, -0.51016360854330479, (2.4671318358732939, 0.10133224190328166))],
)
def test_period_1(side, phase, multipliers):
    """Gamma = 1.2, e = 0.5: cos(phi) = n pi (1 - e)/((1 + e) Gamma), v after = n pi; determinant e^2, trace above."""
    gamma, e = 1.2, 0.5
    phi = side * math.acos(saddle_node(e) / gamma)
    assert phi == pytest.approx(phase, rel=1e-15)
    time, start = highest_point(gamma, phi)
    guess = {"x": start["x"] + 1e-2, "v": 1e-2}
    orbit = find_orbit(BALL, T, guess, start_time=time, parameters=scaled(gamma, e))
    assert [orbit.start["x"], orbit.start["v"]] == pytest.approx([start["x"], 0.0], abs=1e-13)
    assert np.linalg.det(orbit.monodromy) == pytest.approx(e**2, abs=1e-12)
    assert np.trace(orbit.monodromy) == pytest.approx(trace(gamma, e, phi), abs=1e-12)
    assert orbit.stable == (side > 0)
    if multipliers:
        assert orbit.multipliers == pytest.approx(multipliers, abs=1e-12)
    else:
        assert np.trace(orbit.monodromy) == pytest.approx(-0.068464077776575518, abs=1e-12)
    times, at = at_impacts(BALL, time + T, start_time=time, start=dict(orbit.start), parameters=scaled(gamma, e))
    assert times - T == pytest.approx([phi], abs=1e-13)
    assert at["v"] == pytest.approx([math.pi], abs=1e-13)


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("e", [0.2, 0.5, 0.8])
def test_period_n_is_born_and_doubles(n, e):
    """Multipliers are +1, e^2 at Gamma_SN = n pi (1 - e)/(1 + e), where phi = 0, and -1, -e^2 at the flip,
    Gamma_PD^2 = Gamma_SN^2 + (2 (1 + e^2)/(1 + e)^2)^2.
    """
    for gamma, expected in ((saddle_node(e, n), (1, e**2)), (flip(e, n), (-1, -(e**2)))):
        phi = math.acos(saddle_node(e, n) / gamma)
        time, start = highest_point(gamma, phi, n)
        orbit = orbit_at(BALL, n * T, start, start_time=time, parameters=scaled(gamma, e))
        assert orbit.residual < 1e-11
        assert orbit.multipliers == pytest.approx(expected, abs=1e-10)


def test_the_scenario_of_one_restitution():
    """e = 0.5: onset at 1.0471975511965977, flip at 1.5268237005190609; there is nothing below the onset, and the
    long-run motion has period 1 before the flip and 2 after.
    """
    e = 0.5
    assert saddle_node(e) == pytest.approx(1.0471975511965977, rel=1e-15)
    assert flip(e) == pytest.approx(1.5268237005190609, rel=1e-15)
    for gamma, period in ((1.04, 0), (1.06, 1), (1.52, 1), (1.535, 2)):
        x = bounce(1005 * T, gamma, e, v=math.pi, output_times=T * np.arange(1000, 1006))["x"]
        recurs = next(n for n in (1, 2) if np.abs(x[n:] - x[:-n]).max() < 1e-6)
        assert (0 if np.abs(x).max() < 1e-9 else recurs) == period  # at theta = 0 it lies on the table or is high up


def test_period_2_doubles():
    """e = 0.5: at Gamma = 1.6671306607695431 the motion of two impacts in two periods has the multiplier -1."""
    gamma, e = 1.6671306607695431, 0.5
    long = bounce(400 * T, gamma - 1e-3, e, v=math.pi, output_times=[400 * T])
    guess = {"x": long["x"][0], "v": long["v"][0]}
    orbit = find_orbit(BALL, 2 * T, guess, parameters=scaled(gamma, e))
    assert orbit.multipliers == pytest.approx([-1, -(e**4)], abs=1e-9)
    assert len(bounce(2 * T, gamma, e, **orbit.start).impacts) == 2
    for side in (-1, 1):
        beside = find_orbit(BALL, 2 * T, orbit.start, parameters=scaled(gamma + side * 1e-9, e))
        assert beside.stable == (side < 0)


@pytest.mark.parametrize(("gamma", "e"), [(3.0, 0.7), (1.9, 0.5), (8.0, 0.9), (2.5, 1.0)])
def test_every_impact_map(gamma, e):
    """Along chaotic motions: [[q, -D/w], ...] of each impact, and its determinant e^2 in (theta, w^2/2)."""
    time, v = 0.3, gamma * math.cos(0.3) + 3.0
    for _ in range(12):
        speed = gamma * math.cos(time)
        flight = fly(
            BALL,
            time,
            gamma * math.sin(time),
            (speed, v),
            lambda _, t: gamma * math.cos(t),
            parameters=scaled(gamma, e),
        )
        if flight is None:
            break
        hit_speed, hit_acceleration = gamma * math.cos(flight.hit), -gamma * math.sin(flight.hit)
        expected = predicted_map(flight.hit - time, (speed, v, hit_speed), hit_acceleration, e, -1.0)
        assert flight.derivative == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())
        # w dw = w (dv - u'' dtheta)
        ratio = (flight.after - hit_speed) / (v - speed)
        assert np.linalg.det(flight.derivative) * ratio == pytest.approx(e**2, abs=1e-10)
        time, v = flight.hit, flight.after
    assert time > T


@pytest.mark.parametrize(("gamma", "e", "periods"), [(3.0, 0.9, 20), (1.2, 0.5, 3)])
def test_areas_shrink_by_e_squared_per_impact(gamma, e, periods):
    """The flow keeps dx dv in flight; every impact multiplies it by e^2."""
    start = {"x": 1.0, "v": 4.0}
    impacts = len(bounce(periods * T, gamma, e, **start).impacts)
    assert impacts > 2
    derivative = flow_derivative(BALL, periods * T, start=start, parameters=scaled(gamma, e)).by_start
    size = np.linalg.norm(derivative, 2) ** 2
    assert np.linalg.det(derivative) == pytest.approx(e ** (2 * impacts), rel=1e-8, abs=float(1e-13 * size))


@pytest.mark.parametrize(("e", "end"), [(0.5, 2.6817425236699174), (0.9, 10.671661474326789)])
def test_chatter_on_the_moving_table(e, end):
    """Gamma = 0.5, from theta = 0 with v = 1: infinitely many impacts end at t_inf; then the ball rides for good."""
    run = bounce(10 * T, 0.5, e, v=1.0)
    assert [event.after for event in run.events[-2:]] == [CHATTERING, CLOSED]
    assert run.events[-1].time == pytest.approx(end, abs=1e-12)
    late = run.time > end + 1e-9
    assert np.abs(run["gap"][late]).max() < 1e-14


def test_stick_cycle():
    """Gamma = 1.2, e = 0.2: release where sin(theta) = 1/Gamma, one hop, chatter, rest; the same in every period."""
    run = bounce(20 * T, 1.2, 0.2, v=1.2)
    release = math.asin(1 / 1.2)
    assert release == pytest.approx(0.98511078333774566, rel=1e-15)
    begins = [event.time for event in run.events if (event.before, event.after) == (CLOSED, OPEN)]
    assert begins == pytest.approx(release + T * np.arange(20), abs=1e-12)
    first = [next(event.time for event in run.impacts if event.time > begin) for begin in begins]
    assert np.array(first) - begins == pytest.approx(3.3874157078481649 - release, abs=1e-12)
    rests = [event.time for event in run.events if (event.before, event.after) == (CHATTERING, CLOSED)]
    assert np.array(rests[:20]) - begins == pytest.approx(3.5971035314219925 - release, abs=1e-12)


def landing(gamma):
    """Where a ball released at sin(theta) = 1/gamma meets the table again."""
    begin = math.asin(1 / gamma)
    x, v = 1.0, gamma * math.cos(begin)
    # without the triple zero at s = 0
    rest = lambda s: (x + v * s - s * s / 2 - gamma * math.sin(begin + s)) / s**3  # noqa: E731
    return begin, begin + root(rest, 0.02, 3 * math.pi)


@pytest.mark.parametrize("gamma", [1.001, 1.2, 2.0, 3.2])
def test_plastic_ball_hops_once_per_period(gamma):
    """e = 0: release at sin(theta) = 1/Gamma, landing for good, for 1 < Gamma < sqrt(1 + pi^2)."""
    begin, land = landing(gamma)
    if gamma == 2.0:
        assert (begin, land) == pytest.approx((math.pi / 6, 5.1824502513098596), rel=1e-14)
    run = bounce(6 * T + 0.9 * begin, gamma, 0.0, v=gamma)
    assert [(event.before, event.after) for event in run.events] == [(CLOSED, OPEN), (OPEN, CLOSED)] * 6
    times = np.array([event.time for event in run.events]).reshape(6, 2)
    # a cubic departure: rounding of the release is felt at a short hop
    expected = np.add.outer(T * np.arange(6), (begin, land))
    assert times == pytest.approx(expected, abs=1e-12 if gamma > 1.1 else 1e-9)


def test_plastic_ball_beyond_one_hop():
    """e = 0: at Gamma = sqrt(1 + pi^2) the hop lands just where the table would throw again."""
    for side, after in ((-1, CLOSED), (1, OPEN)):
        gamma = math.sqrt(1 + math.pi**2) + side * 1e-3
        run = bounce(1.2 * T, gamma, 0.0, v=gamma)
        assert run.impacts[0].after == after


@pytest.mark.parametrize(
    ("below", "expected"), [(1e-4, 0.48585762866182985), (1e-8, 0.49985857864352699), (-1e-12, 3.2831147565030203)]
)
def test_near_graze(below, expected):
    """Gamma = 2, from theta = (pi - 1)/2 with v = 1/2 at x = 1.875 - d: touches the table at d = 0, misses it below.

    At d = 0 both arrive at theta = pi/2 with x = 2 and without speed.
    """
    begin = (math.pi - 1) / 2
    run = bounce(begin + 4, 2.0, 0.5, x=1.875 - below, v=0.5, start_time=begin)
    # the time at which a graze is missed depends on d by its root
    assert run.impacts[0].time - begin == pytest.approx(expected, abs=1e-9 if below > 0 else 2e-6)


@pytest.mark.parametrize(
    ("e", "end"), [(0.5, 1.3545709229571927), (0.9, 8.5789491787288872), (0.999, 902.59575833047608)]
)
def test_static_floor(e, end):
    """Dropped from h0 = 1 onto a floor that rests: t1 (1 + e)/(1 - e), t1 = sqrt(2 h0/g); all energy m g h0 is lost."""
    first = math.sqrt(2 / 9.81)
    assert first * (1 + e) / (1 - e) == pytest.approx(end, rel=1e-13)
    parameters = {"A": 0.0, "g": 9.81, "e": e}
    run = simulate(BALL, 1.5 * end, start={"x": 1.0, "v": 0.0}, parameters=parameters)
    assert run.events[-1].time == pytest.approx(end, abs=1e-9)
    assert [event.after for event in run.events[-2:]] == [CHATTERING, CLOSED]
    pauses = np.diff([event.time for event in run.impacts])
    assert pauses[:20] == pytest.approx(2 * first * e ** np.arange(1, 21), rel=1e-9)
    assert sum(event.work for event in run.impacts) == pytest.approx(-9.81, rel=1e-12)
    assert run["x"][-1] == 0.0


@pytest.mark.parametrize(
    ("theta", "state", "events"),
    [
        (0.2, CLOSED, [(math.pi / 6, CLOSED, OPEN)]),
        (1.0, OPEN, [(1.0 + 3.9777690548940729, OPEN, OPEN)]),
        (math.pi / 6, OPEN, [(None, OPEN, OPEN)]),
        (5 * math.pi / 6, CLOSED, [(13 * math.pi / 6, CLOSED, OPEN)]),
    ],
)
def test_starts_in_contact(theta, state, events):
    """Gamma = 2, on the table with its speed: the ball stays where it presses, -P = 1 - Gamma sin(theta) > 0 or, at
    P = 0, rising; at pi/6 it falls.
    """
    x, v = 2 * math.sin(theta), 2 * math.cos(theta)
    run = bounce(theta + T, 2.0, 0.5, x=x, v=v, start_time=theta)
    assert run["table_state"][0] == state
    for (time, before, after), event in zip(events, run.events, strict=False):
        assert (event.before, event.after) == (before, after)
        if time is not None:
            assert event.time == pytest.approx(time, abs=1e-12)
    if theta == math.pi / 6:
        assert run.events[0].time == pytest.approx(5.1824502513098596, abs=1e-12)


@pytest.mark.parametrize("e", [0.0, 0.3, 0.5, 0.8])
@pytest.mark.parametrize("gamma", [0.9, 2.0, 5.0])
def test_speeds_are_bounded(gamma, e):
    """limsup v after <= (1 + 3 e) Gamma/(1 - e), whatever the start.

    Speeds from the energy that an impact loses: (1 - e^2) w^2/2 at the gap speed w before; v = u' + e w after.
    """
    run = bounce(300 * T, gamma, e, x=300.0, v=20.0)
    late = [event for event in run.impacts if event.time > 100 * T]
    after = [gamma * math.cos(i.time) + e * math.sqrt(-2 * i.work / (1 - e**2)) for i in late]
    assert max(after, default=0.0) <= (1 + 3 * e) * gamma / (1 - e)
    assert max(after, default=1.0) > 0.5  # of nothing else


def test_weak_shaking_never_lifts():
    """Gamma <= 1: a ball at rest on the table stays, exactly at Gamma = 1 as well."""
    for gamma in (0.0, 0.5, 1.0 - 1e-12, 1.0):
        assert not bounce(20 * T, gamma, 0.5, v=gamma).events
    assert bounce(T, 1.0 + 1e-6, 0.5, v=1.0 + 1e-6).events


def test_the_default_start_reaches_the_stable_motion():
    """SI units, 10 Hz: phase 0.51016 rad, flight 0.1 s, v = pi g/omega after."""
    times, at = at_impacts(BALL, 20.0)
    assert (times[-1] * 20 * math.pi) % T == pytest.approx(0.51016360854330479, abs=1e-9)
    assert at["v"][-1] == pytest.approx(9.81 / 20, rel=1e-10)
