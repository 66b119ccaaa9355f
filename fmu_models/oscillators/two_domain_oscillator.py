"""Oscillator with one linear law left of a wall without mass and another right of it: a generalised Fermi oscillator.

    x'' + 2 d x' + w_a^2 x = b_a + Q_a cos(W t),    a = 1 where x < X_s, a = 2 where x > X_s

The acceleration jumps at x = X_s, the velocity does not: the motion crosses and never slides. With w_a = 0 each domain
is a constant field, which turns the particle around as a soft wall would. Damped between fields that push towards each
other, the particle crosses X_s ever faster, without end; a start at rest there is refused.

A proposal of this project: the literature on the Fermi oscillator at hand (Luo and Guo, Vibro-impact dynamics) gives
no equations for it. Values chosen here; frequencies of the springs in a ratio that does not repeat soon.
"""

import sympy

from fmu_models import TIME, Automaton, Output, Parameter, State, Switch

d = Parameter("d", 0.02, "1/s", "half the viscous damping per mass", minimum=0.0)
X_s = Parameter("X_s", 0.0, "m", "where the domains meet")
w1 = Parameter("w1", 1.0, "rad/s", "frequency of the spring of domain 1", minimum=0.0)
w2 = Parameter("w2", 1.7, "rad/s", "frequency of the spring of domain 2", minimum=0.0)
b1 = Parameter("b1", 0.5, "m/s2", "constant field of domain 1")
b2 = Parameter("b2", -0.5, "m/s2", "constant field of domain 2")
Q1 = Parameter("Q1", 1.0, "m/s2", "amplitude of the forcing in domain 1")
Q2 = Parameter("Q2", 1.0, "m/s2", "amplitude of the forcing in domain 2")
W = Parameter("W", 2.0, "rad/s", "frequency of the forcing", minimum=0.0)

x = State("x", "m", "displacement")
v = State("v", "m/s", "velocity", start=1.0)
side = Switch(name="side", function=x - X_s, unit="m", description="which domain: - left, + right of X_s")


def field(w: Parameter, b: Parameter, Q: Parameter) -> sympy.Expr:
    """Acceleration in one domain."""
    return b + Q * sympy.cos(W * TIME) - 2 * d * v - w**2 * x


# shares of exactly 0 and 1: a stiff domain leaves no rounding in a soft one
left, right = (1 - side.sign) / 2 * field(w1, b1, Q1), (1 + side.sign) / 2 * field(w2, b2, Q2)

MODEL = Automaton(
    name="two_domain_oscillator",
    title="Oscillator of two linear domains",
    source="generalised Fermi oscillator, a proposal of this project",
    states=[x, v],
    flows={x: v, v: left + right},
    switches=[side],
    outputs=[Output("acceleration", v.rate, "m/s2", "acceleration")],
)
