"""The fit of a machine of several joints: tables for a page and a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fmu_models.base.console import plain
from fmu_models.base.table import Cell, Column, Table, known_to, number, sd, table
from fmu_models.base.terminal_table import terminal
from identification.report.law_table import LEGEND, law_table

if TYPE_CHECKING:
    from rich.console import Group, RenderableType

    from identification.inference.comparison import LawComparison
    from identification.machines.machine_fit import MachineFit
    from identification.model_check.machine_runs import MachineRun

RUNS = "Runs from the measured state by the measured efforts; error, root mean square; share: of the motion, %"


def machine_report(fit: MachineFit) -> Group:
    """Everything that logs say of a machine."""
    from rich.console import Group

    parts = [terminal(parameters_table(fit)), terminal(scores_table(fit)), plain(meaning(fit))]
    return Group(*parts, *(plain(f"- {verdict}") for verdict in fit.verdicts))


def parameters_table(fit: MachineFit) -> Table:
    """Base parameters, by the method that was asked for and by least squares."""
    rows = [
        [
            one.combination,
            known_to(one.value, one.standard_deviation),
            sd(one.standard_deviation),
            one.unit,
            known_to(one.least_squares, one.least_squares_deviation),
            sd(one.least_squares_deviation),
            number(one.shift, "+.1f"),
        ]
        for one in fit.parameters
    ]
    columns = ["base parameter", "value", "sd", "unit", *(Column(x, spare=2) for x in ("least squares", "its sd"))]
    title = f"{fit.title}: by {fit.method}, cutoff {fit.cutoff:g} Hz, efforts {fit.parallel_cutoff:g} Hz"
    return table(title, [*columns, Column("shift, sd", spare=1)], rows)


def scores_table(fit: MachineFit) -> Table:
    """How well efforts are predicted, joint by joint."""
    rows = [
        [one.joint, *(_per_cent(error) for error in (one.seen, one.left_out, one.held_out, one.free_run))]
        for one in fit.joints
    ]
    columns = ("joint", "seen", "logs left out in turn", "held out", "free run of 1 s")
    return table("Errors, % of the effort; of a free run, % of the motion", columns, rows)


def meaning(fit: MachineFit) -> str:
    """What the numbers rest on."""
    known = ", ".join(f"{name} = {value:g}" for name, value in fit.known.items())
    return (
        f"{fit.samples} thinned samples of {len(fit.logs)} logs; condition of the columns {fit.condition:.3g}. "
        "Deviations: the larger of Newey-West's and that of a jackknife over logs."
        + (f" Taken as known: {known}." if known else "")
    )


def runs_table(runs: Sequence[MachineRun]) -> Table:
    """How far the machine comes from each log, joint by joint."""
    rows = [
        [
            run.log,
            *(cell for one in run.joints for cell in (number(one.error, ".3g"), _per_cent(one.relative))),
            number(len(run.given_up), "d"),
        ]
        for run in runs
    ]
    joints = (Column(*head) for one in runs[0].joints for head in ((f"{one.joint} error", one.unit), ("share", "%")))
    return table(f"{RUNS}; windows of {runs[0].window:g} s", ["log", *joints, Column("given up", spare=1)], rows)


def runs_report(fit: MachineFit, runs: Sequence[MachineRun]) -> Group:
    """The machine beside its logs."""
    from rich.console import Group

    said = [plain(f"- {run.log}: {why}") for run in runs for why in run.given_up[:1]]
    return Group(plain(fit.title, "bold"), terminal(runs_table(runs)), *said)


def joint_laws(compared: Mapping[str, LawComparison]) -> Group:
    """Friction laws of each joint."""
    from rich.console import Group

    parts: list[RenderableType] = []
    for joint, found in compared.items():
        shown = law_table(found)
        shown.title = f"{joint}: {shown.title}"
        parts += [shown, plain(f"- {found.verdict}")]
    return Group(*parts, plain(LEGEND))


def _per_cent(error: float | None) -> Cell:
    return number(None if error is None else 100 * error, ".1f")
