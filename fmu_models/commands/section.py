"""Command that takes a Poincaré section."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Contacts, Json, Overwrite, Settings
from fmu_models.commands import families as f


def section(
    model: f.System,
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
    points: Annotated[int, typer.Option(help="Points of the section.", min=1)] = 5000,
    transient: Annotated[int, typer.Option(help="Steps before that.", min=0)] = 500,
    output: f.Output = None,
    figure: f.Drawn = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Take a Poincaré section of a motion.

    Example: stickslip section discontinuous_support --forcing omega --set ks=300 --set omega=0.94 --figure section.png
    """
    from fmu_models.analyses.poincare import poincare_section

    f.check_files(output, figure, overwrite)
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
    with console.progress("section") as advance:
        found = poincare_section(
            system,
            f.start_of(model, start),
            points=points,
            transient=transient,
            progress=advance,
        )
    content = {"model": found.model, "states": list(found.states), "points": found.points.tolist()}
    f.tell(found, content, output, figure, overwrite, json)
