"""Command that finds Lyapunov exponents."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.bundles import bundled


@console.trusting
@bundled
def lyapunov(
    section: f.Section,
    *,
    steps: Annotated[int, typer.Option(help="Steps of the section, all motions together.", min=2)] = 100_000,
    transient: Annotated[int, typer.Option(help="Steps of each motion before that.", min=0)] = 1000,
    motions: Annotated[int, typer.Option(help="Motions that are followed.", min=2)] = 8,
    runs: f.Runs,
    files: f.StillStored,
) -> None:
    """Find all Lyapunov exponents of a motion, with their errors.

    Example: stickslip lyapunov hinge_clearance --forcing f --set f=0.41 --start x=0 --steps 20000
    """
    from fmu_models.analyses.lyapunov import lyapunov as find

    files.check()
    system = section.system()
    with console.progress("exponents") as advance:
        found = find(
            system,
            section.starts(),
            periods=steps,
            transient=transient,
            motions=motions,
            **runs.options(files),
            progress=advance,
        )
    content = {
        "model": system.name,
        # null where every difference is lost
        "exponents": [console.finite(one) for one in found.values.tolist()],
        "errors": found.errors.tolist(),
        "per_time": [console.finite(one) for one in found.per_time.tolist()],
        "per_time_errors": found.per_time_errors.tolist(),
        "unit": found.unit,
        "steps": found.steps,
        "zero": found.zero,
        "identity": found.identity,
        "lost": found.lost,
        "shares": dict(found.shares),
        "transient": dataclasses.asdict(found.transient) if found.transient else None,
    }
    files.tell(found, content)
