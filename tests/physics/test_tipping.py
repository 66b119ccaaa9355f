"""Rate-induced tipping against closed forms, and against SciPy's integration with its own bisection."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from wells import well

from fmu_models import TIME, Automaton, Fmu, Input, Parameter, State, StickslipError, Strobe, load, tipping_rates

RATE = Parameter("rate", 1.0, "1/s", "rate", positive=True)


@cache
def drift() -> Fmu:
    """x' = (x + u)^2 - 1."""
    x, u = State("x", "1", "place", start=-1.0), Input("u", 0.0, "1", "shift")
    flows: Any = {x: RATE * ((x + u) ** 2 - 1)}
    return load(Automaton(name="drift", title="drift", source="here", states=[x], flows=flows))


@cache
def pushed_well(forced: bool) -> Fmu:
    push = Input("push", 0.0, "1", "push")
    omega = Parameter("w", 1.0, "rad/s", "frequency", positive=True)
    return well("pushed_well" + "_forced" * forced, push + (0.05 * sympy.cos(omega * TIME) if forced else 0))


@pytest.mark.parametrize("last", [2.2, 3.0])
def test_the_rate_of_a_drift_is_that_of_its_closed_form(last):
    """While u moves at r > 1, y = x + u goes from -1 to w tan(w t + c); it must not be beyond 1 at the end of that."""

    def beyond(rate):
        w = math.sqrt(rate - 1.0)
        return w * last / rate - 2.0 * math.atan(1.0 / w)

    (tip,) = tipping_rates(drift(), ramp={"u": (0.0, last)}).tips
    assert tip.value == pytest.approx(brentq(beyond, 1.001, 100.0, xtol=1e-15), rel=1e-11)
    assert (tip.slower, tip.faster, tip.edge) == ("equilibrium", "to infinity", "equilibrium")


@pytest.mark.parametrize("last", [1.9, -3.0])
def test_an_input_that_leaves_the_motion_in_its_basin_never_tips(last):
    """A step by less than the distance 2 to the border, or away from it."""
    found = tipping_rates(drift(), ramp={"u": (0.0, last)})
    assert not found.tips and set(found.words) == {"equilibrium"}


def test_the_rates_of_a_well_are_those_of_scipy():
    """x'' + c x' - x + x^3 = p from 0 to .36, damped weakly: a slow push keeps the motion in the left well, a fast one
    throws it over the hill."""
    c, last, start = 0.1, 0.36, {"x": -1.0, "v": 0.0}
    found = tipping_rates(Strobe(pushed_well(False), parameters={"c": c}), start, ramp={"push": (0.0, last)})
    assert found.tips and found.words[0] != found.words[-1]

    def side(rate):
        """Of the hill on which the motion rests in the end."""

        def rates(t, x):
            return [x[1], x[0] - x[0] ** 3 - c * x[1] + min(rate * t, last)]

        y = solve_ivp(rates, (0, last / rate), [-1.0, 0.0], rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]
        return solve_ivp(rates, (last / rate, last / rate + 300), y, rtol=1e-11, atol=1e-13).y[0, -1]

    for tip in found.tips[:2]:
        below, above = (side(tip.value * (1.0 + sign * 1e-7)) for sign in (-1, 1))
        assert below * above < 0.0
        assert tip.edge == "equilibrium"


def test_a_forced_motion_goes_on_to_a_whole_period():
    """Two rates beside a tip, and where SciPy comes to, in the same phase of the forcing."""
    system = Strobe(pushed_well(True), forcing="w", parameters={"c": 0.1})
    found = tipping_rates(system, {"x": -1.0}, ramp={"push": (0.0, 0.3)}, slowest=0.01, fastest=10.0, rates=8)
    assert found.tips
    tip = found.tips[0]

    def side(rate):
        def rates(t, x):
            return [x[1], x[0] - x[0] ** 3 - 0.1 * x[1] + 0.05 * math.cos(t) + min(max(rate * t, 0.0), 0.3)]

        settled = solve_ivp(rates, (-200 * math.pi, 0.0), [-1.0, 0.0], rtol=1e-11, atol=1e-13).y[:, -1]
        y = solve_ivp(rates, (0, 0.3 / rate), settled, rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]
        return solve_ivp(rates, (0.3 / rate, 0.3 / rate + 300), y, rtol=1e-11, atol=1e-13).y[0, -1]

    below, above = (side(tip.value * (1.0 + sign * 1e-6)) for sign in (-1, 1))
    assert below * above < 0.0 and tip.edge == "1"


def test_the_rate_at_which_a_belt_tears_off_is_that_of_scipy():
    """From the end of a stick at .3 m/s to .8 m/s, where steady sliding attracts too."""
    start = {"x": (9.81 * 0.65 - 0.5 * 0.3) / 100.0, "v": 0.3}
    (tip,) = tipping_rates("block_on_belt", start, ramp={"v_belt": (0.3, 0.8)}).tips
    assert tip.slower.startswith("cycle") and tip.faster == "equilibrium" and tip.edge.startswith("cycle")
    sticks = [_sticks_in_the_end(start, tip.value * (1.0 + sign * 1e-8)) for sign in (-1, 1)]
    assert sticks == [True, False]


def _sticks_in_the_end(start, rate):
    """Whether the block still sticks now and then long after the belt has come to its last speed."""

    def belt(t):
        return min(0.3 + rate * t, 0.8)

    def slides(t, y):
        mu = 0.3 / (1 + 15 * abs(y[1] - belt(t))) + 0.35
        return [y[1], 9.81 * mu - 0.5 * y[1] - 100 * y[0]]

    def meets(t, y):
        return y[1] - belt(t)

    def tears(t, y):
        acceleration = rate if belt(t) < 0.8 else 0.0
        return 100 * y[0] + 0.5 * belt(t) + acceleration - 9.81 * 0.65

    meets.terminal, meets.direction, tears.terminal, tears.direction = True, 1.0, True, 1.0  # type: ignore[attr-defined]
    y: Any
    y, t, held, last, knot = [start["x"], start["v"]], 0.0, False, 0.0, 0.5 / rate
    while t < knot + 60.0:
        end = knot if t < knot else knot + 60.0
        if held:
            last = t
            run = solve_ivp(lambda t, y: [belt(t), 0.0], (t, end), y, events=tears, rtol=1e-12, atol=1e-14)
            y = [run.y[0, -1], belt(run.t[-1])]
        else:
            run = solve_ivp(slides, (t, end), y, events=meets, rtol=1e-12, atol=1e-14, method="DOP853", max_step=0.1)
            y = run.y[:, -1]
        if run.status == 1:
            held = not held
        t = run.t[-1]
    return last > knot + 40.0


def test_what_cannot_move_is_refused():
    bad: Any
    for bad, why in (
        ({"ramp": {"c": (0.0, 1.0)}}, "has no input 'c'"),
        ({"ramp": {}}, "One input moves"),
        ({"ramp": {"u": (1.0, 1.0)}}, "the two values of the input differ"),
        ({"ramp": {"u": (0.0, 1.0)}, "slowest": -1.0}, "above 0"),
    ):
        with pytest.raises(StickslipError, match=why):
            tipping_rates(drift(), **bad)
    with pytest.raises(StickslipError, match="comes to no attractor"):
        tipping_rates(drift(), {"x": 3.0}, ramp={"u": (0.0, 1.0)})
    with pytest.raises(StickslipError, match="strobe"):
        tipping_rates("henon", ramp={"a": (0.0, 1.0)})
