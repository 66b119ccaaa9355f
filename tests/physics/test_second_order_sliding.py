"""Infinitely many switchings of a pair of relays in finite time: the twisting controller,

    x'' = -k sgn x - a sgn x' + A sin(w t),    k > a

without push from (x0, 0): x' at the zeros of x shrinks by r = sqrt((k - a)/(k + a)) each time, and all is over
after a geometric sum of times; then it rests while the push is less than k + a.

Source: Levant, International Journal of Control 58 (1993) 1247-1263.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy
from mechanisms import opened

from fmu_models import TIME, Automaton, Parameter, SensitiveRun, State, Switch, simulate


@pytest.fixture(scope="module")
def twisting():
    x, v = State("x", "m", "place", start=1.0), State("v", "m/s", "speed")
    a, k = Parameter("a", 1.0, "m/s2", "relay on v"), Parameter("k", 2.0, "m/s2", "relay on x")
    push, w = Parameter("A", 0.0, "m/s2", "push"), Parameter("w", 1.0, "rad/s", "frequency")
    side = Switch(name="side", function=x, unit="m")
    turn = Switch(name="turn", function=v, unit="m/s")
    rate = -k * side.sign - a * turn.sign + push * sympy.sin(w * TIME)
    return opened(
        Automaton(
            name="twisting",
            title="Twisting controller",
            source="Levant (1993)",
            states=[x, v],
            flows={x: v, v: rate},
            switches=[side, turn],
        )
    )


def over_at(k: float, a: float = 1.0, x0: float = 1.0) -> float:
    """First fall to x = 0, then per half turn v/(k + a) to stand still and r v/(k - a) back to zero."""
    ratio = math.sqrt((k - a) / (k + a))
    first = math.sqrt(2 * (k - a) * x0)
    return first / (k - a) + first * (1 / (k + a) + ratio / (k - a)) / (1 - ratio)


@pytest.mark.parametrize("k", [1.05, 1.5, 2.0, 3.0, 10.0])
def test_the_switching_is_over_in_time(twisting, k):
    run = simulate(twisting, 60.0, parameters={"k": k}, output_times=[over_at(k) + 0.1, 60.0])
    assert run.events[-1].time == pytest.approx(over_at(k), rel=1e-14)
    assert {event.contact for event in list(run.events)[-2:] if event.after == 0} == {"side", "turn"}
    assert run["x"] == pytest.approx([0.0, 0.0], abs=1e-16) and run["v"] == pytest.approx([0.0, 0.0], abs=1e-16)


def test_rest_holds_what_both_relays_hold(twisting):
    """4 sin t > 3 from asin(3/4) on; 2.5 sin t never is."""
    times, begin = np.array([0.5, 1.0, 1.2]), math.asin(0.75)
    held = simulate(twisting, 9.0, parameters={"A": 2.5}, start={"x": 0.0}, output_times=times)
    assert held["x"] == pytest.approx(np.zeros(3), abs=1e-15)
    gone = simulate(twisting, 2.0, parameters={"A": 4.0}, start={"x": 0.0}, output_times=times)
    late = np.maximum(times - begin, 0.0)
    free = 4 * (math.sin(begin) - np.sin(begin + late)) + 4 * math.cos(begin) * late - 1.5 * late**2
    assert gone["x"] == pytest.approx(free, abs=1e-14)


def test_nothing_of_a_difference_is_left(twisting):
    """The end is at T(x0), which goes by the root of x0."""
    with SensitiveRun(twisting, by=["x"]) as runs:
        run = runs.run([2.0, 6.0])
    assert run.derivative[-1] == pytest.approx(np.zeros((2, 1)), abs=1e-15)
    assert run.event_derivative[-1] == pytest.approx([over_at(2.0) / 2], rel=1e-12)
