"""Commands about models: what there is, what it is made of, export, simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models import console
from fmu_models.console import Contacts, Json, Overwrite, Settings
from fmu_models.errors import StickslipError, nearest
from fmu_models.files import refuse_existing

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.scene.scene import Scene
    from fmu_models.simulation.fmu import Fmu

app = console.app("Models: list, show, export, simulate.")

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
    path: Annotated[Path | None, typer.Option("--output", "-o", help="File to write. [default: MODEL.fmu]")] = None,
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
    from fmu_models.codegen.package import export_built
    from fmu_models.simulation.fmu import Fmu

    values = console.assignments(settings, "parameter")
    if is_scene(model):
        scene = _scene(model, contacts)
        path = path or Path(f"{scene.name}.fmu")
        _export_scene(scene, path, values, fmi, overwrite)
    else:
        path = path or Path("_".join([model, *(console.chosen(contacts) or [])]) + ".fmu")
        kept = console.chosen(contacts)
        export_built(model, path, contacts=kept, values=values, fmi_version=fmi, overwrite=overwrite)
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
        str, typer.Argument(metavar="MODEL", help="Name of a model, an .fmu exported from one, or a scene (.toml).")
    ],
    until: Annotated[float | None, typer.Option(help="End of the run, s. [default: 20, or as the scene says]")] = None,
    settings: Settings = None,
    start: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Start value of a state.")] = None,
    inputs: Annotated[list[str] | None, typer.Option("--input", metavar="NAME=VALUE", help="Constant input.")] = None,
    contacts: Contacts = None,
    samples: Annotated[int, typer.Option(help="Number of output times.", min=2)] = 2001,
    error: Annotated[
        bool, typer.Option("--error", help="Run again four times otherwise, and estimate the error.")
    ] = False,
    csv: Annotated[Path | None, typer.Option(help="Write the trajectory as CSV.")] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw phase portrait and time series (png, svg, pdf).")] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Simulate a model through its FMU and tell what happened.

    Example: stickslip simulate disc_rig --contacts disc0 --input w0=0.41 --until 25 --figure portrait.png
    """
    import numpy as np

    from fmu_models.report.run_summary import print_summary, summary
    from fmu_models.simulation.accuracy import simulate_with_error
    from fmu_models.simulation.system import simulate as run

    refuse_existing(csv, figure, overwrite=overwrite)
    if figure:
        from fmu_models.report.figures import check_format

        check_format(figure)
    changed = {
        "parameters": console.assignments(settings, "parameter"),
        "start": console.assignments(start, "start value"),
        "inputs": console.assignments(inputs, "input"),
    }
    fmu, given = _to_run(model, contacts, until, changed)
    stop = given["stop_time"]
    given["output_times"] = np.linspace(0.0, stop, samples) if stop > 0 else None
    with console.progress("simulating") as advance:
        if error:
            trajectory, estimate = simulate_with_error(fmu, progress=advance, **given)
        else:
            trajectory, estimate = run(fmu, progress=advance, **given), None
    if csv:
        trajectory.write_csv(csv, overwrite=overwrite)
    if figure:
        from fmu_models.report.trajectory_figure import draw

        draw(trajectory, fmu, figure, overwrite=overwrite)
    content = summary(fmu, trajectory, stop, estimate)
    content["files"] = [str(path) for path in (csv, figure) if path]
    console.say(json, content, lambda out: print_summary(content, out))


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
    """The FMU of a model, file or scene, and the arguments of ``simulate``."""
    from fmu_models.codegen.package import built
    from fmu_models.simulation.fmu import Fmu

    if is_scene(model):
        from fmu_models.scene.compute import arguments
        from fmu_models.scene.reduce import built_scene

        scene = _scene(model, contacts)
        return Fmu.open(built_scene(scene)), arguments(scene, until, **changed)
    path = model if model.endswith(".fmu") else built(model, contacts=console.chosen(contacts))
    return Fmu.open(path), {"stop_time": 20.0 if until is None else until, **changed}


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
