"""Tinkerbell map.

    x(k+1) = x^2 - y^2 + a x + b y,    y(k+1) = 2 x y + c x + d y

Source: Nusse and Yorke, Dynamics: Numerical Explorations (1998).
"""

from fmu_models import Map, Parameter, State

a, b = Parameter("a", 0.9, "1", "x to x"), Parameter("b", -0.6013, "1", "y to x")
c, d = Parameter("c", 2.0, "1", "x to y"), Parameter("d", 0.5, "1", "y to y")
x, y = State("x", "1", "first state", start=1.0), State("y", "1", "second state", start=-1.3)

MAP = Map(
    name="tinkerbell",
    title="Tinkerbell map",
    source="Nusse and Yorke, Dynamics: Numerical Explorations (1998)",
    states=[x, y],
    rule={x: x**2 - y**2 + a * x + b * y, y: 2 * x * y + c * x + d * y},
    box={x: (-1.5, 0.6), y: (-1.8, 0.7)},
)
