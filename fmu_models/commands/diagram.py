"""Command that makes an orbit diagram."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.branch import content as branch_content
from fmu_models.commands.bundles import bundled


@console.trusting
@bundled
def diagram(
    *,
    over: f.Ranges = None,
    section: f.Section,
    direction: Annotated[str | None, typer.Option(help="Of the sweep: up, down, both.", show_default="up")] = None,
    transient: Annotated[
        int | None, typer.Option(help="Steps at each value that are not kept.", min=0, show_default="250")
    ] = None,
    points: Annotated[
        int | None, typer.Option(help="Points kept where a motion does not repeat itself.", min=1, show_default="50")
    ] = None,
    of: Annotated[str | None, typer.Option(help="State that is drawn.", show_default="the first")] = None,
    branches: Annotated[
        int | None,
        typer.Option(
            help="Lay branches of its motions over it, stable or not, to this period.", min=0, show_default="none"
        ),
    ] = None,
    runs: f.Runs,
    files: f.StoredFiles,
) -> None:
    """Show where motions stay over a parameter, swept up and down.

    Example: stickslip diagram discontinuous_support --forcing omega --set ks=300 --over omega=0.8:1:400 --figure d.png
    """
    from fmu_models.analyses.diagram import orbit_diagram

    files.check()
    ((name, values),) = section.axes("diagram", over, 1).items()
    options = section.options(
        "diagram", direction=direction, transient=transient, points=points, of=of, branches=branches
    )
    system = section.system()
    with console.progress("sweeping") as advance:
        found = orbit_diagram(
            system,
            name,
            values,
            start=section.starts(),
            **options,
            **runs.options(files),
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
    if found.branches is not None:
        content["branches"] = branch_content(found.branches)["branches"]
    files.tell(found, content, section)
