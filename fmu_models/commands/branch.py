"""Command that follows a branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.commands import families as f
from fmu_models.commands.bundles import bundled

SWITCHES = ("none", "all")


@console.trusting
@bundled
def branch(
    *,
    over: Annotated[
        list[str] | None,
        typer.Option("--over", metavar="NAME=FROM:TO", help="Parameter and its range (default: those of a scene)."),
    ] = None,
    section: f.Strobe,
    settle: Annotated[bool, typer.Option("--settle", help="Run to a motion from the start first.")] = False,
    begin: Annotated[
        Path | None, typer.Option("--from", metavar="ORBIT.json", help="Start values by name, instead of --start.")
    ] = None,
    switch: Annotated[str, typer.Option(help="Branches that leave the first one to follow too: none, all.")] = "none",
    longest: Annotated[int, typer.Option(help="With --switch all: period, in those of the forcing.", min=1)] = 8,
    curve: Annotated[
        str | None,
        typer.Option("--curve", metavar="NAME=FROM:TO", help="Each special point as a curve in this parameter too."),
    ] = None,
    closed_form: Annotated[
        str | None,
        typer.Option(metavar="FORMULA", help="With --curve: NAME as it is known of one, by the first parameter."),
    ] = None,
    points: Annotated[int, typer.Option(help="Motions in each direction, at most.", min=2)] = 2000,
    of: Annotated[str | None, typer.Option(help="State that is drawn.", show_default="the first")] = None,
    files: f.StillStored,
) -> None:
    """Follow a periodic motion over a parameter, stable or not, through every bifurcation.

    Example: stickslip branch discontinuous_support --forcing omega --set omega=0.8 --over omega=0.8:1.4 --figure b.png
    """
    from fmu_models.base.formula import Formula
    from fmu_models.continuation.branches import all_branches
    from fmu_models.continuation.curves.curve import closed_form_of

    files.check()
    checked_switch(switch)
    name, low, high = range_of(section, "branch", over)
    second = one_range(curve) if curve else None
    if closed_form and second is None:
        raise StickslipError("--closed-form is laid over curves: say which, by --curve NAME=FROM:TO.")
    formula = Formula.read(closed_form) if closed_form else None
    system = section.system()
    start = {**section.starts(), **(_orbit(begin) if begin else {})}
    with console.progress("following") as advance:
        found = all_branches(
            system,
            name,
            (low, high),
            start=start,
            settle=settle,
            points=points,
            switch=switch == "all",
            longest=longest,
            of=of,
            execution=files.execution(),
            progress=advance,
        )
        whole = found.curves(second[0], second[1:]) if second and not found.interrupted else None
    curves = whole.curves if whole else ()
    told = found.record()
    form = closed_form_of(curves[0], formula, {}) if formula and curves else None
    if second:
        told["curves"] = [
            {**one.record(), "from_closed_form": None if form is None else console.finite(form.error(one))}
            for one in curves
        ]
    told["not_followed"] = list(whole.failures) if whole else []
    files.tell(replace(whole, closed_form=form) if whole else found, told)
    if found.interrupted or any(kind == "interrupted" for one in curves for kind, _ in one.ends):
        raise typer.Exit(130)


def checked_switch(switch: str) -> None:
    """Raises StickslipError: none of ``SWITCHES``."""
    if switch not in SWITCHES:
        raise StickslipError(f"--switch takes {' or '.join(SWITCHES)}, found '{switch}'.")


def range_of(section: f.Section, kind: str, over: Sequence[str] | None) -> tuple[str, float, float]:
    """Name, least and largest value of the parameter; those of a scene of this kind where none are given."""
    if not over:
        axes = section.axes(kind, ())
        ((name, values),) = axes.items()
        return name, float(values.min()), float(values.max())
    if len(over) > 1:
        raise StickslipError(f"A branch is followed over one parameter, found {len(over)} ranges.")
    return one_range(over[0])


def one_range(given: str) -> tuple[str, float, float]:
    """Name, least and largest value of NAME=FROM:TO.

    Raises:
        StickslipError: not of that form.
    """
    name, _, values = given.partition("=")
    try:
        low, high = (float(one) for one in values.split(":"))
    except ValueError:
        raise StickslipError(f"A range is given as NAME=FROM:TO, as omega=0.8:1.4; found '{given}'.") from None
    return name.strip(), low, high


def _orbit(path: Path) -> dict[str, float]:
    """Start values from a file."""
    import json

    try:
        read = json.loads(path.read_text("utf-8"))
        given: Any = read.get("start", read) if isinstance(read, dict) else None
        return {str(name): float(value) for name, value in given.items()}
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise StickslipError(
            f"'{path}' holds no start values: {error}. Write one JSON object with a number per state."
        ) from error
