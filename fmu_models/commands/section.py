"""Command that takes a Poincaré section."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.bundles import bundled


@console.trusting
@bundled
def section(
    section: f.Section,
    *,
    points: Annotated[int | None, typer.Option(help="Points of the section.", min=1, show_default="5000")] = None,
    transient: Annotated[int | None, typer.Option(help="Steps before that.", min=0, show_default="500")] = None,
    files: f.StillFiles,
) -> None:
    """Take a Poincaré section of a motion.

    Example: stickslip section discontinuous_support --forcing omega --set ks=300 --set omega=0.94 --figure section.png
    """
    from fmu_models.analyses.poincare import poincare_section

    files.check()
    system = section.system()
    with console.progress("section") as advance:
        found = poincare_section(
            system,
            section.starts(),
            **section.options("section", points=points, transient=transient),
            progress=advance,
        )
    content = {"model": found.model, "states": list(found.states), "points": found.points.tolist()}
    files.tell(found, content)
