"""Nordmark's map: what a grazing impact makes of the motion of an oscillator.

    x <= 0   x(k+1) = alpha x + y + rho,      y(k+1) = -gamma x
    x >  0   x(k+1) = -sqrt(x) + y + rho,     y(k+1) = -gamma tau2 x

Source: Nordmark, Journal of Sound and Vibration 145 (1991); this form: Chin, Ott, Nusse, Grebogi, Physical Review E 50
(1994).
"""

import sympy

from fmu_models import Map, Parameter, State

alpha, gamma = Parameter("alpha", 0.65, "1", "trace"), Parameter("gamma", 0.05, "1", "determinant")
tau2, rho = Parameter("tau2", 0.9, "1", "restitution squared"), Parameter("rho", 0.02, "1", "beyond grazing")
x, y = State("x", "1", "depth", start=-0.1), State("y", "1", "second state", start=0.0)

MAP = Map(
    name="nordmark",
    title="Nordmark's map of grazing impacts",
    source="Nordmark, Journal of Sound and Vibration 145 (1991)",
    states=[x, y],
    rule={
        x: sympy.Piecewise((alpha * x, x <= 0), (-sympy.sqrt(sympy.Abs(x)), True)) + y + rho,
        y: sympy.Piecewise((-gamma * x, x <= 0), (-gamma * tau2 * x, True)),
    },
    box={x: (-1.0, 0.2), y: (-0.2, 0.2)},
)
