"""Command that writes an FMU."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.shipped import is_scene
from fmu_models.codegen.rights import Rights
from fmu_models.commands.arguments import ModelOrScene, no_fmu, scene_of
from fmu_models.fmu.load import named_map
from fmu_models.oscillators import MODELS
from fmu_models.toolchain.platforms import ALL, HOST, PLATFORMS
from fmu_models.toolchain.platforms import platforms as chosen_platforms

if TYPE_CHECKING:
    from fmu_models.scene.scene import Scene

FMI, SYSTEM_FMI = "3.0", "2.0"  # versions where none is given


@console.trusting
def export(
    model: ModelOrScene,
    path: Annotated[Path | None, typer.Option("--output", "-o", help="File to write (default: MODEL.fmu).")] = None,
    fmi: Annotated[
        str | None,
        typer.Option(
            help=f"FMI version: 2.0 or 3.0 (default: {FMI}; in a system {SYSTEM_FMI}, which more tools take)."
        ),
    ] = None,
    contacts: console.Contacts = None,
    settings: console.Settings = None,
    expose: Annotated[
        list[str] | None,
        typer.Option(
            help="A local variable that becomes an output; 'states' (integers) and 'clocks' (FMI 3) are those of all "
            "contacts. By commas, or again and again."
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
    as_system: Annotated[
        bool,
        typer.Option(
            "--ssp",
            help="Pack the FMU, or those of a system, with parameters and connections as .ssp.",
            rich_help_panel="System",
        ),
    ] = False,
    fitted: Annotated[
        Path | None,
        typer.Option(help="Parameter set (.ssv) to pack along, as 'stickslip apply' writes.", rich_help_panel="System"),
    ] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Export a model, or what a scene uses of it, as an FMU with Model Exchange, Co-Simulation and sources.

    Parameters that are set become the start values of the FMU. A map makes a step at every time event, 'period' apart.

    Example: stickslip export disc_rig --contacts disc0 --fmi 2.0 -o rig.fmu

    Example: stickslip export disc_rig_motors --ssp -o motors.ssp
    """
    from fmu_models.codegen.package import Packaging
    from fmu_models.fmu.fmu import Fmu

    if verify:
        return _verify(model, json)
    rights = Rights(author, copyright_line, license_) if author or copyright_line or license_ else None
    built = chosen_platforms(names := console.names_of(platform))
    values = console.assignments(settings, "parameter")
    if fitted is not None and not as_system:
        raise StickslipError("A parameter set is packed along with --ssp. For an FMU: stickslip apply FIT -o FILE.fmu")
    fmi = fmi or (SYSTEM_FMI if as_system else FMI)
    chosen: dict[str, Any] = {
        "contacts": contacts,
        "values": values,
        "expose": console.names_of(",".join(expose or []) or None),
    }
    if as_system:
        with console.progress("packing") as advance:
            chosen["packaging"] = Packaging(rights, names, advance)
            packed = _pack(model, path, fitted, fmi, overwrite, chosen)
        return console.say(json, packed, lambda out: _print_system(packed, out))
    with console.progress("compiling") as advance:
        chosen["packaging"] = Packaging(rights, names, advance)
        written = _export_one(model, path, fmi_version=fmi, overwrite=overwrite, **chosen)
    fmu = Fmu.open(written)
    content = {
        "file": str(written),
        "fmi_version": fmi,
        "kinds": ["Model Exchange", "Co-Simulation"],
        "platforms": [package.fmi2 if fmi == "2.0" else package.fmi3 for package in built],
        "bytes": written.stat().st_size,
        "states": fmu.states,
        "inputs": fmu.inputs,
        "outputs": fmu.ports,
        "parameters": fmu.parameters,
        "contacts": fmu.contacts,
    }

    def show(out: console.Console) -> None:
        out.print(
            f"[bold]{written}[/bold]: FMI {fmi}, Model Exchange and Co-Simulation, {content['bytes'] / 1000:.0f} kB"
        )
        for heading in ("platforms", "states", "inputs", "outputs", "contacts", "parameters"):
            out.print(f"  {heading:10s} {', '.join(content[heading]) or 'none'}")

    console.say(json, content, show)


