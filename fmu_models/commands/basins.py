"""Command that maps basins of attraction."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Contacts, Json, Overwrite, Settings
from fmu_models.commands import families as f


def basins(
    model: f.System,
    over: f.Ranges,
    settings: Settings = None,
    start: f.Start = None,
    contacts: Contacts = None,
    forcing: f.Forcing = None,
    period: f.Period = None,
    every: f.Every = 1,
    most: Annotated[int, typer.Option(help="Steps after which a motion is taken to stay as it is.", min=1)] = 3000,
    workers: f.Workers = None,
    output: f.Output = None,
    figure: f.Drawn = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Map which attractor each start of a grid comes to.

    Example: stickslip basins discontinuous_support --forcing omega --set omega=1.1 --over x=-8:8:101 --over v=-8:8:101
    """
    from fmu_models.analyses.basins import basins as make

    f.check_files(output, figure, overwrite)
    axes = f.ranges(over, len(over))
    system = f.system_of(model, settings=settings, contacts=contacts, forcing=forcing, period=period, every=every)
    with console.progress("mapping") as advance:
        found = make(
            system,
            start=f.start_of(model, start),
            most=most,
            workers=workers,
            progress=advance,
            **axes,  # type: ignore[arg-type] # names of states or parameters
        )
    content = {
        "model": found.model,
        "axes": {name: values.tolist() for name, values in found.axes.items()},
        "labels": found.labels.tolist(),
        "attractors": [
            {"period": one.period, "points": one.points[: max(1, one.period)].tolist()} for one in found.attractors
        ],
        "shares": found.shares.tolist(),
        "undecided": found.undecided,
        "boundary": found.boundary,
        "entropy": f.finite(found.entropy()),
        "failures": [f"{place}: {why}" for place, why in found.failures.items()],
    }
    f.tell(found, content, output, figure, overwrite, json)
