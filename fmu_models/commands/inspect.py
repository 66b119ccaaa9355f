"""Command that tells what an FMU is."""

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console


def inspect(
    path: Annotated[Path, typer.Argument(metavar="FILE.fmu", help="An FMU of anybody.")], json: console.Json = False
) -> None:
    """Tell what an FMU is, without loading its library: interfaces, platforms, variables, departures from the standard.

    Example: stickslip inspect pump.fmu
    """
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.report.fmu_sheet import print_sheet, sheet

    content = sheet(Fmu.open(path))
    console.say(json, content, lambda out: print_sheet(content, out))
