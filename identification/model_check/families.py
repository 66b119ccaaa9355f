"""A family of logs against the fitted model: phase portraits, sticks and bifurcations over the drive speed.

The family is ordered by the one drive speed that varies. Logs without stick, above the bifurcation, are members like
the others. Where the model has both steady sliding and a cycle with stick (between its Hopf and its fold speed), a log
is held against the motion that it shows: which of the two a bench ends in is decided by its start, not by the law.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Pictured
from identification.fit.followed import followed_in
from identification.fit.result import FrictionFit
from identification.fitted_model.model import FittedModel, SimulatedMotion, check_rig_of, fitted_model, fitted_rig
from identification.measurement.motion import DiscMotion
from identification.measurement.seen_beam import beam_words
from identification.model_check import bifurcations as bifurcations
from identification.model_check.at_log import SwayedError, model_at, swayed
from identification.model_check.bifurcations import BifurcationComparison, MeasuredBifurcation, Transition
from identification.model_check.portraits import (
    MEANING,
    Portrait,
    PortraitComparison,
    Rest,
    Settling,
    compare_motions,
    sequence_of,
)
from identification.model_check.processing import Processing, measured_motions
from rig_io.logs.log import RigLog

if TYPE_CHECKING:
    import pandas

    from fmu_models.scene.scene import Scene

CERTAIN = ("same motion", "period")  # of a motion that has not settled, what is judged
STEADY = 0.02  # relative spread of a drive speed up to which it counts as held


@dataclass(frozen=True, eq=False)
class FamilyComparison(Pictured, Recorded):
    """A family in order of the drive speed that varies. varied: its disc; hopf: rad/s, predicted speed above which
    steady sliding is stable (None: not one); notes: what was left out, and why."""

    RECORD = ("passed", "varied", "hopf_speed=hopf", "bifurcations", "comparisons=members", "meaning", "notes")
    meaning = MEANING

    members: tuple[PortraitComparison, ...]
    varied: str
    hopf: float | None
    bifurcations: tuple[BifurcationComparison, ...]
    notes: tuple[str, ...] = ()

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each log: drive speeds (rad/s), every metric, whether all that are judged are kept."""
        import pandas

        rows = [
            {**member.drive_speeds, **{v.name: v.value for v in member.verdicts}, "passed": member.passed}
            for member in self.members
        ]
        return pandas.DataFrame(rows, index=pandas.Index([member.log for member in self.members], name="log"))

    def _heading(self) -> str:
        return f"FamilyComparison: {len(self.members)} logs, {'all judged kept' if self.passed else 'FAIL'}"

    def _contents(self) -> Mapping[str, Any]:
        contents = {member.log: f"{member.drives}: {'pass' if member.passed else 'FAIL'}" for member in self.members}
        return {**contents, "hopf": self.hopf, "notes": self.notes or None}

    @property
    def passed(self) -> bool:
        """Whether every judged metric of every member and every judged bifurcation is kept."""
        return all(member.passed for member in self.members) and all(
            bifurcation.passed is not False for bifurcation in self.bifurcations
        )


def compare_families(
    fit: FrictionFit,
    logs: Sequence[RigLog],
    *,
    scene: Scene | None = None,
    uncertainty: bool = True,
    progress: Callable[[float], None] = lambda _: None,
) -> tuple[FamilyComparison, ...]:
    """Measured against modelled motions at the mean drive speeds of each log, and bifurcations over the drive speed: a
    family for every set of discs in contact.

    logs: of the rig of the fit, not necessarily those fitted; a free decay among them gives the zero of the angle.
    scene: its FMU, start and laws in place of the rig's. uncertainty: of the predicted bifurcation speeds.
    StickslipError: logs of another rig, of other discs or materials, a log that is no motion, or a law that the FMU
    does not have.
    """
    families = measured_motions(logs, fitted_rig(fit).natural_period)
    for contacts, motions in families.items():
        check_rig_of(fit, contacts, [motion.log for motion in motions])
    comparisons = []
    for number, (contacts, motions) in enumerate(families.items()):
        model = fitted_model(fit, scene, contacts)
        comparison = _family(
            fit, model, motions, uncertainty, lambda share, done=number: progress((done + share) / len(families))
        )
        said, taken = logs[0].calibration.laser, motions[0].log.calibration.laser
        if said and taken and taken.beam != said.beam:
            comparison = replace(comparison, notes=(beam_words(said, [taken.beam]), *comparison.notes))
        comparisons.append(comparison)
    return tuple(comparisons)


