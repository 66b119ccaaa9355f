"""Regulated drive of a disc: its speed droops under the friction force on the disc's border.

    w' = a,    T**2 a' + 2 T a + w = w_set - r F / K

Under a constant force F the speed lacks r F / K, the droop; the drive approaches it with the time T, critically
damped. An infinite K is a disc of prescribed speed. The rate of the speed is a state: a disc that sticks to a body
takes speed and rate of the drive for given, so that neither may jump with the force.

Source: linear characteristic of a regulated drive of second order; its constants are assumed.
"""

from fmu_models import Automaton, Input, Output, Parameter, State

K = Parameter("K", 1.0, "N m s/rad", "torque per lack of speed", minimum=0.0)
T = Parameter("T", 0.3, "s", "time in which the drive answers to its load", minimum=0.0)
r = Parameter("r", 0.06, "m", "radius of the disc", minimum=0.0)
w_set = Input("w_set", 0.83, "rad/s", "speed asked for")
F = Input("F", 1.0, "N", "force of the disc on what it drives, opposite to it on the disc")
w = State("w", "rad/s", "speed of the disc", start=0.83)
a = State("a", "rad/s2", "rate of the speed")

MODEL = Automaton(
    name="drive_motor",
    title="Drive of a disc whose speed droops under load",
    source="Regulated drive with a linear characteristic of second order",
    states=[w, a],
    flows={w: a, a: (w_set - w - r * F / K - 2 * T * a) / T**2},
    outputs=[
        Output("speed", w, "rad/s", "speed of the disc"),
        Output("acceleration", w.rate, "rad/s2", "rate of the speed"),
    ],
)
