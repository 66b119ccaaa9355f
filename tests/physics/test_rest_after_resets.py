"""Infinitely many resets in finite time, the rest after them and its end: closed forms, SciPy, rigid contacts.

Sources of the block: Housner, Bulletin of the Seismological Society of America 53 (1963); Hogan, Proceedings of the
Royal Society A 425 (1989).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy
from mechanisms import opened
from resetting import ball, block, neuron, wheel
from scipy.integrate import solve_ivp

from fmu_models import (
    TIME,
    Coordinate,
    Impact,
    Mechanism,
    Newton,
    Parameter,
    SensitiveRun,
    Signal,
    simulate,
    simulate_any,
)
from fmu_models.lowering.lower import lower

PUSH, OMEGA = 1.5, 0.2
RELEASE = math.asin(1 / PUSH) / OMEGA


@pytest.fixture(scope="module")
def rocking():
    return opened(block())


@pytest.fixture(scope="module")
def bouncing():
    return opened(ball())


def end_of_rocking(x: float, r: float) -> float:
    """From rest at x: arcosh(1/(1 - x)) to the first impact, whose speed is sqrt(2 x - x^2); flights 2 artanh(v)."""
    speed, total = math.sqrt(2 * x - x * x), math.acosh(1 / (1 - x))
    return total + 2 * math.fsum(math.atanh(speed * r**k) for k in range(1, 400))


@pytest.mark.parametrize(("x", "r"), [(0.3, 0.5), (0.9, 0.5), (0.05, 0.8), (0.3, 0.0)])
def test_a_block_rocks_to_rest_in_time(rocking, x, r):
    run = simulate(rocking, 10.0, start={"x": x}, parameters={"r": r})
    *resets, rest = run.events
    assert (rest.after, rest.reset) == (0, r == 0.0)
    assert rest.time == pytest.approx(end_of_rocking(x, r), rel=1e-14)
    assert all(event.reset for event in resets) and len(resets) <= 1 + math.log(1e-8, r or 1e-8)
    assert (abs(run["x"][-1]), run["v"][-1]) == (pytest.approx(0.0, abs=1e-15), 0.0)


def test_the_end_of_rocking_has_its_derivative(rocking):
    run = SensitiveRun(rocking, by=["x", "r"]).run([4.0], start={"x": 0.3})
    h = 1e-5
    by_x = (end_of_rocking(0.3 + h, 0.5) - end_of_rocking(0.3 - h, 0.5)) / (2 * h)
    by_r = (end_of_rocking(0.3, 0.5 + h) - end_of_rocking(0.3, 0.5 - h)) / (2 * h)
    assert run.event_derivative[-1] == pytest.approx([by_x, by_r], rel=2e-7)
    assert run.derivative[-1] == pytest.approx(np.zeros((2, 2)), abs=1e-14)


def test_a_pushed_block_lifts_off_again(rocking):
    """At rest while |A sin(omega t)| < 1; from there on x'' = x + 1 - ... to the left as SciPy has it."""
    pushed = {"A": -PUSH, "omega": OMEGA, "r": 0.3}
    run = simulate(rocking, 6.0, start={"x": 0.05}, parameters=pushed)
    lifted = run.events[-1]
    assert (lifted.before, lifted.after, lifted.time) == (0, -1, pytest.approx(RELEASE, rel=1e-14))
    flight = solve_ivp(
        lambda t, y: [y[1], y[0] + 1 - PUSH * math.sin(OMEGA * t)],
        (RELEASE, 6.0), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    assert [run["x"][-1], run["v"][-1]] == pytest.approx(flight.y[:, -1], rel=1e-9)
    held = SensitiveRun(rocking, by=["x", "A"]).run([3.9], start={"x": 0.05}, parameters=pushed)
    slope = -1 / (PUSH**2 * math.sqrt(1 - 1 / PUSH**2) * OMEGA)
    assert held.event_derivative[-1] == pytest.approx([0.0, -slope], abs=1e-10)


def test_a_block_stands_until_it_is_pushed(rocking):
    run = simulate(rocking, 5.0, start={"x": 0.0}, parameters={"A": PUSH, "omega": OMEGA})
    assert [(e.before, e.after, e.reset) for e in run.events] == [(0, 1, False)]
    assert run.events[0].time == pytest.approx(RELEASE, rel=1e-14)
    moving = simulate(rocking, 0.1, start={"x": 0.0, "v": -0.5})
    assert not moving.events  # x'' = x + 1
    assert moving["x"][-1] == pytest.approx(math.cosh(0.1) - 1 - 0.5 * math.sinh(0.1), rel=1e-13)


@pytest.mark.parametrize("shake", [0.5, 1.2])
def test_a_reset_is_as_good_as_a_rigid_contact(bouncing, shake):
    """A table that is slower than the fall, and one that throws the ball up again and again."""
    z, m = Coordinate("z", "m", "height", start=1.0), Parameter("m", 1.0, "kg", "mass")
    gravity, e = Parameter("g", 10.0, "m/s2", "gravity"), Parameter("e", 0.5, "1", "restitution")
    a, omega = Parameter("a", 0.0, "m", "amplitude"), Parameter("omega", 3.0, "rad/s", "frequency")
    table = Impact(name="table", gap=z - a * sympy.sin(omega * TIME), restitution=Newton(e))
    rigid = Mechanism(
        name="rigid", title="rigid", source="Newton", coordinates=[z], kinetic_energy=m * z.v**2 / 2,
        potential_energy=m * gravity * z, contacts=[table],
    )  # fmt: skip
    options = {"parameters": {"a": shake}, "output_times": np.linspace(0.0, 12.0, 241)}
    expected = simulate(opened(rigid), 12.0, **options)
    run = simulate(bouncing, 12.0, **options)
    assert run["z"] == pytest.approx(expected["z"], abs=1e-10)
    released = [event.time for event in run.events if event.before == 0]
    assert released == pytest.approx([e.time for e in expected.events if e.before == 3 and e.after == 2], rel=1e-10)
    assert bool(released) == (shake == 1.2)


def test_a_ball_that_rests_is_lifted_by_an_input(bouncing):
    run = simulate(bouncing, 5.0, inputs={"lift": Signal([0.0, 2.0, 5.0], [0.0, 0.0, 30.0])})
    rest, lifted = run.events[-2:]
    assert rest.time == pytest.approx(3 * math.sqrt(0.2), rel=1e-14)
    assert (lifted.before, lifted.after, lifted.time) == (0, 1, pytest.approx(3.0, rel=1e-14))
    assert run["z"][-1] == pytest.approx(10 * 2**3 / 6, rel=1e-13)


def test_a_ball_rests_below_a_ceiling():
    fmu = opened(ball(-1))
    run = simulate(fmu, 3.0, inputs={"lift": Signal([0.0, 2.0, 3.0], [0.0, 0.0, 20.0])})
    rest, fallen = run.events[-2:]
    assert rest.time == pytest.approx(3 * math.sqrt(0.2), rel=1e-14)
    assert (fallen.before, fallen.after, fallen.time) == (0, -1, pytest.approx(2.5, rel=1e-14))


def test_an_importer_comes_to_the_same_rest(rocking):
    run = simulate_any(rocking, 4.0, method="dop853", tolerance=1e-10)
    assert run.events[-1].time == pytest.approx(end_of_rocking(0.3, 0.5), abs=1e-5)
    assert run["x"][-1] == pytest.approx(0.0, abs=1e-7) and run["v"][-1] == 0.0


def test_a_reset_that_keeps_its_speed_or_its_place_has_no_rest():
    (foot,) = (system := lower(block())).contacts
    assert foot.reset_sides == 3 + 8 and str(system.G[0, 0]) == "p2"
    assert [c.reset_sides for c in lower(neuron()).contacts + lower(wheel()).contacts] == [1, 1]
