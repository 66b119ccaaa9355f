"""Planar system with a multiple crossing bifurcation, smoothed.

    x1' = x1 + 4/pi arctan(eps x1) x1 + x2
    x2' = x1 + 4/pi arctan(eps x1) x1 + x2/2 + mu

``planar_multiple_crossing`` with 2/pi arctan(eps x1) in place of sgn(x1). Its one bifurcation is torn apart into a
homoclinic one that begets an unstable limit cycle, a Hopf bifurcation in which the cycle dies, and a saddle-node; with
eps x1, eps x2 and eps mu for x1, x2 and mu the equations are free of eps. The default start is inside the cycle.

Source: Leine and van Campen, Bifurcation phenomena in non-smooth dynamical systems, European Journal of Mechanics
A/Solids 25 (2006), equation (14); Figs. 5 and 6 have eps = 20. (The "mu = -0.05" below Fig. 5 is -0.005.)
"""

import sympy

from fmu_models import Automaton, Parameter, State

mu = Parameter("mu", 0.0, "1", "bifurcation parameter")
eps = Parameter("eps", 20.0, "1", "steepness of the smoothing", positive=True)
x1 = State("x1", "1", "first state", start=-0.04, nominal=0.1)
x2 = State("x2", "1", "second state", start=0.0, nominal=0.1)

bent = x1 + 4 / sympy.pi * sympy.atan(eps * x1) * x1

MODEL = Automaton(
    name="planar_multiple_crossing_smooth",
    title="Planar system with a multiple crossing bifurcation, smoothed",
    source="Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), equation (14)",
    states=[x1, x2],
    flows={x1: bent + x2, x2: bent + x2 / 2 + mu},
)