def _export_one(
    model: str,
    path: Path | None,
    *,
    contacts: str | None,
    values: dict[str, float],
    expose: list[str],
    folder: Path = Path(),
    **options: Any,
) -> Path:
    """Write the FMU of a model or a scene; without a path into the folder, by its name."""
    from fmu_models.codegen.package import export as write_fmu
    from fmu_models.codegen.package import export_map, kept_by_name

    if is_scene(model):
        scene = scene_of(model, contacts)
        path = path or folder / f"{scene.name}.fmu"
        if expose:
            raise StickslipError("A scene lists all its outputs. Add the states to its 'outputs', as \"disc0_state\".")
        _export_scene(scene, path, values, **options)
        return path
    if (declared := named_map(model)) is not None:
        if contacts or expose:
            raise StickslipError(f"{declared.name} is a map: it has no contacts to choose or to expose.")
        return export_map(declared, path or folder / f"{declared.name}.fmu", values=values, **options)
    name = model if kept_by_name(no_fmu(model)) else MODELS.load(model).name
    selected = console.chosen(contacts)
    path = path or folder / ("_".join([name, *(selected or [])]) + ".fmu")
    return write_fmu(model, path, contacts=selected, values=values, expose=expose, **options)


def _pack(
    model: str, path: Path | None, fitted: Path | None, fmi: str, overwrite: bool, chosen: dict[str, Any]
) -> dict[str, Any]:
    """Write a system, or a model or scene as one, as .ssp, and say what it holds."""
    from fmu_models.base.files import refuse_existing
    from fmu_models.base.temporary import temporary_folder
    from fmu_models.coupling import ssp_writer
    from fmu_models.coupling.system import CoupledSystem, Unit
    from fmu_models.coupling.toml_system import is_system, read_system
    from fmu_models.fmu.fmu import Fmu

    with temporary_folder("pack") as folder:
        if is_system(model):
            if chosen["contacts"] or chosen["values"] or chosen["expose"] or not chosen["packaging"].plain:
                raise StickslipError(
                    f"'{model}' is a system: its units say their contacts and parameters, and their FMUs are as they "
                    "are. Leave --contacts, --set, --expose, --platform and the rights out."
                )
            with console.warnings_said():
                system = read_system(model, fmi_version=fmi)
        else:
            package = Fmu.open(_export_one(model, None, fmi_version=fmi, overwrite=overwrite, folder=folder, **chosen))
            name = str(package.description.modelName)
            system = CoupledSystem(name, {name: Unit(package)})
        path = ssp_writer.check_path(path or Path(f"{system.name}.ssp"))
        refuse_existing(path, overwrite=overwrite)
        sets = ssp_writer.parameter_sets(system, fitted)
        ssp_writer.write(path, system, sets, overwrite=overwrite)
    return {
        "file": str(path),
        "fmi_version": fmi,
        "bytes": path.stat().st_size,
        "units": {name: unit.fmu.path.name for name, unit in system.units.items()},
        "connections": [str(connection) for connection in system.connections],
        "parameters": {
            name: {kind: {e.name: e.value for e in entries} for kind, entries in sets[name].items()} for name in sets
        },
    }


def _print_system(content: dict[str, Any], out: console.Console) -> None:
    out.print(f"[bold]{content['file']}[/bold]: a system of FMI {content['fmi_version']} FMUs, SSP 1.0")
    for name, file in content["units"].items():
        sets = content["parameters"].get(name, {})
        out.print(
            f"  {name}: {file}; " + ", ".join(f"{kind} {len(values)}" for kind, values in sets.items()), markup=False
        )
    for connection in content["connections"]:
        out.print(f"  {connection}", markup=False)


def _verify(path: str, json: bool) -> None:
    from fmu_models.fmu.verification import verify

    verification = verify(path)
    content = {"file": path, "entries": verification.entries, "differences": list(verification.differences)}
    if verification.differences:
        console.say(json, content, lambda out: None)
        raise StickslipError(f"'{path}' is not what its model gives:\n" + "\n".join(verification.differences))
    console.say(
        json, content, lambda out: out.print(f"{path}: all {verification.entries} files are what its model gives")
    )


def _export_scene(scene: Scene, path: Path, values: dict[str, float], **options: Any) -> None:
    from fmu_models.scene.compute import arguments
    from fmu_models.scene.reduce import export_scene

    free = arguments(scene, parameters=values)["parameters"]
    if unknown := [name for name in free if name not in scene.free]:
        raise StickslipError(
            f"Scene '{scene.name}' has no free parameter '{unknown[0]}'.{nearest(unknown[0], scene.free)}"
        )
    export_scene(replace(scene, free=free), path, **options)
