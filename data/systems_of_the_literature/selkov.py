"""Sel'kov's glycolysis, as Strogatz has it: two Hopf points for a < 1/8.

    x' = -x + a y + x^2 y,    y' = b - a y - x^2 y

Source: Sel'kov, Self-oscillations in glycolysis, European Journal of Biochemistry 4 (1968); Strogatz, Nonlinear
Dynamics and Chaos (1994), example 7.3.2.
"""

from fmu_models import Automaton, Parameter, State

unit, a = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("a", 0.08, "1", "without feedback")
b = Parameter("b", 0.2, "1", "sugar that comes in")
x, y = State("x", "1", "ADP", start=0.2), State("y", "1", "sugar", start=1.7)

MODEL = Automaton(
    name="selkov",
    title="Sel'kov's glycolysis",
    source="Sel'kov, European Journal of Biochemistry 4 (1968)",
    states=[x, y],
    flows={x: (-x + a * y + x**2 * y) / unit, y: (b - a * y - x**2 * y) / unit},
)
