"""Command that lists the maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base import console
from fmu_models.base.console import Json
from fmu_models.maps import MAPS

if TYPE_CHECKING:
    from rich.console import Console


def maps(json: Json = False) -> None:
    """List the maps.

    Example: stickslip maps
    """
    loaded = [MAPS.load(name) for name in MAPS.names()]
    rows = [
        {
            "name": one.name,
            "title": one.title,
            "states": [state.name for state in one.states],
            "parameters": {p.name: p.value for p in one.parameters},
            "inverse": one.inverse is not None,
            "source": one.source,
        }
        for one in loaded
    ]

    def show(out: Console) -> None:
        made = console.table("map", "what it is", "states", "parameters", "source")
        for row in rows:
            values = ", ".join(f"{name} {value:g}" for name, value in row["parameters"].items())
            made.add_row(row["name"], row["title"], ", ".join(row["states"]), values, row["source"])
        out.print(made)
        out.print("Look at one:  stickslip map MAP")

    console.say(json, {"maps": rows}, show)
