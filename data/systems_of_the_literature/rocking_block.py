"""Slender block that rocks on its corners, and comes to rest after infinitely many impacts.

    x'' = p^2 (x - sgn x),    x' := r x' where x = 0

x tilt over that of balance. From rest at x it comes down after arcosh(1/(1 - x))/p; flights last 2 artanh(x'/p)/p.

Source: Housner, The behavior of inverted pendulum structures during earthquakes, Bulletin of the Seismological Society
of America 53 (1963).
"""

from fmu_models import Automaton, Parameter, Reset, State, Switch

p, r = Parameter("p", 1.0, "1/s", "frequency", positive=True), Parameter("r", 0.5, "1", "what an impact leaves")
x, v = State("x", "1", "tilt", start=0.3), State("v", "1/s", "its rate")
foot = Switch(name="foot", function=x, description="both corners down")

MODEL = Automaton(
    name="rocking_block",
    title="Rocking block",
    source="Housner, Bulletin of the Seismological Society of America 53 (1963)",
    states=[x, v],
    flows={x: v, v: p**2 * (x - foot.sign)},
    switches=[foot],
    resets=[Reset(foot, "both", {v: r * v})],
)
