"""Command that lists the maps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from fmu_models.maps import MAPS

if TYPE_CHECKING:
    from fmu_models.language.maps import Map


def maps(json: console.Json = False) -> None:
    """List the maps.

    Example: stickslip maps
    """
    from fmu_models.commands.listing import listed

    rows = listed(MAPS, _row)

    def show(out: console.Console) -> None:
        lines = [
            [
                *(row["name"], row["title"], ", ".join(row["states"])),
                ", ".join(f"{name} {value:g}" for name, value in row["parameters"].items()),
                row["source"],
            ]
            for row in rows
        ]
        out.print(console.table("", ("map", "what it is", "states", "parameters", "source"), lines))
        out.print("Look at one:  stickslip map MAP")

    console.say(json, {"maps": rows}, show)


def _row(name: str, map_: Map) -> dict[str, Any]:
    return {
        "name": map_.name,
        "title": map_.title,
        "states": [state.name for state in map_.states],
        "parameters": {p.name: p.value for p in map_.parameters},
        "inverse": map_.inverse is not None,
        "source": map_.source,
    }
