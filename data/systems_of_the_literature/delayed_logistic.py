"""Delayed logistic map: an invariant circle is born at a = 2.

    x(k+1) = a x (1 - y),    y(k+1) = x

Source: Aronson, Chory, Hall, McGehee, Communications in Mathematical Physics 83 (1982).
"""

from fmu_models import Map, Parameter, State

a = Parameter("a", 1.9, "1", "growth")
x, y = State("x", "1", "population", start=0.5), State("y", "1", "population before", start=0.5)

MAP = Map(
    name="delayed_logistic",
    title="Delayed logistic map",
    source="Aronson, Chory, Hall, McGehee, Communications in Mathematical Physics 83 (1982)",
    states=[x, y],
    rule={x: a * x * (1 - y), y: x},
    box={x: (0.0, 1.2), y: (0.0, 1.2)},
)
