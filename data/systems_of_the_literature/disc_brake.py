"""A disc brake that squeals: two modes of a mass on a moving belt, which friction couples.

    m x'' + c x' + k11 x + k12 y = mu (N0 + k3 y),   m y'' + c y' + k12 x + (k22 + k3) y = 0    while it slides

Springs k1 and k2 stand at 150 and 30 degrees to the belt, k3 presses on it.

Source: Hoffmann, Fischer, Allgaier, Gaul, A minimal model for studying properties of the mode-coupling type
instability in friction induced oscillations, Mechanics Research Communications 29 (2002).
"""

import sympy

from fmu_models import Coordinate, Coulomb, Friction, Mechanism, Parameter

m, c = Parameter("m", 1.0, "kg", "mass", positive=True), Parameter("c", 0.1, "N s/m", "damping", minimum=0.0)
k1, k2 = Parameter("k1", 11.0, "N/m", "spring at 150 degrees"), Parameter("k2", 20.0, "N/m", "spring at 30 degrees")
k3, N0 = Parameter("k3", 11.0, "N/m", "spring that presses"), Parameter("N0", 1.0, "N", "preload")
mu, belt = Parameter("mu", 0.4, "1", "friction", minimum=0.0), Parameter("belt", 0.02, "m/s", "speed of the belt")
x, y = Coordinate("x", "m", "along the belt", velocity="vx"), Coordinate("y", "m", "onto the belt", velocity="vy")
ways = [-sympy.sqrt(3) / 2 * x + y / 2, sympy.sqrt(3) / 2 * x + y / 2]

MODEL = Mechanism(
    name="disc_brake",
    title="Disc brake of two modes",
    source="Hoffmann, Fischer, Allgaier, Gaul, Mechanics Research Communications 29 (2002)",
    coordinates=[x, y],
    kinetic_energy=m * (x.v**2 + y.v**2) / 2,
    potential_energy=(k1 * ways[0] ** 2 + k2 * ways[1] ** 2 + k3 * y**2) / 2,
    dissipation=c * (x.v**2 + y.v**2) / 2,
    contacts=[Friction(name="pad", slip=x.v - belt, law=Coulomb(N0 + k3 * y, mu), where=N0 + k3 * y)],
)
