"""Edge states: against closed forms, and against motions that SciPy integrates or solves for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from wells import forced_well, ring, well

from fmu_models import Map, State, StickslipError, Strobe, edge_state, load
from fmu_models.analyses.edge import EdgeState
from fmu_models.analyses.unforced import LimitCycle


def test_the_edge_of_a_double_well_is_its_saddle():
    """(0, 0) with the eigenvalues of l^2 + c l - 1."""
    for c in (0.25, 0.02):
        system = Strobe(well(), parameters={"c": c})
        found = edge_state(system, {"x": 1.0, "v": 1.5}, other={"x": -1.0})
        assert found.word == "equilibrium" and found.labels <= 200
        assert np.abs(found.points).max() < 1e-12
        assert found.multipliers is not None
        logarithms = np.log(found.multipliers.real) / float(system.periods({}, 1)[0])
        known = [(-c + s * math.sqrt(c**2 + 4)) / 2 for s in (1, -1)]
        assert logarithms == pytest.approx(known, abs=1e-10)


def test_the_edge_of_a_forced_double_well_is_a_saddle_cycle():
    found = edge_state(forced_well(), {"x": 1.0, "v": 0.3}, other={"x": -1.0})

    def period(start):
        def rates(t, x):
            return [x[1], x[0] - x[0] ** 3 - 0.25 * x[1] + 0.1 * math.cos(t)]

        return solve_ivp(rates, (0, 2 * math.pi), start, rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]

    # near the hill: x'' + x'/4 - x = cos(t)/10
    known, step = 0.1 * np.array([-2.0, 0.25]) / (4.0 + 0.25**2), 1e-6 * np.eye(2)
    for _ in range(4):
        end = period(known)
        slopes = np.stack([(period(known + e) - end) / 1e-6 for e in step], axis=1)
        known = known - np.linalg.solve(slopes - np.eye(2), end - known)
    assert found.points[0] == pytest.approx(known, abs=1e-10) and found.labels <= 200
    assert found.multipliers is not None
    assert found.multipliers.prod().real == pytest.approx(math.exp(-0.25 * 2 * math.pi), rel=1e-9)
    assert [abs(value) > 1.0 for value in found.multipliers] == [True, False]


def test_the_edge_of_a_ring_is_a_cycle():
    """r' = r (r^2 - 1/4)(1 - r^2): radius 1/2, T = 2 pi, multiplier exp(3 pi/4)."""
    found = edge_state(ring(), {"x": 1.2, "y": 0.1}, other={"x": 0.1})
    assert math.hypot(*found.points[0]) == pytest.approx(0.5, abs=1e-10) and found.labels <= 200
    assert found.time == pytest.approx(2 * math.pi, abs=1e-10)
    assert found.multipliers is not None
    assert found.multipliers[0].real == pytest.approx(math.exp(0.75 * math.pi), rel=1e-9)


def test_the_edge_of_stick_and_slip_is_the_cycle_that_time_reversed_comes_to():
    """A belt at .62 m/s: a block slides steadily, or sticks and slips; the cycle between them slides."""
    speed = 0.62
    belt = Strobe(load("block_on_belt"), parameters={"v_belt": speed})
    rest = edge_state(belt, {"x": 0.0, "v": 0.6}, other={"x": 0.037, "v": 0.0}, most=20_000)
    assert rest.edge is not None and isinstance(rest.edge.motion, LimitCycle) and rest.labels <= 200

    def reversed_rates(t, x):
        slip = speed - x[1]
        force = 9.81 * (0.3 / (1 + 15 * slip) + 0.35)
        divergence = -0.5 + 9.81 * 0.3 * 15 / (1 + 15 * slip) ** 2
        return [-x[1], -(force - 0.5 * x[1] - 100 * x[0]), divergence]

    def crosses(t, x):
        return x[1] - rest.points[0, 1]

    crosses.direction = 1.0 if rest.edge.section.direction < 0 else -1.0  # type: ignore[attr-defined]
    run = solve_ivp(reversed_rates, (0, 350), [0.04, 0.3, 0.0], rtol=1e-11, atol=1e-13, events=crosses, method="LSODA")
    assert rest.points[0, 0] == pytest.approx(run.y_events[0][-1, 0], abs=1e-9)
    assert rest.time == pytest.approx(run.t_events[0][-1] - run.t_events[0][-2], abs=1e-8)
    growth = run.y_events[0][-1, 2] - run.y_events[0][-2, 2]
    assert rest.multipliers is not None and rest.multipliers[0].real == pytest.approx(math.exp(growth), rel=1e-6)


def test_the_edge_of_a_bouncing_ball_is_the_other_motion_of_holmes():
    """cos(phi) = pi (1 - e)/((1 + e) Gamma): the ball of phase -phi; its volume shrinks by e^2 in an impact."""
    g, gamma, omega, e, amplitude = 9.81, 1.2, 20 * math.pi, 0.5, 2.981882434594e-3
    ball = Strobe(load("bouncing_ball"), forcing="omega")
    found = edge_state(ball, other={"x": 0.003, "v": 0.0})
    phi = math.acos(math.pi * (1 - e) / ((1 + e) * gamma))
    later, speed = phi / omega, math.pi * g / omega
    known = [-amplitude * math.sin(phi) + speed * later - g * later**2 / 2, speed - g * later]
    assert found.points[0] == pytest.approx(known, abs=1e-10) and found.labels <= 200
    assert found.multipliers is not None
    assert found.multipliers.prod().real == pytest.approx(e**2, abs=1e-10)


def parted() -> Map:
    x = State("x", "1", "x", start=0.5)
    rule: Any = {x: sympy.Piecewise(((x + 1) / 2, x > 0), ((x - 1) / 2, True))}
    return Map(name="parted", title="parted", source="here", states=[x], rule=rule, box={x: (-2.0, 2.0)})


def test_where_motions_are_torn_no_edge_state_is_claimed():
    found = edge_state(parted(), {"x": 0.7}, other={"x": -0.4})
    assert (found.word, found.edge) == ("torn", None)
    assert abs(found.points[0, 0]) < 1e-10


def test_an_edge_that_does_not_repeat_itself_is_not_decided():
    found = told_early()
    assert found.word == "not decided" and found.edge is None and found.labels <= 8


def told_early() -> EdgeState:
    return edge_state(well(), {"x": 1.0}, other={"x": -1.0}, labels=8)


def test_two_starts_of_one_basin_have_no_edge():
    with pytest.raises(StickslipError, match="come to 'equilibrium"):
        edge_state(well(), {"x": 1.0}, other={"x": 0.9})
