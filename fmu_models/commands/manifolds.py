"""Command that grows the manifolds of a saddle, and locates where they meet."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.commands import families as f
from fmu_models.commands.branch import one_range
from fmu_models.commands.bundles import bundled
from fmu_models.maps import MAPS


@console.trusting
@bundled
def manifolds(
    section: f.Section,
    *,
    steps: Annotated[
        int, typer.Option("--steps", metavar="N", help="Steps of the section in the motion of the saddle.", min=1)
    ] = 1,
    length: Annotated[float, typer.Option(help="Of each half, in sizes of the states.")] = 20.0,
    spacing: Annotated[float, typer.Option(help="Between neighbours on a curve, in the same.")] = 0.05,
    homoclinic: Annotated[
        str | None,
        typer.Option(
            "--homoclinic", metavar="NAME=FROM:TO", help="Instead: where an equilibrium has a motion to itself."
        ),
    ] = None,
    files: f.StillFiles,
) -> None:
    """Stable and unstable manifolds of a saddle: an equilibrium, or, with a section, a periodic motion, or of a map.

    Example: stickslip manifolds henon --start x=0.63 --start y=0.19 --length 3 --spacing 0.01 --figure manifolds.png
    """
    from fmu_models.analyses.homoclinic import homoclinic as locate
    from fmu_models.analyses.manifolds import manifolds as grow

    files.check()
    if homoclinic is not None:
        _no_section(section)
        name, low, high = one_range(homoclinic)
        fmu, values = section.oscillator()
        found = locate(fmu, name, (low, high), start=section.starts(), parameters=values)
        files.tell(found, found.record())
        return
    if _is_seen_at_a_section(section):
        grown = grow(section.system(), section.starts(), period=steps, length=length, spacing=spacing)
    else:
        fmu, values = section.oscillator()
        grown = grow(fmu, section.starts(), parameters=values, length=length, spacing=spacing)
    files.tell(grown, grown.record())


def _is_seen_at_a_section(section: f.Section) -> bool:
    named = section.forcing or section.period or section.level or section.impacts
    return bool(named) or section.model in MAPS.members()


def _no_section(section: f.Section) -> None:
    if _is_seen_at_a_section(section):
        raise StickslipError("A homoclinic point is that of an equilibrium of an oscillator: leave the section out.")
