"""Valve oscillator: a damped circuit that a constant current drives while its rate is positive.

    x'' + 2 h x' + x = 1 where x' > 0, 0 where x' < 0

Source: Andronov, Vitt, Khaikin, Theory of Oscillators (1937, 1966), chapter VIII, section 3.
"""

from fmu_models import Automaton, Parameter, State, Switch

unit, h = Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("h", 0.1, "1", "damping")
x, v = State("x", "1", "current", start=1.5), State("v", "1", "its rate", start=0.5)
valve = Switch(name="valve", function=v)

MODEL = Automaton(
    name="valve_oscillator",
    title="Valve oscillator",
    source="Andronov, Vitt, Khaikin, Theory of Oscillators (1966)",
    states=[x, v],
    flows={x: v / unit, v: ((1 + valve.sign) / 2 - x - 2 * h * v) / unit},
    switches=[valve],
)
