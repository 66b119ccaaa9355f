"""FitzHugh and Nagumo's nerve.

    v' = v - v^3/3 - w + I,    w' = epsilon (v + a - b w)

Source: FitzHugh, Impulses and physiological states in theoretical models of nerve membrane, Biophysical Journal 1
(1961).
"""

from fmu_models import Automaton, Parameter, State

unit, current = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("I", 0.5, "1", "current")
a, b = Parameter("a", 0.7, "1", "threshold"), Parameter("b", 0.8, "1", "recovery")
epsilon = Parameter("epsilon", 0.08, "1", "how slow the recovery is")
v, w = State("v", "1", "potential", start=1.9), State("w", "1", "recovery", start=0.6)

MODEL = Automaton(
    name="fitzhugh_nagumo",
    title="FitzHugh and Nagumo's nerve",
    source="FitzHugh, Biophysical Journal 1 (1961)",
    states=[v, w],
    flows={v: (v - v**3 / 3 - w + current) / unit, w: epsilon * (v + a - b * w) / unit},
)
