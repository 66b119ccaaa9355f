"""Command that makes a page in which a model moves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.files import checked_page
from fmu_models.commands.arguments import NAMED


@console.trusting
def explore(
    model: Annotated[
        str, typer.Argument(metavar="MODEL", help=f"A scene (.toml), an FMU of this suite, or a model: {NAMED}.")
    ],
    path: Annotated[Path | None, typer.Option("--output", "-o", help="Page to write (default: MODEL.html).")] = None,
    contacts: console.Contacts = None,
    plot: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES", help="Coordinates to draw, by commas (default: all; needed where there are more than six)."
        ),
    ] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Make a page in which a model moves: sliders for its parameters, portraits, sections and bifurcation diagrams.

    The engine is in the page, as WebAssembly: it needs neither this suite nor a network. Parameters that a scene holds
    fixed start at its values and can be moved.

    Example: stickslip explore forced_stick_slip -o belt.html

    Example: stickslip explore disc_rig --contacts disc0
    """
    from fmu_models.explorer.page import explore as made

    target = checked_page(path or Path(f"{Path(model).stem.partition(':')[0]}.html"), overwrite=overwrite)
    drawn = None if plot is None else console.names_of(plot)
    page = made(model, contacts=console.chosen(contacts), plot=drawn)
    page.write(target, overwrite=overwrite)
    content = {
        "file": str(target),
        "bytes": target.stat().st_size,
        "model": page.name,
        "version": page.version,
        "planes": [list(plane) for plane in page.planes],
        "notes": list(page.notes),
    }

    def show(out: console.Console) -> None:
        planes = ", ".join(f"{y} over {x}" for x, y in page.planes)
        message = f"{target}: {page.name}, {content['bytes'] / 1000:.0f} kB, draws {planes}"
        out.print(console.plain(message))
        out.print("Open it in a browser; it needs no network.")

    for note in page.notes:
        console.warn(note)
    console.say(json, content, show)
