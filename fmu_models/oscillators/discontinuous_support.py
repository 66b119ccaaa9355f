"""Oscillator with a discontinuous support: a mass on spring and dashpot that meets a support without mass.

    m x'' + c x' + k x                      = f0 cos(omega t)    free
    m x'' + (c + cs) x' + k x + ks (x - g)  = f0 cos(omega t)    on the support

The support is touched from x = g with x' > 0 until its force fs = ks (x - g) + cs x' falls to zero. It cannot pull and
relaxes at once, so that the mass leaves it at x > g on its way back: "free where x < g" would be wrong.

Source: a study of this oscillator by the switch model of Leine and van Campen (Nonlinear Dynamics 16 (1998)),
equations (1) to (11): (3) free, (4) in contact, (8) and (9) which of them holds. Its "05m" for f0 is 0.5 N. Sets:

    |         | m, kg | k, N/m | c, N s/m | f0, N      | omega, rad/s | ks, N/m        | cs, N s/m | g, m |
    |---------|-------|--------|----------|------------|--------------|----------------|-----------|------|
    | Table 1 | 1     | 1      | 0.05     | 0.5        | 1            | 10, 50 and 1e5 | 0.3       | 4    |
    | Table 2 | 1     | 1      | 0.05     | 0.5        | 0.8 to 1     | 300            | 0.6       | 1.6  |
    | Fig. 10 | 1     | 1      | 0.05     | 0.45 to 0.8 | 0.9         | 1000           | 0.6       | 2    |

The defaults are those of Table 1; the default start lies on its periodic motion, since rest leads there only slowly.
"""

import sympy

from fmu_models import TIME, Coordinate, KelvinVoigt, Mechanism, Parameter, Stop

m = Parameter("m", 1.0, "kg", "mass", positive=True)
k = Parameter("k", 1.0, "N/m", "stiffness of the spring", minimum=0.0)
c = Parameter("c", 0.05, "N s/m", "viscous damping", minimum=0.0)
f0 = Parameter("f0", 0.5, "N", "amplitude of the force")
omega = Parameter("omega", 1.0, "rad/s", "angular frequency of the force", minimum=0.0)
ks = Parameter("ks", 10.0, "N/m", "stiffness of the support", minimum=0.0)
cs = Parameter("cs", 0.3, "N s/m", "viscous damping of the support", minimum=0.0)
g = Parameter("g", 4.0, "m", "gap between the mass at rest and the support")

x = Coordinate(
    "x",
    "m",
    "displacement of the mass from the relaxed spring",
    velocity="v",
    start=3.648464099396639,
    v_start=2.514570496974713,
)
support = Stop(name="support", gap=g - x, law=KelvinVoigt(ks, cs), release="force", description="mass on its support")

MODEL = Mechanism(
    name="discontinuous_support",
    title="Oscillator with a discontinuous support",
    source="study of a discontinuous support by the switch model of Leine and van Campen, Nonlinear Dynamics 16 (1998)",
    coordinates=[x],
    kinetic_energy=m * x.v**2 / 2,
    potential_energy=k * x**2 / 2,
    dissipation=c * x.v**2 / 2,
    applied={x: f0 * sympy.cos(omega * TIME)},
    contacts=[support],
)
