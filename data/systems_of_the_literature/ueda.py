"""Ueda's circuit: a coil that saturates under alternating current.

    x'' + k x' + x^3 = B cos t

Source: Ueda, Randomly transitional phenomena in the system governed by Duffing's equation, Journal of Statistical
Physics 20 (1979).
"""

import sympy

from fmu_models import TIME, Automaton, Parameter, State

unit, k = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("k", 0.05, "1", "damping")
B = Parameter("B", 7.5, "1", "amplitude of the force")
x, v = State("x", "1", "flux", start=2.27), State("v", "1", "its rate", start=-0.26)

MODEL = Automaton(
    name="ueda",
    title="Ueda's circuit",
    source="Ueda, Journal of Statistical Physics 20 (1979)",
    states=[x, v],
    flows={x: v / unit, v: (B * sympy.cos(TIME / unit) - k * v - x**3) / unit},
)
