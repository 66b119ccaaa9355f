"""Chua's circuit in its own units: a diode of three slopes.

    x' = alpha (y - h(x)),  y' = x - y + z,  z' = -beta y,    h = m1 x + (m0 - m1)(|x + 1| - |x - 1|)/2

Source: Matsumoto, Chua, Komuro, The double scroll, IEEE Transactions on Circuits and Systems 32 (1985).
"""

from fmu_models import Automaton, Parameter, State, Switch

unit, alpha = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("alpha", 8.0, "1", "capacities")
beta, m0 = Parameter("beta", 100 / 7, "1", "coil"), Parameter("m0", -1 / 7, "1", "inner slope of the diode")
m1 = Parameter("m1", 2 / 7, "1", "outer slope of the diode")
x, y, z = (State(name, "1", name, start=value) for name, value in (("x", 2.0), ("y", 0.2), ("z", -2.2)))
up, down = Switch(name="up", function=x - 1), Switch(name="down", function=x + 1)

h = m1 * x + (m0 - m1) * (down.abs - up.abs) / 2
MODEL = Automaton(
    name="chua",
    title="Chua's circuit",
    source="Matsumoto, Chua, Komuro, IEEE Transactions on Circuits and Systems 32 (1985)",
    states=[x, y, z],
    flows={x: alpha * (y - h) / unit, y: (x - y + z) / unit, z: -beta * y / unit},
    switches=[up, down],
)
