"""One page with everything that the fit of a machine says, and the machine run beside its logs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fmu_models.base.errors import StickslipError
from fmu_models.language.mechanism import Mechanism
from fmu_models.report.document import bullets, drawing, glance, paragraph, section
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import MachineLog
from identification.machines.predicted import Predicted, predict_efforts
from identification.model_check.machine_runs import MachineRun, machine_runs
from identification.report.citations import machine_citations
from identification.report.law_table import LEGEND
from identification.report.machine_figures import draw_effort, draw_friction, machine_fit_figure, machine_runs_figure
from identification.report.machine_tables import laws_tables, meaning, parameters_table, runs_table, scores_table
from identification.report.page import Findings, counted, warned


@dataclass(frozen=True, eq=False)
class MachineFindings(Findings):
    """What the report of a machine is made of. seen, others: efforts of logs that were fitted and of others; runs:
    beside the logs; notes: what could not be shown, and why."""

    RECORD = ("fit", "runs", "notes")

    fit: MachineFit
    mechanism: Mechanism
    seen: Sequence[Predicted]
    others: Sequence[Predicted]
    runs: Sequence[MachineRun]
    notes: Sequence[str]

    def title(self) -> str:
        return self.fit.title

    def about(self) -> str:
        return f"{len(self.fit.parameters)} base parameters by {self.fit.method}"

    def citations(self) -> list[str]:
        return machine_citations(self.fit)

    def summary(self) -> list[str]:
        fit = self.fit
        worst = max(
            fit.parameters, key=lambda parameter: parameter.standard_deviation / max(abs(parameter.value), 1e-300)
        )
        many = ", ".join(fit.logs) if len(fit.logs) == 1 else f"{len(fit.logs)} logs"
        off = max(fit.joints, key=lambda one: one.seen.relative_error)
        sentences = [
            f"Efforts are predicted to {100 * off.seen.relative_error:.1f} % or better (worst '{off.joint}'). "
            f"{counted('verdict', fit.verdicts)}",
            f"{len(fit.parameters)} base parameters of {fit.title} were found by {fit.method} in {many}.",
            f"Least well known is {worst.combination}: {worst.value:.4g} ± {worst.standard_deviation:.2g} "
            f"{worst.unit}.",
        ]
        every = [(one.relative, one.joint, run.log) for run in self.runs for one in run.joints if one.relative]
        if every:
            share, joint, log = max(every)
            sentences.append(
                f"Run from the measured state, it stays within {100 * share:.1f} % of the motion over "
                f"{self.runs[0].window:g} s (root mean square; worst '{joint}' in {log})."
            )
        return sentences

    def values(self) -> list[str]:
        """Verdicts; parameters; effort and friction of the joint that is predicted worst."""
        fit = self.fit
        table = parameters_table(fit).taking("value", "sd", "unit", "meaning").html()
        place = fit.joints.index(max(fit.joints, key=lambda joint: joint.seen.relative_error))
        joint = f"'{fit.joints[place].joint}', the joint that is predicted worst"
        panels = [
            (lambda axes: draw_effort(fit, axes, self.seen), f"Effort of {joint}: measured (line), model (dashed)."),
            (
                lambda axes: draw_friction(self.mechanism, fit, self.seen, place, axes),
                f"Friction of {joint}: effort less the rest (dots), model (line).",
            ),
        ]
        return [*warned("Verdicts", fit.verdicts), table, *([glance(panels)] if self.seen else [])]

    def sections(self) -> list[str]:
        """Efforts, friction laws, runs beside the logs, the machine, its parameters whole."""
        fit, runs = self.fit, self.runs
        efforts = "Effort of each joint, measured and by the fit, and what is left; shaded: logs that were not fitted."
        figure = machine_fit_figure(self.mechanism, fit, self.seen, self.others)
        parts = [drawing(figure, "efforts", efforts), scores_table(fit).html()]
        sections = [section("efforts", "Efforts, measured and modelled", parts)]
        if laws := laws_tables(fit):
            parts = [*(law.html() for law in laws), paragraph(LEGEND, "about")]
            sections.append(section("laws", "Friction laws", parts))
        if runs:
            beside = "Position of each joint, measured and as the engine moves the machine by the measured efforts."
            parts = [drawing(machine_runs_figure(fit, runs), "runs", beside), runs_table(runs).html()]
            sections.append(section("runs", "The machine beside its logs", parts))
        sections.append(section("machine", "The machine", [bullets([*_sentences(fit), *self.notes])]))
        whole = [parameters_table(fit).html(), paragraph(meaning(fit), "about")]
        return [*sections, section("tables", "Parameters, and what they rest on", whole)]


def machine_findings(
    fit: MachineFit,
    mechanism: Mechanism,
    logs: Sequence[MachineLog],
    *,
    progress: Callable[[float], None] = lambda _: None,
) -> MachineFindings:
    """Everything that is in the report of a machine. logs: those fitted, and others, that are only predicted.

    Errors as for `predict_efforts`.
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


def _sentences(fit: MachineFit) -> list[str]:
    where = f"Declared in {fit.declaration}" if fit.declaration else "Declared in a program"
    gravity = f", gravity {', '.join(f'{one:g}' for one in fit.gravity)} m/s2" if fit.gravity else ""
    sentences = [f"{where}{gravity}.", f"Logs: {', '.join(fit.logs)}."]
    return [*sentences, *([f"No effort shows {', '.join(fit.silent)}."] if fit.silent else [])]
