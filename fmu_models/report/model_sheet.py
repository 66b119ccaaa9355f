"""One page about a model: equations as derived, parameters, contacts with their states, outputs, source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy

from fmu_models.lowering.lower import lower

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.language.mechanism import Mechanism
    from fmu_models.lowering.hybrid_system import HybridSystem


def sheet(mechanism: Mechanism) -> dict[str, Any]:
    """The page as plain data, ready for JSON."""
    system = lower(mechanism)
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "source": mechanism.source,
        "equations": _equations(system),
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
        "contacts": [
            {
                "name": contact.name,
                "description": contact.description,
                "law": type(declared.law).__name__,
                "slip": readable(contact.slip),
                "force in slip": readable(contact.force.xreplace({contact.slip_symbol: sympy.Symbol("slip")})),
                "capacity in stick": readable(contact.capacity) if contact.sticks else None,
                "states": ["slip+", "slip-", *(["stick"] if contact.sticks else [])],
                "indicators": {
                    "in slip": "|slip|, the slip speed",
                    **({"in stick": "capacity - |force|, the margin"} if contact.sticks else {}),
                },
            }
            for contact, declared in zip(system.contacts, mechanism.contacts, strict=True)
        ],
        "outputs": [
            {"name": y.name, "expression": readable(y.expression), "unit": y.unit, "description": y.description}
            for y in system.outputs
        ],
        "requirements": [requirement.sentence for requirement in system.all_requirements],
    }


def readable(expression: sympy.Basic) -> str:
    """An expression in plain letters."""
    names = {symbol: sympy.Symbol(symbol.name) for symbol in expression.atoms(sympy.Dummy)}
    return sympy.sstr(expression.xreplace(names))


def _equations(system: HybridSystem) -> list[str]:
    lines = []
    for i, q in enumerate(system.coordinates):
        force = sum((system.W[i, c] * contact.force_symbol for c, contact in enumerate(system.contacts)), sympy.S.Zero)
        lines.append(f"{q.name}' = {q.v.name}")
        lines.append(f"{q.v.name}' = {readable(sympy.expand(system.acceleration[i]) + force)}")
    for state, rate in zip(system.internal_states, system.internal_rates, strict=True):
        lines.append(f"{state.name}' = {readable(rate)}")
    return lines


def print_sheet(content: dict[str, Any], out: Console) -> None:
    """The page for people."""
    from fmu_models.console import table

    out.print(f"[bold]{content['name']}[/bold]  {content['title']}")
    out.print(f"source: {content['source']}\n")
    for line in content["equations"]:
        out.print(f"    {line}", markup=False)
    for contact in content["contacts"]:
        out.print(f"\ncontact [bold]{contact['name']}[/bold] ({contact['law']}): {contact['description']}")
        out.print(f"    slip speed   {contact['slip']}", markup=False)
        out.print(f"    force, slip  {contact['force in slip']}", markup=False)
        if contact["capacity in stick"]:
            out.print(f"    stick while  |force| < {contact['capacity in stick']}", markup=False)
        out.print(f"    states       {', '.join(contact['states'])}")
        out.print(f"    indicators   {'; '.join(f'{k}: {v}' for k, v in contact['indicators'].items())}", markup=False)
    made = table("parameter", ">value", "unit", ">from", ">to", "meaning")
    for row in content["parameters"]:
        ends = ["" if row[key] is None else f"{row[key]:g}" for key in ("minimum", "maximum")]
        made.add_row(row["name"], f"{row['value']:g}", row["unit"], *ends, row["description"])
    out.print(made)
    made = table("variable", "kind", ">start", "unit", "meaning")
    for row in content["inputs"]:
        made.add_row(row["name"], "input", f"{row['value']:g}", row["unit"], row["description"])
    for row in content["states"]:
        made.add_row(row["name"], "state", f"{row['start']:g}", row["unit"], row["description"])
    for row in content["outputs"]:
        made.add_row(row["name"], "output", "", row["unit"], row["description"])
    out.print(made)
    for sentence in content["requirements"]:
        out.print(f"refused: {sentence}")
