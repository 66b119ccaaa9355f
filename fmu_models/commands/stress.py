"""The command that puts models under stress."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import check_files

if TYPE_CHECKING:
    from fmu_models.validation.stress.judge import StressCell

SEED = 0


def stress(
    models: Annotated[
        list[str] | None, typer.Argument(metavar="[MODEL]...", help="Names of models. [default: all]")
    ] = None,
    case: Annotated[
        str | None, typer.Option(metavar="PATTERN", help="Only cases whose name matches, for example 'ks=*'.")
    ] = None,
    until: Annotated[
        float | None, typer.Option(help="Length of each run, s. [default: ten characteristic periods]")
    ] = None,
    random: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="N random cases instead, each against a second, independent path."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help=f"What random cases are drawn from. [default: {SEED}]")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A small choice of the cases, in some seconds.")] = False,
    every: Annotated[bool, typer.Option("--every", help="Name accurate cells too.")] = False,
    processes: Annotated[int | None, typer.Option(min=1, help="Child processes. [default: one per core]")] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw a heat map (png, svg, pdf).")] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Run models at the extremes of their parameters, starts and times, and judge every run.

    A cell is accurate, degraded (with its error), refused with a reason, or failed; any that failed makes the exit code
    1. The cases come from the declaration: stiffness up to 1e12, steep friction, no and huge damping, gaps of zero and
    less, every restitution, starts on boundaries, long and late runs, other units.

    With --random parameters, starts and drives are drawn instead, and each run is held against the declaration and
    against the importer's own integration of the same FMU. A wrong one comes with the command that repeats it.

    Example: stickslip stress discontinuous_support --case 'ks=*' --figure heat.png

    Example: stickslip stress --random 500 --seed 1
    """
    from fmu_models.validation.stress import report
    from fmu_models.validation.stress.workers import drawn_cases, judged, judges, listed_cases

    check_files(figures=[figure], overwrite=overwrite)
    if until is not None and not 0 < until < float("inf"):
        raise StickslipError(f"A run lasts a positive time, found --until {until:g}.")
    if random is None and seed is not None:
        raise StickslipError("A seed is what random cases are drawn from. Say how many: --random 500")
    if random is not None and (case is not None or quick):
        raise StickslipError("--case and --quick choose from the cases that are listed; leave them out with --random.")
    cells: list[StressCell] = []
    interrupted = False
    # the children import what they need while the cases are made here
    with judges(processes) as pool, console.progress("stressing") as advance:
        if random is None:
            chosen = listed_cases(models or [], case, until, quick)
        else:
            chosen = drawn_cases(models or [], random, SEED if seed is None else seed, until)
        try:
            for cell in judged(chosen, advance, pool):
                cells.append(cell)
        except KeyboardInterrupt:
            interrupted = True
    order = {(case.model, case.name): i for i, case in enumerate(chosen)}
    cells.sort(key=lambda cell: order[cell.case.model, cell.case.name])
    console.say(
        json, report.content(cells, len(chosen)), lambda out: report.print_report(cells, len(chosen), out, every=every)
    )
    if figure and cells:
        report.draw(cells, figure, overwrite=overwrite)
    if interrupted:
        raise typer.Abort
    if any(cell.verdict == "failed" for cell in cells):
        raise typer.Exit(1)
