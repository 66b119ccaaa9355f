"""The fit of a machine: tables for a page and a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fmu_models.base.console import plain
from fmu_models.base.table import Cell, PrintedColumn, PrintedTable, known_to, number, sd, table
from identification.inference.uncertainty import LAG_RULE
from identification.machines.identify import METHODS
from identification.machines.scores import FREE_RUN
from identification.report.law_table import LEGEND, law_table

if TYPE_CHECKING:
    from rich.console import Group

    from identification.machines.excite import Excitation
    from identification.machines.machine_fit import MachineFit, MachineParameter
    from identification.model_check.machine_runs import MachineRun

RUNS = "Runs from the measured state by the measured efforts; error, root mean square; share: of the motion, %"


def machine_report(fit: MachineFit) -> Group:
    """Everything that logs say of a machine."""
    from rich.console import Group

    head = [plain(fit.title, "bold"), plain(f"{fit.source}\n" if fit.source else "")]
    parts = [parameters_table(fit), scores_table(fit), plain(meaning(fit))]
    laws = [*laws_tables(fit), plain(LEGEND)] if fit.laws else []
    return Group(*head, *parts, *laws, *(plain(f"- {verdict}") for verdict in fit.verdicts))


def parameters_table(fit: MachineFit) -> PrintedTable:
    """Base parameters, by the method that was asked for and, beside instruments, by least squares."""
    squares = fit.method != METHODS[0]
    columns: list[str | PrintedColumn] = ["parameter", PrintedColumn("meaning", spare=4), "value", "sd"]
    columns += [PrintedColumn("sd if white", spare=3), *([PrintedColumn("ratio", spare=3)] if squares else [])]
    columns += ["unit"]
    if not squares:
        columns += [
            *(PrintedColumn(x, spare=2) for x in ("least squares", "its sd")),
            PrintedColumn("shift, sd", spare=1),
        ]
    return table(
        f"Values by {fit.method}, {_filters(fit)}", columns, [_row(parameter, squares) for parameter in fit.parameters]
    )


def _row(one: MachineParameter, squares: bool) -> list[str | Cell]:
    first: list[str | Cell] = [one.combination, one.meaning, known_to(one.value, one.standard_deviation)]
    first += [sd(one.standard_deviation), sd(one.white_deviation)]
    if squares:
        return [*first, number(one.factor, ".1f"), one.unit]
    by_squares = (known_to(one.least_squares, one.least_squares_deviation), sd(one.least_squares_deviation))
    return [*first, one.unit, *by_squares, number(one.shift, "+.1f")]


def _filters(fit: MachineFit) -> str:
    if fit.cutoff is None:
        return "filters of the recipe"
    moving = f", samples slower than {fit.still:g} of a joint's usual speed left out" if fit.still else ""
    return f"cutoff {fit.cutoff:g} Hz, efforts {fit.parallel_cutoff:g} Hz{moving}"


def scores_table(fit: MachineFit) -> PrintedTable:
    """How well efforts are predicted, joint by joint, in all that was asked."""
    first = fit.joints[0]
    parts = "logs" if len(fit.logs) > 1 else "parts"
    asked = {"fitted": [joint.seen for joint in fit.joints]}
    asked[f"its {parts}, left out in turn"] = [joint.left_out for joint in fit.joints]
    asked |= {log: [joint.held_out[log] for joint in fit.joints] for log in first.held_out}
    rows = [
        [
            name,
            *(_per_cent(score.relative_error) for score in scores),
            _per_cent(min(score.explained for score in scores)),
        ]
        for name, scores in asked.items()
    ]
    rows.append(
        [f"free run of {FREE_RUN:g} s", *(_per_cent(joint.free_run) for joint in fit.joints), number(None, ".1f")]
    )
    errors = [PrintedColumn(f"error of {joint.joint}", "%") for joint in fit.joints]
    explained = PrintedColumn("explained" if len(fit.joints) == 1 else "least explained", "%")
    return table(
        "Relative errors of efforts, of a free run that of the motion; variance explained",
        ["of", *errors, explained],
        rows,
    )


def meaning(fit: MachineFit) -> str:
    """What the numbers rest on."""
    known = ", ".join(f"{name} = {value:g}" for name, value in fit.known.items())
    return (
        f"{fit.samples} thinned samples of {', '.join(fit.logs)}, worth {fit.effective_samples:.0f} independent ones; "
        f"condition of the columns {fit.raw_condition:.5g}, scaled {fit.condition:.3g}. Deviations: {LAG_RULE}"
        + ("; that of a jackknife over logs where it is larger." if len(fit.logs) > 1 else ".")
        + (f" Taken as known: {known}." if known else "")
    )


def runs_table(runs: Sequence[MachineRun]) -> PrintedTable:
    """How far the machine comes from each log, joint by joint."""
    rows = [
        [
            run.log,
            *(cell for joint in run.joints for cell in (number(joint.error, ".3g"), _per_cent(joint.relative))),
            number(len(run.given_up), "d"),
        ]
        for run in runs
    ]
    joints = (
        PrintedColumn(*head)
        for joint in runs[0].joints
        for head in ((f"{joint.joint} error", joint.unit), ("share", "%"))
    )
    return table(f"{RUNS}; windows of {runs[0].window:g} s", ["log", *joints, PrintedColumn("given up", spare=1)], rows)


def runs_report(fit: MachineFit, runs: Sequence[MachineRun]) -> Group:
    """The machine beside its logs."""
    from rich.console import Group

    notes = [plain(f"- {run.log}: {why}") for run in runs for why in run.given_up[:1]]
    return Group(plain(fit.title, "bold"), runs_table(runs), *notes)


def excitation_table(found: Excitation) -> PrintedTable:
    """What a designed motion would tell: the deviation foretold of every base parameter."""
    title = f"Excitation of {found.machine}: {found.period:g} s, condition {found.condition:.3g}"
    rows = [[name, sd(deviation), found.units.get(name, "")] for name, deviation in found.deviations.items()]
    return table(title, ["parameter", "sd foretold", "unit"], rows)


def laws_tables(fit: MachineFit) -> list[PrintedTable]:
    """Friction laws of each joint, where they were compared."""
    return [law_table(found, joint) for joint, found in fit.laws.items()]


def _per_cent(error: float | None) -> Cell:
    return number(None if error is None else 100 * error, ".4g")
