"""Rimless wheel that rolls down a slope on its spokes.

    q'' = w0^2 sin q;    at q = gamma + alpha: q := q - 2 alpha, q' := q' cos(2 alpha)

Source: McGeer, Passive dynamic walking, International Journal of Robotics Research 9 (1990).
"""

import sympy

from fmu_models import Automaton, Parameter, Reset, State, Switch

w0, alpha = Parameter("w0", 1.0, "1/s", "frequency", positive=True), Parameter("alpha", 0.2, "rad", "half the angle")
gamma = Parameter("gamma", 0.08, "rad", "slope")
q, w = State("q", "rad", "angle of the spoke", start=-0.12), State("w", "rad/s", "its rate", start=0.6)
spoke = Switch(name="spoke", function=gamma + alpha - q, unit="rad", description="the next spoke lands")

MODEL = Automaton(
    name="rimless_wheel",
    title="Rimless wheel",
    source="McGeer, International Journal of Robotics Research 9 (1990)",
    states=[q, w],
    flows={q: w, w: w0**2 * sympy.sin(q)},
    switches=[spoke],
    resets=[Reset(spoke, "+", {q: q - 2 * alpha, w: w * sympy.cos(2 * alpha)})],
)
