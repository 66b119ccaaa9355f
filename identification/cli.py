"""The command `stickslip`: the commands of every package, which is imported when one of its commands is called."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.version import version
from fmu_models.commands import bench as bench_commands
from fmu_models.commands import data as data_commands
from fmu_models.commands import maps as map_commands
from fmu_models.commands import models as model_commands
from fmu_models.commands import scene as scene_commands
from fmu_models.commands import stress as stress_commands
from identification.commands import apply as handover_commands
from identification.commands import compare as comparison_commands
from identification.commands import fit as friction_commands
from identification.commands import laws as structure_commands
from identification.commands import machines as machine_commands
from rig_io.commands import emulate as rig_commands

HELP = "Non-smooth oscillators as FMUs, friction laws from rig logs, and an emulator of the rig."
app = console.app(HELP, completion=True)
MODELS = (model_commands, scene_commands, bench_commands, stress_commands, map_commands)
FRICTION = (friction_commands, structure_commands, comparison_commands, handover_commands, machine_commands)
for part in (*MODELS, rig_commands, *FRICTION):
    app.registered_commands += part.app.registered_commands
app.add_typer(data_commands.app, name="data")


def _say_version(asked: bool) -> None:
    if asked:
        print(f"stickslip {version()}")
        raise typer.Exit


@app.callback(help=HELP)
def options(
    asked: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """What is asked of the suite as a whole."""


def main() -> None:
    """Entry point."""
    console.run(app)
