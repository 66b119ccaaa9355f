"""A block with dry friction between two smooth walls: rest at a wall is shared by floor and wall.

    m x'' = a sin(w t) - k x - N mu sign(x'),    -d1 <= x <= d0,    no rebound

The reference integrates by DOP853 from event to event: what rests leaves where the force exceeds what the floor holds,
and a wall at its back adds what pushes into it.
"""

import math

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmu_models import (
    TIME,
    Coordinate,
    Coulomb,
    Friction,
    Impact,
    Mechanism,
    Newton,
    Parameter,
    Poisson,
    StickslipError,
    load,
    simulate,
)

END = 8.0  # s


def parameter(name, value, unit="1", **bounds):
    return Parameter(name, value, unit, name, **bounds)


@pytest.fixture(scope="module")
def block():
    m, k = parameter("m", 1.0, "kg", positive=True), parameter("k", 1.0, "N/m")
    a, w = parameter("a", 1.0, "N"), parameter("w", 1.0, "rad/s")
    N, mu = parameter("N", 1.0, "N", minimum=0.0), parameter("mu", 0.3, minimum=0.0)
    d0, d1 = parameter("d0", 0.5, "m"), parameter("d1", 0.5, "m")
    x = Coordinate("x", "m", "displacement", velocity="v")
    return load(
        Mechanism(
            name="smooth_walls",
            title="Block between smooth walls",
            source="textbook",
            coordinates=[x],
            kinetic_energy=m * x.v**2 / 2,
            potential_energy=k * x**2 / 2,
            applied={x: a * sympy.sin(w * TIME)},
            contacts=[
                Friction(name="floor", slip=x.v, law=Coulomb(N, mu)),
                Impact(name="right", gap=d0 - x, restitution=Newton(parameter("e0", 0.0, minimum=0.0, maximum=1.0))),
                Impact(name="left", gap=d1 + x, restitution=Poisson(parameter("e1", 0.0, minimum=0.0, maximum=1.0))),
            ],
        )
    )


def drawn(rng, at_origin=False):
    uniform = rng.uniform
    values = {"m": uniform(0.3, 2), "k": uniform(0.2, 2), "a": uniform(0.3, 2), "w": uniform(0.5, 3)}
    values |= {"N": uniform(0.1, 1), "mu": uniform(0.1, 0.9), "d0": uniform(0.1, 0.6), "d1": uniform(0.1, 0.6)}
    values["d0"] = 0.0 if at_origin else values["d0"]
    start = {"x": uniform(-values["d1"], values["d0"]) * 0.99, "v": uniform(-1, 1)}
    return values, start


def reference(p, start):
    """End state and times of arrival at a wall."""
    capacity = p["N"] * p["mu"]

    def force(t, x):
        return p["a"] * math.sin(p["w"] * t) - p["k"] * x

    def slide(t, y, sign, end, events=()):
        return solve_ivp(
            lambda t, y: [y[1], (force(t, y[0]) - sign * capacity) / p["m"]],
            (t, end),
            y,
            method="DOP853",
            rtol=1e-12,
            atol=1e-16,
            max_step=0.05,
            events=events,
        )

    def pull(t, x, wall):
        """By how much the force exceeds what holds the block; a wall holds against all that pushes into it."""
        return (-wall * force(t, x) if wall else abs(force(t, x))) - capacity

    def arrivals(sign):
        events = [lambda t, y: y[1] * sign, lambda t, y: p["d0"] - y[0], lambda t, y: p["d1"] + y[0]]
        for event in events:
            event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
        return events

    t, x, v, wall, hits = 0.0, start["x"], start["v"], 0, []
    while t < END:
        if v == 0.0:
            if pull(t, x, wall) <= 1e-14:
                grid = np.arange(t, END, 1e-3)
                above = np.flatnonzero([pull(s, x, wall) > 1e-14 for s in grid])
                if not above.size:
                    break
                t = brentq(pull, grid[above[0] - 1], grid[above[0]], (x, wall), xtol=1e-15, rtol=1e-15)  # type: ignore[arg-type]
            sign, wall = math.copysign(1.0, force(t, x)), 0
            run = slide(t, [x, 0.0], sign, min(t + 1e-5, END))  # type: ignore[operator]
        else:
            sign = math.copysign(1.0, v)
            run = slide(t, [x, v], sign, END, arrivals(sign))
            wall = 0
        t, (x, v) = run.t[-1], run.y[:, -1]
        if run.status == 1:
            v = 0.0
            wall = 1 if run.t_events[1].size else -1 if run.t_events[2].size else 0
            x = {1: p["d0"], -1: -p["d1"], 0: x}[wall]
            hits += [t] if wall else []
    return (x, v), hits


def test_the_case_that_was_called_a_paradox_of_friction(block):
    values = {"m": 0.688684298049109, "k": 0.7008787394963131, "a": 0.7416830524519606, "w": 1.8757788222771903}
    values |= {"N": 0.3273642936595341, "mu": 0.6442385136359828, "d0": 0.5285180112840638, "d1": 0.16918050441299762}
    start = {"x": 0.49180710989615983, "v": 0.09099894166553923}
    run = simulate(block, END, parameters=values, start=start)
    (x, v), hits = reference(values, start)
    assert [event.time for event in run.impacts] == pytest.approx(hits, abs=1e-10)
    assert (run["x"][-1], run["v"][-1]) == pytest.approx((x, v), abs=1e-10)


@pytest.mark.parametrize("at_origin", [False, True])
def test_random_blocks_rest_and_leave_as_the_reference_does(block, at_origin):
    # at the origin the gap is a single term, which says nothing of its own rounding
    rng = np.random.default_rng(7)
    for _ in range(25):
        values, start = drawn(rng, at_origin)
        run = simulate(block, END, parameters=values, start=start, output_times=[END])
        (x, v), hits = reference(values, start)
        assert [event.time for event in run.impacts] == pytest.approx(hits, abs=1e-9), (values, start)
        assert (run["x"][-1], run["v"][-1]) == pytest.approx((x, v), abs=1e-9), (values, start)


@pytest.mark.parametrize("seed", [1, 2])
def test_no_random_block_is_refused(block, seed):
    rng = np.random.default_rng(seed)
    for i in range(1000):
        values, start = drawn(rng, at_origin=i % 5 == 0)
        try:
            simulate(block, END, parameters=values, start=start, output_times=[END])
        except StickslipError as error:
            pytest.fail(f"{values} {start}: {error}")
