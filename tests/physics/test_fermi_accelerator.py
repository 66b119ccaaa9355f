"""Fermi's accelerator against closed forms: wall sin(theta), fixed elastic wall at L, kappa = (1 + e)/(1 - e).

An impact with the vibrating wall takes v to -e v + (1 + e) cos(theta), one with the fixed wall to -v.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from bounces import at_impacts, fly, just_after, predicted_map
from lazy_fmu import LazyFmu

from fmu_models.base.errors import StickslipError
from fmu_models.sections.orbits import find_orbit, orbit_at
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

FERMI = LazyFmu("fermi_accelerator")
T = 2 * math.pi


def motion(L, e, m):
    """Phase of the impact at the vibrating wall, and v after it, of the motion that meets it once in m periods."""
    if e == 1.0:
        return -math.pi / 2, (L + 1) / (math.pi * m)
    kappa = (1 + e) / (1 - e)
    r = math.hypot(1, math.pi * m * kappa)
    phi = math.atan2(1, math.pi * m * kappa) - math.acos(L / r)
    return phi, kappa * math.cos(phi)


def range_of_stability(e, m):
    """L of the flip and of the saddle-node."""
    kappa = (1 + e) / (1 - e)
    flip = kappa * ((math.pi * m) ** 2 - 1) / math.hypot(math.pi * m, kappa)
    return flip, math.hypot(1, math.pi * m * kappa)


def on_the_way(L, e, m):
    """Time and state a quarter of the motion after the impact, on the way to the fixed wall."""
    phi, v = motion(L, e, m)
    return phi + m * math.pi / 2, {"x": math.sin(phi) + v * m * math.pi / 2, "v": v}


def test_default_motion():
    """L = 100, e = 0.9, m = 2: phi = 5.7136919915757950, v = 16.001311514163451; L_PD = 36.532655920670565."""
    phi, v = motion(100.0, 0.9, 2)
    assert (phi % T, v) == pytest.approx((5.7136919915757950, 16.001311514163451), rel=1e-14)
    assert range_of_stability(0.9, 2)[0] == pytest.approx(36.532655920670565, rel=1e-14)
    times, at = at_impacts(FERMI, 200 * T)
    hits = np.abs(at["x"]) < 50
    assert times[hits][-1] % T == pytest.approx(phi % T, abs=1e-12)
    assert at["v"][hits][-1] == pytest.approx(v, abs=1e-12)
    assert np.diff(times[hits]) == pytest.approx(2 * T, abs=1e-11)


@pytest.mark.parametrize(
    ("L", "e", "m"),
    [(100.0, 0.9, 2), (50.0, 0.9, 1), (100.0, 0.9, 4), (10.0, 0.5, 2), (100.0, 1.0, 1), (100.0, 1.0, 4)],
)
def test_multipliers(L, e, m):
    """Determinant e^2, trace 2 e + pi m (1 - e^2) tan(phi); elastic 2 - 4 pi^2 m^2/(L + 1), where phi = -pi/2.

    L = 100, e = 1: v = 32.149298504562858 and trace 1.6091245781746789 at m = 1; m = 4 is unstable.
    """
    phi, v = motion(L, e, m)
    trace = 2 - 4 * (math.pi * m) ** 2 / (L + 1) if e == 1.0 else 2 * e + math.pi * m * (1 - e**2) * math.tan(phi)
    if (L, e, m) == (100.0, 1.0, 1):
        assert (v, trace) == pytest.approx((32.149298504562858, 1.6091245781746789), rel=1e-14)
    time, start = on_the_way(L, e, m)
    orbit = orbit_at(FERMI, m * T, start, start_time=time, parameters={"L": L, "e": e})
    assert orbit.residual < 1e-11
    scale = np.linalg.norm(orbit.monodromy, 2) ** 2
    assert np.linalg.det(orbit.monodromy) == pytest.approx(e**2, abs=float(1e-13 * scale))
    assert np.trace(orbit.monodromy) == pytest.approx(trace, abs=1e-10)
    if e < 1.0:
        low, high = range_of_stability(e, m)
        assert orbit.stable == (low < L < high)
    else:
        assert (np.abs(orbit.multipliers).max() > 1 + 1e-9) == (abs(trace) > 2)


@pytest.mark.parametrize(("e", "m"), [(0.9, 1), (0.9, 2), (0.5, 1), (0.3, 3)])
def test_ends_of_stability(e, m):
    """-1 and -e^2 at the flip, +1 and e^2 at the saddle-node."""
    for L, sign, accuracy in zip(range_of_stability(e, m), (-1, 1), (1e-9, 1e-5), strict=True):
        time, start = on_the_way(L, e, m)
        orbit = orbit_at(FERMI, m * T, start, start_time=time, parameters={"L": L, "e": e})
        assert orbit.multipliers == pytest.approx([sign, sign * e**2], abs=accuracy)


def test_found_from_a_rough_guess():
    """The unstable motion at L below the flip: Newton's method stays on it."""
    L, e, m = 30.0, 0.9, 2
    time, start = on_the_way(L, e, m)
    guess = {"x": start["x"] + 1e-3, "v": start["v"] - 1e-3}
    orbit = find_orbit(FERMI, m * T, guess, start_time=time, parameters={"L": L, "e": e})
    assert [orbit.start["x"], orbit.start["v"]] == pytest.approx([start["x"], start["v"]], abs=1e-10)
    assert not orbit.stable


