"""Command that says which experiment would tell the parameters apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.commands.bundles import bundled
from identification.commands.experiments import OfCalibration, design_calibration
from identification.commands.fits import ANY_MODEL, RIG, FitFile, fitted_kind
from identification.commands.machines import refuse

if TYPE_CHECKING:
    from identification.next_step.design import Design


@console.trusting
@bundled
def design(
    fitted: FitFile,
    speeds: Annotated[str | None, typer.Option(help="Drive speeds to try, rad/s, separated by commas.")] = None,
    loads: Annotated[str | None, typer.Option(help="Normal forces to try, N, separated by commas.")] = None,
    duration: Annotated[float, typer.Option(help="Of each log to come, s.")] = 20.0,
    logs: Annotated[int | None, typer.Option(help="How many logs of a rig to plan together.")] = None,
    *,
    any_model: OfCalibration,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Name the drive speed and load whose log would tell the fitted parameters apart best.

    Of any calibrated model: which values of its inputs, drives and start states, among those to try or within limits,
    would; and which inputs over time, by Fourier series or levels within limits.

    Example: stickslip design fit.json

    Example: stickslip design fit.json --logs 4 --duration 30

    Example: stickslip design pump.json --try w=10,20,40 --try p0=0.5,1 --for c

    Example: stickslip design pump.json --input u=-1:1 --within p0=0.5:2 --for c -o u.csv
    """
    from identification.fit.result import read_fit

    kind = fitted_kind(fitted)
    if kind == ANY_MODEL:
        refuse(ANY_MODEL, RIG, {"speeds": speeds, "loads": loads, "logs": logs})
        design_calibration(fitted, any_model, duration, overwrite, json)
        return
    refuse(RIG, ANY_MODEL, any_model.given())
    from identification.next_step.design import design as designed

    fit = read_fit(fitted)
    given = {"speeds": speeds, "loads": loads}
    asked = {name: None if text is None else console.numbers(text, f"--{name}") for name, text in given.items()}
    with console.progress("simulating candidates") as advance:
        proposal = designed(fit, **asked, duration=duration, logs=1 if logs is None else logs, progress=advance)
    console.say(json, proposal.to_dict(), lambda out: _print_design(proposal, out))


def _print_design(found: Design, out: console.Console) -> None:
    from identification.report.tables import design_table, plan_table

    if len(found.plan.logs) > 1:
        out.print(plan_table(found))
    out.print(design_table(found))
    refused = [candidate for candidate in found.candidates if candidate.refused is not None]
    for reason in dict.fromkeys(one.refused for one in refused):
        where = ", ".join(f"{one.drive_speed:.2g} rad/s {one.load:.2g} N" for one in refused if one.refused == reason)
        out.print(f"Refused ({reason}): {where}.")
    out.print(found.advice)
