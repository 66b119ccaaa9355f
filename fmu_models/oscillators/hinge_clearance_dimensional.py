"""Hinge with clearance in physical units, and its conversion to the scaled form.

    M X'' + C X' + K X + F_NL(X, X') = P sin(Omega T + Gamma)

    F_NL =  K0 ( X - Delta)^(3/2) (1 + mu X'/V0)      X >  Delta    right stop
    F_NL = -K0 (-X - Delta)^(3/2) (1 - mu X'/V0)      X < -Delta    left stop
    mu = 3 (1 - ce^2)/4, V0 the speed at entry

With t = T sqrt(K/M) and x = X K/P this is ``hinge_clearance``; ``scaled`` gives its parameters.

Source: Ding, Cheng, Zhang, Chai, Li, Niu, Cao, Study on dynamic characteristics and parameter influence of a kind of
bilateral restraint impact vibration system, equations (1), (2) and (8). The paper gives no dimensional values; the
defaults are assumed, such that the scaled ones are the paper's (zeta 0.2, delta 0.01, k0 300, f 0.429).
"""

import math
from collections.abc import Mapping

import sympy

from fmu_models import TIME, Coordinate, LankaraniNikravesh, Mechanism, Parameter, Stop

HERTZ = sympy.Rational(3, 2)

M = Parameter("M", 50.0, "kg", "mass", positive=True)
C = Parameter("C", 200.0, "N s/m", "viscous damping", minimum=0.0)
K = Parameter("K", 5000.0, "N/m", "stiffness of the spring", positive=True)
P = Parameter("P", 50.0, "N", "amplitude of the force", positive=True)
Omega = Parameter("Omega", 8.58 * math.pi, "rad/s", "angular frequency of the force", minimum=0.0)
Gamma = Parameter("Gamma", 0.0, "rad", "phase of the force at time zero")
K0 = Parameter("K0", 1.5e7, "N/m1.5", "stiffness of the stops", minimum=0.0)
Delta = Parameter("Delta", 1e-4, "m", "clearance to either side", minimum=0.0)
ce = Parameter("ce", 0.9, "1", "coefficient of restitution", minimum=0.0, maximum=1.0)

X = Coordinate("X", "m", "displacement from the middle", velocity="V", nominal=1e-4, v_nominal=0.1)
law = LankaraniNikravesh(K0, HERTZ, ce)

MODEL = Mechanism(
    name="hinge_clearance_dimensional",
    title="Hinge with clearance in physical units",
    source="Ding et al., Dynamic characteristics of a bilateral restraint impact vibration system",
    coordinates=[X],
    kinetic_energy=M * X.v**2 / 2,
    potential_energy=K * X**2 / 2,
    dissipation=C * X.v**2 / 2,
    applied={X: P * sympy.sin(Omega * TIME + Gamma)},
    contacts=[
        Stop(name="right", gap=Delta - X, law=law, release="gap", description="right stop"),
        Stop(name="left", gap=Delta + X, law=law, release="gap", description="left stop"),
    ],
)


def scaled(values: Mapping[str, float]) -> dict[str, float]:
    """Parameters of ``hinge_clearance`` from those of this model (by name, SI); defaults where left out. Equation (8).

    Its lengths are in units of P/K, its times of sqrt(M/K), its velocities of P/sqrt(K M).
    """
    v = {p.name: p.value for p in MODEL.parameters} | dict(values)
    return {
        "zeta": v["C"] / (2 * math.sqrt(v["K"] * v["M"])),
        "delta": v["Delta"] * v["K"] / v["P"],
        "k0": v["K0"] * math.sqrt(v["P"]) / v["K"] ** 1.5,
        "ce": v["ce"],
        "f": v["Omega"] * math.sqrt(v["M"] / v["K"]) / (2 * math.pi),
        "tau": v["Gamma"],
    }
