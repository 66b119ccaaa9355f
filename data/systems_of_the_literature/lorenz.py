"""Lorenz' convection in three numbers.

    x' = sigma (y - x),    y' = x (rho - z) - y,    z' = x y - beta z

Source: Lorenz, Deterministic nonperiodic flow, Journal of the Atmospheric Sciences 20 (1963).
"""

from fmu_models import Automaton, Parameter, State

unit, sigma = (Parameter("unit", 1.0, "s", "unit of time", positive=True), Parameter("sigma", 10.0, "1", "Prandtl"))
rho, beta = Parameter("rho", 28.0, "1", "Rayleigh number"), Parameter("beta", 8 / 3, "1", "shape of the roll")
x, y, z = (State(name, "1", name, start=value) for name, value in (("x", -13.8), ("y", -19.6), ("z", 27.0)))

MODEL = Automaton(
    name="lorenz",
    title="Lorenz' convection",
    source="Lorenz, Journal of the Atmospheric Sciences 20 (1963)",
    states=[x, y, z],
    flows={x: sigma * (y - x) / unit, y: (x * (rho - z) - y) / unit, z: (x * y - beta * z) / unit},
)
