"""Command that says which experiment would tell the parameters apart."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from identification.commands.calibrations import design_calibration, pairs_of
from identification.commands.fits import FitFile
from identification.commands.machines import MachinePlace, refuse

if TYPE_CHECKING:
    from identification.next_step.design import Design


@console.trusting
def design(
    fitted: FitFile,
    speeds: Annotated[str | None, typer.Option(help="Drive speeds to try, rad/s, separated by commas.")] = None,
    loads: Annotated[str | None, typer.Option(help="Normal forces to try, N, separated by commas.")] = None,
    tried: Annotated[
        list[str] | None,
        typer.Option(
            "--try", metavar="NAME=V1,V2,...", help="Of a calibration: values of an input or drive; all combinations."
        ),
    ] = None,
    only: Annotated[
        str | None, typer.Option("--for", metavar="NAMES", help="Of a calibration: parameters that the ranking is for.")
    ] = None,
    machine: MachinePlace = None,
    duration: Annotated[float, typer.Option(help="Of the log to come, s.")] = 20.0,
    json: console.Json = False,
) -> None:
    """Name the drive speed and load whose log would tell the fitted parameters apart best.

    Of any calibrated model: which values of its inputs, drives and start states, among those to try, would.

    Example: stickslip design fit.json

    Example: stickslip design pump.json --try w=10,20,40 --try p0=0.5,1 --for c
    """
    from identification.calibration.result import is_calibration
    from identification.fit.result import read_fit

    if is_calibration(fitted):
        refuse("any model", "a rig", {"speeds": speeds, "loads": loads})
        design_calibration(fitted, machine, _candidates(tried), console.names_of(only), duration, json)
        return
    refuse("a rig", "any model", {"try": tried, "for": only, "machine": machine})
    from identification.next_step.design import design as designed

    fit = read_fit(fitted)
    asked = {"speeds": _numbers(speeds, "--speeds"), "loads": _numbers(loads, "--loads")}
    with console.progress("simulating candidates") as advance:
        found = designed(fit, **asked, duration=duration, progress=advance)
    console.say(json, found.to_dict(), lambda out: _print_design(found, out))


def _numbers(text: str | None, option: str) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise StickslipError(
            f"{option} takes numbers separated by commas, such as 0.2,0.41; found '{text}'."
        ) from error


def _candidates(tried: list[str] | None) -> list[dict[str, float]]:
    """All combinations of values."""
    values = {
        name: _numbers(text, "--try") or [] for name, text in pairs_of(tried, "--try", "NAME=V1,V2, such as w=10,20")
    }
    if not values:
        raise StickslipError("Say what could be set in the next experiment: --try w=10,20,40.")
    return [dict(zip(values, combination, strict=True)) for combination in product(*values.values())]


def _print_design(found: Design, out: console.Console) -> None:
    from identification.report.tables import design_table

    out.print(design_table(found))
    refused = [candidate for candidate in found.candidates if candidate.refused is not None]
    for reason in dict.fromkeys(one.refused for one in refused):
        where = ", ".join(f"{one.drive_speed:.2g} rad/s {one.load:.2g} N" for one in refused if one.refused == reason)
        out.print(f"Refused ({reason}): {where}.")
    out.print(found.advice)
