"""Command that writes an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Contacts, Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.codegen.rights import Rights
from fmu_models.commands.arguments import ModelOrScene, is_scene, scene_of
from fmu_models.oscillators import MODELS
from fmu_models.toolchain.platforms import ALL, HOST, PLATFORMS
from fmu_models.toolchain.platforms import platforms as chosen_platforms

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.scene.scene import Scene


def export(
    model: ModelOrScene,
    path: Annotated[Path | None, typer.Option("--output", "-o", help="File to write (default: MODEL.fmu).")] = None,
    fmi: Annotated[str, typer.Option(help="FMI version: 2.0 or 3.0.")] = "3.0",
    contacts: Contacts = None,
    settings: Settings = None,
    expose: Annotated[
        str | None,
        typer.Option(
            help="What of the contacts becomes outputs, by commas: 'states' (integers), 'clocks' (FMI 3, of events)."
        ),
    ] = None,
    platform: Annotated[
        str, typer.Option(help=f"Platforms to build for, by commas: {', '.join((*PLATFORMS, HOST, ALL))}.")
    ] = HOST,
    author: Annotated[str | None, typer.Option(help="Author of the model.", rich_help_panel="Rights")] = None,
    copyright_line: Annotated[
        str | None, typer.Option("--copyright", help='Such as "(c) 2026 A. Author".', rich_help_panel="Rights")
    ] = None,
    license_: Annotated[
        str | None,
        typer.Option(
            "--license", help="Licence of the model: a name such as MIT, or a file.", rich_help_panel="Rights"
        ),
    ] = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="MODEL is an FMU: build it once more and compare, writing nothing.")
    ] = False,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Export a model, or what a scene uses of it, as an FMU with Model Exchange, Co-Simulation and sources.

    Parameters that are set become the start values of the FMU.

    Example: stickslip export disc_rig --contacts disc0 --fmi 2.0 -o rig.fmu
    """
    from fmu_models.codegen.package import Packaging, kept_by_name
    from fmu_models.codegen.package import export as write_fmu
    from fmu_models.fmu.fmu import Fmu

    if verify:
        return _verify(model, json)
    rights = Rights(author, copyright_line, license_) if author or copyright_line or license_ else None
    names = [name.strip() for name in platform.split(",") if name.strip()]
    built = chosen_platforms(names)
    options: dict[str, Any] = {"fmi_version": fmi, "overwrite": overwrite}
    values = console.assignments(settings, "parameter")
    if is_scene(model):
        scene = scene_of(model, contacts)
        path = path or Path(f"{scene.name}.fmu")
        if expose:
            raise StickslipError("A scene lists all its outputs. Add the states to its 'outputs', as \"disc0_state\".")
        with console.progress("compiling") as advance:
            _export_scene(scene, path, values, packaging=Packaging(rights, names, advance), **options)
    else:
        name = model if kept_by_name(model) else MODELS.load(model).name
        path = path or Path("_".join([name, *(console.chosen(contacts) or [])]) + ".fmu")
        kept = console.chosen(contacts)
        options["expose"] = [what.strip() for what in (expose or "").split(",") if what.strip()]
        with console.progress("compiling") as advance:
            options["packaging"] = Packaging(rights, names, advance)
            write_fmu(model, path, contacts=kept, values=values, **options)
    fmu = Fmu.open(path)
    content = {
        "file": str(path),
        "fmi_version": fmi,
        "kinds": ["Model Exchange", "Co-Simulation"],
        "platforms": [one.fmi2 if fmi == "2.0" else one.fmi3 for one in built],
        "bytes": path.stat().st_size,
        "states": fmu.states,
        "inputs": fmu.inputs,
        "outputs": fmu.outputs,
        "parameters": fmu.parameters,
        "contacts": fmu.contacts,
    }

    def show(out: Console) -> None:
        out.print(f"[bold]{path}[/bold]: FMI {fmi}, Model Exchange and Co-Simulation, {content['bytes'] / 1000:.0f} kB")
        for what in ("platforms", "states", "inputs", "outputs", "contacts", "parameters"):
            out.print(f"  {what:10s} {', '.join(content[what]) or 'none'}")

    console.say(json, content, show)


def _verify(path: str, json: bool) -> None:
    from fmu_models.fmu.verification import verify

    found = verify(path)
    content = {"file": path, "entries": found.entries, "differences": list(found.differences)}
    if found.differences:
        console.say(json, content, lambda out: None)
        raise StickslipError(f"'{path}' is not what its model gives:\n" + "\n".join(found.differences))
    console.say(json, content, lambda out: out.print(f"{path}: all {found.entries} files are what its model gives"))


def _export_scene(scene: Scene, path: Path, values: dict[str, float], **options: Any) -> None:
    import dataclasses

    from fmu_models.scene.compute import arguments
    from fmu_models.scene.reduce import export_scene

    free = arguments(scene, parameters=values)["parameters"]
    if unknown := [name for name in free if name not in scene.free]:
        raise StickslipError(
            f"Scene '{scene.name}' has no free parameter '{unknown[0]}'.{nearest(unknown[0], scene.free)}"
        )
    export_scene(dataclasses.replace(scene, free=free), path, **options)