def _family(
    fit: FrictionFit,
    model: FittedModel,
    motions: Sequence[DiscMotion],
    uncertainty: bool,
    progress: Callable[[float], None],
) -> FamilyComparison:
    """The comparison of one family."""
    processing = processing_of(model)
    varied = _varied(motions)
    motions = sorted(motions, key=lambda motion: drive_speeds(motion)[varied])
    members, left_out = [], []
    for number, motion in enumerate(motions):
        try:
            members.append(_member(model_at(fit, model, motion), processing, motion))
        except StickslipError as error:
            if not (sways := tuple(swayed(motion))):
                raise
            left_out.append(f"'{motion.log.name}' is left out. {' '.join((str(error), *sways))}")
        progress(0.5 * (number + 1) / len(motions))
    if not members:
        raise SwayedError(" ".join(left_out))
    fixed, notes = _fixed_speeds(motions, varied)
    notes = (*(f"Log '{member.log}' {member.settling.words}." for member in members if member.settling), *notes)
    kept_logs = {member.log for member in members}
    sways = (words for motion in motions if motion.log.name in kept_logs for words in swayed(motion))
    notes = (*followed_in(fit.structure), *left_out, *sways, *notes)
    if fixed is None:
        return FamilyComparison(tuple(members), varied, None, (), notes)
    predicted, hopf = _predicted(model, varied, fixed, [member.drive_speeds[varied] for member in members])
    # what swings and has not settled yet may still come to stick, or to rest; a swing that dies out has told
    conclusive = [
        member
        for member in members
        if not member.settling or member.settling.measured or isinstance(member.measured, Rest)
    ]
    measured = _measured(conclusive, varied, model)
    progress(0.7)
    if uncertainty:
        for i, transition in enumerate(predicted):
            predicted[i] = bifurcations.with_uncertainty(fit, model, transition, fixed)
            progress(0.7 + 0.3 * (i + 1) / len(predicted))
    return FamilyComparison(tuple(members), varied, hopf, _matched(measured, predicted, hopf), notes)


def processing_of(model: FittedModel) -> Processing:
    """The processing that makes portraits of the model's motions, and of those measured beside them."""
    p = model.parameters
    return Processing(p["r"], p["R"], model.natural_period, arrangement=model.arrangement, changeover=model.changeover)


def drive_speeds(motion: DiscMotion) -> dict[str, float]:
    """Mean drive speeds by contact, rad/s."""
    return {contact: float(np.mean(row)) for contact, row in zip(motion.log.contacts, motion.drives, strict=True)}


def _member(model: FittedModel, processing: Processing, motion: DiscMotion) -> PortraitComparison:
    """One log against the model's motion at its drive speeds."""
    speeds = drive_speeds(motion)
    settled = processing.settled(motion.time, motion.angle)
    if settled != motion.time[0]:
        return _unsettled(model, processing, motion, settled)
    length = float(motion.time[-1] - motion.time[0])
    run = model.run(speeds, length, motion.step)
    measured, modelled = _motions(processing, motion, run, f"the model at the drive speed of '{motion.log.name}'")
    sliding = model.sliding(speeds)
    if not sequence_of(measured) and sequence_of(modelled) and sliding is not None and sliding.damping > 0:
        modelled = Rest(sliding.angle, 0.0, "steady sliding (from another start stick-slip)")
    verdicts = compare_motions(measured, modelled)
    return PortraitComparison(motion.log.name, speeds, measured, modelled, verdicts, length=length, step=motion.step)


