"""Command that follows an equilibrium."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.branch import SWITCHES, branch_content, checked_switch, curve_content, one_range, range_of
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
    from fmu_models.analyses.continuation.curve import Curves
    from fmu_models.analyses.continuation.equilibria import equilibria as follow

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
    told = _content(found)
    if second:
        told["curves"] = [curve_content(one) for one in curves]
    files.tell(Curves(curves) if curves else found, told)
    if found.interrupted or any(kind == "interrupted" for one in curves for kind, _ in one.ends):
        raise typer.Exit(130)


def _content(found: Any) -> dict[str, Any]:
    rows = zip(found.values.tolist(), found.points.tolist(), found.eigenvalues, found.stable.tolist(), strict=True)
    content = {
        "model": found.model,
        "over": found.over,
        "states": list(found.states),
        "ends": [{"kind": kind, "why": why} for kind, why in found.ends],
        "points": [
            {"value": value, "state": state, "eigenvalues": pairs(eigenvalues), "stable": stable}
            for value, state, eigenvalues, stable in rows
        ],
        "special": [_special(one) for one in found.special],
        "cycles": [_cycles(one) for one in found.cycles],
    }
    if found.intervals is not None:
        content["intervals"] = found.intervals.tolist()
    return content


def _cycles(one: Any) -> dict[str, Any]:
    ends = [
        {"value": one.values[i], "period": one.periods[i], "multipliers": pairs(one.multipliers[i])} for i in (0, -1)
    ]
    return {**branch_content(one), "first": ends[0], "last": ends[1]}


def _special(special: Any) -> dict[str, Any]:
    after = special.eigenvalues_after
    return {
        "kind": special.kind,
        "criticality": special.criticality,
        "normal_form": console.finite(special.normal_form),
        "value": special.value,
        "state": dict(special.state),
        "eigenvalues": pairs(special.eigenvalues),
        "eigenvalues_after": None if after is None else pairs(after),
        "frequency": console.finite(special.frequency),
        "contact": special.contact,
        "turns": special.turns,
        "crossings": {
            name: [{"q": q, "eigenvalues": pairs(special.path([q])[0])} for q in shares]
            for name, shares in special.crossings.items()
        },
    }


def pairs(eigenvalues: Any) -> list[list[float | None]]:
    """Real and imaginary parts; what comes back at once has no real part."""
    return [[console.finite(one.real), one.imag] for one in eigenvalues.tolist()]
