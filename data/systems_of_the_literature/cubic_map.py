"""Odd cubic map: two mirror motions that double, become chaotic, and merge at a = 3 sqrt(3)/2.

    x(k+1) = a x - x^3

Source: Rogers and Whitley, Chaos in the cubic mapping, Mathematical Modelling 4 (1983).
"""

from fmu_models import Map, Parameter, State

a, x = Parameter("a", 1.5, "1", "growth"), State("x", "1", "state", start=0.5)

MAP = Map(
    name="cubic_map",
    title="Odd cubic map",
    source="Rogers and Whitley, Mathematical Modelling 4 (1983)",
    states=[x],
    rule={x: a * x - x**3},
    box={x: (-2.0, 2.0)},
)
