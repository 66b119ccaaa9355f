"""Tent map.

    x(k+1) = s x        x <= 1/2
             s (1 - x)  x > 1/2

Its slope has the size s everywhere, and so its Lyapunov exponent is ln s. For s > 1 the fixed points 0 and s/(1 + s)
are unstable. In binary arithmetic the motions at s = 2 all end at 0 after as many steps as a number has digits: the
division by two is exact. Two values lead to each, so there is no inverse.

Source: Collet and Eckmann, Iterated Maps on the Interval as Dynamical Systems (1980).
"""

import sympy

from fmu_models import Map, Parameter, State

s = Parameter("s", 1.9, "1", "slope", minimum=0.0)
x = State("x", "1", "state", start=0.3)

MAP = Map(
    name="tent",
    title="Tent map",
    source="Collet and Eckmann, Iterated Maps on the Interval as Dynamical Systems (1980)",
    states=[x],
    rule={x: sympy.Piecewise((s * x, x <= sympy.Rational(1, 2)), (s * (1 - x), True))},
    box={x: (-1.0, 2.0)},
)
