"""All commands of `stickslip`, of every package; what a command needs is imported when it is called."""

from __future__ import annotations

from fmu_models.base import console
from fmu_models.commands import bench as bench_commands
from fmu_models.commands import maps as map_commands
from fmu_models.commands import models as model_commands
from fmu_models.commands import scene as scene_commands
from fmu_models.commands import stress as stress_commands
from identification.commands import apply as apply_commands
from identification.commands import compare as comparison_commands
from identification.commands import fit as friction_commands
from identification.commands import laws as law_commands
from identification.commands import machines as machine_commands
from rig_io.commands import emulate as rig_commands

app = console.app("Non-smooth oscillators as FMUs, friction laws from rig logs, and an emulator of the rig.")
MODELS = (model_commands, scene_commands, bench_commands, stress_commands, map_commands)
FRICTION = (friction_commands, law_commands, comparison_commands, apply_commands, machine_commands)
for part in (*MODELS, rig_commands, *FRICTION):
    app.registered_commands += part.app.registered_commands


def run() -> None:
    """Run it, and end the process."""
    console.run(app)
