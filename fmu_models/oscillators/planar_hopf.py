"""Planar system with a discontinuous Hopf bifurcation.

    x1' = x2
    x2' = -x2 - 3/2 |x2 - mu| - x1

Its flow is continuous and has a kink at x2 = mu. The one equilibrium (-3/2 |mu|, 0) is a stable node for mu < 0 and an
unstable focus inside a stable limit cycle for mu > 0. The cycle scales with mu, its period does not depend on it.

Source: Leine and van Campen, Bifurcation phenomena in non-smooth dynamical systems, European Journal of Mechanics
A/Solids 25 (2006), equation (2); Fig. 1 has mu = -1 and mu = 1.
"""

import sympy

from fmu_models import Automaton, Parameter, State, Switch

mu = Parameter("mu", 1.0, "1", "bifurcation parameter")
x1 = State("x1", "1", "first state", start=0.0)
x2 = State("x2", "1", "second state", start=2.0)
kink = Switch(name="kink", function=x2 - mu, description="kink of the flow at x2 = mu")

MODEL = Automaton(
    name="planar_hopf",
    title="Planar system with a discontinuous Hopf bifurcation",
    source="Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), equation (2)",
    states=[x1, x2],
    flows={x1: x2, x2: -x2 - sympy.Rational(3, 2) * kink.abs - x1},
    switches=[kink],
)
