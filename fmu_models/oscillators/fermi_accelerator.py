"""Fermi's accelerator: a particle between a vibrating wall and a fixed one.

    x'' = 0,    gaps x - A sin(omega t + phi0) >= 0 (restitution e) and L - x >= 0 (elastic)

x place of the particle from the middle of the vibrating wall. An impact there takes its speed from v to
-e v + (1 + e) u', u' the speed of the wall; the fixed wall turns it back. With kappa = (1 + e)/(1 - e) the motion that
meets the vibrating wall once in m of its periods leaves it at the phase

    phi = atan2(1, m pi kappa) - arccos(L/(A R)),    R = sqrt(1 + m^2 pi^2 kappa^2),    v = A omega kappa cos(phi)

and is stable for kappa (m^2 pi^2 - 1)/sqrt(m^2 pi^2 + kappa^2) < L/A < R. With the defaults m = 2 and
36.5 < L/A = 100 < 119.4; the default start lies on that motion. Without loss (e = 1) the same motion has phi = -pi/2
and v = omega (L + A)/(m pi), and below some speed the particle wanders chaotically.

Source: Fermi, On the origin of the cosmic radiation, Physical Review 75 (1949); Lieberman and Lichtenberg, Stochastic
and adiabatic behavior of particles accelerated by periodic forces, Physical Review A 5 (1972).
"""

import sympy

from fmu_models import TIME, Coordinate, Impact, Mechanism, Newton, Output, Parameter, Requirement

m = Parameter("m", 1.0, "kg", "mass of the particle", positive=True)
L = Parameter("L", 100.0, "m", "distance of the fixed wall from the middle of the vibrating one")
A = Parameter("A", 1.0, "m", "amplitude of the vibrating wall", minimum=0.0)
omega = Parameter("omega", 1.0, "rad/s", "angular frequency of the vibrating wall", minimum=0.0)
phi0 = Parameter("phi0", 0.0, "rad", "phase of the vibrating wall at time zero")
e = Parameter("e", 0.9, "1", "coefficient of restitution of the vibrating wall", minimum=0.0, maximum=1.0)

x = Coordinate(
    "x",
    "m",
    "place of the particle from the middle of the vibrating wall",
    velocity="v",
    start=8.573434546814733,
    v_start=16.00131151416345,
    nominal=10.0,
    v_nominal=10.0,
)
wall = A * sympy.sin(omega * TIME + phi0)
moving = Impact(name="moving", gap=x - wall, restitution=Newton(e), description="particle at the vibrating wall")
fixed = Impact(name="fixed", gap=L - x, restitution=Newton(1), description="particle at the fixed wall")

MODEL = Mechanism(
    name="fermi_accelerator",
    title="Particle between a vibrating wall and a fixed one",
    source="Fermi, Physical Review 75 (1949); Lieberman and Lichtenberg, Physical Review A 5 (1972)",
    coordinates=[x],
    kinetic_energy=m * x.v**2 / 2,
    contacts=[moving, fixed],
    outputs=[Output("wall", wall, "m", "place of the vibrating wall")],
    requirements=[
        Requirement(L - A, "the walls overlap: their distance L must be larger than the amplitude A", strict=True)
    ],
)
