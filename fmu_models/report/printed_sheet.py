"""The page about a model as it is printed for people; apart from what derives it, which takes sympy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fmu_models.base.console import hanging
from fmu_models.base.table import Cell, number, table

if TYPE_CHECKING:
    from rich.console import Console


def print_sheet(content: dict[str, Any], out: Console) -> None:
    """The page for people."""
    out.print(f"[bold]{content['name']}[/bold]  {content['title']}")
    out.print(f"source: {content['source']}\n")
    for line in content["equations"]:
        out.print(hanging(f"    {line}", out.width, 8), markup=False)
    for contact in content["contacts"]:
        kind = f"{contact['kind']}, {contact['law']}" if contact["law"] else contact["kind"]
        out.print(f"\n[bold]{contact['name']}[/bold] ({kind}): {contact['description']}")
        of_it = {
            **contact["equations"],
            "states": ", ".join(contact["states"]),
            "indicators": "; ".join(contact["indicators"]),
        }
        for name, text in of_it.items():
            out.print(hanging(f"    {name:22s} {text}", out.width, 27), markup=False)
    out.print()
    rows: list[list[str | Cell]] = [
        [p["name"], *(number(p[key], "g") for key in ("value", "minimum", "maximum")), p["unit"], p["description"]]
        for p in content["parameters"]
    ]
    out.print(table("", ("parameter", "value", "from", "to", "unit", "meaning"), rows))
    rows = [
        [item["name"], kind, number(item.get("value", item.get("start")), "g"), item["unit"], item["description"]]
        for kind in ("input", "state", "output")
        for item in content[f"{kind}s"]
    ]
    out.print(table("", ("variable", "kind", "start", "unit", "meaning"), rows))
    for sentence in content["requirements"]:
        out.print(f"refused: {sentence}")
    exact = content["exact_flow"]
    linear = "every mode is linear with constant coefficients" if exact["linear"] else "no"
    out.print(f"exact flow: {linear}" + ("; strobes of ensembles are made by it" if exact["lanes"] else ""))
    for sentence in exact["obstacles"]:
        out.print(hanging(f"    {sentence}", out.width, 4), markup=False)
