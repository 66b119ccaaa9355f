"""Command that looks for the motions of a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.record import record
from fmu_models.maps import MAPS

if TYPE_CHECKING:
    from fmu_models.sections.iteration import Iteration
    from fmu_models.sections.periodic import PeriodicMotion


def show_map(
    name: Annotated[
        str, typer.Argument(metavar="MAP", help="A map: its name in 'stickslip maps', or my_map.py, my_map.py:NAME.")
    ],
    settings: console.Settings = None,
    period: Annotated[int, typer.Option(help="Number of points of the motions to look for.", min=1)] = 1,
    negative: Annotated[bool, typer.Option("--negative", help="Take the inverse map.")] = False,
    lyapunov: Annotated[bool, typer.Option("--lyapunov", help="Lyapunov exponents, from --start.")] = False,
    start: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Start value of a state.")] = None,
    vary: Annotated[
        str | None, typer.Option(metavar="NAME=TO", help="Saddle-nodes and flips as this parameter goes there.")
    ] = None,
    json: console.Json = False,
) -> None:
    """Look for the motions of a map: points, eigenvalues, what those mean, jumps across the diagonal.

    Example: stickslip map henon --set a=1.2 --period 2 --lyapunov
    """
    from fmu_models.report.map_sheet import print_map
    from fmu_models.sections.iteration import Iteration, find_iterate_crossings
    from fmu_models.sections.periodic import find_periodic

    if start and not lyapunov:
        raise StickslipError("A start value is where --lyapunov begins; motions are sought everywhere. Add --lyapunov.")
    declared = MAPS.load(name)
    values = console.assignments(settings, "parameter")
    iteration = Iteration.of(declared, values, backward=negative)
    rule = (declared.inverse if negative else declared.rule) or {}
    content: dict[str, Any] = {
        "map": declared.name,
        "title": declared.title,
        "source": declared.source,
        "negative": negative,
        "rule": {state.name: str(rule[state]) for state in declared.states},
        "parameters": dict(iteration.values),
        "box": {state.name: list(declared.box[state]) for state in declared.states},
        "period": period,
        "motions": [_motion(iteration, motion) for motion in find_periodic(iteration, period)],
    }
    if len(iteration.states) == 1 and not declared.modulus:
        content["jumps"] = [
            {"x": jump.x, "left": jump.left, "right": jump.right, "crosses_diagonal": jump.crosses_diagonal}
            for jump in find_iterate_crossings(iteration, period).jumps
        ]
    if vary:
        content["bifurcations"] = _bifurcations(iteration, vary, period)
    if lyapunov:
        content["lyapunov"] = _exponents(iteration, console.assignments(start, "start value"))
    console.say(json, content, lambda out: print_map(content, out))


def _motion(iteration: Iteration, motion: PeriodicMotion) -> dict[str, Any]:
    return {
        "points": [dict(zip(iteration.states, point, strict=True)) for point in motion.points.tolist()],
        "eigenvalues": [
            {"real": float(eigenvalue.real), "imag": float(eigenvalue.imag)}
            for eigenvalue in motion.stability.eigenvalues
        ],
        "classes": list(motion.stability.classes),
        "stable": motion.stability.stable,
        "hyperbolic": motion.stability.hyperbolic,
    }


def _bifurcations(iteration: Iteration, vary: str, period: int) -> list[dict[str, Any]]:
    from fmu_models.analyses.bifurcation import find_bifurcations
    from fmu_models.sections.periodic import find_periodic

    ((parameter, end),) = console.assignments([vary], "parameter").items()
    ends, cycles = (iteration.values.get(parameter, 0.0), end), [one.points for one in find_periodic(iteration, period)]
    bifurcations = find_bifurcations(iteration, parameter, ends, cycles)
    if not cycles:
        raise StickslipError(
            f"{iteration.name} has no motion of period {period} at {parameter} = {ends[0]:g} that could be followed. "
            "Begin where it exists: 'stickslip map' shows what a map has."
        )
    return [
        {"parameter": parameter, "value": value, "kind": kind} | _motion(iteration, motion)
        for value, kind, motion in bifurcations
    ]


def _exponents(iteration: Iteration, start: dict[str, float]) -> dict[str, Any]:
    from fmu_models.analyses.lyapunov import lyapunov

    with console.progress("exponents") as advance:
        exponents = lyapunov(iteration, start, periods=1_000_000, motions=256, progress=advance)
    return {
        # JSON has no infinity: null where every difference is lost in one step
        "exponents": record(exponents.values),
        "standard_errors": exponents.errors.tolist(),
        "steps": exponents.steps,
    }