def _unsettled(
    model: FittedModel, processing: Processing, motion: DiscMotion, settled: float | None
) -> PortraitComparison:
    """One log that has not settled when it begins against the model from the state in which it begins; both from where
    each has settled (s), or all of both."""
    speeds = drive_speeds(motion)
    onset, angle, speed = processing.state(motion.time, motion.angle)
    start = {**model.start, "theta": angle, "omega": speed}
    length = float(motion.time[-1]) - onset
    run = model.run(speeds, length, motion.step, transient=0.0, start=start)
    runs = processing.settled(run.time, run.angle)
    begins = (-np.inf if settled is None else settled, -np.inf if settled is None or runs is None else runs)
    label, first = f"the model from the first state of '{motion.log.name}'", float(motion.time[0])
    measured, modelled = _motions(processing, motion, run, label, begins)
    settling = Settling(None if settled is None else settled - first, None if runs is None else runs + onset - first)
    verdicts = compare_motions(measured, modelled)
    if settled is None:  # a swing that grows or dies is as large as its begin, which is known but roughly
        verdicts = tuple(
            verdict if verdict.name in CERTAIN else replace(verdict, limit=None, passed=None) for verdict in verdicts
        )
    return PortraitComparison(motion.log.name, speeds, measured, modelled, verdicts, settling)


def _motions(
    processing: Processing,
    motion: DiscMotion,
    run: SimulatedMotion,
    label: str,
    begins: tuple[float, float] = (-np.inf, -np.inf),
) -> tuple[Portrait | Rest, Portrait | Rest]:
    """A log and its model, processed alike, from a time (s) of each on."""
    late, later = motion.time >= begins[0], run.time >= begins[1]
    drives = {on: row[late] for on, row in zip(motion.log.contacts, motion.drives, strict=True)}
    steady = {contact: np.full(np.count_nonzero(later), speed) for contact, speed in drive_speeds(motion).items()}
    states = {contact: row[later] for contact, row in run.states.items()}
    return (
        processing.motion(motion.time[late], motion.angle[late], drives, f"log '{motion.log.name}'"),
        processing.motion(run.time[later], run.angle[later], steady, label, states),
    )


def _varied(motions: Sequence[DiscMotion]) -> str:
    """The disc whose drive speed differs most from log to log."""
    speeds = [drive_speeds(motion) for motion in motions]
    return max(speeds[0], key=lambda contact: float(np.ptp([speed[contact] for speed in speeds])))


def _fixed_speeds(motions: Sequence[DiscMotion], varied: str) -> tuple[dict[str, float] | None, tuple[str, ...]]:
    """Speeds of the other drives; None, and why, where they are not held."""
    fixed = {}
    for contact in motions[0].log.contacts:
        speeds = np.array([drive_speeds(motion)[contact] for motion in motions])
        if contact == varied:
            if np.ptp(np.sign(speeds)) > 0:
                return None, (f"The drive of {varied} turns both ways in this family: no bifurcation was looked for.",)
            continue
        if np.ptp(speeds) > STEADY * float(np.abs(speeds).max()):
            return None, (
                f"The drive of {contact} varies as well (from {speeds.min():.3g} to {speeds.max():.3g} rad/s): the "
                "logs are no family of one speed, and no bifurcation was looked for.",
            )
        fixed[contact] = float(np.mean(speeds))
    return fixed, ()


def _predicted(
    model: FittedModel, varied: str, fixed: Mapping[str, float], speeds: Sequence[float]
) -> tuple[list[Transition], float | None]:
    """Transitions over the range of the family and beyond, and the Hopf speed."""
    turn = float(np.sign(speeds[0]))
    low, high = 0.5 * min(map(abs, speeds)), 1.2 * max(map(abs, speeds))
    changes = bifurcations.transitions(model, varied, fixed, turn * low, turn * high, beyond=len(model.contacts) == 1)
    top = max([high, *(1.2 * abs(change.speed) for change in changes)])
    return list(changes), bifurcations.hopf_speed(model, varied, fixed, turn * 0.05 * low, turn * top)


def _measured(
    members: Sequence[PortraitComparison], varied: str, model: FittedModel
) -> list[tuple[MeasuredBifurcation, float | None]]:
    """Brackets between neighbours that stick otherwise, each with what the model gives by the same extrapolation."""
    brackets: list[tuple[MeasuredBifurcation, float | None]] = []
    sets = [_sticking(member.measured) for member in members]
    speeds = [member.drive_speeds[varied] for member in members]
    for i in range(len(members)):
        last = i + 1 == len(members)
        if (last and not (len(model.contacts) == 1 and sets[i])) or (not last and sets[i] == sets[i + 1]):
            continue
        after = () if last else sets[i + 1]
        bracket = MeasuredBifurcation(varied, speeds[i], float("inf") if last else speeds[i + 1], sets[i], after)
        analogue = None
        if len(sets[i]) == 1 and not after:
            peers = [m for m, s in zip(members[: i + 1], sets, strict=False) if s == sets[i]]
            carried = _extrapolated([m.measured for m in peers], peers, varied)
            modelled = _extrapolated([m.model for m in peers], peers, varied)
            analogue = modelled[0] if modelled else None
            bracket = replace(bracket, estimate=carried[0], deviation=carried[1]) if carried else bracket
        brackets.append((bracket, analogue))
    return brackets


