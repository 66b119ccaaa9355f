"""Command that charts what motions become over two parameters."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.bundles import bundled


@console.trusting
@bundled
def chart(
    *,
    over: f.Ranges = None,
    section: f.Strobe,
    what: Annotated[
        str | None, typer.Option(help="period, impacts, stick, exponent or attractor.", show_default="period")
    ] = None,
    transient: Annotated[
        int | None, typer.Option(help="Steps before a motion is classified, at most.", min=0, show_default="3000")
    ] = None,
    points: Annotated[
        int | None, typer.Option(help="Steps over which it is looked at then.", min=1, show_default="48")
    ] = None,
    refine: Annotated[
        int | None,
        typer.Option(help="Cells a side of a coarse grid to begin with: 1, 2, 4, ...", min=1, show_default="1"),
    ] = None,
    runs: f.Runs,
    files: f.StoredFiles,
) -> None:
    """Chart what a motion becomes over two parameters.

    Example: stickslip chart disc_rig --period 1 --autonomous --what stick --over w0=0.2:1.8:41 --over w1=-0.6:1:41
    """
    from fmu_models.analyses.chart import chart as make

    files.check()
    axes = section.axes("chart", over, 2)
    options = section.options("chart", what=what, transient=transient, points=points, refine=refine)
    system = section.system()
    with console.progress("charting") as advance:
        found = make(
            system,
            start=section.starts(),
            **options,
            **runs.options(files),
            progress=advance,
            **axes,
        )
    content = {
        "model": found.model,
        "what": found.what,
        "axes": {name: values.tolist() for name, values in found.axes.items()},
        "classes": list(found.classes),
        "labels": found.labels.tolist(),
        "runs": found.runs,
        "failures": [f"{place}: {why}" for place, why in found.failures.items()],
    }
    files.tell(found, content, section)
