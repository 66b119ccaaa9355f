"""Impact pair: a particle between two walls that vibrate together.

    x'' = 0,    gaps D/2 + u - x >= 0 and x - u + D/2 >= 0,    u = A sin(omega t + phi0),    restitution e

x place of the particle; an impact takes its speed from v to -e v + (1 + e) u'. With kappa = (1 + e)/(1 - e) the
symmetric motion that meets either wall once in n periods of the walls, n odd, leaves the right wall at the phase

    phi = atan2(2, n pi kappa) + arccos(-D/(A R)),    R = sqrt(4 + n^2 pi^2 kappa^2),    v = A omega kappa cos(phi)

and is stable for kappa (n^2 pi^2 - 4)/sqrt(n^2 pi^2 + 4 kappa^2) < D/A < R: below, the two flights become unequal. The
defaults have n = 1 and 2.73 < D/A = 6 < 12.72; the default start reaches that motion.

Source: Bapat, Popplewell and McLachlan, Stable periodic motions of an impact-pair, Journal of Sound and Vibration 87
(1983).
"""

import sympy

from fmu_models import TIME, Coordinate, Impact, Mechanism, Newton, Output, Parameter, Requirement

m = Parameter("m", 1.0, "kg", "mass of the particle", positive=True)
D = Parameter("D", 6.0, "m", "distance of the walls")
A = Parameter("A", 1.0, "m", "amplitude of the walls", minimum=0.0)
omega = Parameter("omega", 1.0, "rad/s", "angular frequency of the walls", minimum=0.0)
phi0 = Parameter("phi0", 0.0, "rad", "phase of the walls at time zero")
e = Parameter("e", 0.6, "1", "coefficient of restitution", minimum=0.0, maximum=1.0)

x = Coordinate("x", "m", "place of the particle from the mean middle of the walls", velocity="v", v_start=2.0)
middle = A * sympy.sin(omega * TIME + phi0)
law = Newton(e)
right = Impact(name="right", gap=D / 2 + middle - x, restitution=law, description="particle at the right wall")
left = Impact(name="left", gap=x - middle + D / 2, restitution=law, description="particle at the left wall")

MODEL = Mechanism(
    name="impact_pair",
    title="Particle between two vibrating walls",
    source="Bapat, Popplewell and McLachlan, Journal of Sound and Vibration 87 (1983)",
    coordinates=[x],
    kinetic_energy=m * x.v**2 / 2,
    contacts=[right, left],
    outputs=[Output("middle", middle, "m", "middle of the walls")],
    requirements=[Requirement(D, "the walls overlap: their distance D must be positive", strict=True)],
)
