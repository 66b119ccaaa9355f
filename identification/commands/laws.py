"""Command that says which law the logs ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Settings
from identification.commands.logs import Logs, ReaderOption, read_logs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from identification.next_step.laws import LawComparison, LawScore


def laws(
    logs: Logs,
    estimator: Annotated[str, typer.Option(help="weak-form or savitzky-golay.")] = "weak-form",
    contact: Annotated[
        bool, typer.Option("--contact", help="Rigid contact against bristles (LuGre) too, over whole cycles.")
    ] = False,
    settings: Settings = None,
    reader: ReaderOption = None,
    allow_no_stick: Annotated[bool, typer.Option("--allow-no-stick", help="Take logs that never stick.")] = False,
    json: Json = False,
) -> None:
    """Compare friction laws on the same logs, by information criteria and by the prediction of held-out logs.

    Example: stickslip laws data/rigs/paper_rubber
    """
    from identification.measurement.pooling import pool
    from identification.next_step.laws import compare_contacts, compare_laws

    with console.progress("comparing laws") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"), reader=reader)
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
