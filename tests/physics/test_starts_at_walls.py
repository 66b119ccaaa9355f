"""A start inside a rigid wall by no more than the rounding of the gap is a contact, at every scale and phase.

A ball above a table, gap = x - A sin(w t + phi): its places are known to some 1e-16 A, also where sin vanishes.
"""

import math

import numpy as np
import pytest
import sympy
from fmpy import simulate_fmu

from fmu_models import TIME, Coordinate, Impact, Input, Mechanism, Newton, Parameter, StickslipError, load, simulate


@pytest.fixture(scope="module")
def ball():
    m, g = Parameter("m", 1.0, "kg", "mass", positive=True), Parameter("g", 9.81, "m/s2", "gravity")
    A, w = Parameter("A", 0.1, "m", "amplitude"), Parameter("w", 10.0, "rad/s", "angular frequency")
    phi, e = Parameter("phi", 0.0, "rad", "phase"), Parameter("e", 0.8, "1", "restitution", minimum=0.0, maximum=1.0)
    x = Coordinate("x", "m", "height", velocity="v")
    return load(
        Mechanism(
            name="table_ball",
            title="Ball above a table",
            source="textbook",
            coordinates=[x],
            kinetic_energy=m * x.v**2 / 2,
            potential_energy=m * g * x,
            contacts=[Impact(name="table", gap=x - A * sympy.sin(w * TIME + phi), restitution=Newton(e))],
        )
    )


def drawn(rng):
    A, period = 10 ** rng.uniform(-9, 6), 10 ** rng.uniform(-6, 4)
    values = {"A": A, "w": 2 * math.pi / period, "e": rng.choice([0.0, 0.5, 1.0])}
    values |= {"g": A / period**2 * 10 ** rng.uniform(-1, 2)}
    values["phi"] = rng.choice([0.0, math.pi, 2 * math.pi, -math.pi / 2, 1.0])
    time = rng.choice([0.0, 1.0, 2.0, 3.5]) * period
    return values, time, A * math.sin(values["w"] * time + values["phi"]), A / period * rng.uniform(-10, 1)


def start_at(ball, values, time, x, v):
    period = 2 * math.pi / values["w"]
    soon = [time + 1e-9 * period, time + period / 50]
    return simulate(ball, soon[-1], start_time=time, parameters=values, start={"x": x, "v": v}, output_times=soon)


@pytest.mark.parametrize("inside", [1.4e-16, 3e-16, 1e-15])
def test_rounding_is_no_penetration(ball, inside):
    rng = np.random.default_rng(3)
    for _ in range(300):
        values, time, table, v = drawn(rng)
        run = start_at(ball, values, time, table - inside * values["A"], v)
        speed = values["A"] * values["w"] * math.cos(values["w"] * time + values["phi"])
        # an impact at the start, or where rounding went the other way just after it, if the ball moves into the table
        after = speed - values["e"] * (v - speed) if v < speed else v
        assert run["v"][0] == pytest.approx(after, abs=1e-6 * values["A"] * values["w"]), (values, v)


def test_more_than_rounding_is_one(ball):
    rng = np.random.default_rng(4)
    for _ in range(100):
        values, time, table, v = drawn(rng)
        with pytest.raises(StickslipError, match="penetrated"):
            start_at(ball, values, time, table - 1e-11 * values["A"], v)


def test_a_floor_at_the_origin_is_judged_by_the_flight(ball):
    values = {"A": 0.0, "g": 9.81, "e": 0.5}
    run = simulate(ball, 0.1, parameters=values, start={"x": -1.4e-16, "v": -5.0})
    assert run["v"][0] == pytest.approx(2.5)
    with pytest.raises(StickslipError, match="penetrated"):
        simulate(ball, 0.1, parameters=values, start={"x": -1e-13, "v": -5.0})
    # the same where it flies away for good
    run = simulate(ball, 0.1, parameters=values | {"g": -9.81}, start={"x": -1.4e-16, "v": 5.0})
    assert run["x"][-1] == pytest.approx(0.5 + 9.81 * 0.1**2 / 2)


def test_an_input_may_be_set_while_a_body_rests_where_its_wall_is():
    """Terms of a gap that are zero all the time round by nothing: 1e-35 beyond the wall is still no penetration."""
    m, length = Parameter("m", 1.375, "kg", "mass", positive=True), Parameter("l", 1.0, "m", "length", positive=True)
    f, k = Parameter("f", 0.9, "N", "push"), Parameter("k", 3.0, "N/m", "stiffness")
    q, p = Coordinate("q", "m", "held body", velocity="v"), Coordinate("p", "m", "load", velocity="w")
    coupled = m * q.v * p.v * sympy.cos((p - q) / length) / 4
    pushed = Mechanism(
        name="pushed",
        title="Held body and load",
        source="test",
        coordinates=[q, p],
        kinetic_energy=m * (1 + (q / length) ** 2 / 4) * q.v**2 / 2 + m * p.v**2 / 2 + coupled,
        potential_energy=k * (q**2 + p**2) / 2 - f * q,
        applied={p: Input("u", 0.0, "N", "pull")},
        contacts=[Impact(name="wall", gap=-q, restitution=Newton(0.0))],
    )
    pull = np.zeros(61, [("time", "f8"), ("u", "f8"), ("u_rate", "f8")])
    pull["time"] = np.linspace(0, 3, 61)
    pull["u"] = np.sin(7 * pull["time"])
    run = simulate_fmu(
        str(load(pushed).path),
        fmi_type="CoSimulation",
        stop_time=3.0,
        output_interval=0.05,
        start_values={"p": 0.28, "w": 1.48},
        input=pull,
        output=["q", "wall_state"],
    )
    assert set(run["wall_state"]) == {3} and np.abs(run["q"]).max() < 1e-30
