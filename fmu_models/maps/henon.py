"""Henon map.

    x(k+1) = 1 - a x^2 + y
    y(k+1) = b x

Its determinant is -b everywhere. It has fixed points for a >= -(1 - b)^2/4, where they are born in a saddle-node
bifurcation; the stable one flips at a = 3 (1 - b)^2/4, and the motion of period two at a = (1 - b)^2 + (1 + b)^2/4.

Source: Henon, A two-dimensional mapping with a strange attractor, Communications in Mathematical Physics 50 (1976).
"""

from fmu_models import Map, Parameter, State

a = Parameter("a", 1.4, "1", "strength of the fold")
b = Parameter("b", 0.3, "1", "contraction of areas")
x = State("x", "1", "first state", start=0.1)
y = State("y", "1", "second state", start=0.1)

MAP = Map(
    name="henon",
    title="Henon map",
    source="Henon, Communications in Mathematical Physics 50 (1976)",
    states=[x, y],
    rule={x: 1 - a * x**2 + y, y: b * x},
    inverse={x: y / b, y: x - 1 + a * (y / b) ** 2},
    box={x: (-3.0, 3.0), y: (-3.0, 3.0)},
)
