"""Ball on a vibrating table.

    x'' = -g,    gap x - A sin(omega t + phi0) >= 0,    restitution e

x height of the ball over the middle of the table. With the table at u = A sin(omega t + phi0) an impact takes the speed
of the ball from v to -e v + (1 + e) u'. A ball at rest on the table leaves it where u'' = -g, and so never if
Gamma = A omega^2/g <= 1.

Motions of one impact in n periods of the table meet it at the phase phi with

    cos(phi) = n pi (1 - e) / ((1 + e) Gamma)    and leave it with    v = n pi g/omega

They exist from Gamma = n pi (1 - e)/(1 + e) on; of the two, the one with 0 < phi < pi/2 is stable up to the flip at
Gamma^2 = (n pi (1 - e)/(1 + e))^2 + (2 (1 + e^2)/(1 + e)^2)^2. The defaults (Gamma = 1.2, 10 Hz, e = 0.5) lie between
the two for n = 1, and the default start on that motion. A ball that is dropped may end in another, which rests on the
table for half of every period.

Source: Holmes, The dynamics of repeated impacts with a sinusoidally vibrating table, Journal of Sound and Vibration 84
(1982), whose table does not move between impacts; without that simplification Luo and Han, The dynamics of a bouncing
ball with a sinusoidally vibrating table revisited, Nonlinear Dynamics 10 (1996).
"""

import math

import sympy

from fmu_models import TIME, Coordinate, Impact, Mechanism, Newton, Output, Parameter

m = Parameter("m", 1.0, "kg", "mass of the ball", positive=True)
g = Parameter("g", 9.81, "m/s2", "gravity", minimum=0.0)
A = Parameter("A", 2.981882434594e-3, "m", "amplitude of the table", minimum=0.0)
omega = Parameter("omega", 20 * math.pi, "rad/s", "angular frequency of the table", minimum=0.0)
phi0 = Parameter("phi0", 0.0, "rad", "phase of the table at time zero")
e = Parameter("e", 0.5, "1", "coefficient of restitution", minimum=0.0, maximum=1.0)

x = Coordinate(
    "x",
    "m",
    "height over the middle of the table",
    velocity="v",
    start=0.005115361730320378,
    v_start=-0.41084764605635454,
    nominal=0.01,
    v_nominal=0.1,
)
height = A * sympy.sin(omega * TIME + phi0)
table = Impact(name="table", gap=x - height, restitution=Newton(e), description="ball on the table")

MODEL = Mechanism(
    name="bouncing_ball",
    title="Ball on a vibrating table",
    source="Holmes, Journal of Sound and Vibration 84 (1982); Luo and Han, Nonlinear Dynamics 10 (1996)",
    coordinates=[x],
    kinetic_energy=m * x.v**2 / 2,
    potential_energy=m * g * x,
    contacts=[table],
    outputs=[
        Output("height", height, "m", "height of the table"),
        Output("gap", table.gap, "m", "height of the ball over the table"),
    ],
)
