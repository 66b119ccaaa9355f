"""A start inside a rigid wall by no more than the rounding of the gap is a contact, at every scale and phase.

A ball above a table, gap = x - A sin(w t + phi): its places are known to some 1e-16 A, also where sin vanishes.
"""

import math

import numpy as np
import pytest
import sympy

from fmu_models import TIME, Coordinate, Impact, Mechanism, Newton, Parameter, StickslipError, load, simulate


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
