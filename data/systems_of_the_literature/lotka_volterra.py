"""Prey x and predators y: x - ln x + y - ln y stays as it is.

    x' = x (1 - y),    y' = y (x - 1)

Source: Volterra, Fluctuations in the abundance of a species considered mathematically, Nature 118 (1926).
"""

from fmu_models import Automaton, Parameter, State, Switch

unit = Parameter("unit", 1.0, "s", "unit of time", positive=True)
x, y = State("x", "1", "prey", start=2.0), State("y", "1", "predators", start=1.0)

MODEL = Automaton(
    name="lotka_volterra",
    title="Lotka and Volterra's prey and predators",
    source="Volterra, Nature 118 (1926)",
    states=[x, y],
    flows={x: x * (1 - y) / unit, y: y * (x - 1) / unit},
    switches=[Switch(name="mean", function=x - 1, description="counts the turns")],
)
