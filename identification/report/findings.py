"""Everything that a report of a fit shows, gathered."""

from collections.abc import Callable, Sequence

from fmu_models.base.errors import StickslipError
from identification.fit.result import FrictionFit
from identification.fit.samples import samples_by_disc
from identification.measurement.free_decay import fit_free_decay
from identification.measurement.pooling import pool
from identification.model_check.at_log import SwayedError
from identification.model_check.families import compare_families
from identification.model_check.processing import NoCycleError
from identification.next_step.design import design
from identification.report.live import LiveFrame, live_frame
from identification.report.residuals import refitted
from identification.report.rig_page import RigFindings
from rig_io.logs.log import RigLog


def findings(
    fit: FrictionFit,
    logs: Sequence[RigLog],
    *,
    residuals: bool = True,
    uncertainty: bool = True,
    interactive: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> RigFindings:
    """Everything that is in the report of a fit; what cannot be had is left out with a note.

    logs: those fitted, and others that are only compared. residuals: fit once more, for the correlation of residuals
    and as a check; uncertainty: carried on to the predicted bifurcation speeds; interactive: the model live beside the
    measured portraits. ``progress`` is told the fraction done. Errors as for `compare_families`.
    """
    notes: list[str] = []
    try:
        families = compare_families(fit, logs, uncertainty=uncertainty, progress=lambda share: progress(0.5 * share))
    except (SwayedError, NoCycleError) as error:
        families = ()
        notes.append(f"The model's motion was not held against the logs: {error}")
    decays = [log for log in logs if log.kind == "free-decay"]
    names = {one.name for one in fit.logs}
    fitted = [log for log in logs if log.name in names]
    missing = sorted(names - {log.name for log in fitted})
    samples, evaluation = None, None
    if missing:
        notes.append(f"Not among the logs given, though fitted: {', '.join(missing)}. Figures of the fit lack them.")
    try:
        ready = pool([*fitted, *decays[:1]], allow_no_stick=True)
        samples = samples_by_disc(fit, ready) if not missing else None
        if residuals and not missing:
            evaluation, said = refitted(fit, ready)
            notes += said
    except StickslipError as error:
        notes.append(f"Residuals could not be found again: {error}")
    progress(0.9)
    decay = fit_free_decay(decays[0]) if decays else None
    try:
        following = design(fit)
    except StickslipError as error:
        following = None
        notes.append(f"No next experiment is proposed: {error}")
    live = live_frame(fit, families) if interactive else LiveFrame("", ())
    notes += live.notes
    return RigFindings(fit, logs, families, decay, samples, evaluation, following, live.html, notes)
