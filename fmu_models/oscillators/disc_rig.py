"""Rotating body pressed against one or two driven discs.

    J theta'' + c theta' + k theta = R sum_i N_i mu_i(|v_i|) sgn(v_i),    v_i = r w_i - R theta'
    mu_i(|v|) = (mu_si - mu_ki)/(1 + p_i |v|) + mu_ki

The rig's body turns about a fixed axis on a torsion spring; discs i = 0, 1 with prescribed speeds w_i (positive
clockwise) rub on its border. Both discs touch always (the paper's class b); disc 0 alone is its class a:
``MODEL.restricted_to(["disc0"])``; a free decay is ``MODEL.restricted_to([])``.

Source: Casini, Giannini, Vestroni, Experimental evidence of non-standard bifurcations in non-smooth oscillator
dynamics, Nonlinear Dynamics 46 (2006): equations (1), (2) with sgn(v) written out, (11) to (16) for two discs, (27),
(28) for the rig; friction of the pair paper/rubber from Table 1:

    | pair         | mu_s | mu_k | p, s/m |
    |--------------|------|------|--------|
    | paper/paper  | 0.35 | 0.25 | 15     |
    | liner/rubber | 0.50 | 0.33 | 20     |
    | paper/rubber | 0.65 | 0.35 | 15     |

The paper gives no normal forces; N = 4.905 N (a dead weight of 0.5 kg) is assumed.
"""

from collections.abc import Sequence

import sympy

from fmu_models import Conti, Coordinate, Friction, Input, Mechanism, Output, Parameter

J = Parameter("J", 0.0548, "kg m2", "moment of inertia of the body", positive=True)
k = Parameter("k", 2.62, "N m/rad", "stiffness of the torsion spring", minimum=0.0)
c = Parameter("c", 0.055, "N m s/rad", "viscous damping", minimum=0.0)
R = Parameter("R", 0.125, "m", "radius of the body at the contact", positive=True)
r = Parameter("r", 0.06, "m", "radius of the discs", positive=True)

theta = Coordinate("theta", "rad", "angle of the body, positive counterclockwise", velocity="omega", nominal=0.1)
omega = theta.v


def disc(i: int, speed: float, where: sympy.Expr | None = None) -> tuple[Friction, list[Output]]:
    """Disc i driven at ``speed`` (rad/s): its contact, and friction force and slip speed as outputs."""
    N = Parameter(f"N{i}", 4.905, "N", f"normal force of disc {i}", minimum=0.0)
    mu_s = Parameter(f"mu_s{i}", 0.65, "1", f"static friction coefficient of disc {i}", minimum=0.0)
    mu_k = Parameter(f"mu_k{i}", 0.35, "1", f"kinetic friction coefficient of disc {i}", minimum=0.0)
    p = Parameter(f"p{i}", 15.0, "s/m", f"steepness of the friction law of disc {i}", minimum=0.0)
    w = Input(f"w{i}", speed, "rad/s", f"speed of disc {i}, positive clockwise")
    law = Conti(N, mu_s, mu_k, p)
    contact = Friction(name=f"disc{i}", slip=r * w - R * omega, law=law, where=where, description=f"body on disc {i}")
    force = Output(f"F{i}", -contact.force, "N", f"friction force of disc {i} on the body, positive with the slip")
    slip = Output(f"slip{i}", contact.slip, "m/s", f"slip speed of disc {i} over the body")
    return contact, [force, slip]


def rig(name: str, title: str, *discs: tuple[Friction, list[Output]], outputs: Sequence[Output] = ()) -> Mechanism:
    """The body with these discs and outputs beside theirs."""
    return Mechanism(
        name=name,
        title=title,
        source="Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006)",
        coordinates=[theta],
        kinetic_energy=J * omega**2 / 2,
        potential_energy=k * theta**2 / 2,
        dissipation=c * omega**2 / 2,
        contacts=[contact for contact, _ in discs],
        outputs=[*(output for _, disc_outputs in discs for output in disc_outputs), *outputs],
    )


MODEL = rig(
    "disc_rig",
    "Rotational oscillator against two driven discs",
    disc(0, speed=0.83),
    disc(1, speed=0.41),
    outputs=[Output("alpha", theta.a, "rad/s2", "angular acceleration of the body")],
)
