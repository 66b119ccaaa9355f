"""Simplest walking machine: a heavy hip on two legs without mass, down a slope.

    theta'' = sin(theta - gamma),    phi'' = theta'' + theta'^2 sin phi - cos(theta - gamma) sin phi
    at phi = 2 theta, with the foot in front:
        theta := -theta,  phi := -2 theta,  theta' := theta' cos 2 theta,  phi' := theta' cos 2 theta (1 - cos 2 theta)

Source: Garcia, Chatterjee, Ruina, Coleman, The simplest walking model, ASME Journal of Biomechanical Engineering 120
(1998), equations (1) to (4).
"""

from sympy import cos, sin

from fmu_models import Automaton, Parameter, Reset, State, Switch

w0, gamma = Parameter("w0", 1.0, "1/s", "frequency", positive=True), Parameter("gamma", 0.009, "rad", "slope")
q, p = State("q", "rad", "stance leg", start=0.2003), State("p", "rad", "swing leg", start=0.4006)
u, v = State("u", "rad/s", "rate of q", start=-0.1998), State("v", "rad/s", "rate of p", start=-0.0158)
foot = Switch(name="foot", function=p - 2 * q, unit="rad", description="the swing foot lands")

fall = w0**2 * sin(q - gamma)
MODEL = Automaton(
    name="simplest_walker",
    title="Simplest walking machine",
    source="Garcia, Chatterjee, Ruina, Coleman, ASME Journal of Biomechanical Engineering 120 (1998)",
    states=[q, p, u, v],
    flows={q: u, p: v, u: fall, v: fall + u**2 * sin(p) - w0**2 * cos(q - gamma) * sin(p)},
    switches=[foot],
    resets=[Reset(foot, "-", {q: -q, p: -2 * q, u: u * cos(2 * q), v: u * cos(2 * q) * (1 - cos(2 * q))})],
)
