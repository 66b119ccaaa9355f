"""Commands that say which law the logs ask for, and which experiment would tell its parameters apart."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Settings
from fmu_models.base.errors import StickslipError
from identification.commands.fit import Logs, read_logs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from identification.next_step.design import Design
    from identification.next_step.laws import LawComparison, LawScore

app = console.app("Which friction law, and which experiment next.")

SHOWN = 12  # candidates of a design; all are in --json


@app.command()
def laws(
    logs: Logs,
    estimator: Annotated[str, typer.Option(help="weak-form or savitzky-golay.")] = "weak-form",
    contact: Annotated[
        bool, typer.Option("--contact", help="Rigid contact against bristles (LuGre) too, over whole cycles.")
    ] = False,
    settings: Settings = None,
    allow_no_stick: Annotated[bool, typer.Option("--allow-no-stick", help="Take logs that never stick.")] = False,
    json: Json = False,
) -> None:
    """Compare friction laws on the same logs, by information criteria and by the prediction of held-out logs.

    Example: stickslip laws data/rigs/paper_rubber
    """
    from identification.measurement.pooling import pool
    from identification.next_step.laws import compare_contacts, compare_laws

    with console.progress("comparing laws") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"))
        ready = pool(read, allow_no_stick=allow_no_stick)
        share = 0.1 if contact else 1.0
        found = compare_laws(ready, estimator=estimator, progress=lambda done: advance(share * done))
        contacts = None
        if contact:
            contacts = compare_contacts(ready, progress=lambda done: advance(share + (1 - share) * done))

    def show(out: Console) -> None:
        print_laws(found, out)
        if contacts is not None:
            print_laws(contacts, out)

    console.say(json, {**found.to_dict(), "contacts": contacts.to_dict() if contacts else None}, show)


@app.command()
def design(
    fitted: Annotated[Path, typer.Argument(metavar="FIT", help="Result of 'stickslip fit --result'.")],
    speeds: Annotated[str | None, typer.Option(help="Drive speeds to try, rad/s, separated by commas.")] = None,
    loads: Annotated[str | None, typer.Option(help="Normal forces to try, N, separated by commas.")] = None,
    duration: Annotated[float, typer.Option(help="Of the log to come, s.")] = 20.0,
    json: Json = False,
) -> None:
    """Name the drive speed and load whose log would tell the fitted parameters apart best.

    Example: stickslip design fit.json
    """
    from identification.fit.result import read_fit
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


def print_laws(found: LawComparison, out: Console) -> None:
    """The laws as a table, and what decides."""
    columns = ("law", ">BIC", ">AICc", ">AIC", ">held out", ">worse by", "parameters")
    table = console.table(*columns, title=f"{found.residuals} residuals, worth {found.effective:.0f} independent ones")
    best = found.best
    for one in found.scores:
        values = ", ".join(
            f"{name} {value:.4g}{' (bound)' if name in one.bounds else ''}" for name, value in one.values.items()
        )
        criteria = (f"{value - least:+.1f}" for value, least in _leads(one, best))
        table.add_row(one.law, *criteria, f"{one.held_out:.3g}", f"{one.worse:.1f} se", values)
    out.print(table)
    out.print("Criteria against the first law. Held out: rms of predicted residuals, 1 = as good as fitted.")
    out.print(found.verdict)
    for doubt in found.doubts:
        out.print(f"Warning: {doubt}", style="bold")


def _leads(one: LawScore, best: LawScore) -> Sequence[tuple[float, float]]:
    return ((one.bic, best.bic), (one.aicc, best.aicc), (one.aic, best.aic))


def _print_design(found: Design, out: Console) -> None:
    names = list(found.deviations)
    columns = ("experiment", ">rad/s", ">N", *(f">sd {name}" for name in names), ">gain", ">collinearity", ">slip m/s")
    table = console.table(*columns, "", title=f"One more log of {found.duration:g} s")
    known = (f"{value:.2g}" for value in found.deviations.values())
    table.add_row("as it is", "", "", *known, "", f"{found.index:.3g}", "", "")
    useful = [one for one in found.candidates if one.refused is None]
    for one in useful[:SHOWN]:
        deviations = (f"{one.deviations[name]:.2g}" for name in names)
        table.add_row(
            one.kind,
            f"{one.drive_speed:.3g}",
            f"{one.load:.3g}",
            *deviations,
            f"{one.gain:.0%}",
            f"{one.index:.3g}",
            f"{one.greatest_slip:.2g}",
            "",
        )
    out.print(table)
    refused = [one for one in found.candidates if one.refused is not None]
    for reason in dict.fromkeys(one.refused for one in refused):
        where = ", ".join(f"{one.drive_speed:.2g} rad/s {one.load:.2g} N" for one in refused if one.refused == reason)
        out.print(f"Refused ({reason}): {where}.")
    out.print(found.advice)
