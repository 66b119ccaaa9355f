"""Thermostat with hysteresis: a heater that goes off when it is warm and on when it is cold.

    T' = (T_heater q - T)/tau,    q := 0 at T = warm,    q := 1 at T = cold

Source: Branicky, Multiple Lyapunov functions and other analysis tools for switched and hybrid systems, IEEE
Transactions on Automatic Control 43 (1998).
"""

import sympy

from fmu_models import Automaton, Parameter, Reset, State, Switch

tau, heater = Parameter("tau", 1.0, "s", "time constant", positive=True), Parameter("heater", 2.0, "1", "its warmth")
warm, cold = Parameter("warm", 1.1, "1", "where it goes off"), Parameter("cold", 0.9, "1", "where it goes on")
T, q = State("T", "1", "temperature", start=1.0), State("q", "1", "whether the heater is on", start=1.0)
hot, cool = Switch(name="hot", function=warm - T), Switch(name="cool", function=T - cold)

MODEL = Automaton(
    name="thermostat",
    title="Thermostat with hysteresis",
    source="Branicky, IEEE Transactions on Automatic Control 43 (1998)",
    states=[T, q],
    flows={T: (heater * q - T) / tau, q: sympy.Integer(0)},
    switches=[hot, cool],
    resets=[Reset(hot, "+", {q: sympy.Integer(0)}), Reset(cool, "+", {q: sympy.Integer(1)})],
)
