"""Logistic map.

    x(k+1) = r x (1 - x)

Its fixed points are 0 and 1 - 1/r, with slopes r and 2 - r. The second one flips at r = 3, the motion of period two,
of slope 4 + 2 r - r^2, at r = 1 + sqrt(6); motions of period three are born at r = 1 + sqrt(8). At r = 4 the Lyapunov
exponent is ln 2. Two values lead to each, so there is no inverse.

Source: May, Simple mathematical models with very complicated dynamics, Nature 261 (1976).
"""

from fmu_models import Map, Parameter, State

r = Parameter("r", 3.2, "1", "growth rate")
x = State("x", "1", "population, as a share of the largest", start=0.3)

MAP = Map(
    name="logistic",
    title="Logistic map",
    source="May, Nature 261 (1976)",
    states=[x],
    rule={x: r * x * (1 - x)},
    box={x: (-1.0, 2.0)},
)
