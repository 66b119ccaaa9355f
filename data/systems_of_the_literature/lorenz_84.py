"""Lorenz' westerly wind x with waves y, z.

    x' = -y^2 - z^2 - a x + a F,    y' = x y - b x z - y + G,    z' = b x y + x z - z

Without G the waves turn at x = 1 with y^2 + z^2 = a (F - 1), at the rate b.

Source: Lorenz, Irregularity: a fundamental property of the atmosphere, Tellus 36A (1984).
"""

from fmu_models import Automaton, Parameter, State

unit, a = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("a", 0.25, "1", "loss of the wind")
b, F = Parameter("b", 4.0, "1", "how the wind moves waves"), Parameter("F", 6.0, "1", "heat between pole and equator")
G = Parameter("G", 0.0, "1", "heat between land and sea")
x, y, z = (State(name, "1", name, start=value) for name, value in (("x", 1.0), ("y", 1.1), ("z", 0.0)))

MODEL = Automaton(
    name="lorenz_84",
    title="Lorenz' general circulation",
    source="Lorenz, Tellus 36A (1984)",
    states=[x, y, z],
    flows={
        x: (-(y**2) - z**2 - a * x + a * F) / unit,
        y: (x * y - b * x * z - y + G) / unit,
        z: (b * x * y + x * z - z) / unit,
    },
)
