"""Van der Pol's oscillator.

    x'' - mu (1 - x^2) x' + x = 0

Source: van der Pol, On relaxation-oscillations, Philosophical Magazine 2 (1926).
"""

from fmu_models import Automaton, Parameter, State

unit, mu = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("mu", 1.0, "1", "strength")
x, v = State("x", "1", "current", start=2.0), State("v", "1", "its rate", start=0.0)

MODEL = Automaton(
    name="van_der_pol",
    title="Van der Pol's oscillator",
    source="van der Pol, Philosophical Magazine 2 (1926)",
    states=[x, v],
    flows={x: v / unit, v: (mu * (1 - x**2) * v - x) / unit},
)
