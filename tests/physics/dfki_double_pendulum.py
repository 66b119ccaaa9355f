"""The double pendulum of the DFKI (design C.0): motors of gear ratio gr act between neighbours, at the joints. Friction
is published as cf atan(100 w): Coulomb friction of cf pi/2."""

from math import pi

from sympy import S, cos

from fmu_models import Coordinate, Coulomb, Friction, Input, Mechanism, Parameter

q1 = Coordinate("q1", "rad", "shoulder, from hanging", velocity="w1")
q2 = Coordinate("q2", "rad", "elbow, from the upper link", velocity="w2")
g = Parameter("g", 9.81, "m/s2", "acceleration of gravity", positive=True)
l1 = Parameter("l1", 0.2, "m", "length of the upper link", positive=True)
gr = Parameter("gr", 6.0, "1", "gear ratio", positive=True)
I1 = Parameter("I1", 0.02671, "kg m2", "inertia of the upper link about the shoulder", positive=True)
I2 = Parameter("I2", 0.05388, "kg m2", "inertia of the lower link about the elbow", positive=True)
Ir = Parameter("Ir", 9.94e-5, "kg m2", "inertia of a rotor", positive=True)
m1 = Parameter("m1", 0.6417, "kg", "mass of the upper link", positive=True)
r1 = Parameter("r1", 0.2, "m", "its centre of mass from the shoulder", positive=True)
m2 = Parameter("m2", 0.5639, "kg", "mass of the lower link", positive=True)
r2 = Parameter("r2", 0.3213, "m", "its centre of mass from the elbow", positive=True)
b1 = Parameter("b1", 0.001, "N m s", "viscous friction of the shoulder")
b2 = Parameter("b2", 0.001, "N m s", "viscous friction of the elbow")
cf1 = Parameter("cf1", 0.093 * pi / 2, "N m", "Coulomb friction of the shoulder")
cf2 = Parameter("cf2", 0.078 * pi / 2, "N m", "Coulomb friction of the elbow")
tau1 = Input("tau1", 0.0, "N m", "torque on the shoulder")
tau2 = Input("tau2", 0.0, "N m", "torque on the elbow")

w1, w2 = q1.v, q2.v
MODEL = Mechanism(
    name="double_pendulum",
    title="double pendulum, both motors at the joints",
    source="DFKI RIC Underactuated Lab, double pendulum",
    coordinates=[q1, q2],
    kinetic_energy=I1 * w1**2 / 2
    + m2 * l1**2 * w1**2 / 2
    + I2 * (w1 + w2) ** 2 / 2
    + m2 * l1 * r2 * w1 * (w1 + w2) * cos(q2)
    + Ir * (gr * w1) ** 2 / 2
    + Ir * (gr * w2 - w1) ** 2 / 2,
    potential_energy=-(m1 * r1 + m2 * l1) * g * cos(q1) - m2 * r2 * g * cos(q1 + q2),
    dissipation=b1 * w1**2 / 2 + b2 * w2**2 / 2,
    applied={q1: tau1, q2: tau2},
    contacts=[
        Friction(name="shoulder", slip=w1, law=Coulomb(N=S.One, mu=cf1)),
        Friction(name="elbow", slip=w2, law=Coulomb(N=S.One, mu=cf2)),
    ],
)
