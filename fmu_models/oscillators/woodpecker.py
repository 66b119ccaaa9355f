"""Woodpecker toy: a sleeve that slides and jams on a pole, and a woodpecker that swings on it by a spring.

    M q'' = h + sum over the contacts of w_N lambda_N + w_T lambda_T,    q = (y, phi_M, phi_S)

        | m_S + m_M   m_S l_M             m_S l_G           |        | -(m_S + m_M) g                         |
    M = | m_S l_M     J_M + m_S l_M^2     m_S l_M l_G       |    h = | -c_phi (phi_M - phi_S) - m_S g l_M     |
        | m_S l_G     m_S l_M l_G         J_S + m_S l_G^2   |        | -c_phi (phi_S - phi_M) - m_S g l_G     |

    contact            gap                                       slip
    1 beak             l_M + l_G - l_S - r_0 - h_S phi_S         y' + l_M phi_M' + (l_G - l_S) phi_S'
    2 lower edge       r_M - r_0 + h_M phi_M                     y' + r_M phi_M'
    3 upper edge       r_M - r_0 - h_M phi_M                     y' + r_M phi_M'

y height of the sleeve, phi_M and phi_S angles of sleeve and woodpecker. Newton's restitution and Coulomb's friction at
every contact. Only the height has no period: the toy falls by some 19 mm in each of 0.146 s.

Source: Leine and van Campen, Bifurcation phenomena in non-smooth dynamical systems, European Journal of Mechanics
A/Solids 25 (2006), equations (21) and (22), there after Glocker, Dynamik von Starrkoerpersystemen mit Reibung und
Stoessen (1995). The paper prints J_S for the J_M in the mass matrix and leaves out c_phi, which here gives its 72.91
Hz. The defaults are its values. The default start lies on its periodic motion, where the sleeve is jammed at its lower
edge and the woodpecker is farthest back.
"""

from fmu_models import Coordinate, Impact, Mechanism, Newton, Output, Parameter, Requirement

m_M = Parameter("m_M", 0.0003, "kg", "mass of the sleeve", positive=True)
J_M = Parameter("J_M", 5.0e-9, "kg m2", "moment of inertia of the sleeve", positive=True)
m_S = Parameter("m_S", 0.0045, "kg", "mass of the woodpecker", positive=True)
J_S = Parameter("J_S", 7.0e-7, "kg m2", "moment of inertia of the woodpecker", positive=True)
c_phi = Parameter("c_phi", 0.0056, "N m/rad", "stiffness of the spring between sleeve and woodpecker", minimum=0.0)
g = Parameter("g", 9.81, "m/s2", "gravity", minimum=0.0)
r_0 = Parameter("r_0", 0.0025, "m", "radius of the pole", positive=True)
r_M = Parameter("r_M", 0.0031, "m", "inner radius of the sleeve", positive=True)
h_M = Parameter("h_M", 0.0058, "m", "half the height of the sleeve", positive=True)
l_M = Parameter("l_M", 0.010, "m", "distance of the spring from the middle of the sleeve", positive=True)
l_G = Parameter("l_G", 0.015, "m", "distance of the woodpecker's centre of mass from the spring", positive=True)
h_S = Parameter("h_S", 0.020, "m", "height of the beak over the woodpecker's centre of mass", positive=True)
l_S = Parameter("l_S", 0.0201, "m", "distance of the beak from the woodpecker's centre of mass", positive=True)
mu1, mu2, mu3 = (
    Parameter(f"mu{i}", 0.3, "1", f"coefficient of friction, {edge}", minimum=0.0)
    for i, edge in enumerate(("beak", "lower edge", "upper edge"), start=1)
)
eN1, eN2, eN3 = (
    Parameter(f"eN{i}", value, "1", f"coefficient of restitution, {edge}", minimum=0.0, maximum=1.0)
    for i, (edge, value) in enumerate((("beak", 0.5), ("lower edge", 0.0), ("upper edge", 0.0)), start=1)
)

y = Coordinate("y", "m", "height of the sleeve", velocity="v", nominal=0.01, v_nominal=0.1)
phi_M = Coordinate(
    "phi_M",
    "rad",
    "angle of the sleeve",
    velocity="w_M",
    start=-(r_M.value - r_0.value) / h_M.value,
    nominal=0.1,
    v_nominal=10.0,
)
phi_S = Coordinate(
    "phi_S", "rad", "angle of the woodpecker", velocity="w_S", start=-0.529471967111, nominal=0.1, v_nominal=10.0
)
place = l_M + l_G - l_S - r_0
play = r_M - r_0
edge_speed = y.v + r_M * phi_M.v
beak = Impact(
    name="beak",
    gap=place - h_S * phi_S,
    restitution=Newton(eN1),
    slip=y.v + l_M * phi_M.v + (l_G - l_S) * phi_S.v,
    mu=mu1,
    description="beak on the pole",
)
lower = Impact(
    name="lower",
    gap=play + h_M * phi_M,
    restitution=Newton(eN2),
    slip=edge_speed,
    mu=mu2,
    description="lower edge of the sleeve on the pole",
)
upper = Impact(
    name="upper",
    gap=play - h_M * phi_M,
    restitution=Newton(eN3),
    slip=edge_speed,
    mu=mu3,
    description="upper edge of the sleeve on the pole",
)
speed = y.v + l_M * phi_M.v + l_G * phi_S.v

MODEL = Mechanism(
    name="woodpecker",
    title="Woodpecker toy",
    source="Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), equations (21) and (22)",
    coordinates=[y, phi_M, phi_S],
    kinetic_energy=(m_M * y.v**2 + J_M * phi_M.v**2 + m_S * speed**2 + J_S * phi_S.v**2) / 2,
    potential_energy=c_phi * (phi_M - phi_S) ** 2 / 2 + m_M * g * y + m_S * g * (y + l_M * phi_M + l_G * phi_S),
    contacts=[beak, lower, upper],
    outputs=[
        Output("slip_beak", beak.expressions[1], "m/s", "speed of the beak along the pole"),
        Output("slip_sleeve", edge_speed, "m/s", "speed of the edges of the sleeve along the pole"),
    ],
    requirements=[
        Requirement(play, "the sleeve overlaps the pole: its radius r_M must be larger than r_0", strict=True),
        Requirement(place, "the beak overlaps the pole: l_M + l_G - l_S must be larger than r_0", strict=True),
    ],
)
