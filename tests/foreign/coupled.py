"""Units for coupled systems, exported from declarations."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import sympy
from quick_export import quick_export

from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import Connection
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton
from fmu_models.language.declaration import Output
from fmu_models.language.quantities import Input, Parameter, State


def mass() -> Automaton:
    """A mass between two springs: one to the ground, one to the place ``other``."""
    m, k, kc = (
        Parameter("m", 1.0, "kg", "mass"),
        Parameter("k", 4.0, "N/m", "spring"),
        Parameter("kc", 2.5, "N/m", "link"),
    )
    x, v = State("x", "m", "place"), State("v", "m/s", "speed")
    other = Input("other", 0.0, "m", "place of the other end")
    return Automaton(
        name="mass",
        title="A mass",
        source="test",
        states=[x, v],
        flows={x: v, v: (kc * (other - x) - k * x) / m},
        outputs=[Output("place", x, "m", "place"), Output("speed", v, "m/s", "speed")],
    )


def link() -> Automaton:
    """x' = -x + g u + n sin(u); the rate is an output, which depends on u directly."""
    g, n = Parameter("g", 0.5, "1", "gain"), Parameter("n", 0.0, "1", "part that is not linear")
    x, u = State("x", "1", "state", start=1.0), Input("u", 0.0, "1", "input")
    return Automaton(
        name="link",
        title="A link",
        source="test",
        states=[x],
        flows={x: -x + g * u + n * sympy.sin(u)},
        outputs=[Output("y", x.rate, "1", "rate")],
    )


@cache
def exported(name: str, folder: Path, fmi: str = "3.0") -> Fmu:
    declared: Any = {"mass": mass, "link": link}[name]()
    path = folder / f"{name}{fmi}.fmu"
    quick_export(declared, path, fmi_version=fmi, overwrite=True)
    return Fmu.open(path)


def wires(*texts: str) -> tuple[Connection, ...]:
    """Connections written as "a.y -> b.u"."""
    ends = [text.split(" -> ") for text in texts]
    return tuple(Connection(source, target) for source, target in ends)


def masses(fmu: Fmu, **settings: Any) -> CoupledSystem:
    """Two equal masses, the first one displaced by 1 m."""
    return CoupledSystem(
        "masses",
        {"a": Unit(fmu, start={"x": 1.0}), "b": Unit(fmu)},
        wires("a.place -> b.other", "b.place -> a.other"),
        **settings,
    )
