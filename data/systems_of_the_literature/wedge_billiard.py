"""Wedge billiard: a ball under gravity between two walls that lean to either side.

    x'' = 0,    y'' = -g;    at a wall the speed towards it turns round

Source: Lehtihet and Miller, Numerical study of a billiard in a gravitational field, Physica D 21 (1986).
"""

from sympy import cos, sin

from fmu_models import Automaton, Parameter, Reset, State, Switch

g, theta = Parameter("g", 1.0, "m/s2", "gravity"), Parameter("theta", 0.6435011087932844, "rad", "wall from vertical")
x, y = State("x", "m", "across", start=0.3), State("y", "m", "up", start=2.0)
u, v = State("u", "m/s", "across", start=0.0), State("v", "m/s", "up", start=0.0)
right = Switch(name="right", function=y * sin(theta) - x * cos(theta), unit="m")
left = Switch(name="left", function=y * sin(theta) + x * cos(theta), unit="m")

bounce = {
    sign: {u: -u * cos(2 * theta) + sign * v * sin(2 * theta), v: sign * u * sin(2 * theta) + v * cos(2 * theta)}
    for sign in (1, -1)
}
MODEL = Automaton(
    name="wedge_billiard",
    title="Wedge billiard",
    source="Lehtihet and Miller, Physica D 21 (1986)",
    states=[x, y, u, v],
    flows={x: u, y: v, u: 0 * g, v: -g},
    switches=[right, left],
    resets=[Reset(right, "+", bounce[1]), Reset(left, "+", bounce[-1])],
)
