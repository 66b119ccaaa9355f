"""Rotor that is kicked and damped: many motions of low period side by side where the damping is weak.

    x(k+1) = x + y mod 2 pi,    y(k+1) = (1 - nu) y + f0 sin(x + y)

Source: Feudel, Grebogi, Hunt, Yorke, Map with more than 100 coexisting low-period periodic attractors, Physical Review
E 54 (1996).
"""

import sympy

from fmu_models import Map, Parameter, State

nu, f0 = Parameter("nu", 0.02, "1", "damping"), Parameter("f0", 3.5, "1", "strength of the kicks")
x, y = State("x", "rad", "angle", start=3.1), State("y", "rad", "rate, per kick", start=6.28)

MAP = Map(
    name="dissipative_standard",
    title="Kicked rotor with damping",
    source="Feudel, Grebogi, Hunt, Yorke, Physical Review E 54 (1996)",
    states=[x, y],
    rule={x: x + y, y: (1 - nu) * y + f0 * sympy.sin(x + y)},
    modulus={x: 2 * sympy.pi},
    box={y: (-10.0, 10.0)},
)
