"""Thomas' labyrinth, alike in its three states.

    x' = sin y - b x,    y' = sin z - b y,    z' = sin x - b z

Source: Thomas, Deterministic chaos seen in terms of feedback circuits, International Journal of Bifurcation and Chaos 9
(1999).
"""

import sympy

from fmu_models import Automaton, Parameter, State

unit, b = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("b", 0.4, "1", "damping")
x, y, z = (State(name, "1", name, start=1.9) for name in "xyz")

MODEL = Automaton(
    name="thomas",
    title="Thomas' labyrinth",
    source="Thomas, International Journal of Bifurcation and Chaos 9 (1999)",
    states=[x, y, z],
    flows={to: (sympy.sin(of) - b * to) / unit for to, of in ((x, y), (y, z), (z, x))},
)
