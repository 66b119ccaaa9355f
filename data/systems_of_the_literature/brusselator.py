"""Brusselator: a reaction that goes round.

    x' = a + x^2 y - (b + 1) x,    y' = b x - x^2 y

Source: Prigogine and Lefever, Symmetry breaking instabilities in dissipative systems, Journal of Chemical Physics 48
(1968).
"""

from fmu_models import Automaton, Parameter, State

unit, a = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("a", 1.0, "1", "first reagent")
b = Parameter("b", 3.0, "1", "second reagent")
x, y = State("x", "1", "first product", start=1.0), State("y", "1", "second product", start=4.0)

MODEL = Automaton(
    name="brusselator",
    title="Brusselator",
    source="Prigogine and Lefever, Journal of Chemical Physics 48 (1968)",
    states=[x, y],
    flows={x: (a + x**2 * y - (b + 1) * x) / unit, y: (b * x - x**2 * y) / unit},
)
