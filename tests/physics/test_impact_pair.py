"""The impact pair against closed forms: walls +-D/2 + sin(theta), kappa = (1 + e)/(1 - e).

An impact takes v to -e v + (1 + e) cos(theta); between two impacts the particle keeps its speed.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from bounces import CHATTERING, CLOSED, OPEN, at_impacts, fly, just_after, predicted_map
from closed_form import root
from lazy_fmu import LazyFmu

from fmu_models.base.errors import StickslipError
from fmu_models.sections.orbits import find_orbit, orbit_at
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

PAIR = LazyFmu("impact_pair")
T = 2 * math.pi


def symmetric(D, e, n=1):
    """Phase of the impact at the right wall, and v after it, of the motion with n half-periods from wall to wall."""
    kappa = (1 + e) / (1 - e)
    phi = math.atan2(2, n * math.pi * kappa) + math.acos(-D / math.hypot(2, n * math.pi * kappa))
    return phi, kappa * math.cos(phi)


def range_of_stability(e, n=1):
    """D of symmetry breaking and of the saddle-node."""
    kappa = (1 + e) / (1 - e)
    broken = kappa * ((n * math.pi) ** 2 - 4) / math.hypot(n * math.pi, 2 * kappa)
    return broken, math.hypot(2, n * math.pi * kappa)


def half_way(D, e, n=1):
    """Time and state in the middle of the flight from the right wall to the left one."""
    phi, v = symmetric(D, e, n)
    return phi + n * math.pi / 2, {"x": D / 2 + math.sin(phi) + v * n * math.pi / 2, "v": v}


def multipliers_of_half(trace, determinant):
    """Eigenvalues of a 2 by 2 matrix, larger modulus first."""
    found = np.roots([1.0, -trace, determinant])
    return found[np.argsort(-np.abs(found))]


def test_default_motion():
    """e = 0.6, D = 6: phi and v after at the right wall; stable between D_SB and D_SN."""
    phi, v = symmetric(6.0, 0.6)
    assert (phi, v) == pytest.approx((2.2196526809040508, -2.4171022888002921), rel=1e-15)
    assert range_of_stability(0.6) == pytest.approx((2.7317184533479952, 12.724530263134657), rel=1e-15)
    run = simulate(PAIR, 100 * T)
    last = {event.contact: event.time % T for event in run.impacts[-2:]}
    assert last == pytest.approx({"right": phi, "left": phi + math.pi}, abs=1e-12)
    times, at = at_impacts(PAIR, 100 * T)
    assert at["v"][-4:] == pytest.approx(np.where(times[-4:] % T < math.pi, v, -v), abs=1e-12)


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("e", [0.3, 0.6, 0.85])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_symmetric_motions(e, n, share):
    """The half-map with mirror has the determinant e^2 and the trace 2 e + n pi (1 - e^2) tan(phi)/2; the multipliers
    over n periods are the squares of its eigenvalues. At D_SB the eigenvalue is +1: symmetry breaks, no flip.
    """
    broken, last = range_of_stability(e, n)
    D = broken + share * (last - broken)
    time, start = half_way(D, e, n)
    orbit = orbit_at(PAIR, n * T, start, start_time=time, parameters={"D": D, "e": e})
    assert orbit.residual < 1e-11
    phi, _ = symmetric(D, e, n)
    trace = 2 * e + n * math.pi * (1 - e**2) * math.tan(phi) / 2
    half = multipliers_of_half(trace, e**2)
    if share == 0.0:
        # the mirrored half-map turns the sign: its eigenvalue -1 is a motion that is its own mirror no more
        assert np.abs(half[0]) == pytest.approx(1.0, abs=1e-12)
        assert orbit.multipliers == pytest.approx([1.0, e**4], abs=1e-9)
    else:
        assert orbit.stable
        assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(half**2 + 0j), abs=1e-9)
    assert np.linalg.det(orbit.monodromy) == pytest.approx(e**4, abs=1e-10)


@pytest.mark.parametrize(("e", "n"), [(0.6, 1), (0.6, 3), (0.3, 1)])
def test_symmetric_motion_ends_in_a_fold(e, n):
    """At D_SN = sqrt(4 + n^2 pi^2 kappa^2) one multiplier is +1 again; beyond it there is no such motion."""
    _, last = range_of_stability(e, n)
    time, start = half_way(last, e, n)
    orbit = orbit_at(PAIR, n * T, start, start_time=time, parameters={"D": last, "e": e})
    assert orbit.residual < 1e-11
    # rounding of D moves phi by its root
    assert orbit.multipliers == pytest.approx([1.0, e**4], abs=1e-6)
    with pytest.raises(StickslipError):
        find_orbit(PAIR, n * T, start, start_time=time, parameters={"D": last * (1 + 1e-3), "e": e})


def test_asymmetric_pair_and_its_flip():
    """e = 0.6: below D_SB = 2.7317 two motions, each the mirror of the other half a period later, live down to a flip
    at D = 1.9831650412008264.
    """
    D, flip = 2.7, 1.9831650412008264
    run = simulate(PAIR, 2000 * T, parameters={"D": D}, start={"x": 0.1, "v": 1.0}, output_times=[2000 * T])
    orbit = find_orbit(PAIR, T, {"x": run["x"][0], "v": run["v"][0]}, parameters={"D": D})
    start = dict(orbit.start)
    for between in (*np.linspace(D, flip + 1e-2, 12), flip):
        orbit = find_orbit(PAIR, T, start, parameters={"D": between})
        start = dict(orbit.start)
        events = simulate(PAIR, T, start=start, parameters={"D": between}).impacts
        assert sorted(event.contact for event in events) == ["left", "right"]
        assert abs(abs(events[1].time - events[0].time) - math.pi) > 1e-2  # not symmetric
        assert np.linalg.det(orbit.monodromy) == pytest.approx(0.6**4, abs=1e-10)
    assert orbit.multipliers == pytest.approx([-1.0, -(0.6**4)], abs=1e-9)
    for side in (-1, 1):
        assert find_orbit(PAIR, T, start, parameters={"D": flip + side * 1e-9}).stable == (side > 0)
    half = simulate(PAIR, math.pi, start=start, parameters={"D": flip}, output_times=[math.pi])
    mirror = {"x": -half["x"][0], "v": -half["v"][0]}
    assert abs(mirror["x"] - start["x"]) > 1e-2
    assert orbit_at(PAIR, T, mirror, parameters={"D": flip}).residual < 1e-11


def test_plastic_particle():
    """e = 0, D < pi: at the right wall until it brakes at pi, then over after tau - sin(tau) = D, and there until 2 pi.

    D = 1: tau = 1.9345632107520243.
    """
    for D in (0.5, 1.0, 3.0):
        tau = root(lambda t, D=D: t - math.sin(t) - D, 0.0, 4.0)
        if D == 1.0:
            assert tau == pytest.approx(1.9345632107520243, rel=1e-15)
        run = simulate(PAIR, 4 * T, parameters={"D": D, "e": 0.0}, start={"x": 0.0, "v": 1.0})
        late = [event for event in run.events if T - 0.01 < event.time < 3 * T - 0.01]
        assert [(event.contact, event.before, event.after) for event in late] == [
            ("left", CLOSED, OPEN),
            ("right", OPEN, CLOSED),
            ("right", CLOSED, OPEN),
            ("left", OPEN, CLOSED),
        ] * 2
        expected = [T, T + tau, T + math.pi, T + math.pi + tau]
        assert [event.time for event in late] == pytest.approx(expected + [t + T for t in expected], abs=1e-12)


@pytest.mark.parametrize("D", [0.7, 2.0, 6.0])
@pytest.mark.parametrize("e", [0.0, 0.4, 0.8])
def test_speeds_are_bounded(D, e):
    """limsup |v after| <= kappa A omega: an impact takes |v| to e |v| + (1 + e) at most."""
    run = simulate(PAIR, 400 * T, parameters={"D": D, "e": e}, start={"x": 0.1, "v": 50.0})
    late = [i for i in run.impacts if i.time > 200 * T]
    side = {"right": -1, "left": 1}
    after = [math.cos(i.time) + side[i.contact] * e * math.sqrt(-2 * i.work / (1 - e**2)) for i in late]
    assert np.abs(after).max() <= (1 + e) / (1 - e) * (1 + 1e-12)


@pytest.mark.parametrize(("D", "e"), [(6.0, 0.6), (1.5, 0.6), (2.0, 0.9), (4.0, 1.0)])
def test_every_impact_map(D, e):
    """Along motions of any kind: the map between walls in closed form, and its determinant e^2 in (theta, w^2/2)."""
    wall = {"right": D / 2, "left": -D / 2}
    time, contact, v = 0.3, "right", -2.0
    for _ in range(12):
        speed = math.cos(time)
        place = wall[contact] + math.sin(time)
        flight = fly(PAIR, time, place, (speed, v), lambda _, t: math.cos(t), parameters={"D": D, "e": e})
        if flight is None:
            break
        hit_speed = math.cos(flight.hit)
        expected = predicted_map(flight.hit - time, (speed, v, hit_speed), -math.sin(flight.hit), e)
        assert flight.derivative == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())
        ratio = (flight.after - hit_speed) / (v - speed)
        assert np.linalg.det(flight.derivative) * ratio == pytest.approx(e**2, abs=1e-10)
        time, contact, v = flight.hit, flight.contact, flight.after
    assert time > 3.0


def test_chatter_at_the_walls():
    """D = 0.5, e = 0.3: the particle rests at a wall while that pushes and leaves where it brakes, at 0 and pi."""
    run = simulate(PAIR, 20 * T, parameters={"D": 0.5, "e": 0.3}, start={"x": 0.0, "v": 0.5})
    rests = [(event.contact, event.time) for event in run.events if (event.before, event.after) == (CHATTERING, CLOSED)]
    leaves = [(event.contact, event.time) for event in run.events if (event.before, event.after) == (CLOSED, OPEN)]
    assert len(rests) > 20
    assert abs(len(rests) - len(leaves)) <= 1
    for contact, time in leaves:
        # the right wall pushes to the left while its acceleration -sin(theta) is negative, the left one the other way
        assert math.sin(time) == pytest.approx(0.0, abs=1e-12)
        assert math.cos(time) * (-1 if contact == "right" else 1) > 0


def test_elastic_pair_keeps_areas():
    """e = 1: the flow over any time has the determinant 1."""
    start = {"x": 0.1, "v": 3.0}
    derivative = flow_derivative(PAIR, 10.0, start=start, parameters={"e": 1.0}).by_start
    assert np.linalg.det(derivative) == pytest.approx(1.0, abs=1e-9)


def test_negative_clearance_is_refused():
    with pytest.raises(StickslipError, match="walls overlap"):
        simulate(PAIR, 1.0, parameters={"D": -1.0})


def test_output_at_an_impact_is_after_it():
    """Segments are half-open: the state at the time of an event is that after it."""
    run = simulate(PAIR, T)
    first = run.impacts[0]
    at = simulate(PAIR, T, output_times=[first.time - 1e-9, float(just_after(first.time))])
    e, wall = 0.6, math.cos(first.time)
    assert at["v"][1] == pytest.approx(-e * at["v"][0] + (1 + e) * wall, abs=1e-13)
