"""A declaration of tests/oracle as a file in the suite's own words: what is run, and what a failure is printed as."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from oracle.declaration import Declaration

_LAWS = {
    **{"coulomb": "Coulomb", "coulomb_viscous": "CoulombViscous", "conti": "Conti", "conti_viscous": "ContiViscous"},
    **{"directional": "Directional", "stribeck": "Stribeck", "stribeck_cubic": "StribeckCubic", "tustin": "Tustin"},
    **{"tanh": "Tanh", "arctan": "Arctan", "lugre": "LuGre", "lugre_stribeck": "LuGreStribeck", "ageing": "Ageing"},
    **{"dieterich": "Dieterich", "ruina": "Ruina", "kelvin_voigt": "KelvinVoigt"},
    "lankarani_nikravesh": "LankaraniNikravesh",
}
_MEMORY = {"lugre": ("bristle", "z"), "lugre_stribeck": ("bristle", "z"), "ageing": ("clock", "clock")}
_MEMORY |= {"dieterich": ("age", "theta"), "ruina": ("age", "theta")}

HEAD = '''"""A declaration drawn at random."""

from sympy import Rational, S, atan, cos, exp, log, sin, sqrt, tanh

from fmu_models import TIME as t
from fmu_models import (
    Automaton, Coordinate, Friction, Hysteresis, Impact, Input, MaxwellSlip, Mechanism, Newton, Parameter, Poisson,
    Reset, Signal, State, Stop, Switch, load, simulate,
)
from fmu_models.language.quantities import InternalState
'''


def source(declared: Declaration, defaults: Mapping[str, float]) -> str:
    """Python text that sets ``MODEL``, with default values of its parameters."""
    laws = {law["name"] for contact in declared.contacts for law in _laws(contact.get("law"))}
    lines = [HEAD.rstrip()]
    lines += [f"from fmu_models.language.laws.{name} import {_LAWS[name]}" for name in sorted(laws)]
    lines.append("")
    lines += [f'{name} = Parameter("{name}", {defaults[name]!r}, "1", "{name}")' for name in declared.parameters]
    lines += [f'{name} = Input("{name}", 0.0, "1", "{name}")' for name in declared.inputs]
    if declared.flows:
        lines += [f'{name} = State("{name}", "1", "{name}")' for name in declared.states]
        return "\n".join([*lines, *_automaton(declared)]) + "\n"
    for q, v in zip(declared.states, declared.velocities, strict=True):
        lines += [f'{q} = Coordinate("{q}", "1", "{q}", velocity="{v}")', f"{v} = {q}.v"]
    lines += [
        "MODEL = Mechanism(",
        '    name="drawn", title="Drawn", source="tests/oracle",',
        f"    coordinates=[{', '.join(declared.states)}],",
        f"    kinetic_energy={declared.kinetic},",
        f"    potential_energy={declared.potential},",
        f"    dissipation={declared.dissipation},",
        f"    applied={{{', '.join(f'{q}: {force}' for q, force in declared.applied.items())}}},",
        "    contacts=[",
        *(f"        {_contact(contact)}," for contact in declared.contacts),
        "    ],",
        ")",
    ]
    return "\n".join(lines) + "\n"


def _contact(contact: Mapping[str, Any]) -> str:
    name = f'name="{contact["name"]}"'
    if contact["kind"] == "friction":
        where = f", where={contact['where']}" if contact.get("where") else ""
        return f"Friction({name}, slip={contact['slip']}, law={_law(contact['law'], contact['name'])}{where})"
    if contact["kind"] == "sliders":
        k, bounds = (", ".join(contact[key]) for key in ("k", "D"))
        return f"Hysteresis({name}, way={contact['way']}, law=MaxwellSlip(k=[{k}], D=[{bounds}]))"
    if contact["kind"] == "stop":
        law = _law(contact["law"], contact["name"])
        return f'Stop({name}, gap={contact["gap"]}, law={law}, release="{contact["release"]}")'
    rubs = f", slip={contact['slip']}, mu={contact['mu']}" if contact.get("slip") else ""
    return f"Impact({name}, gap={contact['gap']}, restitution={contact['rule'].title()}({contact['e']}){rubs})"


def _laws(law: Any) -> Any:
    if law:
        yield law
        yield from _laws(law.get("law") or law.get("steady"))


def _law(law: Mapping[str, Any], contact: str) -> str:
    parts = []
    for key, value in law.items():
        if key in ("law", "steady"):
            parts.append(f"{key}={_law(value, contact)}")
        elif key == "n":
            parts.append(f"n=Rational({value!r})")
        elif key in ("v_r", "v_c", "exponent"):
            parts.append(f"{key}={value}")
        elif key != "name":
            parts.append(f"{key}=S({value})")
    if law["name"] in _MEMORY:
        key, stem = _MEMORY[law["name"]]
        start = ", start=1.0" if stem == "theta" else ""
        parts.append(f'{key}=InternalState("{stem}_{contact}", "1", "{stem}"{start})')
    return f"{_LAWS[law['name']]}({', '.join(parts)})"


def _automaton(declared: Declaration) -> list[str]:
    lines = []
    for contact in declared.contacts:
        name = contact["name"]
        lines += [f'{name} = Switch(name="{name}", function={contact["function"]})', f"sign_{name} = {name}.sign"]
    resets = [
        f'Reset({c["name"]}, "{c["side"]}", {{{", ".join(f"{x}: {e}" for x, e in c["to"].items())}}})'
        for c in declared.contacts
        if c.get("side")
    ]
    return [
        *lines,
        "MODEL = Automaton(",
        '    name="drawn", title="Drawn", source="tests/oracle",',
        f"    states=[{', '.join(declared.states)}],",
        f"    flows={{{', '.join(f'{x}: {flow}' for x, flow in declared.flows.items())}}},",
        f"    switches=[{', '.join(c['name'] for c in declared.contacts)}],",
        f"    resets=[{', '.join(resets)}],",
        ")",
    ]