@pytest.mark.parametrize(("L", "e"), [(10.0, 1.0), (10.0, 0.9), (2.0, 0.6)])
def test_every_impact_map(L, e):
    """The map between walls in closed form; determinant e^2 at the vibrating wall and 1 at the fixed one."""
    time, contact, v = 0.3, "moving", 3.0
    for _ in range(12):
        speed, place = (math.cos(time), math.sin(time)) if contact == "moving" else (0.0, L)
        flight = fly(
            FERMI,
            time,
            place,
            (speed, v),
            lambda hit, t: math.cos(t) if hit == "moving" else 0.0,
            parameters={"L": L, "e": e},
        )
        assert flight is not None
        restitution = e if flight.contact == "moving" else 1.0
        hit_speed = math.cos(flight.hit) if flight.contact == "moving" else 0.0
        acceleration = -math.sin(flight.hit) if flight.contact == "moving" else 0.0
        expected = predicted_map(flight.hit - time, (speed, v, hit_speed), acceleration, restitution)
        assert flight.derivative == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())
        ratio = (flight.after - hit_speed) / (v - speed)
        assert np.linalg.det(flight.derivative) * ratio == pytest.approx(restitution**2, abs=1e-10)
        time, contact, v = flight.hit, flight.contact, flight.after


def test_elastic_walls_lose_nothing():
    """e = 1: no impact does work in the gap; walls at rest keep the energy, vibrating ones the areas dx dv."""
    start = {"x": 5.0, "v": 3.0}
    chaotic = simulate(FERMI, 200 * T, parameters={"L": 10.0, "e": 1.0}, start=start)
    energy = chaotic["energy"]
    assert len(chaotic.impacts) > 100
    assert max(abs(event.work) for event in chaotic.impacts) < 1e-14 * energy.max()
    assert energy.max() > 2 * energy.min()
    still = simulate(FERMI, 200 * T, parameters={"L": 10.0, "e": 1.0, "A": 0.0}, start=start)
    assert len(still.impacts) > 100
    assert still["energy"] == pytest.approx(4.5, rel=1e-14)
    assert np.diff([event.time for event in still.impacts]) == pytest.approx(10 / 3, abs=1e-11)
    derivative = flow_derivative(FERMI, 5 * T, parameters={"L": 10.0, "e": 1.0}, start=start).by_start
    scale = np.linalg.norm(derivative, 2) ** 2
    assert np.linalg.det(derivative) == pytest.approx(1.0, abs=float(1e-12 * scale))


def test_each_impact_of_the_elastic_wall():
    """e = 1: v after = 2 cos(theta) - v before; the energy changes by the work of the wall alone."""
    run = simulate(FERMI, 10 * T, parameters={"L": 10.0, "e": 1.0}, start={"x": 5.0, "v": 3.0})
    moving = np.array([event.time for event in run.impacts if event.contact == "moving"])
    times = np.sort(np.concatenate([moving - 1e-6, just_after(moving)]))
    at = simulate(FERMI, 10 * T, parameters={"L": 10.0, "e": 1.0}, start={"x": 5.0, "v": 3.0}, output_times=times)
    assert at["v"][1::2] == pytest.approx(2 * np.cos(moving) - at["v"][::2], abs=1e-11)


def test_overlapping_walls_are_refused():
    with pytest.raises(StickslipError, match="walls overlap"):
        simulate(FERMI, 1.0, parameters={"L": 0.5})
