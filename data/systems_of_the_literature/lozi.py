"""Lozi's map: Henon's with a modulus for the square.

    x(k+1) = 1 + y - a |x|,    y(k+1) = b x

Source: Lozi, Un attracteur etrange du type attracteur de Henon, Journal de Physique Colloques 39 (1978), C5-9.
"""

import sympy

from fmu_models import Map, Parameter, State

a, b = Parameter("a", 1.7, "1", "strength of the fold"), Parameter("b", 0.5, "1", "contraction of areas")
x, y = State("x", "1", "first state", start=0.4), State("y", "1", "second state", start=0.2)

MAP = Map(
    name="lozi",
    title="Lozi's map",
    source="Lozi, Journal de Physique Colloques 39 (1978)",
    states=[x, y],
    rule={x: 1 + y - a * sympy.Abs(x), y: b * x},
    box={x: (-2.0, 2.0), y: (-2.0, 2.0)},
)
