"""Gear pair with backlash: a mesh of stiffness k behind a gap of 2 b, without load.

    x'' + k (x - b) = 0 for x > b,    x'' = 0 for |x| < b,    x'' + k (x + b) = 0 for x < -b

Source: Theodossiades and Natsiavas, Non-linear dynamics of gear-pair systems with periodic stiffness and backlash,
Journal of Sound and Vibration 229 (2000).
"""

from fmu_models import Automaton, Parameter, State, Switch

k, b = Parameter("k", 4.0, "1/s2", "stiffness over mass", positive=True), Parameter("b", 0.5, "m", "half the backlash")
x, v = State("x", "m", "error of transmission", start=1.5), State("v", "m/s", "its rate", start=0.0)
drive = Switch(name="drive", function=x - b, unit="m", description="teeth meet")
coast = Switch(name="coast", function=x + b, unit="m", description="their backs meet")

MODEL = Automaton(
    name="gear_backlash",
    title="Gear pair with backlash",
    source="Theodossiades and Natsiavas, Journal of Sound and Vibration 229 (2000)",
    states=[x, v],
    flows={x: v, v: -k * (x + (drive.abs - coast.abs) / 2)},
    switches=[drive, coast],
)
