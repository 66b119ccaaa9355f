"""Command that follows an equilibrium."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.record import record
from fmu_models.commands import families as f
from fmu_models.commands.branch import SWITCHES, checked_switch, one_range, range_of
from fmu_models.commands.bundles import Without, bundled

Point = Annotated[f.Section, Without("forcing", "period", "every", "autonomous", "level", "down", "impacts", "stepper")]


@console.trusting
@bundled
def equilibria(
    *,
    over: Annotated[
        list[str] | None,
        typer.Option("--over", metavar="NAME=FROM:TO", help="Parameter and its range (default: those of a scene)."),
    ] = None,
    section: Point,
    switch: Annotated[str, typer.Option(help="Cycles that leave it to follow too: none, all.")] = "none",
    curve: Annotated[
        str | None,
        typer.Option("--curve", metavar="NAME=FROM:TO", help="Folds, Hopf points as curves in this parameter too."),
    ] = None,
    points: Annotated[int, typer.Option(help="Equilibria, or cycles, in each direction, at most.", min=2)] = 2000,
    of: Annotated[
        str | None, typer.Option(help="State that is drawn, or eigenvalues.", show_default="the first state")
    ] = None,
    files: f.StillFiles,
) -> None:
    """Follow an equilibrium over a parameter, with its eigenvalues: folds, Hopf points, switching surfaces.

    Example: stickslip equilibria planar_hopf --over mu=-1:1 --start x1=-1.5 --start x2=0 --switch all --figure e.png
    """
    from fmu_models.continuation.curves.curve import Curves
    from fmu_models.continuation.equilibria import equilibria as follow

    files.check()
    checked_switch(switch)
    second = one_range(curve) if curve else None
    name, low, high = range_of(section, "equilibria", over)
    fmu, values = section.oscillator()
    of = section.options("equilibria", of=of).get("of")
    with console.progress("following") as advance:
        found = follow(
            fmu, name, (low, high), start=section.starts(), parameters=values, of=of, points=points, progress=advance
        )
        if switch == SWITCHES[-1] and not found.interrupted:
            found = found.with_cycles(points)
        curves = found.curves(second[0], second[1:]) if second and not found.interrupted else ()
    told = {**found.record(), "cycles": [_cycles(branch) for branch in found.cycles]}
    if second:
        told["curves"] = [one.record() for one in curves]
    files.tell(Curves(curves) if curves else found, told)
    if found.interrupted or any(kind == "interrupted" for one in curves for kind, _ in one.ends):
        raise typer.Exit(130)


def _cycles(branch: Any) -> dict[str, Any]:
    """A branch of cycles with its first and last one."""
    ends = [
        {"value": branch.values[i], "period": branch.periods[i], "multipliers": branch.multipliers[i]} for i in (0, -1)
    ]
    return record({**branch.record(), "first": ends[0], "last": ends[1]})
