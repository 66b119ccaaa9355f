"""A double well, x'' + c x' - x + x^3 = force, with and without a force."""

from __future__ import annotations

from typing import Any

import sympy

from fmu_models import Automaton, Fmu, Parameter, State, load


def well(name: str = "double_well", force: sympy.Expr = sympy.S.Zero) -> Fmu:
    """Its FMU; c = .25."""
    rate, c = Parameter("rate", 1.0, "1/s", "rate", positive=True), Parameter("c", 0.25, "1", "damping", minimum=0.0)
    x, v = State("x", "1", "place", start=0.5), State("v", "1", "speed")
    flows: Any = {x: rate * v, v: rate * (x - x**3 - c * v + force)}
    return load(Automaton(name=name, title=name, source="here", states=[x, v], flows=flows))
