"""Buck converter under voltage control: the source is on while a ramp is above the amplified error.

    C v' = i - v/R,    L i' = E where ramp > a (v - V_ref), 0 elsewhere

Source: Fossas and Olivar, IEEE Transactions on Circuits and Systems I 43 (1996); di Bernardo, Garofalo, Glielmo and
Vasca, the same 45 (1998).
"""

from fmu_models import Automaton, Parameter, PeriodicSignal, State, Switch

R, L, C = Parameter("R", 22.0, "ohm", "load"), Parameter("L", 0.02, "H", "coil"), Parameter("C", 47e-6, "F", "capacity")
E, T = Parameter("E", 24.0, "V", "source"), Parameter("T", 400e-6, "s", "period of the ramp", positive=True)
low, high = Parameter("low", 3.8, "V", "ramp from"), Parameter("high", 8.2, "V", "ramp to")
a, V_ref = Parameter("a", 8.4, "1", "gain"), Parameter("V_ref", 11.3, "V", "wanted voltage")
v, i = State("v", "V", "voltage", start=12.0), State("i", "A", "current", start=0.55)
ramp = PeriodicSignal.sawtooth("ramp", "V", "ramp", period=T, low=low, high=high)
comparator = Switch(name="comparator", function=ramp - a * (v - V_ref), unit="V")

MODEL = Automaton(
    name="buck_converter",
    title="Buck converter",
    source="Fossas and Olivar, IEEE Transactions on Circuits and Systems I 43 (1996)",
    states=[v, i],
    flows={v: (i - v / R) / C, i: (E * (1 + comparator.sign) / 2 - v) / L},
    switches=[comparator],
)
