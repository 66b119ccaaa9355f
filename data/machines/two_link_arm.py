"""A planar arm of two links in the vertical plane, each with viscous and Coulomb friction in its joint."""

from sympy import S, cos

from fmu_models import Coordinate, Coulomb, Friction, Input, Mechanism, Parameter

q1 = Coordinate("q1", "rad", "shoulder, from hanging", velocity="w1")
q2 = Coordinate("q2", "rad", "elbow, from the upper link", velocity="w2")
g = Parameter("g", 9.81, "m/s2", "acceleration of gravity", positive=True)
l1 = Parameter("l1", 0.3, "m", "length of the upper link", positive=True)
J1 = Parameter("J1", 0.06, "kg m2", "inertia of the upper link about the shoulder", positive=True)
J2 = Parameter("J2", 0.025, "kg m2", "inertia of the lower link about the elbow", positive=True)
m1 = Parameter("m1", 1.2, "kg", "mass of the upper link", positive=True)
r1 = Parameter("r1", 0.16, "m", "its centre of mass from the shoulder", positive=True)
m2 = Parameter("m2", 0.8, "kg", "mass of the lower link", positive=True)
r2 = Parameter("r2", 0.14, "m", "its centre of mass from the elbow", positive=True)
b1 = Parameter("b1", 0.08, "N m s", "viscous friction of the shoulder", minimum=0.0)
b2 = Parameter("b2", 0.03, "N m s", "viscous friction of the elbow", minimum=0.0)
f1 = Parameter("f1", 0.25, "N m", "Coulomb friction of the shoulder", minimum=0.0)
f2 = Parameter("f2", 0.1, "N m", "Coulomb friction of the elbow", minimum=0.0)
tau1 = Input("tau1", 0.0, "N m", "torque on the shoulder")
tau2 = Input("tau2", 0.0, "N m", "torque on the elbow")

w1, w2 = q1.v, q2.v
MODEL = Mechanism(
    name="two_link_arm",
    title="Planar arm of two links",
    source="Khalil, Dombre, Modeling, Identification and Control of Robots (2002), example 9.1",
    coordinates=[q1, q2],
    kinetic_energy=J1 * w1**2 / 2
    + J2 * (w1 + w2) ** 2 / 2
    + m2 * (l1**2 * w1**2 / 2 + l1 * r2 * w1 * (w1 + w2) * cos(q2)),
    potential_energy=-g * ((m1 * r1 + m2 * l1) * cos(q1) + m2 * r2 * cos(q1 + q2)),
    dissipation=b1 * w1**2 / 2 + b2 * w2**2 / 2,
    applied={q1: tau1, q2: tau2},
    contacts=[
        Friction(name="shoulder", slip=w1, law=Coulomb(N=S.One, mu=f1), description="bearing and gear of the shoulder"),
        Friction(name="elbow", slip=w2, law=Coulomb(N=S.One, mu=f2), description="bearing and gear of the elbow"),
    ],
)
