"""Command that makes an orbit diagram."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Contacts, Json, Overwrite, Settings
from fmu_models.commands import families as f


def diagram(
    model: f.System,
    over: f.Ranges,
    settings: Settings = None,
    start: f.Start = None,
    contacts: Contacts = None,
    forcing: f.Forcing = None,
    period: f.Period = None,
    every: f.Every = 1,
    autonomous: f.Autonomous = False,
    level: f.Level = None,
    down: f.Down = False,
    impacts: f.Impacts = None,
    direction: Annotated[str, typer.Option(help="Of the sweep: up, down, both.")] = "up",
    transient: Annotated[int, typer.Option(help="Steps at each value that are not kept.", min=0)] = 250,
    points: Annotated[int, typer.Option(help="Points kept where a motion does not repeat itself.", min=1)] = 50,
    workers: f.Workers = None,
    output: f.Output = None,
    figure: f.Drawn = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Show where motions stay over a parameter, swept up and down.

    Example: stickslip diagram discontinuous_support --forcing omega --set ks=300 --over omega=0.8:1:400 --figure d.png
    """
    from fmu_models.analyses.diagram import orbit_diagram

    f.check_files(output, figure, overwrite)
    ((name, values),) = f.ranges(over, 1).items()
    system = f.system_of(
        model,
        settings=settings,
        contacts=contacts,
        forcing=forcing,
        period=period,
        every=every,
        autonomous=autonomous,
        level=level,
        down=down,
        impacts=impacts,
    )
    with console.progress("sweeping") as advance:
        found = orbit_diagram(
            system,
            name,
            values,
            direction=direction,
            start=f.start_of(model, start),
            transient=transient,
            points=points,
            workers=workers,
            progress=advance,
        )
    content = {
        "model": found.model,
        "over": name,
        "values": values.tolist(),
        "directions": list(found.directions),
        "periods": found.periods.tolist(),
        "words": [[found.word(d, i) for i in range(len(values))] for d in range(len(found.directions))],
        "steps": found.steps,
        "failures": [f"{way}, {name} = {value:g}: {why}" for (way, value), why in found.failures.items()],
    }
    f.tell(found, content, output, figure, overwrite, json)
