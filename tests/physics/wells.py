"""Systems with borders between basins: a double well, x'' + c x' - x + x^3 = force, and a ring."""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy

from fmu_models import TIME, Automaton, Fmu, Parameter, State, Strobe, load


@cache
def well(name: str = "double_well", force: sympy.Expr = sympy.S.Zero) -> Fmu:
    """Its FMU; c = .25."""
    rate, c = Parameter("rate", 1.0, "1/s", "rate", positive=True), Parameter("c", 0.25, "1", "damping", minimum=0.0)
    x, v = State("x", "1", "place", start=0.5), State("v", "1", "speed")
    flows: Any = {x: rate * v, v: rate * (x - x**3 - c * v + force)}
    return load(Automaton(name=name, title=name, source="here", states=[x, v], flows=flows))


@cache
def forced_well() -> Strobe:
    """Under A cos(w t), A = .1, w = 1."""
    amplitude, omega = Parameter("A", 0.1, "1", "amplitude"), Parameter("w", 1.0, "rad/s", "frequency", positive=True)
    return Strobe(well("forced_well", amplitude * sympy.cos(omega * TIME)), forcing="w")


@cache
def ring() -> Fmu:
    """r' = r (r^2 - 1/4)(1 - r^2), turning once in 2 pi."""
    rate = Parameter("rate", 1.0, "1/s", "rate", positive=True)
    x, y = State("x", "1", "x", start=1.0), State("y", "1", "y", start=0.1)
    square = x**2 + y**2
    grows = (square - sympy.Rational(1, 4)) * (1 - square)
    flows: Any = {x: rate * (x * grows - y), y: rate * (y * grows + x)}
    return load(Automaton(name="ring", title="ring", source="here", states=[x, y], flows=flows))
