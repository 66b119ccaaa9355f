"""Impact damper: a mass on spring and dashpot under a harmonic force, with a free mass in a cavity of it.

    M x'' + c x' + k x = f0 cos(omega t + phi0) + lambda_r - lambda_l,    m y'' = lambda_l - lambda_r
    gaps x + D/2 - y >= 0 (right wall, lambda_r) and y - x + D/2 >= 0 (left wall, lambda_l),    restitution e

x displacement of the driven mass M, y of the free mass m. Momentum is exchanged with the walls in the ratio of the
masses: an impact takes the speeds v of M and u of m to v + (1 + e) (u - v) m/(M + m), u - (1 + e) (u - v) M/(M + m).

Its symmetric motion with two impacts in a period of the force, one at either wall in equal intervals, is the one that
damps. With the defaults, at resonance, it is stable (multipliers over half a period of modulus 0.873 and 0.538) and
holds the amplitude of M at 0.297 m, which would be 2.5 m without the free mass; the default start lies on it, in the
middle of the cavity.

Source: Masri and Caughey, On the stability of the impact damper, Journal of Applied Mechanics 33 (1966).
"""

import sympy

from fmu_models import TIME, Coordinate, Impact, Mechanism, Newton, Output, Parameter, Requirement

M = Parameter("M", 1.0, "kg", "driven mass", positive=True)
m = Parameter("m", 0.1, "kg", "free mass", positive=True)
k = Parameter("k", 1.0, "N/m", "stiffness of the spring", minimum=0.0)
c = Parameter("c", 0.04, "N s/m", "viscous damping", minimum=0.0)
f0 = Parameter("f0", 0.1, "N", "amplitude of the force")
omega = Parameter("omega", 1.0, "rad/s", "angular frequency of the force", minimum=0.0)
phi0 = Parameter("phi0", 5.082783065777492, "rad", "phase of the force at time zero")
D = Parameter("D", 2.0, "m", "clearance of the free mass, from wall to wall")
e = Parameter("e", 0.5, "1", "coefficient of restitution", minimum=0.0, maximum=1.0)

x = Coordinate(
    "x", "m", "displacement of the driven mass", velocity="v", start=-0.29609752054994676, v_start=-0.022282752788391536
)
y = Coordinate(
    "y", "m", "displacement of the free mass", velocity="u", start=-0.29609752054994676, v_start=-0.7030950326546709
)
law = Newton(e)
right = Impact(name="right", gap=x + D / 2 - y, restitution=law, description="free mass at the right wall")
left = Impact(name="left", gap=y - x + D / 2, restitution=law, description="free mass at the left wall")

MODEL = Mechanism(
    name="impact_damper",
    title="Driven oscillator with a free mass in a cavity",
    source="Masri and Caughey, Journal of Applied Mechanics 33 (1966)",
    coordinates=[x, y],
    kinetic_energy=M * x.v**2 / 2 + m * y.v**2 / 2,
    potential_energy=k * x**2 / 2,
    dissipation=c * x.v**2 / 2,
    applied={x: f0 * sympy.cos(omega * TIME + phi0)},
    contacts=[right, left],
    outputs=[Output("z", y - x, "m", "place of the free mass in the cavity")],
    requirements=[Requirement(D, "the walls overlap: the clearance D must be positive", strict=True)],
)
