"""Gingerbread man: a map that keeps areas, of two linear pieces.

    x(k+1) = 1 - y + |x|,    y(k+1) = x

Source: Devaney, A piecewise linear model for the zones of instability of an area-preserving map, Physica D 10 (1984).
"""

import sympy

from fmu_models import Map, State

x, y = State("x", "1", "first state", start=2.9), State("y", "1", "second state", start=-0.9)

MAP = Map(
    name="gingerbread",
    title="Gingerbread man",
    source="Devaney, Physica D 10 (1984)",
    states=[x, y],
    rule={x: 1 - y + sympy.Abs(x), y: x},
    box={x: (-4.0, 8.0), y: (-4.0, 8.0)},
)
