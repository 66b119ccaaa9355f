"""Ball on a shaking table that bounces so high that the table is taken to stay in its place.

    phi(k+1) = phi + 2 v
    v(k+1)   = e v + (1 + e) Gamma cos(phi(k+1))

phi phase of the table at the impact, v speed after it times angular frequency over gravity, Gamma greatest
acceleration of the table over gravity, e restitution. The determinant is e. Motions of period one have v = n pi and
cos(phi) = n pi (1 - e)/((1 + e) Gamma); they are born at Gamma_SN = n pi (1 - e)/(1 + e) and the one with sin(phi) > 0
flips at sqrt(Gamma_SN^2 + 1), later than that of the ball itself, whose flight the table's height changes. Speeds below
zero, which the map allows, have no meaning for a ball.

Source: Holmes, The dynamics of repeated impacts with a sinusoidally vibrating table, Journal of Sound and Vibration 84
(1982).
"""

import sympy

from fmu_models import Map, Parameter, State

e = Parameter("e", 0.5, "1", "restitution", minimum=0.0, maximum=1.0)
Gamma = Parameter("Gamma", 1.2, "1", "greatest acceleration of the table over gravity", minimum=0.0)
phi = State("phi", "rad", "phase of the table at the impact", start=0.5)
v = State("v", "1", "speed after the impact, times angular frequency over gravity", start=3.0)

phase = phi + 2 * v
MAP = Map(
    name="high_bounce",
    title="Ball on a shaking table, high bounces",
    source="Holmes, Journal of Sound and Vibration 84 (1982)",
    states=[phi, v],
    rule={phi: phase, v: e * v + (1 + e) * Gamma * sympy.cos(phase)},
    inverse={phi: phi - 2 * (v - (1 + e) * Gamma * sympy.cos(phi)) / e, v: (v - (1 + e) * Gamma * sympy.cos(phi)) / e},
    modulus={phi: 2 * sympy.pi},
    box={v: (0.0, 12.0)},
)
