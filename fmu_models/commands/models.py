"""Commands about models: what there is, what it is made of, export, simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Contacts, Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import refuse_existing

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.fmu.fmu import Fmu
    from fmu_models.fmu.isolation import Limits
    from fmu_models.importer.experiment import Experiment
    from fmu_models.scene.scene import Scene

app = console.app("Models: list, show, export, simulate.")

MANY = 20_000  # variables from which checking a description takes seconds
SAMPLES = 2001  # output times of a run unless told otherwise: a smooth curve on paper
METHODS = "auto, dopri5, dop853, stiff, co-simulation"
SOLVERS = "auto, dopri5, dop853, stiff, jacobi, gauss-seidel"
OWN = "Default: the FMU's own engine if stickslip exported it, otherwise auto."
Model = Annotated[str, typer.Argument(metavar="MODEL", help="Name of a model, as 'stickslip models' lists them.")]
ModelOrScene = Annotated[str, typer.Argument(metavar="MODEL", help="Name of a model, or a scene (.toml).")]


@app.command()
def models(json: Json = False) -> None:
    """List the models, by paper.

    Example: stickslip models
    """
    from fmu_models import oscillators

    rows = [
        {
            "name": name,
            "title": model.title,
            "contacts": [contact.name for contact in model.contacts],
            "source": model.source,
        }
        for name in oscillators.names()
        for model in [oscillators.load(name)]
    ]

    def show(out: Console) -> None:
        papers = {row["name"]: row["source"].partition(", equation")[0] for row in rows}
        for paper in dict.fromkeys(papers.values()):
            made = console.table("model", "what it is", "contacts", title=paper)
            for row in rows:
                if papers[row["name"]] == paper:
                    made.add_row(row["name"], row["title"], ", ".join(row["contacts"]))
            out.print(made)
        out.print("Look at one:  stickslip show MODEL")

    console.say(json, {"models": rows}, show)


@app.command()
def show(model: Model, contacts: Contacts = None, json: Json = False) -> None:
    """Show a model: equations, parameters with units, contacts, outputs, source.

    Example: stickslip show disc_rig --contacts disc0
    """
    from fmu_models.codegen.package import variant
    from fmu_models.report.model_sheet import print_sheet, sheet

    mechanism = variant(model, console.chosen(contacts))
    content = sheet(mechanism)
    console.say(json, content, lambda out: print_sheet(content, out))


@app.command()
def export(
    model: ModelOrScene,
    path: Annotated[Path | None, typer.Option("--output", "-o", help="File to write (default: MODEL.fmu).")] = None,
    fmi: Annotated[str, typer.Option(help="FMI version: 2.0 or 3.0.")] = "3.0",
    contacts: Contacts = None,
    settings: Settings = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Export a model, or what a scene uses of it, as an FMU with Model Exchange, Co-Simulation and sources.

    Parameters that are set become the start values of the FMU.

    Example: stickslip export disc_rig --contacts disc0 --fmi 2.0 -o rig.fmu
    """
    from fmu_models.codegen.package import export
    from fmu_models.fmu.fmu import Fmu

    values = console.assignments(settings, "parameter")
    if is_scene(model):
        scene = _scene(model, contacts)
        path = path or Path(f"{scene.name}.fmu")
        _export_scene(scene, path, values, fmi, overwrite)
    else:
        path = path or Path("_".join([model, *(console.chosen(contacts) or [])]) + ".fmu")
        kept = console.chosen(contacts)
        export(model, path, contacts=kept, values=values, fmi_version=fmi, overwrite=overwrite)
    fmu = Fmu.open(path)
    content = {
        "file": str(path),
        "fmi_version": fmi,
        "kinds": ["Model Exchange", "Co-Simulation"],
        "bytes": path.stat().st_size,
        "states": fmu.states,
        "inputs": fmu.inputs,
        "outputs": fmu.outputs,
        "parameters": fmu.parameters,
        "contacts": fmu.contacts,
    }

    def show(out: Console) -> None:
        out.print(f"[bold]{path}[/bold]: FMI {fmi}, Model Exchange and Co-Simulation, {content['bytes'] / 1000:.0f} kB")
        for what in ("states", "inputs", "outputs", "contacts", "parameters"):
            out.print(f"  {what:10s} {', '.join(content[what]) or 'none'}")

    console.say(json, content, show)


