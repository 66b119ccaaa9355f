"""Sine circle map: an oscillator that is pushed once per turn; it locks where Omega is near a fraction.

    x(k+1) = x + Omega - K/(2 pi) sin(2 pi x) mod 1

Source: Arnold, Small denominators I, American Mathematical Society Translations 46 (1965); Jensen, Bak, Bohr, Physical
Review A 30 (1984).
"""

import sympy

from fmu_models import Map, Parameter, State

Omega, K = Parameter("Omega", 0.0, "1", "turns in a step"), Parameter("K", 0.8, "1", "strength of the push")
x = State("x", "1", "turns", start=0.1)

MAP = Map(
    name="circle_map",
    title="Sine circle map",
    source="Jensen, Bak, Bohr, Physical Review A 30 (1984)",
    states=[x],
    rule={x: x + Omega - K / (2 * sympy.pi) * sympy.sin(2 * sympy.pi * x)},
    modulus={x: sympy.Integer(1)},
)
