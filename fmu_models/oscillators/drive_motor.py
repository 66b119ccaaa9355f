"""Motor of a disc: its speed droops under the friction force on the disc's border.

    J_m w' = K (w_set - w) - r F

The regulator pulls the speed w back to the speed w_set that is asked for. In rest under a constant force F the speed
lacks r F / K; an infinite K is a disc of prescribed speed.

Source: standard linear characteristic of a regulated direct-current drive; the inertia and the stiffness are assumed.
"""

from __future__ import annotations

from fmu_models.language.automaton import Automaton
from fmu_models.language.mechanism import Output
from fmu_models.language.quantities import Input, Parameter, State

J_m = Parameter("J_m", 1e-3, "kg m2", "moment of inertia of motor and disc", minimum=0.0)
K = Parameter("K", 1.0, "N m s/rad", "torque per lack of speed", minimum=0.0)
r = Parameter("r", 0.06, "m", "radius of the disc", minimum=0.0)
w_set = Input("w_set", 0.83, "rad/s", "speed asked for")
F = Input("F", 0.0, "N", "force of the disc on what it drives, opposite to it on the disc")
w = State("w", "rad/s", "speed of the disc", start=0.83)
RATE = (K * (w_set - w) - r * F) / J_m

MODEL = Automaton(
    name="drive_motor",
    title="Motor of a disc whose speed droops under load",
    source="Regulated drive with a linear characteristic",
    states=[w],
    flows={w: RATE},
    outputs=[
        Output("speed", w, "rad/s", "speed of the disc"),
        Output("acceleration", w.rate, "rad/s2", "rate of the speed"),
    ],
)
