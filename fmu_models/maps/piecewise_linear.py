"""Piecewise linear map with a jump.

    x(k+1) = r - 2    x <= 0
             r - a x  x > 0        a > 1

It is the local picture of the return map of the Woodpecker toy. Its fixed points are r/(1 + a) for r > 0, of slope -a,
and r - 2 for r <= 2, of slope 0. The jump at x = 0 crosses the diagonal for 0 < r < 2; it is no fixed point, and no
crossing of the second iterate either, whose jump at r/a crosses the diagonal instead:

    x(k+2) = r - 2            x <= 0
             a^2 x + (1-a) r  0 < x < r/a
             r - 2            x >= r/a

For r > 2 the left branch leads to the right one, and x(k+2) = 2 a + (1 - a) r for x <= 0, where the source, which
looks at r < 2, has r - 2.

Source: Leine and van Campen, Bifurcation phenomena in non-smooth dynamical systems, European Journal of Mechanics
A/Solids 25 (2006), equations (25), (26); Fig. 19 has a = 5/4 and r = 1.
"""

import sympy

from fmu_models import Map, Parameter, Requirement, State

a = Parameter("a", 1.25, "1", "slope on the right, downwards")
r = Parameter("r", 1.0, "1", "shift")
x = State("x", "1", "state", start=0.5)

MAP = Map(
    name="piecewise_linear",
    title="Piecewise linear map with a jump",
    source="Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), equation (25)",
    states=[x],
    rule={x: sympy.Piecewise((r - 2, x <= 0), (r - a * x, True))},
    box={x: (-4.0, 4.0)},
    requirements=[Requirement(a - 1, "a, the slope on the right, must exceed 1", strict=True)],
)
