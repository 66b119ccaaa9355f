"""Hinge with clearance, scaled: an oscillator between two Hertz stops that damp after Lankarani and Nikravesh.

    x'' + 2 zeta x' + x + F = sin(2 pi f t + tau)

    F =  k0 ( x - delta)^(3/2) (1 + mu x'/v0)      x >  delta    right stop
    F = -k0 (-x - delta)^(3/2) (1 - mu x'/v0)      x < -delta    left stop
    mu = 3 (1 - ce^2)/4

v0 > 0 is the speed at which the stop was entered, taken anew at every entry on either side. (The paper's signed v0
would give the left stop negative damping.) A contact lasts until |x| = delta; then F may pull at the end of a very slow
one, and the mass lingers. ``hinge_clearance_clamped`` is the same with stops that cannot pull.

Source: Ding, Cheng, Zhang, Chai, Li, Niu, Cao, Study on dynamic characteristics and parameter influence of a kind of
bilateral restraint impact vibration system, equations (8) to (10); ``hinge_clearance_dimensional`` has equations (1)
and (2) and the conversion. Reference parameters of section 3:

    | zeta | delta | k0  | ce  | f                                | tau |
    |------|-------|-----|-----|----------------------------------|-----|
    | 0.2  | 0.01  | 300 | 0.9 | 0.35 to 0.43, figures 5 to 15    | 0   |
"""

import sympy

from fmu_models import TIME, Coordinate, LankaraniNikravesh, Mechanism, Parameter, Stop

HERTZ = sympy.Rational(3, 2)

zeta = Parameter("zeta", 0.2, "1", "damping ratio", minimum=0.0)
delta = Parameter("delta", 0.01, "1", "clearance to either side", minimum=0.0)
k0 = Parameter("k0", 300.0, "1", "stiffness of the stops", minimum=0.0)
ce = Parameter("ce", 0.9, "1", "coefficient of restitution", minimum=0.0, maximum=1.0)
f = Parameter("f", 0.429, "1", "frequency of the force, cycles in a unit of scaled time", minimum=0.0)
tau = Parameter("tau", 0.0, "rad", "phase of the force at time zero")

x = Coordinate("x", "1", "displacement from the middle", velocity="v", nominal=0.01, v_nominal=0.1)


def hinge(name: str, release: str) -> Mechanism:
    """The hinge whose stops let go by that rule, "gap" or "force"."""
    law = LankaraniNikravesh(k0, HERTZ, ce)
    return Mechanism(
        name=name,
        title="Hinge with clearance" if release == "gap" else "Hinge with clearance, stops that cannot pull",
        source="Ding et al., Dynamic characteristics of a bilateral restraint impact vibration system",
        coordinates=[x],
        kinetic_energy=x.v**2 / 2,
        potential_energy=x**2 / 2,
        dissipation=zeta * x.v**2,
        applied={x: sympy.sin(2 * sympy.pi * f * TIME + tau)},
        contacts=[
            Stop(name="right", gap=delta - x, law=law, release=release, description="right stop"),
            Stop(name="left", gap=delta + x, law=law, release=release, description="left stop"),
        ],
    )


MODEL = hinge("hinge_clearance", release="gap")
