"""Slips that depend on time: a block upon plates that move as they are told, against event-driven integration by scipy.

Dry friction alone, v' = -mu N/m sgn(v - s(t)): where the states are polynomials, only the slip tells that it falls.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import sympy
from scipy.optimize import brentq

from fmu_models import TIME, Coordinate, Coulomb, Friction, Mechanism, Parameter, load, simulate

DECELERATION = 0.3
MASS = Parameter("m", 1.0, "kg", "mass", positive=True)
LOAD = Parameter("N", 1.0, "N", "normal force", minimum=0.0)
MU = Parameter("mu", DECELERATION, "1", "friction coefficient", minimum=0.0)
B = Parameter("b", 1.0, "m/s", "speed of the plate")
W = Parameter("w", 1.0, "rad/s", "frequency")
X = Coordinate("x", "m", "position", velocity="v", v_start=2.0)

# plate: its speed as declared and as a function of t, b and w
PLATES = {
    "sine": (B * sympy.sin(W * TIME), lambda t, b, w: b * math.sin(w * t)),
    "cube": (B * sympy.sin(W * TIME) ** 3, lambda t, b, w: b * math.sin(w * t) ** 3),
    "power": (B * sympy.sin(W * TIME) ** 10, lambda t, b, w: b * math.sin(w * t) ** 10),
    "decay": (B * sympy.exp(-W * TIME), lambda t, b, w: b * math.exp(-w * t)),
    "growth": (B * sympy.log(1 + W * TIME), lambda t, b, w: b * math.log(1 + w * t)),
}


def plate(name: str) -> Mechanism:
    return Mechanism(
        name=f"plate_{name}",
        title="Block on a plate that moves",
        source="closed form",
        coordinates=[X],
        kinetic_energy=MASS * X.v**2 / 2,
        contacts=[Friction(name="plate", slip=X.v - PLATES[name][0], law=Coulomb(LOAD, MU))],
    )


def reference(speed: Callable[[float], float], v: float, end: float, step: float) -> float:
    """Velocity at the end: slip along a straight line until it meets the plate, stick until that is too fast."""
    t, h = 0.0, 1e-6

    def faster(t: float) -> float:
        return DECELERATION - abs(speed(t + h) - speed(t - h)) / (2 * h)

    side = math.copysign(1.0, v - speed(0.0))
    if abs(v - speed(0.0)) < 1e-12:
        side = 0.0 if faster(0.0) > 0 else -math.copysign(1.0, speed(h) - speed(-h))
    while t < end:
        start, begin = v, t

        def slip(t: float, side: float = side, start: float = start, begin: float = begin) -> float:
            return side * (start - side * DECELERATION * (t - begin) - speed(t)) if side else faster(t)

        t += step if side else 0.0
        while t < end and slip(t) > 0:
            t += step
        if t >= end:
            return start - side * DECELERATION * (end - begin) if side else speed(end)
        t = float(brentq(slip, t - step, t, xtol=1e-14))  # type: ignore[arg-type]
        v = speed(t)
        side = -math.copysign(1.0, speed(t + h) - speed(t - h)) if side == 0.0 or faster(t) < 0.0 else 0.0
    return v


@pytest.mark.parametrize("name", PLATES)
@pytest.mark.parametrize(("v", "b", "w"), [(2.0, 1.0, 1.0), (-1.0, 1.0, 3.0), (0.5, 0.1, 0.3), (-1.0, 5.0, 0.3)])
def test_block_meets_the_plate(name: str, v: float, b: float, w: float) -> None:
    speed = PLATES[name][1]
    run = simulate(load(plate(name)), 12.0, parameters={"b": b, "w": w}, start={"v": v}, output_times=[6.0, 12.0])
    expected = [reference(lambda t: speed(t, b, w), v, end, 1e-3) for end in (6.0, 12.0)]
    np.testing.assert_allclose(run["v"], expected, rtol=0, atol=1e-8 * max(1.0, b))


def test_known_velocities_of_the_sine() -> None:
    run = simulate(load(plate("sine")), 20.0, output_times=[10.0, 20.0])
    np.testing.assert_allclose(run["v"], [0.32299699, 0.04191231], atol=1e-8)


def test_forces_that_begin_flat_are_followed() -> None:
    """High powers whose first derivatives vanish at the start: k x^9 from x = 0, and sin(w t)^10 from rest."""
    length = Parameter("L", 1.0, "m", "length", positive=True)
    k = Parameter("k", 1.0, "N/m", "stiffness", positive=True)
    force = Parameter("F", 1.0, "N", "amplitude")
    body: dict = {"source": "closed form", "coordinates": [X], "kinetic_energy": MASS * X.v**2 / 2}
    spring = load(Mechanism(name="flat", title="f", potential_energy=k * length**2 * (X / length) ** 10 / 10, **body))
    run = simulate(spring, 10.0, start={"v": 1.0}, output_times=np.linspace(0, 10, 21))
    np.testing.assert_allclose(run["v"] ** 2 / 2 + run["x"] ** 10 / 10, 0.5, atol=1e-11)
    assert np.abs(run["x"]).max() < 1.2
    pulses = load(Mechanism(name="flat_pulses", title="f", applied={X: force * sympy.sin(W * TIME) ** 10}, **body))
    run = simulate(pulses, 2 * math.pi, start={"v": 0.0}, output_times=[2 * math.pi])
    np.testing.assert_allclose(run["v"], 2 * math.pi * 63 / 256, rtol=1e-11)
