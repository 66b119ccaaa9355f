"""Command that says what brings an oscillator to rest."""

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands.bundles import bundled
from identification.commands.calibrations import columns_of
from identification.commands.logs import ReaderOption
from identification.commands.recipes import ResultFiles


@bundled
def decay(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="A time and an angle, until it rests.")],
    pendulum: Annotated[bool, typer.Option("--pendulum", help="Gravity brings it back (default: a spring).")] = False,
    columns: Annotated[
        list[str] | None, typer.Option("--column", metavar="ROLE=COLUMN", help="Column of time or angle; repeat.")
    ] = None,
    units: Annotated[
        list[str] | None, typer.Option("--unit", metavar="angle=UNIT", help="Where files state none: angle=deg.")
    ] = None,
    reader: ReaderOption = None,
    *,
    files: ResultFiles,
) -> None:
    """Find natural frequency, dry, viscous and quadratic friction over inertia from free decays of any oscillator.

    No effort is measured. A start that is driven is cut, several decays in a file are parted, and the stick at the end
    counts. Everything is in parts of the inertia, which a decay does not tell.

    Example: stickslip decay swing.csv --pendulum --unit angle=deg --figure swing.png
    """
    files.check()
    with console.warnings_said(), console.output_of_libraries(), console.progress("fitting") as advance:
        from identification.hysteresis.decay import fit_decays
        from identification.report.calibration_summary import calibration_report

        fit = fit_decays(
            list(logs),
            pendulum=pendulum,
            columns=columns_of(columns),
            units=dict(console.pairs(units, "--unit", "ROLE=UNIT, such as angle=deg")),
            reader=reader,
            progress=advance,
        )
        if files.figure:
            fit.figure(files.figure, overwrite=files.overwrite)
    files.say(fit.to_dict(), lambda: calibration_report(fit))
