"""Two tanks that lose water, and a hose that goes to whichever has sunk to its mark: it moves ever faster.

    x1' = w q - v1,    x2' = w (1 - q) - v2,    q := 1 at x1 = r1,    q := 0 at x2 = r2

With w < v1 + v2 the hose has moved infinitely often when both are at their marks.

Source: Johansson, Egerstedt, Lygeros, Sastry, On the regularization of Zeno hybrid automata, Systems and Control
Letters 38 (1999).
"""

import sympy

from fmu_models import Automaton, Parameter, Reset, State, Switch

v1, v2 = Parameter("v1", 0.5, "m/s", "loss of the first"), Parameter("v2", 0.4, "m/s", "loss of the second")
w, r1 = Parameter("w", 0.75, "m/s", "hose"), Parameter("r1", 0.0, "m", "mark of the first")
r2, q = Parameter("r2", 0.0, "m", "mark of the second"), State("q", "1", "1: it fills the first", start=1.0)
x1, x2 = State("x1", "m", "first level", start=0.4), State("x2", "m", "second level", start=0.5)
one, two = Switch(name="one", function=x1 - r1, unit="m"), Switch(name="two", function=x2 - r2, unit="m")

MODEL = Automaton(
    name="two_tanks",
    title="Two tanks and a hose",
    source="Johansson, Egerstedt, Lygeros, Sastry, Systems and Control Letters 38 (1999)",
    states=[x1, x2, q],
    flows={x1: w * q - v1, x2: w * (1 - q) - v2, q: sympy.Integer(0)},
    switches=[one, two],
    resets=[Reset(one, "+", {q: sympy.Integer(1)}), Reset(two, "+", {q: sympy.Integer(0)})],
)
