"""Ikeda's map: light that goes round in a ring with a nonlinear absorber, its field z = x + i y at each turn.

    z(k+1) = A + B z exp(i (kappa - alpha/(1 + |z|^2)))

Source: Ikeda, Optics Communications 30 (1979); constants as in Nusse and Yorke, Dynamics: Numerical Explorations
(1998).
"""

import sympy

from fmu_models import Map, Parameter, State

A, B = Parameter("A", 1.0, "1", "light that comes in"), Parameter("B", 0.9, "1", "what a turn leaves of it")
kappa, alpha = Parameter("kappa", 0.4, "1", "phase of the ring"), Parameter("alpha", 6.0, "1", "phase of the absorber")
x, y = State("x", "1", "real part", start=0.5), State("y", "1", "imaginary part", start=0.25)

t = kappa - alpha / (1 + x**2 + y**2)
MAP = Map(
    name="ikeda",
    title="Ikeda's map of a ring cavity",
    source="Ikeda, Optics Communications 30 (1979)",
    states=[x, y],
    rule={x: A + B * (x * sympy.cos(t) - y * sympy.sin(t)), y: B * (x * sympy.sin(t) + y * sympy.cos(t))},
    box={x: (-1.0, 2.0), y: (-2.0, 1.5)},
)
