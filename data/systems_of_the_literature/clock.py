"""Clock: a pendulum with dry friction that gets a push as it passes its lowest point to the right.

    x'' + x = -f sgn x',    x' := sqrt(x'^2 + h^2) at x = -f, x' > 0

Source: Andronov, Vitt, Khaikin, Theory of Oscillators (1937, 1966), chapter III, section 5: a push of constant energy.
"""

import sympy

from fmu_models import Automaton, Parameter, Reset, State, Switch

unit, f = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("f", 0.1, "1", "friction")
h = Parameter("h", 1.0, "1", "root of twice the energy of a push")
x, v = State("x", "1", "angle", start=-1.0), State("v", "1", "its rate", start=0.1)
dry, escapement = Switch(name="dry", function=v), Switch(name="escapement", function=x + f)

MODEL = Automaton(
    name="clock",
    title="Clock with a push of constant energy",
    source="Andronov, Vitt, Khaikin, Theory of Oscillators (1966)",
    states=[x, v],
    flows={x: v / unit, v: (-x - f * dry.sign) / unit},
    switches=[dry, escapement],
    resets=[Reset(escapement, "-", {v: sympy.sqrt(v**2 + h**2)})],
)
