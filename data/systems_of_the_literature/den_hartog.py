"""Den Hartog's oscillator: a mass on a spring with dry friction, under a harmonic force.

    m x'' + k x + F sgn x' = P cos(omega t)

Source: Den Hartog, Forced vibrations with combined Coulomb and viscous friction, Transactions of the ASME 53 (1931).
"""

import sympy

from fmu_models import TIME, Coordinate, Coulomb, Friction, Mechanism, Parameter

m, k = Parameter("m", 1.0, "kg", "mass", positive=True), Parameter("k", 1.0, "N/m", "stiffness", positive=True)
P, omega = Parameter("P", 1.0, "N", "amplitude of the force"), Parameter("omega", 0.7, "rad/s", "its frequency")
N, mu = Parameter("N", 1.0, "N", "load", minimum=0.0), Parameter("mu", 0.5, "1", "friction", minimum=0.0)
x = Coordinate("x", "m", "displacement", velocity="v", start=1.0)

MODEL = Mechanism(
    name="den_hartog",
    title="Den Hartog's oscillator",
    source="Den Hartog, Transactions of the ASME 53 (1931)",
    coordinates=[x],
    kinetic_energy=m * x.v**2 / 2,
    potential_energy=k * x**2 / 2,
    applied={x: P * sympy.cos(omega * TIME)},
    contacts=[Friction(name="ground", slip=x.v, law=Coulomb(N, mu))],
)
