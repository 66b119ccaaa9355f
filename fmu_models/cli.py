"""Commands about models: what there is, what it is made of, export, simulation."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models import console
from fmu_models.console import Contacts, Json, Overwrite, Settings
from fmu_models.files import refuse_existing

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.simulation.fmu import Fmu
    from fmu_models.simulation.trajectory import Trajectory

app = console.app("Models: list, show, export, simulate.")

Model = Annotated[str, typer.Argument(metavar="MODEL", help="Name of a model, as 'stickslip models' lists them.")]


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
    model: Model,
    path: Annotated[Path | None, typer.Option("--output", "-o", help="File to write. [default: MODEL.fmu]")] = None,
    fmi: Annotated[str, typer.Option(help="FMI version: 2.0 or 3.0.")] = "3.0",
    contacts: Contacts = None,
    settings: Settings = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Export a model as an FMU with Model Exchange, Co-Simulation and sources.

    Parameters that are set become the start values of the FMU.

    Example: stickslip export disc_rig --contacts disc0 --fmi 2.0 -o rig.fmu
    """
    from fmu_models.codegen.package import export_built
    from fmu_models.simulation.fmu import Fmu

    path = path or Path("_".join([model, *(console.chosen(contacts) or [])]) + ".fmu")
    values = console.assignments(settings, "parameter")
    export_built(model, path, contacts=console.chosen(contacts), values=values, fmi_version=fmi, overwrite=overwrite)
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
    model: Annotated[str, typer.Argument(metavar="MODEL", help="Name of a model, or an .fmu exported from one.")],
    until: Annotated[float, typer.Option(help="End of the run, s.")] = 20.0,
    settings: Settings = None,
    start: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Start value of a state.")] = None,
    inputs: Annotated[list[str] | None, typer.Option("--input", metavar="NAME=VALUE", help="Constant input.")] = None,
    contacts: Contacts = None,
    samples: Annotated[int, typer.Option(help="Number of output times.", min=2)] = 2001,
    csv: Annotated[Path | None, typer.Option(help="Write the trajectory as CSV.")] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw phase portrait and time series (png, svg, pdf).")] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Simulate a model through its FMU and tell what happened.

    Example: stickslip simulate disc_rig --contacts disc0 --input w0=0.41 --until 25 --figure portrait.png
    """
    import numpy as np

    from fmu_models.codegen.package import built
    from fmu_models.report.figures import check_format
    from fmu_models.simulation.fmu import Fmu
    from fmu_models.simulation.system import simulate as run

    refuse_existing(csv, figure, overwrite=overwrite)
    if figure:
        check_format(figure)
    fmu = Fmu.open(model if model.endswith(".fmu") else built(model, contacts=console.chosen(contacts)))
    with console.progress("simulating") as advance:
        trajectory = run(
            fmu,
            until,
            parameters=console.assignments(settings, "parameter"),
            start=console.assignments(start, "start value"),
            inputs=console.assignments(inputs, "input"),
            output_times=np.linspace(0.0, until, samples) if until > 0 else None,
            progress=advance,
        )
    if csv:
        trajectory.write_csv(csv, overwrite=overwrite)
    if figure:
        from fmu_models.report.trajectory_figure import draw

        draw(trajectory, fmu, figure, overwrite=overwrite)
    content = _summary(fmu, trajectory, until)
    content["files"] = [str(path) for path in (csv, figure) if path]
    console.say(json, content, lambda out: _print_summary(content, out))


@app.command()
def inspect(
    path: Annotated[Path, typer.Argument(metavar="FILE.fmu", help="An FMU of anybody.")], json: Json = False
) -> None:
    """Tell what an FMU is, without loading its library: interfaces, platforms, variables, departures from the standard.

    Example: stickslip inspect pump.fmu
    """
    from fmu_models.report.fmu_sheet import print_sheet, sheet
    from fmu_models.simulation.fmu import Fmu

    content = sheet(Fmu.open(path))
    console.say(json, content, lambda out: print_sheet(content, out))


def _summary(fmu: Fmu, trajectory: Trajectory, until: float) -> dict[str, Any]:
    """What happened: ranges, ends, events per contact, share of the run in each contact state."""
    from fmu_models.simulation.trajectory import CONTACT_STATES

    ranges = {
        name: {
            "unit": trajectory.units[name],
            "min": float(trajectory[name].min()),
            "max": float(trajectory[name].max()),
            "end": float(trajectory[name][-1]),
        }
        for name in (*fmu.states, *fmu.outputs)
    }
    contacts = {}
    for name in fmu.contacts:
        events = [event for event in trajectory.events if event.contact == name]
        first = events[0].before if events else int(trajectory[f"{name}_state"][0])
        changes = [(0.0, first), *((event.time, event.after) for event in events), (until, first)]
        shares: dict[str, float] = {}
        for (begin, state), (end, _) in itertools.pairwise(changes):
            shares[CONTACT_STATES[state]] = shares.get(CONTACT_STATES[state], 0.0) + (end - begin) / until
        contacts[name] = {"events": len(events), "shares": shares}
    return {
        "model": fmu.description.modelName,
        "until": until,
        "ranges": ranges,
        "contacts": contacts,
        "steps": trajectory.steps,
    }


def _print_summary(content: dict[str, Any], out: Console) -> None:
    out.print(f"[bold]{content['model']}[/bold] to t = {content['until']:g} s in {content['steps']} steps")
    made = console.table("quantity", ">min", ">max", ">at the end", "unit")
    for name, row in content["ranges"].items():
        made.add_row(name, *(f"{row[key]:.6g}" for key in ("min", "max", "end")), row["unit"])
    out.print(made)
    for name, row in content["contacts"].items():
        shares = ", ".join(f"{state} {share:.1%}" for state, share in row["shares"].items() if share > 0)
        out.print(f"contact {name}: {row['events']} events; of the time {shares}")
    for path in content["files"]:
        out.print(f"written: {path}")
