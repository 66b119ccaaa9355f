"""One page with everything that the fit of a machine says, and the machine run beside its logs."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import write_whole
from fmu_models.base.shown import Shown
from fmu_models.language.mechanism import Mechanism
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import MachineLog
from identification.machines.predicted import Predicted, predict_efforts
from identification.model_check.machine_runs import MachineRun, machine_runs
from identification.report.citations import machine_citations
from identification.report.law_table import LEGEND
from identification.report.machine_figures import machine_fit_figure, machine_runs_figure
from identification.report.machine_tables import laws_tables, meaning, parameters_table, runs_table, scores_table
from identification.report.page import drawing, rendered

TEMPLATE = "machine.html.j2"


@dataclass(frozen=True, eq=False)
class MachineFindings(Shown):
    """What a report is made of. seen, others: efforts of logs that were fitted and of others; runs: beside the logs;
    notes: what could not be shown, and why."""

    fit: MachineFit
    mechanism: Mechanism
    seen: Sequence[Predicted]
    others: Sequence[Predicted]
    runs: Sequence[MachineRun]
    notes: Sequence[str]

    def to_dict(self) -> dict[str, Any]:
        """The data of the report, plain values."""
        runs = [run.to_dict() for run in self.runs]
        return {"fit": self.fit.to_dict(), "runs": runs, "notes": list(self.notes)}


def machine_findings(
    fit: MachineFit,
    mechanism: Mechanism,
    logs: Sequence[MachineLog],
    *,
    progress: Callable[[float], None] = lambda _: None,
) -> MachineFindings:
    """Everything that is in the report of a machine. logs: those fitted, and others, that are only predicted.

    Raises:
        StickslipError: as in `predict_efforts`.
    """
    seen, others = ([log for log in logs if (log.name in fit.logs) is used] for used in (True, False))
    fitted, only_seen = (predict_efforts(mechanism, fit, part) if part else [] for part in (seen, others))
    progress(0.3)
    missing = sorted(set(fit.logs) - {log.name for log in seen})
    notes = [f"Not among the logs given, though fitted: {', '.join(missing)}."] if missing else []
    try:
        runs = machine_runs(mechanism, fit, logs, progress=lambda done: progress(0.3 + 0.7 * done))
    except StickslipError as error:
        runs = []
        notes.append(f"The machine could not be run: {error}")
    notes += [f"{run.log}: {why}" for run in runs for why in run.given_up]
    return MachineFindings(fit, mechanism, fitted, only_seen, runs, notes)


def machine_summary(findings: MachineFindings) -> list[str]:
    """What was found and how far it can be trusted, in sentences."""
    fit = findings.fit
    worst = max(fit.parameters, key=lambda one: one.standard_deviation / max(abs(one.value), 1e-300))
    many = ", ".join(fit.logs) if len(fit.logs) == 1 else f"{len(fit.logs)} logs"
    off = max(fit.joints, key=lambda one: one.seen.relative_error)
    said = [
        f"{len(fit.parameters)} base parameters of {fit.title} were found by {fit.method} in {many}.",
        f"Least well known is {worst.combination}: {worst.value:.4g} +- {worst.standard_deviation:.2g} {worst.unit}.",
        f"Efforts are predicted to {100 * off.seen.relative_error:.1f} % or better (worst '{off.joint}').",
    ]
    every = [(one.relative, one.joint, run.log) for run in findings.runs for one in run.joints if one.relative]
    if every:
        share, joint, log = max(every)
        said.append(
            f"Run from the measured state, it stays within {100 * share:.1f} % of the motion over "
            f"{findings.runs[0].window:g} s (root mean square; worst '{joint}' in {log})."
        )
    verdicts = {0: "There are no verdicts against it.", 1: "There is one verdict (below)."}
    return [*said, verdicts.get(len(fit.verdicts), f"{len(fit.verdicts)} verdicts (below).")]


def write_machine_report(findings: MachineFindings, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write the page.

    Raises:
        StickslipError: ``path`` exists and ``overwrite`` is false, or cannot be written.
    """
    text = machine_page(findings)
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, "utf-8")
    return Path(path)


def machine_page(findings: MachineFindings) -> str:
    """The page as text."""
    fit, runs = findings.fit, findings.runs
    efforts = "Effort of each joint, measured and by the fit, and what is left; shaded: logs that were not fitted."
    beside = "Position of each joint, measured and as the engine moves the machine by the measured efforts."
    return rendered(
        TEMPLATE,
        findings.to_dict(),
        title=fit.title,
        about=f"{len(fit.parameters)} base parameters by {fit.method}",
        fit=fit,
        summary=machine_summary(findings),
        parameters=parameters_table(fit),
        meaning=meaning(fit),
        efforts=drawing(
            machine_fit_figure(findings.mechanism, fit, findings.seen, findings.others), "efforts", efforts
        ),
        scores=scores_table(fit),
        laws=laws_tables(fit),
        legend=LEGEND,
        runs=drawing(machine_runs_figure(fit, runs), "runs", beside) if runs else None,
        run_table=runs_table(runs) if runs else None,
        machine=_sentences(fit),
        notes=findings.notes,
        citations=machine_citations(fit),
    )


def _sentences(fit: MachineFit) -> list[str]:
    where = f"Declared in {fit.declaration}" if fit.declaration else "Declared in a program"
    gravity = f", gravity {', '.join(f'{one:g}' for one in fit.gravity)} m/s2" if fit.gravity else ""
    said = [f"{where}{gravity}.", f"Logs: {', '.join(fit.logs)}."]
    return [*said, *([f"No effort shows {', '.join(fit.silent)}."] if fit.silent else [])]
