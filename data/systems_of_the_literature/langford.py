"""Langford's flow, whose cycle gives birth to a torus.

    x' = (z - b) x - d y,    y' = d x + (z - b) y,    z' = c + a z - z^3/3 - (x^2 + y^2)(1 + e z) + f z x^3

Without f the cycle lies at z = b, with x^2 + y^2 = (c + a b - b^3/3)/(1 + e b).

Source: Langford, Numerical studies of torus bifurcations, International Series of Numerical Mathematics 70 (1984).
"""

from fmu_models import Automaton, Parameter, State

unit, a = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("a", 0.95, "1", "growth of z")
b, c = Parameter("b", 0.7, "1", "where the cycle lies"), Parameter("c", 0.6, "1", "drift of z")
d, e = Parameter("d", 3.5, "1", "rate of turning"), Parameter("e", 0.25, "1", "loss with z")
f = Parameter("f", 0.0, "1", "what breaks the symmetry")
x, y, z = (State(name, "1", name, start=value) for name, value in (("x", 1.0), ("y", 0.0), ("z", 0.7)))

MODEL = Automaton(
    name="langford",
    title="Langford's torus",
    source="Langford, International Series of Numerical Mathematics 70 (1984)",
    states=[x, y, z],
    flows={
        x: ((z - b) * x - d * y) / unit,
        y: (d * x + (z - b) * y) / unit,
        z: (c + a * z - z**3 / 3 - (x**2 + y**2) * (1 + e * z) + f * z * x**3) / unit,
    },
)
