"""One page about a model: equations as derived, parameters, contacts with their states, outputs, source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy

from fmu_models.base.table import Cell, number, table
from fmu_models.base.terminal_table import terminal
from fmu_models.language.inertia import mass_matrix
from fmu_models.language.mechanism import Mechanism
from fmu_models.lowering.lagrange import generalised_forces
from fmu_models.lowering.lower import lower

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.lowering.hybrid_system import ContactDynamics, HybridSystem


def sheet(mechanism: Mechanism) -> dict[str, Any]:
    """The page as plain data, ready for JSON."""
    system = lower(mechanism)
    declared = {contact.name: contact for contact in mechanism.contacts}
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "source": mechanism.source,
        "equations": _equations(mechanism, system),
        "parameters": [
            {
                "name": p.name,
                "value": p.value,
                "unit": p.unit,
                "description": p.description,
                "minimum": p.minimum,
                "maximum": p.maximum,
            }
            for p in system.parameters
        ],
        "inputs": [
            {"name": u.name, "value": u.value, "unit": u.unit, "description": u.description} for u in system.inputs
        ],
        "states": [
            {"name": x.name, "start": x.start, "unit": x.unit, "description": x.description} for x in system.states
        ],
        "contacts": [_contact(contact, declared.get(contact.name)) for contact in system.contacts],
        "outputs": [
            {"name": y.name, "expression": readable(y.expression), "unit": y.unit, "description": y.description}
            for y in system.outputs
        ],
        "requirements": [requirement.sentence for requirement in system.all_requirements],
    }


def _contact(contact: ContactDynamics, declared: Any) -> dict[str, Any]:
    """What a contact is made of, by its kind."""
    named = {
        contact.slip_symbol: sympy.Symbol("v" if contact.kind != "switch" else "h"),
        contact.depth_symbol: sympy.Symbol("d"),
        contact.memory_symbol: sympy.Symbol("v0"),
        contact.sign_symbol: sympy.Symbol("s"),
    }
    named = {symbol: letter for symbol, letter in named.items() if symbol is not None}

    def written(expression: sympy.Expr) -> str:
        return readable(sympy.sympify(expression).xreplace(named))

    said: dict[str, str] = {}
    if contact.kind == "friction":
        said |= {"v, slip speed": readable(contact.slip), "lambda in slip": written(contact.force)}
        if contact.sticks:
            said["sticks while"] = f"|lambda| < {readable(contact.capacity)}"
        if contact.depth is not None:
            said["present where"] = f"{readable(contact.depth)} >= 0"
    elif contact.kind == "stop":
        said |= {"d, depth": readable(contact.depth or sympy.S.Zero), "v, its rate": readable(contact.slip)}
        said |= {"lambda while touching": written(contact.force), "lets go": f"where its {declared.release} vanishes"}
    elif contact.kind == "impact":
        said |= {"gap": readable(declared.gap), "v, its rate": readable(contact.slip)}
        said["restitution"] = f"{'Poisson' if contact.poisson else 'Newton'}, {readable(contact.restitution)}"
        said["closed while"] = "lambda, the normal force, is positive"
    elif contact.kind == "impact_friction":
        said |= {"v, slip speed": readable(contact.slip)}
        said["|lambda| in slip"] = f"{readable(contact.friction)} times the normal force; in stick less than that"
    else:
        said |= {"h, switching function": readable(contact.slip)}
        said["slides"] = "where both flows push onto h = 0" if contact.sticks else "never: the flow goes through h = 0"
        if contact.reset:
            jumps = (f"{state.name} := {written(value)}" for state, value in contact.reset.items())
            said["jump at h = 0"] = "; ".join(jumps)
    return {
        "name": contact.name,
        "kind": contact.kind.replace("_", " "),
        "description": contact.description,
        "law": _law(contact, declared),
        "equations": said,
        "states": _states(contact),
        "indicators": [_INDICATORS[what] for what in contact.indicators],
    }


def _law(contact: ContactDynamics, declared: Any) -> str | None:
    if contact.kind == "impact_friction":
        return "Coulomb"
    rule = declared.restitution if contact.kind == "impact" else getattr(declared, "law", None)
    return None if rule is None else type(rule).__name__


_INDICATORS = {
    "depth": "depth, or its negative while away",
    "slip": "|slip speed|; in stick capacity - |lambda|",
    "release": "force while touching, its negative once released",
    "function": "|h|; while sliding 1 - |mean sign|",
    "gap": "gap; closed the normal force",
}


def _states(contact: ContactDynamics) -> list[str]:
    if contact.kind == "impact":
        return ["open", "closed", "chattering"]
    if contact.kind == "impact_friction":
        return ["slip+", "slip-", "stick", "away"]
    if contact.kind == "stop":
        return ["away", "touching", *(["released"] if contact.release is not None else [])]
    moving = ["slip+", "slip-"] if contact.kind == "friction" else ["+", "-"]
    held = {"friction": "stick", "switch": "sliding"}[contact.kind]
    return [*moving, *([held] if contact.sticks else []), *(["away"] if contact.depth is not None else [])]


def readable(expression: sympy.Basic) -> str:
    """An expression in plain letters."""
    names = {symbol: sympy.Symbol(symbol.name) for symbol in expression.atoms(sympy.Dummy)}
    return sympy.sstr(expression.xreplace(names))


def _equations(mechanism: Mechanism, system: HybridSystem) -> list[str]:
    lines = [f"{q.name}' = {q.v.name}" for q in system.coordinates]
    forces = sympy.Matrix([sympy.Symbol(f"lambda_{contact.name}") for contact in system.contacts])
    if isinstance(mechanism, Mechanism) and not mass_matrix(mechanism).is_diagonal():
        lines += _coupled(mechanism, system, forces)
    else:
        by_contacts: Any = system.W * forces if system.contacts else sympy.zeros(len(system.driven), 1)
        for i, state in enumerate(system.driven):
            lines.append(f"{state.name}' = {readable(sympy.expand(system.acceleration[i]) + by_contacts[i])}")
    for state, rate in zip(system.internal_states, system.internal_rates, strict=True):
        lines.append(f"{state.name}' = {readable(rate)}")
    return lines


def _coupled(mechanism: Mechanism, system: HybridSystem, forces: Any) -> list[str]:
    """Mass matrix times accelerations = forces: solved, these would fill pages."""
    rates = sympy.Matrix([sympy.Symbol(f"{q.v.name}'") for q in mechanism.coordinates])
    inertia: Any = mass_matrix(mechanism) * rates
    free: Any = generalised_forces(mechanism)
    lines = []
    for i, q in enumerate(mechanism.coordinates):
        right: Any = sympy.expand(free[i])
        for c, contact in enumerate(system.contacts):
            right += sympy.diff(contact.slip, q.v) * forces[c]
        lines.append(f"{readable(inertia[i])} = {readable(right)}")
    return lines


def print_sheet(content: dict[str, Any], out: Console) -> None:
    """The page for people."""
    out.print(f"[bold]{content['name']}[/bold]  {content['title']}")
    out.print(f"source: {content['source']}\n")
    for line in content["equations"]:
        out.print(f"    {line}", markup=False)
    for contact in content["contacts"]:
        kind = f"{contact['kind']}, {contact['law']}" if contact["law"] else contact["kind"]
        out.print(f"\n[bold]{contact['name']}[/bold] ({kind}): {contact['description']}")
        for what, expression in contact["equations"].items():
            out.print(f"    {what:22s} {expression}", markup=False)
        out.print(f"    {'states':22s} {', '.join(contact['states'])}", markup=False)
        out.print(f"    {'indicators':22s} {'; '.join(contact['indicators'])}", markup=False)
    rows: list[list[str | Cell]] = [
        [p["name"], *(number(p[key], "g") for key in ("value", "minimum", "maximum")), p["unit"], p["description"]]
        for p in content["parameters"]
    ]
    out.print(terminal(table("", ("parameter", "value", "from", "to", "unit", "meaning"), rows)))
    rows = [
        [one["name"], kind, number(one.get("value", one.get("start")), "g"), one["unit"], one["description"]]
        for kind in ("input", "state", "output")
        for one in content[f"{kind}s"]
    ]
    out.print(terminal(table("", ("variable", "kind", "start", "unit", "meaning"), rows)))
    for sentence in content["requirements"]:
        out.print(f"refused: {sentence}")