def _sticking(motion: Portrait | Rest) -> tuple[str, ...]:
    """The discs that stick at some time."""
    return tuple(sorted({contact for discs in sequence_of(motion) for contact in discs}))


def _extrapolated(
    motions: Sequence[Portrait | Rest], members: Sequence[PortraitComparison], varied: str
) -> tuple[float, float] | None:
    rows = []
    for motion, member in zip(motions, members, strict=True):
        if isinstance(motion, Portrait):
            speed, stick = member.drive_speeds[varied], motion.sticks[varied]
            rows.append((speed, *bifurcations.stick_angle(stick, speed)))
    if not rows:
        return None
    speeds, squares, spread = zip(*rows, strict=True)
    return bifurcations.extrapolated(speeds, squares, spread)


def _matched(
    brackets: Sequence[tuple[MeasuredBifurcation, float | None]], predicted: Sequence[Transition], hopf: float | None
) -> tuple[BifurcationComparison, ...]:
    """Each bracket with the nearest prediction of the same change; predictions without a bracket by themselves."""
    unmatched = list(predicted)
    comparisons = []
    for bracket, analogue in _joined(brackets, predicted):
        same = [p for p in unmatched if (p.before, p.after) == (bracket.before, bracket.after)]
        if not same:
            # logs so far apart see several changes as one
            same = [p for p in unmatched if bracket.low <= p.speed <= bracket.high]
        middle = bracket.low if not np.isfinite(bracket.high) else 0.5 * (bracket.low + bracket.high)
        nearest = min(same, key=lambda p: abs(p.speed - middle), default=None)
        if nearest is not None:
            unmatched.remove(nearest)
        comparisons.append(
            BifurcationComparison(bracket, nearest, analogue, agreement(bracket, nearest, analogue, hopf))
        )
    comparisons += [BifurcationComparison(None, transition, None, None) for transition in unmatched]
    return tuple(sorted(comparisons, key=lambda pair: pair.predicted.speed if pair.predicted else pair.measured.low))  # type: ignore[union-attr]


def _joined(
    brackets: Sequence[tuple[MeasuredBifurcation, float | None]], predicted: Sequence[Transition]
) -> list[tuple[MeasuredBifurcation, float | None]]:
    """Two brackets as one, where together they are a change that is predicted and alone they are none: discs that turn
    nearly alike both seem to stick in between."""
    changes = {(transition.before, transition.after) for transition in predicted}
    joined: list[tuple[MeasuredBifurcation, float | None]] = []
    for bracket, analogue in brackets:
        last = joined[-1][0] if joined else None
        if last is not None and (last.before, last.after) not in changes and (last.before, bracket.after) in changes:
            joined[-1] = (replace(last, high=bracket.high, after=bracket.after), None)
        else:
            joined.append((bracket, analogue))
    return joined


def agreement(
    seen: MeasuredBifurcation, predicted: Transition | None, model: float | None, hopf: float | None
) -> bool | None:
    """Whether the prediction can be within the bracket (a bench may leave the cycle from the Hopf speed on), and the
    estimate, if there is one, is as near to it or to what the model gives alike as both are known; None where any speed
    would be, within `bifurcations.VAGUE`."""
    if predicted is None:
        return False
    reach = bifurcations.COVER * (predicted.deviation if np.isfinite(predicted.deviation) else 0.0)
    known = 0.5 * (seen.high - seen.low) + reach
    if seen.estimate is not None:
        off = min(abs(seen.estimate - value) for value in (predicted.speed, model) if value is not None)
        within = float(np.hypot(reach, bifurcations.COVER * (seen.deviation or 0.0)))
        if off > within:
            return False
        known = min(known, within)
    least = predicted.speed if hopf is None or predicted.after else min(hopf, predicted.speed)
    if seen.low > predicted.speed + reach or seen.high < least - reach:
        return False
    return True if known < bifurcations.VAGUE * predicted.speed else None
