"""Rossler's band.

    x' = -y - z,    y' = x + a y,    z' = b + z (x - c)

Source: Rossler, An equation for continuous chaos, Physics Letters A 57 (1976).
"""

from fmu_models import Automaton, Parameter, State

unit, a = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("a", 0.2, "1", "growth")
b, c = Parameter("b", 0.2, "1", "source of z"), Parameter("c", 5.7, "1", "where z grows")
x, y, z = (State(name, "1", name, start=value) for name, value in (("x", 0.0), ("y", -6.2), ("z", 0.03)))

MODEL = Automaton(
    name="rossler",
    title="Rossler's band",
    source="Rossler, Physics Letters A 57 (1976)",
    states=[x, y, z],
    flows={x: (-y - z) / unit, y: (x + a * y) / unit, z: (b + z * (x - c)) / unit},
)
