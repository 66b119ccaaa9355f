"""Long flights over a table that shakes fast, each one step of the engine, against roots of their closed form.

With g = omega = 1 and the table at Gamma sin(theta + phase), a ball that starts at (x, v) has the gap

    x + v s - s^2/2 - Gamma sin(s + phase)
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from closed_form import root
from lazy_fmu import LazyFmu

from fmu_models.simulation.run import simulate

BALL = LazyFmu("bouncing_ball")


def fall(stop, gamma, x, v, phase=0.0):
    parameters = {"g": 1.0, "omega": 1.0, "A": gamma, "e": 0.5, "phi0": phase}
    return simulate(BALL, stop, parameters=parameters, start={"x": x, "v": v}, output_times=[stop])


def first_zero(gap, slope_bound):
    """The first zero of a gap that is positive at 0: no step passes one, since none is longer than the slope allows."""
    s = 0.0
    while gap(s) > 1e-9:
        s += gap(s) / slope_bound
    return root(gap, s - 1e-7, s + 1e-4)


@pytest.mark.parametrize("gamma", [0.3, 1.2, 5.0, 12.0])
@pytest.mark.parametrize(("x", "v"), [(60.0, 0.0), (45.0, 12.0), (900.0, -3.0)])
def test_a_long_flight_is_one_step(gamma, x, v):
    phase = 0.7
    gap = lambda s: x + v * s - s * s / 2 - gamma * math.sin(s + phase)  # noqa: E731
    expected = first_zero(gap, 1.001 * (abs(v) + math.sqrt(v * v + 2 * (x + gamma)) + gamma))
    run = fall(expected + 1e-6, gamma, x, v, phase)
    assert run.events[0].time == pytest.approx(expected, rel=1e-14)
    assert run.steps <= len(run.events) + 1


@pytest.mark.parametrize("miss", [1e-3, 1e-6, 1e-9, -1e-9, -1e-6, -1e-3])
def test_a_crest_that_is_missed_or_not(miss):
    """The ball passes a crest of the table at this distance, nearly a double root of its gap."""
    gamma, s, v = 7.0, 9.0, 3.0
    phase = math.acos((v - s) / gamma) - s  # the ball is as fast as the table there, which is the faster to turn
    x = gamma * math.sin(s + phase) - v * s + s * s / 2 + miss
    before = np.linspace(0.0, s - 0.1, 1001)
    assert (x + v * before - before**2 / 2 - gamma * np.sin(before + phase)).min() > 0.0
    hit = fall(s + 0.5, gamma, x, v, phase)
    assert (len(hit.events) > 0 and hit.events[0].time < s) == (miss < 0.0)