@app.command()
def simulate(
    model: Annotated[
        str, typer.Argument(metavar="MODEL", help="Name of a model, a scene (.toml), or the .fmu file of anybody.")
    ],
    until: Annotated[
        float | None,
        typer.Option(help="End of the run, s (default: 20, or what the scene or the FMU of somebody else says)."),
    ] = None,
    settings: Settings = None,
    start: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Start value of a state.")] = None,
    inputs: Annotated[list[str] | None, typer.Option("--input", metavar="NAME=VALUE", help="Constant input.")] = None,
    contacts: Contacts = None,
    samples: Annotated[
        int | None,
        typer.Option(
            help="Number of output times (default: 2001; of a co-simulation its communication points).", min=2
        ),
    ] = None,
    method: Annotated[str | None, typer.Option(help=f"How to integrate: {METHODS}. {OWN}")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Relative tolerance (default: of the method).")] = None,
    step: Annotated[float | None, typer.Option(help="Communication step, s: asks for a co-simulation.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write the trajectory as .csv, or with its origin as .h5.")
    ] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw phase portrait and time series (png, svg, pdf).")] = None,
    error: Annotated[
        bool, typer.Option("--error", help="Run again four times otherwise, and estimate the error.")
    ] = False,
    isolate: Annotated[bool, typer.Option("--isolate", help="Run in a process of its own.")] = False,
    time_limit: Annotated[
        float | None, typer.Option(help="With --isolate: wall time after which the run is stopped, s (default: 600).")
    ] = None,
    memory_limit: Annotated[
        float | None, typer.Option(help="With --isolate: memory that the run may use, MB (Linux; default: 4096).")
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Simulate a model, or the FMU of anybody, and tell what happened.

    With --isolate an FMU that crashes, hangs or eats memory is a failed run and nothing else. A limit of inf is none.

    Example: stickslip simulate disc_rig --contacts disc0 --input w0=0.41 --until 25 --figure portrait.png

    Example: stickslip simulate pump.fmu --set k=3 --isolate --time-limit 60 -o run.h5
    """
    from fmu_models.importer.experiment import perform, perform_with_error
    from fmu_models.report import run_summary
    from fmu_models.simulation.results import check_suffix

    refuse_existing(output, figure, overwrite=overwrite)
    check_suffix(output)
    if figure:
        from fmu_models.report.figures import check_format

        check_format(figure)
    limits = _limits(isolate, time_limit, memory_limit)
    changed = {
        "parameters": console.assignments(settings, "parameter"),
        "start": console.assignments(start, "start value"),
        "inputs": console.assignments(inputs, "input"),
    }
    fmu, given = _to_run(model, contacts, until, changed)
    experiment = _experiment(
        fmu, given.pop("stop_time"), samples, **given, tolerance=tolerance, method=method, step=step
    )
    estimate = None
    with console.output_of_libraries(), console.progress("simulating") as advance:
        if error:
            recording, estimate = perform_with_error(fmu, experiment, limits=limits, progress=advance)
        else:
            recording = perform(fmu, experiment, limits=limits, progress=advance)
    if output:
        recording.write(output, overwrite=overwrite)
    if figure:
        from fmu_models.report.trajectory_figure import draw

        draw(recording.trajectory, fmu, figure, overwrite=overwrite)
    content = run_summary.summary(fmu, recording, estimate)
    for name, time in content["not_finite"].items():
        console.warn(f"'{name}' is not a finite number from t = {time:.9g} s on, or now and then.")
    content["files"] = [str(path) for path in (output, figure) if path]
    console.say(json, content, lambda out: run_summary.print_summary(content, out))


def is_scene(model: str) -> bool:
    """Whether what stands for a model is the path of a scene."""
    return model.endswith(".toml")


def _scene(path: str, contacts: str | None) -> Scene:
    from fmu_models.scene.read import read_scene

    if contacts is not None:
        raise StickslipError("A scene says itself which contacts are in use: change 'contacts' there.")
    return read_scene(path)


def _to_run(
    model: str, contacts: str | None, until: float | None, changed: dict[str, dict[str, float]]
) -> tuple[Fmu, dict[str, Any]]:
    """The FMU of a model, file or scene, and what is asked of the run."""
    from fmu_models.fmu.fmu import Fmu

    if is_scene(model):
        from fmu_models.scene.compute import arguments
        from fmu_models.scene.reduce import built_scene

        scene = _scene(model, contacts)
        return Fmu.open(built_scene(scene)), arguments(scene, until, **changed)
    return _opened(model, contacts), {"stop_time": until, **changed}


def _export_scene(scene: Scene, path: Path, values: dict[str, float], fmi: str, overwrite: bool) -> None:
    import dataclasses

    from fmu_models.scene.compute import arguments
    from fmu_models.scene.reduce import export_scene

    free = arguments(scene, parameters=values)["parameters"]
    if unknown := [name for name in free if name not in scene.free]:
        raise StickslipError(
            f"Scene '{scene.name}' has no free parameter '{unknown[0]}'.{nearest(unknown[0], scene.free)}"
        )
    export_scene(dataclasses.replace(scene, free=free), path, fmi_version=fmi, overwrite=overwrite)


def _opened(model: str, contacts: str | None) -> Fmu:
    """The FMU of a model, or of anybody; then with a word on where its description departs from the standard."""
    from fmu_models.fmu.load import load

    fmu = load(model, contacts=console.chosen(contacts))
    if not fmu.ours and len(fmu.variables) < MANY and fmu.problems:
        console.warn(
            f"the description of '{fmu.path.name}' departs from the standard ({len(fmu.problems)} problems); "
            f"stickslip inspect {fmu.path} lists them."
        )
    return fmu


def _limits(isolate: bool, time_limit: float | None, memory_limit: float | None) -> Limits | None:
    from fmu_models.fmu.isolation import Limits

    if not isolate and not (time_limit is None and memory_limit is None):
        raise StickslipError("A limit of time or memory holds for a process of its own. Add --isolate.")
    if not isolate:
        return None
    default = Limits.default()
    return Limits(
        default.time if time_limit is None else time_limit, default.memory if memory_limit is None else memory_limit
    )


def _experiment(fmu: Fmu, until: float | None, samples: int | None, **asked: Any) -> Experiment:
    """From the start to the end that were asked for, or that the FMU of somebody else suggests."""
    import numpy as np

    from fmu_models.importer.experiment import Experiment

    begin, end = (0.0, 20.0) if fmu.ours else fmu.suggested_times()
    experiment = Experiment(end if until is None else until, begin, **asked)
    if not experiment.stop_time > begin or (samples is None and experiment.is_co_simulation(fmu)):
        return experiment
    return replace(experiment, output_times=np.linspace(begin, experiment.stop_time, samples or SAMPLES))


@app.command()
def inspect(
    path: Annotated[Path, typer.Argument(metavar="FILE.fmu", help="An FMU of anybody.")], json: Json = False
) -> None:
    """Tell what an FMU is, without loading its library: interfaces, platforms, variables, departures from the standard.

    Example: stickslip inspect pump.fmu
    """
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.report.fmu_sheet import print_sheet, sheet

    content = sheet(Fmu.open(path))
    console.say(json, content, lambda out: print_sheet(content, out))


@app.command()
def couple(
    path: Annotated[
        Path,
        typer.Argument(metavar="SYSTEM", help="A system of FMUs: .toml, .ssd or .ssp, or a name of 'stickslip data'."),
    ],
    until: Annotated[float | None, typer.Option(help="End of the run, s (default: what the system says).")] = None,
    solver: Annotated[str | None, typer.Option(help=f"How to run it: {SOLVERS} (default: what it says).")] = None,
    step: Annotated[float | None, typer.Option(help="Communication step of a co-simulation, s.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Relative tolerance of a step.")] = None,
    samples: Annotated[int | None, typer.Option(help="Number of output times.", min=2)] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write the trajectory as .csv, or with its origin as .h5.")
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Simulate several FMUs as one system.

    Where all have Model Exchange they are integrated as one, with common events; otherwise, or by --solver jacobi and
    gauss-seidel, they are stepped one by one.

    Example: stickslip couple data/systems/disc_rig_motors.toml -o rig.csv
    """
    import numpy as np

    from fmu_models.coupling import run
    from fmu_models.coupling.toml_system import read_system
    from fmu_models.report import coupled_summary
    from fmu_models.simulation.results import check_suffix

    refuse_existing(output, overwrite=overwrite)
    check_suffix(output)
    system = read_system(path)
    changes = {"stop_time": until, "solver": solver, "step": step, "tolerance": tolerance}
    system = system.changed(**{name: value for name, value in changes.items() if value is not None})
    times = np.linspace(system.start_time, system.stop_time, samples) if samples else None
    with console.output_of_libraries(), console.progress("simulating") as advance:
        recording = run.recorded(system, output_times=times, progress=advance)
    if output:
        recording.write(output, overwrite=overwrite)
    content = coupled_summary.summary(system, recording)
    content["files"] = [str(output)] if output else []
    console.say(json, content, lambda out: coupled_summary.print_summary(content, out))
