"""Command that tells what an FMU or a system of FMUs is."""

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console


def inspect(
    path: Annotated[
        Path, typer.Argument(metavar="FILE", help="An FMU of anybody (.fmu), or a system of them (.ssp, .ssd).")
    ],
    json: console.Json = False,
) -> None:
    """Tell what an FMU is, without loading its library: interfaces, platforms, variables, departures from the standard;
    of a system its units, connectors, connections and values.

    Example: stickslip inspect pump.fmu
    """
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.report import fmu_sheet, system_sheet

    if path.suffix.lower() in (".ssp", ".ssd"):
        from fmu_models.coupling.toml_system import read_system

        with console.warnings_said():
            content, show = system_sheet.sheet(read_system(path)), system_sheet.print_sheet
    else:
        content, show = fmu_sheet.sheet(Fmu.open(path)), fmu_sheet.print_sheet
    console.say(json, content, lambda out: show(content, out))
