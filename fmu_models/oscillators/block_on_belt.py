"""Block on a moving belt, held by a spring and a dashpot.

    m x'' + c x' + k x = -N mu(|y|) sgn(y),    y = x' - v_belt
    mu(|y|) = (mu_s - mu_k)/(1 + p |y|) + mu_k

x displacement of the block from the relaxed spring, y slip speed of the block over the belt. A belt that is slow
enough drags the block along until the spring tears it off: stick-slip.

Source: the scaled single-contact oscillator of Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006), equations
(4) to (7), read as a block (x the sliding distance, R = 1). Values assumed:

    | m, kg | k, N/m | c, N s/m | N, N | mu_s | mu_k | p, s/m | v_belt, m/s |
    |-------|--------|----------|------|------|------|--------|-------------|
    | 1     | 100    | 0.5      | 9.81 | 0.65 | 0.35 | 15     | 0.1         |
"""

from fmu_models import Conti, Coordinate, Friction, Input, Mechanism, Output, Parameter

m = Parameter("m", 1.0, "kg", "mass of the block", positive=True)
k = Parameter("k", 100.0, "N/m", "stiffness of the spring", minimum=0.0)
c = Parameter("c", 0.5, "N s/m", "viscous damping", minimum=0.0)
N = Parameter("N", 9.81, "N", "normal force", minimum=0.0)
mu_s = Parameter("mu_s", 0.65, "1", "static friction coefficient", minimum=0.0)
mu_k = Parameter("mu_k", 0.35, "1", "kinetic friction coefficient", minimum=0.0)
p = Parameter("p", 15.0, "s/m", "steepness of the friction law", minimum=0.0)
v_belt = Input("v_belt", 0.1, "m/s", "speed of the belt")

x = Coordinate("x", "m", "displacement of the block from the relaxed spring", velocity="v", nominal=0.1, v_nominal=0.1)
belt = Friction(name="belt", slip=x.v - v_belt, law=Conti(N, mu_s, mu_k, p), description="block on belt")

MODEL = Mechanism(
    name="block_on_belt",
    title="Block on a moving belt",
    source="Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006), equation (2) between a block and a belt",
    coordinates=[x],
    kinetic_energy=m * x.v**2 / 2,
    potential_energy=k * x**2 / 2,
    dissipation=c * x.v**2 / 2,
    contacts=[belt],
    outputs=[
        Output("F", belt.force, "N", "friction force of the belt on the block"),
        Output("slip", belt.slip, "m/s", "slip speed of the block over the belt"),
    ],
)
