"""Command that hands fitted parameters on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.digits import deviation, like_sd
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import refuse_existing
from fmu_models.base.shipped import is_scene
from identification.commands.fits import ANY_MODEL, MACHINE, RIG, FitFile, fitted_kind
from identification.commands.machines import MachinePlace, read_machine, refuse

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from identification.transfer.values import HandedValue

TARGETS = (".fmu", ".toml", ".ssv", ".ssp")


@console.trusting
def apply(
    fitted: FitFile,
    source: Annotated[
        Path | None,
        typer.Argument(metavar="[FMU|SCENE]", help="What to copy with fitted values (default: the rig's own FMU)."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write: .fmu, .toml (a scene), .ssv or .ssp.")
    ] = None,
    only: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Hand on these alone, separated by commas (default: all).")
    ] = None,
    names: Annotated[
        list[str] | None,
        typer.Option("--name", metavar="NAME=ITS_NAME", help="What a parameter is called there; repeat for several."),
    ] = None,
    machine: MachinePlace = None,
    fmi: Annotated[str, typer.Option(help="FMI version of a new FMU: 2.0 or 3.0.")] = "3.0",
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Write what was fitted, a friction law with the rig's constants, a machine or any calibrated model, into an FMU, a
    scene or an SSP.

    Refused if a name or a unit does not match; units of the same quantity are converted.

    Example: stickslip apply fit.json -o rig_fitted.fmu

    Example: stickslip apply fit.json my_scene.toml -o fitted_scene.toml

    Example: stickslip apply fit.json -o fitted.ssv
    """
    if output is None:
        raise StickslipError(f"Say what to write with -o FILE; it ends in one of {', '.join(TARGETS)}.")
    kind = output.suffix.lower()
    _check_kinds(source, output, kind)
    refuse_existing(output, overwrite=overwrite)
    with console.progress("writing") as advance:
        handed = _handed(fitted, machine, console.names_of(only), _renamed(names))
        values = handed.values
        advance(0.1)
        _write(handed, source, output, kind, fmi, overwrite)
    notes = [*handed.assumed, *_notes(source, kind)]
    content = {
        "file": str(output),
        "values": {
            value.target: {"value": value.value, "unit": value.unit, "sd": value.deviation, "at_least": value.at_least}
            for value in values
        },
        "notes": notes,
    }
    console.say(json, content, lambda out: _print(values, output, notes, out))


def _check_kinds(source: Path | None, output: Path, kind: str) -> None:
    if kind not in TARGETS:
        raise StickslipError(f"'{output}' is of no kind that takes parameters. End it in one of {', '.join(TARGETS)}.")
    if kind == ".toml" and source is None:
        raise StickslipError(
            "Which scene is to have the fitted values? Name it: stickslip apply FIT SCENE -o FILE.toml"
        )
    if source is not None and kind in (".ssv", ".ssp"):
        raise StickslipError(f"A {kind} file is written anew; leave '{source}' out, and name its parameters by --name.")
    if source is not None and (".toml" if is_scene(str(source)) else source.suffix.lower()) != kind:
        raise StickslipError(f"'{source}' is copied into a file of the same kind; '{output}' is of another.")
    if source is not None and output.exists() and source.resolve() == output.resolve():
        raise StickslipError(f"'{source}' would be overwritten by its own copy. Choose another name.")


def _renamed(names: list[str] | None) -> dict[str, str]:
    renamed: dict[str, str] = {}
    for name, target in console.pairs(names, "--name", "NAME=ITS_NAME, such as mu_s0=contact.mu_static"):
        if name in renamed:
            raise StickslipError(f"'{name}' is named twice. Name it once.")
        renamed[name] = target
    return renamed


@dataclass(frozen=True)
class _Handed:
    """name: of the rig or machine; values: that are handed on; fmu: its own, in a version of FMI; assumed: of normal
    force and temperature, in sentences."""

    name: str
    values: tuple[HandedValue, ...]
    fmu: Callable[[str], Fmu]
    assumed: tuple[str, ...] = ()


def _handed(fitted: Path, machine: str | None, only: list[str], renamed: dict[str, str]) -> _Handed:
    from identification.calibration.result import calibrated_fmu, read_calibration

    kind = fitted_kind(fitted)
    if kind == ANY_MODEL:
        from identification.transfer.values import calibration_values

        calibration = read_calibration(fitted)
        values = calibration_values(calibrated_fmu(calibration, machine), calibration, only=only, renamed=renamed)
        return _Handed(calibration.model, values, lambda fmi: calibrated_fmu(calibration, machine, fmi_version=fmi))
    if kind == MACHINE:
        from fmu_models.codegen.package import built
        from fmu_models.fmu.fmu import Fmu
        from identification.fitted_model.machine import machine_with
        from identification.transfer.values import machine_values

        fit, declared = read_machine(fitted, machine)
        fitted_machine = machine_with(declared.mechanism, fit)
        values = machine_values(fitted_machine, fit, only=only, renamed=renamed)
        return _Handed(fit.machine, values, lambda fmi: Fmu.open(built(fitted_machine, fmi_version=fmi)))
    from identification.fit.followed import followed_in
    from identification.fit.result import read_fit
    from identification.fitted_model.model import fitted_model
    from identification.transfer.values import handed_values

    refuse(RIG, MACHINE, {"machine": machine})
    found = read_fit(fitted)
    values = handed_values(found, only=only, renamed=renamed)
    assumed = followed_in(found.structure)
    return _Handed("rig", values, lambda fmi: fitted_model(found, fmi_version=fmi).fmu, assumed)


def _write(handed: _Handed, source: Path | None, output: Path, kind: str, fmi: str, overwrite: bool) -> None:
    values = handed.values
    if kind == ".toml" and source is not None:
        from fmu_models.scene.read import find
        from identification.transfer.scene import write_scene

        write_scene(find(source), output, values, overwrite=overwrite)
    elif kind == ".fmu":
        from fmu_models.fmu.fmu import Fmu
        from fmu_models.fmu.start_values import copy_with_start_values
        from identification.transfer.values import check_targets

        fmu = Fmu.open(source) if source is not None else handed.fmu(fmi)
        copy_with_start_values(fmu, output, check_targets(values, fmu), overwrite=overwrite)
    elif kind == ".ssv":
        from identification.transfer.ssp import write_parameter_set

        write_parameter_set(output, values, handed.fmu("2.0"), overwrite=overwrite)
    else:
        from identification.transfer.ssp import write_ssp

        write_ssp(output, values, handed.fmu("2.0"), name=handed.name, overwrite=overwrite)


def _notes(source: Path | None, kind: str) -> list[str]:
    if kind == ".toml" and source is not None:
        from fmu_models.scene.read import read_scene

        if read_scene(source).references:
            return [
                "The scene's [[reference]] values are those of its old parameters: remove them, or compute them anew."
            ]
    if kind == ".ssv":
        binding = '<ssd:ParameterBinding source="FILE.ssv"/>'
        return [f"Bind it to a component of a system by {binding}; 'stickslip couple' reads it."]
    return []


def _print(values: tuple[HandedValue, ...], output: Path, notes: list[str], out: console.Console) -> None:
    rows = [
        [
            *(value.target, like_sd(value.value, value.deviation), value.words + deviation(value.deviation)),
            *(value.unit, value.description),
        ]
        for value in values
    ]
    out.print(console.table(str(output), ("parameter", ">value", ">sd", "unit", "meaning"), rows))
    for note in notes:
        out.print(console.plain(note))
