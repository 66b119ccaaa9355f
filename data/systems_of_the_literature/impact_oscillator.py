"""Oscillator without damping beside a rigid wall, shaken.

    x'' + w0^2 x = beta cos(omega t),    x' := -r x' at x = d

Source: Shaw and Holmes, A periodically forced impact oscillator with large dissipation, Journal of Applied Mechanics 50
(1983).
"""

import sympy

from fmu_models import TIME, Automaton, Parameter, Reset, State, Switch

w0, beta = Parameter("w0", 1.0, "1/s", "frequency", positive=True), Parameter("beta", 1.0, "m/s2", "force over mass")
omega, d = Parameter("omega", 2.8, "rad/s", "its frequency"), Parameter("d", 0.0, "m", "place of the wall")
r = Parameter("r", 0.8, "1", "restitution")
x, v = State("x", "m", "displacement", start=-0.48), State("v", "m/s", "speed", start=0.01)
wall = Switch(name="wall", function=d - x, unit="m", description="it hits the wall")

MODEL = Automaton(
    name="impact_oscillator",
    title="Oscillator beside a wall",
    source="Shaw and Holmes, Journal of Applied Mechanics 50 (1983)",
    states=[x, v],
    flows={x: v, v: beta * sympy.cos(omega * TIME) - w0**2 * x},
    switches=[wall],
    resets=[Reset(wall, "+", {v: -r * v})],
)
