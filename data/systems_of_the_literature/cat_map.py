"""Arnold's cat map: the torus stretched and folded, everywhere alike.

    x(k+1) = 2 x + y mod 1,    y(k+1) = x + y mod 1

Source: Arnold and Avez, Ergodic Problems of Classical Mechanics (1968), section 1.
"""

import sympy

from fmu_models import Map, State

x, y = State("x", "1", "first angle", start=0.1), State("y", "1", "second angle", start=0.23)

MAP = Map(
    name="cat_map",
    title="Arnold's cat map",
    source="Arnold and Avez, Ergodic Problems of Classical Mechanics (1968)",
    states=[x, y],
    rule={x: 2 * x + y, y: x + y},
    modulus={x: sympy.Integer(1), y: sympy.Integer(1)},
)
