"""Beam between two magnets, shaken: Duffing's equation with two wells.

    x'' + delta x' - x + x^3 = gamma cos(omega t)

Source: Moon and Holmes, A magnetoelastic strange attractor, Journal of Sound and Vibration 65 (1979).
"""

import sympy

from fmu_models import TIME, Automaton, Parameter, State

unit, delta = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("delta", 0.25, "1", "damping")
gamma, omega = Parameter("gamma", 0.1, "1", "amplitude"), Parameter("omega", 1.0, "rad/s", "frequency of the force")
x, v = State("x", "1", "place", start=1.0), State("v", "1", "its rate", start=0.0)

MODEL = Automaton(
    name="duffing",
    title="Beam between two magnets",
    source="Moon and Holmes, Journal of Sound and Vibration 65 (1979)",
    states=[x, v],
    flows={x: v / unit, v: (gamma * sympy.cos(omega * TIME) - delta * v + x - x**3) / unit},
)
