"""Automata: lessons, sliding by Filippov's convex method, resets, and runs against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy
from compiled_model import CompiledModel
from quick_export import quick_export

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton, Reset, Switch
from fmu_models.language.declaration import Output
from fmu_models.language.quantities import TIME, Input, Parameter, State
from fmu_models.lowering.lower import lower
from fmu_models.simulation.run import simulate

x1 = State("x1", "1", "first state", start=0.0)
x2 = State("x2", "1", "second state", start=2.0)
mu = Parameter("mu", 1.0, "1", "threshold")
u = Input("u", 0.0, "1", "moves the threshold")
fold = Switch(name="fold", function=x2 - mu, description="crossing of the threshold")
other = Switch(name="other", function=x1 - 2 * x2)
HALF = sympy.Rational(1, 2)


def declare(*flows: Any, switches: tuple[Switch, ...] = (fold,), **changes: Any) -> Automaton:
    """An automaton with two states."""
    declaration: dict[str, Any] = {
        "name": "planar",
        "title": "planar",
        "source": "test",
        "states": [x1, x2],
        "flows": dict(zip((x1, x2), flows or (x2, -x1), strict=True)),
        "switches": switches,
    }
    return Automaton(**declaration | changes)


WRONG = {
    "no state": (lambda: declare(states=[], flows={}), "planar has no state"),
    "no flow": (lambda: declare(flows={x1: x2}), "state 'x2' has no flow"),
    "foreign flow": (
        lambda: declare(flows={x1: x2, x2: x1, State("x3", "1", "third"): x1}),
        "'x3' has a flow but is not a state",
    ),
    "product of signs": (
        lambda: declare(x2, fold.sign * other.sign, switches=(fold, other)),
        "the flow of 'x2' is not affine in the signs",
    ),
    "square of a sign": (lambda: declare(x2, fold.sign**2 * x1), "not affine in the signs"),
    "foreign sign": (lambda: declare(x2, other.sign), "belongs to a contact that is not part"),
    "rate in a flow": (lambda: declare(x2, x1.rate), "the flow of 'x2' uses a rate; only outputs"),
    "constant function": (
        lambda: declare(switches=(Switch(name="s", function=mu),)),
        "'s': its function never changes",
    ),
    "sign in a function": (
        lambda: declare(switches=(fold, Switch(name="s", function=x1 + fold.sign))),
        "its function may use states, inputs and time only",
    ),
    "side": (lambda: Reset(fold, "up", {x1: x2}), "has side='up'. Say from which side"),
    "foreign reset": (lambda: declare(resets=[Reset(other, "+", {x1: x2})]), "'other', which is not a switch"),
    "two resets": (
        lambda: declare(resets=[Reset(fold, "+", {x1: x2}), Reset(fold, "-", {x1: x2})]),
        "switch 'fold' has two resets",
    ),
    "reset with a sign": (lambda: declare(resets=[Reset(fold, "+", {x1: fold.sign})]), "sets x1 = fold_sign"),
    "two of one name": (lambda: declare(outputs=[Output("fold", x1, "1", "x1")]), "'fold' names both"),
    "restriction": (lambda: declare().restricted_to(["fold"]), "no contacts to choose from"),
    "law": (lambda: declare().with_law(fold=None), "no contacts that could have another law"),
}


@pytest.mark.parametrize(("declaration", "lesson"), WRONG.values(), ids=WRONG.keys())
def test_a_mistake_is_answered_with_a_lesson(declaration, lesson):
    with pytest.raises(StickslipError, match=lesson):
        declaration()


def test_units_that_do_not_match_are_refused():
    height, speed = State("z", "m", "height"), State("w", "m/s", "speed")
    with pytest.raises(StickslipError, match=r"the flow of w is in m s.-1, not in m/s2"):
        declare(states=[height, speed], flows={height: speed, speed: -speed}, switches=())
    floor = Switch(name="floor", function=height, unit="1")
    with pytest.raises(StickslipError, match="switch 'floor' is in m, not in 1"):
        declare(states=[height, speed], flows={height: speed, speed: 0}, switches=(floor,))


def test_a_flow_that_jumps_slides_by_the_convex_method():
    system = lower(declare(HALF - fold.sign, x1 - 2 * fold.sign))
    (contact,) = system.contacts
    assert contact.sticks and contact.capacity == 1 and contact.force == -fold.sign
    assert system.acceleration == (HALF, x1)
    assert sympy.Matrix([1, 2]) == system.W
    assert sympy.Matrix([2]) == system.G
    assert contact.slip_rate == x2.rate
    # Filippov: the convex mean of f+ and f- tangent to h = 0, worked out by hand
    share = -system.acceleration[1] / system.G[0, 0]
    sliding = system.acceleration[0] + system.W[0] * share
    plus, minus = (-HALF, x1 - 2), (HALF + 1, x1 + 2)
    q = minus[1] / (minus[1] - plus[1])
    assert sympy.simplify(sliding - (q * plus[0] + (1 - q) * minus[0])) == 0


CONTINUOUS = {
    "absolute value": (lambda: declare(x2, -x1 - 3 * fold.abs / 2), fold),
    "factor": (lambda: declare(x2, (x2**2 - mu**2) * fold.sign), fold),
    "crossing": (lambda: declare(fold.sign * x1, x1), fold),
}


@pytest.mark.parametrize("name", ["absolute value", "factor", "crossing"])
def test_what_cannot_slide_keeps_its_sign_in_the_flow(name):
    declaration, switch = CONTINUOUS[name]
    system = lower(declaration())
    assert not system.contacts[0].sticks
    assert sympy.zeros(2, 1) == system.W
    assert any(a.has(switch.sign) for a in system.acceleration)


def test_a_switch_of_time_and_inputs_has_its_rate():
    clock = Switch(name="clock", function=sympy.Float(0.5) * TIME - u)
    system = lower(declare(x2, clock.sign, switches=(clock,)))
    assert system.contacts[0].slip_rate == 0.5 - u.rate
    assert not system.contacts[0].sticks


def test_generated_code_of_an_automaton():
    reset = Reset(fold, "-", {x2: -x2 / 2 + u, x1: x1 + mu})
    model = CompiledModel(
        declare(HALF - fold.sign + u, x1 - 2 * fold.sign, resets=[reset], outputs=[Output("r", x2.rate, "1", "rate")])
    )
    assert model.integers("sizes", 10) == [0, 0, 1, 1, 1, 1, *model.integers("sizes", 8)[6:], 2, 1]
    assert model.table("resets") == [2]
    for kind, i, value in (("x", 0, 3.0), ("x", 1, 1.0), ("u", 0, 0.25), ("U", 0, 0.0), ("t", 0, 0.0)):
        model.series(kind, i)[0] = value
    model.order(0, signs=[-1.0])
    assert model.reset(0) == [4.0, -0.25]
    assert model.series("a", 0)[0] == 0.75
    assert model.series("f")[0] == 1.0
    assert model.series("y")[0] == 3.0 + 2.0
    assert model.magnitude(0) == 2.0


def run(automaton: Any, folder: Any, stop_time: float, **options: Any) -> Any:
    path = quick_export(automaton, folder / f"{automaton.name}.fmu")
    return simulate(Fmu.open(path), stop_time, **options)


def test_the_planar_cycle_has_its_period(tmp_path):
    # reference of 40 digits: T = 7.161378395771368995, of which 2.688908906215790 above the threshold
    trajectory = run(declare(x2, -x2 - sympy.Rational(3, 2) * fold.abs - x1), tmp_path, 400.0)
    *_, up, down, again = [event.time for event in trajectory.events if event.contact == "fold"]
    periods = {event.after: event.time for event in trajectory.events[-3:]}
    assert set(periods) == {-1, 1}
    assert again - up == pytest.approx(7.161378395771369, rel=1e-12)
    above = down - up if trajectory.events[-2].after == -1 else again - down
    assert above == pytest.approx(2.688908906215790, rel=1e-12)


def test_sliding_follows_its_closed_form(tmp_path):
    trajectory = run(declare(HALF - fold.sign, x1 - 2 * fold.sign), tmp_path, 3.0)
    (entry,) = trajectory.events
    arrival = 2 * (math.sqrt(5) - 2)  # x2 = 2 - 2 t - t^2/4 reaches 1
    assert (entry.before, entry.after) == (1, 0)
    assert entry.time == pytest.approx(arrival, rel=1e-13)
    expected = 1 - (1 + arrival / 2) * math.exp(-(3.0 - arrival) / 2)  # x1' = (1 - x1)/2 in sliding
    assert trajectory["x1"][-1] == pytest.approx(expected, rel=1e-12)
    assert trajectory["x2"][-1] == pytest.approx(1.0, rel=1e-15)


def test_a_ball_bounces_by_its_reset(tmp_path):
    z = State("z", "m", "height", start=1.0)
    w = State("w", "m/s", "speed")
    g = Parameter("g", 10.0, "m/s2", "gravity")
    e = Parameter("e", 0.8, "1", "restitution")
    floor = Switch(name="floor", function=z, unit="m")
    ball = declare(
        name="ball", states=[z, w], flows={z: w, w: -g}, switches=(floor,), resets=[Reset(floor, "+", {w: -e * w})]
    )
    trajectory = run(ball, tmp_path, 2.0)
    first = math.sqrt(0.2)
    hits = first + np.array([0.0, 2 * 0.8, 2 * (0.8 + 0.64)]) * first
    falls = hits[hits < 2.0]
    since, speed = 2.0 - falls[-1], 10 * first * 0.8 ** len(falls)
    assert trajectory["z"][-1] == pytest.approx(speed * since - 5 * since**2, rel=1e-11)
    assert trajectory["w"][-1] == pytest.approx(speed - 10 * since, rel=1e-11)


def test_bounces_that_rest_on_neither_side_are_refused_where_they_pile_up(tmp_path):
    """Dropped from h: t1 (1 + e)/(1 - e) with t1 = sqrt(2 h/g); a jump is not tied to the side where rounding put h."""
    z = State("z", "m", "height", start=1.0)
    w = State("w", "m/s", "speed")
    floor = Switch(name="floor", function=z, unit="m")
    ball = declare(
        name="ball",
        states=[z, w],
        flows={z: w, w: -Parameter("g", 9.81, "m/s2", "gravity")},
        switches=(floor,),
        resets=[Reset(floor, "both", {w: -w / 2})],
    )
    with pytest.raises(StickslipError, match=r"contact 'floor' keeps switching at t = 1\.35457092295"):
        run(ball, tmp_path, 3.0)


@pytest.mark.parametrize("limit", [20.0, 1000.0])
def test_a_switch_of_time_falls_at_its_zeros_whatever_the_states_do(tmp_path, limit):
    """The states are straight lines between the zeros of sin(t): their series end long before that of the switch."""
    clock = Switch(name="clock", function=sympy.sin(TIME))
    trajectory = run(declare(clock.sign, x1, switches=(clock,)), tmp_path, limit, output_times=[limit])
    expected = np.pi * np.arange(1, limit // np.pi + 1)
    assert [event.time for event in trajectory.events] == pytest.approx(expected, rel=1e-13)


def test_a_switch_of_a_function_of_straight_states_falls_at_its_zeros(tmp_path):
    """1/(1 + x1^2) - 1/10 with x1 = t - 5: zeros at x1 = -3 and 3, on a series that converges over 1 s only."""
    bell = Switch(name="bell", function=1 / (1 + (x1 - 5) ** 2) - HALF / 5)
    trajectory = run(declare(1, bell.sign, switches=(bell,)), tmp_path, 20.0)
    assert [event.time for event in trajectory.events] == pytest.approx([2.0, 8.0], rel=1e-12)


@pytest.mark.parametrize(("start", "after", "x2_end"), [(1.0, -1.0, 0.0), (1.0, 3.0, 2.0), (3.0, -1.0, 0.0)])
def test_a_jump_takes_another_switch_off_its_surface_or_past_it(start, after, x2_end, tmp_path):
    clock = Switch(name="clock", function=x1 - HALF)
    reset = Reset(clock, "-", {x2: sympy.Float(after)})
    automaton = declare(sympy.S.One, -fold.sign, switches=(fold, clock), resets=[reset])
    motion = run(automaton, tmp_path, 1.5, start={"x1": 0.0, "x2": start}, output_times=[1.5])
    assert motion["x1"][-1] == pytest.approx(1.5, abs=1e-14)
    assert motion["x2"][-1] == pytest.approx(x2_end, abs=1e-14)
    side = 1 if after > 1.0 else -1
    assert [(e.contact, e.after) for e in motion.events if e.time > 0.1] == [("fold", side), ("clock", 1)]
