"""Command that simulates a model, a scene or the FMU of anybody."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.shipped import is_scene
from fmu_models.commands.arguments import NAMED, Isolation, RunFiles, scene_of
from fmu_models.commands.bundles import bundled

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.importer.experiment import FmuExperiment
    from fmu_models.simulation.beside import Beside

MANY = 20_000  # variables from which checking a description takes seconds
UNTIL = 20.0  # s, end of a run of our own models unless told otherwise
SAMPLES = 2001  # output times of a run unless told otherwise: a smooth curve on paper
METHODS = "auto, dopri5, dop853, stiff, co-simulation, scheduled"
OWN = "Default: the FMU's own engine if stickslip exported it, otherwise auto."


@console.trusting
@bundled
def simulate(
    model: Annotated[
        str, typer.Argument(metavar="MODEL", help=f"The .fmu file of anybody, a scene (.toml), or a model: {NAMED}.")
    ],
    until: Annotated[
        float | None,
        typer.Option(
            help=f"End of the run, s (default: {UNTIL:g}, or what the scene or the FMU of somebody else says, or where "
            "the log of an input ends before)."
        ),
    ] = None,
    settings: console.Settings = None,
    start: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Start value of a state.")] = None,
    inputs: console.Inputs = None,
    contacts: console.Contacts = None,
    samples: Annotated[
        int | None,
        typer.Option(
            help=f"Number of output times (default: {SAMPLES}; of a co-simulation its communication points).", min=2
        ),
    ] = None,
    method: Annotated[str | None, typer.Option(help=f"How to integrate: {METHODS}. {OWN}")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Relative tolerance (default: of the method).")] = None,
    step: Annotated[float | None, typer.Option(help="Communication step, s: asks for a co-simulation.")] = None,
    on_zeno: Annotated[
        str,
        typer.Option(
            metavar="stop|hold|continue", help="What to do where events of somebody else's FMU accumulate without end."
        ),
    ] = "stop",
    max_step: Annotated[
        float | None,
        typer.Option(
            help="Longest step, s, of a method of integration (default: that of the FMU's own experiment; inf: none)."
        ),
    ] = None,
    second_run: Annotated[
        bool,
        typer.Option("--second-run", help="Run again with other steps; exit with 1 if variables or events differ."),
    ] = False,
    *,
    files: RunFiles,
    error: Annotated[
        bool, typer.Option("--error", help="Check the defect, run again four times otherwise, and estimate the error.")
    ] = False,
    isolation: Isolation,
    json: console.Json = False,
) -> None:
    """Simulate a model, or the FMU of anybody, and tell what happened.

    A method of integration sees an FMU at the nodes of its steps only, and a pulse between them is missed. --max-step
    bounds the steps, --second-run looks again elsewhere.

    With --isolate an FMU that crashes, hangs or eats memory is a failed run and nothing else. A limit of inf is none.

    Example: stickslip simulate disc_rig --contacts disc0 --input w0=0.41 --until 25 --figure portrait.png

    Example: stickslip simulate woodpecker --until 0.5 --figure run.png --plot y,phi_M,phi_S --plot phi_S:w_S

    Example: stickslip simulate disc_rig --contacts disc0 --input w0=log.csv:speed --beside log.csv --within 0.05

    Example: stickslip simulate pump.fmu --set k=3 --isolate --time-limit 60 -o run.h5
    """
    from fmu_models.importer.experiment import perform, perform_with_error
    from fmu_models.report import run_summary

    files.check()
    if error and second_run:
        raise StickslipError("--error and --second-run are two answers to how far a run can be trusted; choose one.")
    limits = isolation.limits()
    logs = files.logs()
    changed = {"parameters": (settings, "parameter"), "start": (start, "start value"), "inputs": (inputs, "input")}
    fmu, options = _to_run(model, contacts, until, changed)
    experiment = _experiment(
        fmu,
        options.pop("stop_time"),
        until is None,
        samples,
        logs,
        **options,
        **{"tolerance": tolerance, "method": method, "step": step, "on_zeno": on_zeno, "max_step": max_step},
        sides=files.figure is not None,
    )
    estimate = second = None
    with console.output_of_libraries(), console.progress("simulating") as advance:
        if error:
            recording, estimate = perform_with_error(fmu, experiment, limits=limits, progress=advance)
        elif second_run:
            from fmu_models.importer.second_run import perform_twice

            recording, second = perform_twice(fmu, experiment, limits=limits, progress=advance)
        else:
            recording = perform(fmu, experiment, limits=limits, progress=advance)
    written = files.write(recording, logs, fmu)
    content = run_summary.summary(fmu, recording, estimate, second) | written
    for name, time in content["not_finite"].items():
        console.warn(f"'{name}' is not a finite number from t = {time:.9g} s on, or now and then.")
    console.say(json, content, lambda out: run_summary.print_summary(content, out))
    if (second and not second.agrees) or (logs and content["beside"]["within"] is False):
        raise typer.Exit(1)


def _to_run(
    model: str, contacts: str | None, until: float | None, changed: dict[str, tuple[list[str] | None, str]]
) -> tuple[Fmu, dict[str, Any]]:
    """The FMU of a model, file or scene, and what is asked of the run."""
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.importer.texts import is_text

    if is_scene(model):
        from fmu_models.scene.compute import arguments
        from fmu_models.scene.reduce import built_scene

        numbers: dict[str, Any] = {n: console.settings(*texts, columns=n == "inputs") for n, texts in changed.items()}
        scene = scene_of(model, contacts)
        return Fmu.open(built_scene(scene)), arguments(scene, until, **numbers)
    fmu = _opened(model, contacts)
    text = partial(is_text, fmu)
    values = {name: console.settings(*texts, text, columns=name == "inputs") for name, texts in changed.items()}
    return fmu, {"stop_time": until, **values}


def _opened(model: str, contacts: str | None) -> Fmu:
    """The FMU of a model, or of anybody; then with a word on where it departs from the standard."""
    from fmu_models.fmu.load import load

    fmu = load(model, contacts=console.chosen(contacts))
    if Path(model).suffix.lower() == ".fmu" and len(fmu.variables) < MANY and fmu.problems:
        console.warn(
            f"'{fmu.path.name}' departs from the standard ({len(fmu.problems)} problems); "
            f"stickslip inspect {fmu.path} lists them."
        )
    return fmu


def _experiment(
    fmu: Fmu, until: float | None, cut: bool, samples: int | None, logs: Sequence[Beside], **options: Any
) -> FmuExperiment:
    """From the start to the end that were asked for, or that the FMU of somebody else suggests; ``cut`` where a log of
    an input ends before."""
    import numpy as np

    from fmu_models.importer.experiment import FmuExperiment
    from fmu_models.importer.texts import is_text
    from fmu_models.simulation.beside import times_beside
    from fmu_models.simulation.measured import column_of_log, read_measured

    start, end = (0.0, UNTIL) if fmu.ours else fmu.suggested_times()
    end = end if until is None else until
    if cut:
        texts = [text for name, text in options["inputs"].items() if isinstance(text, str) and not is_text(fmu, name)]
        end = min([end, *(float(read_measured(column_of_log(text)[0]).time[-1]) for text in texts)])
    experiment = FmuExperiment(end, start, **options)
    if not experiment.stop_time > start or (samples is None and experiment.is_co_simulation(fmu)):
        return experiment
    times = np.linspace(start, experiment.stop_time, samples or SAMPLES)
    if not experiment.is_co_simulation(fmu):  # whose steps would follow them
        times = times_beside(logs, times)
    return replace(experiment, output_times=times)
