"""Command that maps basins of attraction."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.bundles import bundled


@bundled
def basins(
    *,
    over: f.Ranges = None,
    section: f.ForcedStrobe,
    most: Annotated[
        int | None,
        typer.Option(help="Steps after which a motion is taken to stay as it is.", min=1, show_default="3000"),
    ] = None,
    runs: f.Runs,
    files: f.StoredFiles,
) -> None:
    """Map which attractor each start of a grid comes to.

    Example: stickslip basins discontinuous_support --forcing omega --set omega=1.1 --over x=-8:8:101 --over v=-8:8:101
    """
    from fmu_models.analyses.basins import Cloud
    from fmu_models.analyses.basins import basins as make

    files.check()
    axes = section.axes("basins", over)
    options = section.options("basins", most=most)
    system = section.system()
    with console.progress("mapping") as advance:
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
        "axes": {name: values.tolist() for name, values in found.axes.items()},
        "labels": found.labels.tolist(),
        "attractors": [
            {
                "period": one.period,
                "points": one.points[: max(1, one.period)].tolist(),
                **({"kind": one.verdict.kind, "exponent": one.verdict.exponent} if isinstance(one, Cloud) else {}),
            }
            for one in found.attractors
        ],
        "shares": found.shares.tolist(),
        "undecided": found.undecided,
        "boundary": found.boundary,
        "entropy": console.finite(found.entropy()),
        "failures": [f"{place}: {why}" for place, why in found.failures.items()],
    }
    files.tell(found, content, section)
