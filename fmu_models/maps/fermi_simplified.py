"""Simplified Fermi map: a ball between a fixed wall and one that shakes but is taken to stay in its place.

    phi(k+1) = phi + 2/v
    v(k+1)   = |gamma v - (1 + gamma) eps sin(phi(k+1))|

phi phase of the shaking wall at the impact, v speed after it, in units of distance times angular frequency; eps
amplitude over distance, gamma restitution of the shaking wall (the other is elastic). The modulus stands for the
second impact that a ball too slow to leave would have. The determinant is gamma times the sign inside the modulus:
gamma = 1 preserves areas. Fixed points have v = 1/(k pi), and sin(phi) = -(1 - gamma) v/((1 + gamma) eps) where the
inside is positive, sin(phi) = v/eps where it is negative. A speed has two origins because of the modulus, so there is
no inverse.

Source: Lichtenberg and Lieberman, Regular and Stochastic Motion (1983), section 3.4, for gamma = 1; the restitution
as in Newton's impact law v+ = -gamma v- + (1 + gamma) times the speed of the wall.
"""

import sympy

from fmu_models import Map, Parameter, State

gamma = Parameter("gamma", 0.9, "1", "restitution of the shaking wall", minimum=0.0, maximum=1.0)
eps = Parameter("eps", 0.05, "1", "amplitude over distance of the walls", minimum=0.0)
phi = State("phi", "rad", "phase of the wall at the impact", start=1.0)
v = State("v", "1", "speed after the impact, over distance times angular frequency", start=0.3)

phase = phi + 2 / v
MAP = Map(
    name="fermi_simplified",
    title="Simplified Fermi map",
    source="Lichtenberg and Lieberman, Regular and Stochastic Motion (1983), section 3.4",
    states=[phi, v],
    rule={phi: phase, v: sympy.Abs(gamma * v - (1 + gamma) * eps * sympy.sin(phase))},
    modulus={phi: 2 * sympy.pi},
    box={v: (0.04, 1.0)},
)
