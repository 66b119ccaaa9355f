"""Oscillator with another stiffness on each side.

    x'' + 2 d x' + (k1 if x > 0 else k2) x = beta cos(omega t)

Source: Shaw and Holmes, A periodically forced piecewise linear oscillator, Journal of Sound and Vibration 90 (1983).
"""

import sympy

from fmu_models import TIME, Automaton, Parameter, State, Switch

k1, k2 = Parameter("k1", 4.0, "1/s2", "stiffness over mass"), Parameter("k2", 1.0, "1/s2", "that of the other side")
d, beta = Parameter("d", 0.0, "1/s", "damping"), Parameter("beta", 0.0, "m/s2", "force over mass")
omega = Parameter("omega", 1.0, "rad/s", "its frequency")
x, v = State("x", "m", "displacement", start=1.0), State("v", "m/s", "speed", start=0.0)
side = Switch(name="side", function=x, unit="m", description="the stiffness changes")

MODEL = Automaton(
    name="bilinear_oscillator",
    title="Bilinear oscillator",
    source="Shaw and Holmes, Journal of Sound and Vibration 90 (1983)",
    states=[x, v],
    flows={x: v, v: beta * sympy.cos(omega * TIME) - 2 * d * v - (k1 + k2) / 2 * x - (k1 - k2) / 2 * side.abs},
    switches=[side],
)
