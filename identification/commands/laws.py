"""Command that says which law the logs ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from identification.commands.fits import Disturbing, named
from identification.commands.logs import Logs, ReaderOption, Repairs, read_logs, stated
from identification.estimators import ESTIMATORS
from identification.inference.defaults import DISTURBANCES, ESTIMATOR

if TYPE_CHECKING:
    from identification.inference.comparison import LawComparison


def laws(
    logs: Logs,
    estimator: Annotated[
        str, typer.Option(help=f"Whose likelihood decides: {', '.join(ESTIMATORS.names())}.")
    ] = ESTIMATOR,
    disturbances: Disturbing = DISTURBANCES,
    contact: Annotated[
        bool,
        typer.Option(
            "--contact", help="Rigid contact against bristles (LuGre) too, over whole cycles, as where sticks give way."
        ),
    ] = False,
    settings: console.Settings = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    allow_no_stick: Annotated[bool, typer.Option("--allow-no-stick", help="Take logs that never stick.")] = False,
    json: console.Json = False,
) -> None:
    """Compare friction laws on the same logs, by the likelihood of an estimator and by the prediction of held-out logs.

    Example: stickslip laws data/rigs/paper_rubber
    """
    from identification.measurement.pooling import pool
    from identification.next_step.laws import compare_contacts, compare_laws

    with console.progress("comparing laws") as advance:
        read = read_logs(logs, stated(settings), repair, reader)
        ready = pool(read, allow_no_stick=allow_no_stick)
        share = 0.5 if contact else 0.95
        asked = named(disturbances)
        comparison = compare_laws(
            ready, estimator=estimator, disturbances=asked, progress=lambda done: advance(share * done)
        )
        contacts = None
        if contact or comparison.elastic:
            contacts = compare_contacts(ready, progress=lambda done: advance(share + (1 - share) * done))

    def show(out: console.Console) -> None:
        print_laws(comparison, out)
        if contacts is not None:
            print_laws(contacts, out)

    console.say(json, {**comparison.to_dict(), "contacts": contacts.to_dict() if contacts else None}, show)


def print_laws(found: LawComparison, out: console.Console) -> None:
    """The laws as a table, and what decides."""
    from identification.report.law_table import LEGEND, law_table

    out.print(law_table(found))
    out.print(LEGEND)
    if found.causes:
        out.print(f"Estimated beside every law: {', '.join(found.causes)}.")
    for law, why in found.aside.items():
        out.print(f"Left aside: {law}, {why}")
    out.print(found.verdict)
    for warning in found.warnings:
        out.print(f"Warning: {warning}", style="bold")
