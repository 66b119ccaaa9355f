"""Command that simulates several FMUs as one system."""

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.commands.arguments import Isolation, RunFiles
from fmu_models.commands.bundles import bundled

SOLVERS = "auto, dopri5, dop853, stiff, co-simulation"


@console.trusting
@bundled
def couple(
    path: Annotated[
        Path,
        typer.Argument(metavar="SYSTEM", help="A system of FMUs: .toml, .ssd or .ssp, or a name of 'stickslip data'."),
    ],
    until: Annotated[float | None, typer.Option(help="End of the run, s (default: what the system says).")] = None,
    solver: Annotated[str | None, typer.Option(help=f"How to run it: {SOLVERS} (default: what it says).")] = None,
    step: Annotated[float | None, typer.Option(help="Communication step of a co-simulation, s.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Relative tolerance of a step.")] = None,
    inputs: console.Inputs = None,
    samples: Annotated[int | None, typer.Option(help="Number of output times.", min=2)] = None,
    *,
    files: RunFiles,
    isolation: Isolation,
    json: console.Json = False,
) -> None:
    """Simulate several FMUs as one system.

    Where all have Model Exchange they are integrated as one, with common events; otherwise, or by --solver
    co-simulation, they are stepped one by one.

    Example: stickslip couple disc_rig_motors --input motor0.w_set=log.csv:speed --beside rig.theta=log.csv:angle

    Example: stickslip couple data/systems/disc_rig_motors.toml -o rig.csv
    """
    import numpy as np

    from fmu_models.coupling import run
    from fmu_models.coupling.toml_system import read_system
    from fmu_models.importer.motion_error import MotionError
    from fmu_models.report import coupled_summary
    from fmu_models.simulation.beside import times_beside

    files.check()
    logs = files.logs()
    with console.warnings_said():
        system = read_system(path)
    changes = {"stop_time": until, "solver": solver, "step": step, "tolerance": tolerance}
    system = system.changed(**{name: value for name, value in changes.items() if value is not None})
    system = system.with_inputs(console.settings(inputs, "input", columns=True))
    exact = bool(logs) and system.integrates  # the steps of a co-simulation would follow the times of the logs
    times = np.linspace(system.start_time, system.stop_time, samples or 1001) if samples or exact else None
    if exact and times is not None:
        times = times_beside(logs, times)
    with console.output_of_libraries(), console.progress("simulating") as advance:
        try:
            trajectory = run.couple(system, output_times=times, progress=advance, limits=isolation.limits())
        except MotionError as error:
            if error.so_far is None or not files.output:
                raise
            files.write(run.recorded(system, error.so_far), [], system.fmus, system.name)
            raise StickslipError(f"{error} What ran until then is in '{files.output}'.") from error
    recording = run.recorded(system, trajectory)
    written = files.write(recording, logs, system.fmus, system.name)
    content = coupled_summary.summary(system, recording) | written
    console.say(json, content, lambda out: coupled_summary.print_summary(content, out))
    if logs and content["beside"]["within"] is False:
        raise typer.Exit(1)
