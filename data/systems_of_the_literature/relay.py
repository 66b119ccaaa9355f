"""Three lags under a relay.

    x' = -x - sgn z,    y' = x - y,    z' = y - z

Source: Astrom, Oscillations in systems with relay feedback, IMA Volumes in Mathematics 74 (1995).
"""

from fmu_models import Automaton, Parameter, State, Switch

lag = Parameter("lag", 1.0, "s", "time constant", positive=True)
x, y, z = (State(name, "1", name, start=value) for name, value in (("x", 0.5), ("y", 0.2), ("z", 0.1)))
relay = Switch(name="relay", function=z)

MODEL = Automaton(
    name="relay",
    title="Relay feedback of three lags",
    source="Astrom, IMA Volumes in Mathematics 74 (1995)",
    states=[x, y, z],
    flows={x: (-x - relay.sign) / lag, y: (x - y) / lag, z: (y - z) / lag},
    switches=[relay],
)
