"""Neuron that integrates, leaks and fires.

    tau V' = I - V,    V := 0 at V = 1

Source: Lapicque (1907), as Keener, Hoppensteadt, Rinzel, Integrate-and-fire models of nerve membrane response to
oscillatory input, SIAM Journal on Applied Mathematics 41 (1981).
"""

import sympy

from fmu_models import Automaton, Parameter, Reset, State, Switch

tau, current = Parameter("tau", 1.0, "s", "time constant", positive=True), Parameter("I", 1.2, "1", "current")
V = State("V", "1", "potential", start=0.1)
spike = Switch(name="spike", function=1 - V, description="threshold")

MODEL = Automaton(
    name="integrate_and_fire",
    title="Leaky integrate-and-fire neuron",
    source="Keener, Hoppensteadt, Rinzel, SIAM Journal on Applied Mathematics 41 (1981)",
    states=[V],
    flows={V: (current - V) / tau},
    switches=[spike],
    resets=[Reset(spike, "+", {V: sympy.Integer(0)})],
)
