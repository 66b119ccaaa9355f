"""Block on a moving belt, held by a spring and driven by a harmonic force.

    m x'' + k x = F_T + f0 cos(omega t),    -F_T = a0 sgn(y) - a1 y + a3 y^3,    y = x' - v_dr

x displacement of the block from the relaxed spring, y slip speed of the block over the belt. Stick holds while
|k x - f0 cos(omega t)| < a0 (for a steady belt); it ends at +a0, and the block slips backwards.

Source: Leine and van Campen, Bifurcation phenomena in non-smooth dynamical systems, European Journal of Mechanics
A/Solids 25 (2006), equations (15), (16); first in Yoshitake, Sueoka (2000). Values of both:

    | m, kg | k, N/m | v_dr, m/s | a0, N | a1, N s/m | a3, N s3/m3 | f0, N | omega, rad/s |
    |-------|--------|-----------|-------|-----------|-------------|-------|--------------|
    | 1     | 1      | 1         | 1.5   | 1.5       | 0.45        | 0.1   | 0.2 to 4     |

Of its 1/2-subharmonic resonance the motion at the default frequency and start is stable, of period 4 pi/omega, and
sticks for 0.675 s of it.
"""

import sympy

from fmu_models import TIME, Coordinate, Friction, Input, Mechanism, Output, Parameter, StribeckCubic

m = Parameter("m", 1.0, "kg", "mass of the block", positive=True)
k = Parameter("k", 1.0, "N/m", "stiffness of the spring", minimum=0.0)
a0 = Parameter("a0", 1.5, "N", "friction force at rest", minimum=0.0)
a1 = Parameter("a1", 1.5, "N s/m", "fall of the friction force with small slip speeds")
a3 = Parameter("a3", 0.45, "N s3/m3", "rise of the friction force with large slip speeds")
f0 = Parameter("f0", 0.1, "N", "amplitude of the force")
omega = Parameter("omega", 1.6, "rad/s", "angular frequency of the force", minimum=0.0)
v_dr = Input("v_dr", 1.0, "m/s", "speed of the belt")

x = Coordinate(
    "x",
    "m",
    "displacement of the block from the relaxed spring",
    velocity="v",
    start=1.040922001474,
    v_start=-0.720488407813,
)
belt = Friction(name="belt", slip=x.v - v_dr, law=StribeckCubic(a0, a1, a3), description="block on belt")

MODEL = Mechanism(
    name="forced_stick_slip",
    title="Block on a moving belt, driven by a harmonic force",
    source="Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), equation (15)",
    coordinates=[x],
    kinetic_energy=m * x.v**2 / 2,
    potential_energy=k * x**2 / 2,
    applied={x: f0 * sympy.cos(omega * TIME)},
    contacts=[belt],
    outputs=[
        Output("F", belt.force, "N", "friction force of the belt on the block (F_T)"),
        Output("slip", belt.slip, "m/s", "slip speed of the block over the belt"),
    ],
)
