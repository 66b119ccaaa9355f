"""Command that says which law with memory loops of force over displacement ask for."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.figures import check_files
from fmu_models.commands.bundles import bundled
from identification.commands.calibrations import columns_of
from identification.commands.logs import ReaderOption
from identification.commands.recipes import ResultFiles


@bundled
def hysteresis(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Force and displacement, with or without time.")],
    laws: Annotated[
        str | None, typer.Option("--laws", metavar="NAME,...", help="Laws to fit, or 'none' for sliders alone.")
    ] = None,
    factors: Annotated[
        str | None,
        typer.Option(metavar="NAME,...", help="What sliders grow with: columns, or A from names like 25mm0x25Hz0x5A."),
    ] = None,
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", metavar="LOG", help="Score this log too; repeat for several.")
    ] = None,
    lag: Annotated[
        float | None, typer.Option(help="s, with which sliders follow a column of --factors (default: fitted).", min=0)
    ] = None,
    still: Annotated[
        bool, typer.Option("--rate-independent", help="Let nothing depend on the speed, though times are there.")
    ] = False,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="ROLE=COLUMN", help="Column of way, force, time or load; repeat."),
    ] = None,
    units: Annotated[
        list[str] | None,
        typer.Option("--unit", metavar="ROLE=UNIT", help="Where the file states none: way=mm; repeat."),
    ] = None,
    fmu: Annotated[
        Path | None, typer.Option("--fmu", metavar="FILE.fmu", help="Write the best law as an FMU: way in, force out.")
    ] = None,
    reader: ReaderOption = None,
    *,
    files: ResultFiles,
) -> None:
    """Fit forces with memory to loops of force against displacement: of joints, dampers, tribometers, columns.

    First sliders in parallel, by a convex fit that needs no start values; then laws that start from them, with what
    each leaves of the force, in the logs and in those held out. A column of the load (a normal force) scales the force.

    Example: stickslip hysteresis damper.csv --unit way=mm --unit force=kN --figure damper.png

    Example: stickslip hysteresis run_5mm1A.txt run_10mm1A.txt --held-out run_25mm1A.txt --laws Dahl,BoucWen-1
    """
    files.check()
    check_files(fmu, figures=(), overwrite=files.overwrite)
    with console.warnings_said(), console.progress("fitting") as advance:
        from identification.hysteresis.identify import identify_hysteresis
        from identification.hysteresis.laws import USUAL
        from identification.report.hysteresis_report import hysteresis_figure, hysteresis_report

        chosen: Sequence[str] = USUAL if laws is None else [] if laws == "none" else console.names_of(laws)
        fit = identify_hysteresis(
            list(logs),
            laws=chosen,
            factors=console.names_of(factors),
            held_out=list(held_out or ()),
            rate=False if still else None,
            lag=lag,
            columns=columns_of(columns),
            units=dict(console.pairs(units, "--unit", "ROLE=UNIT, such as way=mm")),
            reader=reader,
            progress=advance,
        )
        files.draw(lambda: hysteresis_figure(fit))
        if fmu is not None:
            from fmu_models.codegen.package import export

            export(fit.model(), fmu, values=fit.best.model_values, overwrite=files.overwrite)

    figures = [path for path in (files.figure, fmu) if path]
    files.say(fit.record(), lambda: hysteresis_report(fit), figures)
