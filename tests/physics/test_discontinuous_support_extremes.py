"""The oscillator with a discontinuous support at extreme parameters and awkward starts, against closed forms."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import brentq
from test_discontinuous_support import AWAY, ORBITS, RELEASED, REST, SUPPORT, TOUCHING, T, free_flow, state

from fmu_models.simulation.run import simulate


@pytest.mark.parametrize("ks", [1e9, 1e12])
def test_a_hard_support_is_an_impact_with_restitution(ks):
    """One contact without force: within cs/sqrt(ks m) of a perfectly elastic impact; the contact's own closed form.

    The closed form is written out: a matrix exponential loses digits as ks t, and how many depends on the processor.
    """
    parameters = {"ks": ks, "f0": 0.0}
    run = simulate(SUPPORT, 1.0, start={"x": 3.9, "v": 2.0}, parameters=parameters, output_times=[1.0])
    assert [event.after for event in run.events] == [TOUCHING, RELEASED, AWAY]
    entry, leave, _ = (event.time for event in run.events)
    x, v = free_flow(entry, 3.9, 2.0)
    assert x == pytest.approx(4.0, rel=1e-14)
    # in contact, with d = x - g: d'' + 2 a d' + (k + ks) d = -k g
    a, rest = 0.175, -4.0 / (1.0 + ks)
    frequency = np.sqrt(1.0 + ks - a**2)

    def inside(t):
        cos, sin = np.cos(frequency * t), np.sin(frequency * t) / frequency
        depth = -rest * cos + (v - a * rest) * sin
        rate = v * cos - (a * v - (1.0 + ks) * rest) * sin
        return np.exp(-a * t) * np.array([depth, rate]) + [rest, 0.0]

    span = np.pi / np.sqrt(ks)
    exact = cast(float, brentq(lambda t: ks * inside(t)[0] + 0.3 * inside(t)[1], 0.5 * span, 1.2 * span, xtol=1e-22))
    # each end of the contact lies where x, near 4, is known to the distance of its neighbours: that over the speed
    placed = np.spacing(4.0) / v
    assert leave - entry == pytest.approx(exact, abs=2 * placed)
    assert state(run) == pytest.approx(
        free_flow(1.0 - entry - exact, *(inside(exact) + np.array([4.0, 0.0]))), abs=1e-9
    )


@pytest.mark.parametrize("cs", [2 * np.sqrt(11.0) - 0.05, 6.0, 50.0, 1e6])
def test_critical_and_overdamped_contact(cs):
    """No force; the state after 0.02 s of contact, and a support force of zero at its end."""
    from scipy.linalg import expm

    run = simulate(SUPPORT, 2.0, start={"x": 3.9, "v": 2.0}, parameters={"f0": 0.0, "cs": cs})
    entry, leave = (event.time for event in run.events[:2])
    assert [event.after for event in run.events[:3]] == [TOUCHING, RELEASED, AWAY]
    later = min(entry + 0.02, 0.5 * (entry + leave))
    at = simulate(
        SUPPORT, 2.0, start={"x": 3.9, "v": 2.0}, parameters={"f0": 0.0, "cs": cs}, output_times=[later, leave]
    )
    A, rest = np.array([[0.0, 1.0], [-11.0, -(0.05 + cs)]]), np.array([-4.0 / 11.0, 0.0])
    _, v = free_flow(entry, 3.9, 2.0)
    inside = expm(A * (later - entry)) @ ([0.0, v] - rest) + rest + [4.0, 0.0]
    assert state(at, 0) == pytest.approx(inside, abs=1e-9)
    force = 10.0 * (at["x"][1] - 4.0) + cs * at["v"][1]
    assert abs(force) < 1e-11 * cs
    assert at["x"][1] > 4.0
    assert at["support_force"][1] == 0.0


@pytest.mark.parametrize(("tolerance", "drift"), [(1e-12, 1e-10), (1e-14, 1e-12)])
def test_without_damping_and_force_energy_is_kept(tolerance, drift):
    """c = cs = 0, f0 = 0: over t = 1000 some 900 steps lose their tolerance each in the same sense."""
    setup: dict[str, Any] = {"parameters": {"c": 0.0, "cs": 0.0, "f0": 0.0}, "output_times": np.linspace(0, 1000, 4001)}
    run = simulate(SUPPORT, 1000.0, start={"x": 0.0, "v": 6.0}, tolerance=tolerance, **setup)
    stored = run["energy"] + np.where(run["support_state"] == TOUCHING, 5.0 * (run["x"] - 4.0) ** 2, 0.0)
    assert len(run.events) > 300
    assert np.abs(stored / 18.0 - 1.0).max() < drift


def test_gap_zero_without_damping_is_two_half_swings():
    """A bilinear oscillator: period pi/sqrt(k/m) + pi/sqrt((k + ks)/m)."""
    parameters = {"c": 0.0, "cs": 0.0, "f0": 0.0, "g": 0.0}
    swing = np.pi + np.pi / np.sqrt(11.0)
    run = simulate(SUPPORT, 50 * swing, start={"x": -1.0, "v": 0.0}, parameters=parameters, output_times=[50 * swing])
    assert state(run) == pytest.approx([-1.0, 0.0], abs=1e-11)
    assert len(run.events) == 100


@pytest.mark.parametrize("gap", [0.0, 1e-12])
def test_start_at_rest_at_the_support(gap):
    """Pushed in by the force from the first instant; a gap of 1e-12 changes nothing that can be seen."""
    contacts = [TOUCHING, RELEASED, AWAY]
    run = simulate(SUPPORT, 100.0, start=REST, parameters={"g": gap}, output_times=[100.0])
    assert [event.after for event in run.events[:6]] == contacts * 2
    assert run.events[0].time == pytest.approx(np.sqrt(2 * gap / 0.5), abs=1e-9)
    tight = simulate(SUPPORT, 100.0, start=REST, parameters={"g": 0.0}, output_times=[100.0], tolerance=1e-15)
    assert state(run) == pytest.approx(state(tight), abs=1e-10)
    pulled = simulate(SUPPORT, 1.0, start=REST, parameters={"g": gap, "f0": -0.5})
    assert pulled.events == ()


def test_preloaded_support():
    """g = -1: pressed on from the start; without force it settles where spring and support balance."""
    parameters = {"g": -1.0, "f0": 0.0}
    run = simulate(SUPPORT, 300.0, start=REST, parameters=parameters)
    assert run["support_state"][0] == TOUCHING
    assert run["x"][-1] == pytest.approx(-10.0 / 11.0, rel=1e-12)
    assert run["support_force"][-1] == pytest.approx(10.0 / 11.0, rel=1e-12)


def test_a_large_force_is_a_matter_of_scale():
    """f0 and g times 2e6: everything times 2e6."""
    small = simulate(SUPPORT, 100.0, start=REST, output_times=[50.0, 100.0])
    large = simulate(SUPPORT, 100.0, start=REST, parameters={"f0": 1e6, "g": 8e6}, output_times=[50.0, 100.0])
    assert large["x"] == pytest.approx(2e6 * small["x"], rel=1e-11)
    assert [e.time for e in large.events] == pytest.approx([e.time for e in small.events], rel=1e-11)


def test_a_large_force_on_a_small_gap():
    setup: dict[str, Any] = {"start": REST, "parameters": {"f0": 1e6}, "output_times": [100.0]}
    run, tight = (simulate(SUPPORT, 100.0, tolerance=tolerance, **setup) for tolerance in (1e-12, 1e-15))
    assert state(run) == pytest.approx(state(tight), rel=1e-10)


def test_undamped_resonance_grows_for_ever():
    """c = 0, omega = 1, no support in reach: x = f0/2 t sin t."""
    run = simulate(SUPPORT, 1000.0, start=REST, parameters={"c": 0.0, "g": 1e6}, tolerance=1e-14)
    exact = 0.25 * run.time * np.sin(run.time)
    assert np.abs(run["x"] - exact).max() < 1e-12 * 250.0


def test_start_inside_a_support_that_would_pull():
    """x > g with fs < 0: released, free until it leaves."""
    run = simulate(SUPPORT, 2.0, start={"x": 5.0, "v": -40.0}, parameters={"f0": 0.0})
    assert run["support_state"][0] == RELEASED
    (leave,) = run.events
    assert leave.after == AWAY
    assert state(run) == pytest.approx(free_flow(2.0, 5.0, -40.0), abs=1e-11)


def test_a_released_support_is_met_again_inside():
    """A force turns the mass round before it is out: contact again where fs rises to zero, equations (8), (9)."""
    parameters = {"f0": 40.0, "cs": 3.0}
    start = {"x": 5.0, "v": -8.0}
    run = simulate(SUPPORT, 1.0, start=start, parameters=parameters)
    assert run["support_state"][0] == RELEASED
    assert [event.after for event in run.events] == [TOUCHING]
    at = simulate(SUPPORT, 1.0, start=start, parameters=parameters, output_times=[run.events[0].time])
    assert 10.0 * (at["x"][0] - 4.0) + 3.0 * at["v"][0] == pytest.approx(0.0, abs=1e-12)
    assert at["x"][0] > 4.0


def test_a_support_without_stiffness_and_damping_is_air():
    air = {"ks": 0.0, "cs": 0.0}
    run = simulate(SUPPORT, 100.0, start=REST, parameters=air, output_times=[100.0])
    free = simulate(SUPPORT, 100.0, start=REST, parameters={"g": 1e6}, output_times=[100.0])
    assert {event.after for event in run.events} == {TOUCHING, AWAY}
    assert state(run) == pytest.approx(state(free), abs=1e-11)


@pytest.mark.parametrize("ks", [10.0, 1e5, 1e12])
def test_an_event_is_not_found_twice(ks):
    """Entry, release, way out: in this order for 1000 periods."""
    start = ORBITS[10.0]["start"]
    run = simulate(SUPPORT, 1000 * T, start=start, parameters={"ks": ks}, output_times=[1000 * T])
    after = [event.after for event in run.events]
    assert len(after) > 700
    assert after == ([TOUCHING, RELEASED, AWAY] * len(after))[: len(after)]
