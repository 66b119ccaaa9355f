"""What to think of the fit of a machine, in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.language.mechanism import Mechanism
from identification.inference.uncertainty import LAG_RULE
from identification.machines.doubts import STILL
from identification.machines.identify import Identified
from identification.machines.machine_fit import MachineParameter
from identification.machines.scores import FREE_RUN, JointScore, Score

BIASED = 3.0  # standard deviations between least squares and instruments
ZERO = 1.96  # standard deviations: a value nearer to zero cannot be told from it
OPEN = 300.0  # condition of the columns: logs of good motion have 5 to 100
ROUGH = 0.1  # of its value: a deviation of friction that a lower cutoff would mend
POOR = 0.8  # of the variance: a model that explains less does not describe the machine
UNSEEN_WORSE = 1.5  # times the error of the fit: the parameters belong to the log, not to the machine
UNEVEN = 3.0  # times the usual window: a free run that few windows decide
TOO_SMALL = 1.5  # times: white standard deviations smaller than that by this are worth a warning


@dataclass(frozen=True)
class Quality:
    """What rows say of themselves. condition: of the weighted columns, each scaled to one; inseparable: parameters that
    they tell apart least; neighbour_correlation: of residuals; effective_samples: independent ones that they are worth;
    oversampled: more samples than the low-pass leaves independent, so that even white noise is coloured."""

    condition: float
    inseparable: Sequence[str]
    neighbour_correlation: float
    effective_samples: float
    oversampled: bool


def verdicts(
    mechanism: Mechanism,
    result: Identified,
    parameters: Sequence[MachineParameter],
    joints: Sequence[JointScore],
    quality: Quality,
    pulled: Mapping[str, tuple[float, float]],
    late: tuple[float, float] | None,
) -> list[str]:
    """All verdicts on a fit. pulled: what `doubts.pulled` gives; late: what `effort_delay` gives."""
    return [
        *_left_open(quality),
        *(on_score for joint in joints for on_score in _on_scores(joint)),
        *_on_standstill(pulled),
        *([] if late is None else _on_delay(*late)),
        *_biased(result, [parameter for parameter in parameters if parameter.name not in pulled]),
        *_on_values(mechanism, result, parameters),
        *_on_colour(parameters, len(result.rows.effort), quality),
        *_on_runs(result, joints),
        *([f"No effort shows {', '.join(result.base.silent)}, whatever the motion."] if result.base.silent else []),
        *_gravity(result),
    ]


def _on_standstill(pulled: Mapping[str, tuple[float, float]]) -> list[str]:
    if not pulled:
        return []
    values = ", ".join(f"{name} {without:.4g} in place of {full:.4g}" for name, (full, without) in pulled.items())
    return [
        f"Where joints hardly move the efforts are not those of the model: without samples slower than {STILL:g} of a "
        f"joint's usual speed least squares gives {values}. Joints stick at their turns, or friction is another one "
        f"near standstill. Leave these samples out: --still {STILL:g}."
    ]


def _on_delay(delay: float, deviation: float) -> list[str]:
    lag = value_with_sd(1e3 * abs(delay), 1e3 * deviation, "ms")
    return [
        f"Efforts come {lag} {'after' if delay > 0 else 'before'} the positions that they go with, which friction and "
        "inertia take up: move their time in the logs by as much."
    ]


def _left_open(quality: Quality) -> list[str]:
    if quality.condition < OPEN:
        return []
    return [
        f"The logs hardly tell {', '.join(quality.inseparable)} apart (condition {quality.condition:.0f}): they show "
        "one combination, and each value rests on noise, more than its deviation says. Record motion at several "
        "frequencies and poses ('stickslip excite' designs it), or take one of them as known."
    ]


def _on_scores(joint: JointScore) -> list[str]:
    remarks, seen = [], joint.seen
    if seen.explained < POOR:
        remarks.append(
            f"Poor fit of '{joint.joint}': the residual is {100 * seen.relative_error:.0f} % of the effort, the model "
            f"fits {100 * (1 - seen.relative_error):.0f} % of it; {100 * seen.explained:.0f} % of its variance "
            "explained. That values can be reproduced does not make them valid: mend the model or the log before you "
            "use them (effort sensor, delay between the signals, play, missing terms, noise of the effort above the "
            "motion)."
        )
    unseen: Mapping[str, Score] = {"what was left out in turn": joint.left_out, **joint.held_out}
    for name, test in unseen.items():
        if test.explained < POOR <= seen.explained or test.relative_error > UNSEEN_WORSE * seen.relative_error:
            remarks.append(
                f"Worse on what the fit has not seen: '{joint.joint}' in {name}, error {100 * test.relative_error:.3g} "
                f"% against {100 * seen.relative_error:.3g} %, {100 * test.explained:.4g} % of the variance explained."
            )
    return remarks


def _biased(result: Identified, parameters: Sequence[MachineParameter]) -> list[str]:
    biased = [parameter.name for parameter in parameters if abs(parameter.shift) > BIASED]
    if not biased:
        return []
    remarks = [
        f"Least squares is biased in {', '.join(biased)} (more than {BIASED:g} deviations from the instruments): "
        "the noise of the positions is in its columns. Take the values by instruments, or lower the cutoff."
    ]
    rough = [
        parameter.name
        for parameter in parameters
        if parameter.frictional and parameter.standard_deviation > ROUGH * abs(parameter.value)
    ]
    if rough:
        remarks.append(
            f"{', '.join(rough)} rest on the velocity near its turns, where noise of the positions is strongest: they "
            f"scatter more than their deviations say. Lower the cutoff; {result.low:.2g} Hz pass the motion of these "
            "logs."
        )
    return remarks


def _on_values(mechanism: Mechanism, result: Identified, parameters: Sequence[MachineParameter]) -> list[str]:
    best = result.best
    positive = {p.name for p in mechanism.parameters if p.positive or p.minimum == 0}
    remarks = []
    for p, spec in zip(parameters, result.base.parameters, strict=True):
        must = p.name in positive and all(factor > 0 for _, factor in spec.others)
        must = must or (p.frictional and not spec.others)
        estimate = f"{p.combination} = {p.value:.4g} {p.unit}"
        if p.name in best.at_bound:
            remarks.append(f"{estimate} lies on a bound that was given: the logs ask for more.")
        elif p.name in best.held:
            remarks.append(f"{p.combination} was held at {p.value:.4g} {p.unit}.")
        elif must and p.value < 0:
            meaning = p.meaning or ("friction" if p.frictional else "what it stands for")
            sure = abs(p.value) > ZERO * p.standard_deviation
            remarks.append(
                f"{estimate} is below zero, which {meaning} cannot be"
                + (
                    ": check the signs of effort and motion, or leave it out."
                    if sure
                    else "; it is within its deviation."
                )
            )
        elif abs(p.value) < ZERO * p.standard_deviation:
            value = value_with_sd(p.value, p.standard_deviation, p.unit)
            remarks.append(
                f"{p.combination} cannot be told from zero: {value}. Motion that excites it more would help, or take "
                "it as known."
            )
    return remarks


def _on_colour(parameters: Sequence[MachineParameter], samples: int, quality: Quality) -> list[str]:
    if quality.oversampled:
        return []
    neighbours, effective = quality.neighbour_correlation, quality.effective_samples
    factors = {parameter.name: parameter.factor for parameter in parameters}
    # neighbours of white residuals are correlated as much in 1 of 20 logs
    if abs(neighbours) < 1.96 / np.sqrt(samples) or max(factors.values()) < TOO_SMALL:
        return []
    inflations = ", ".join(f"{name} {factor:.1f}" for name, factor in factors.items())
    return [
        f"The residuals are coloured (neighbours {neighbours:+.2f}): {samples} samples are worth {effective:.0f}. "
        f"Standard deviations for white noise are too small by {inflations}; those given allow for colour ({LAG_RULE})."
    ]


def _on_runs(result: Identified, joints: Sequence[JointScore]) -> list[str]:
    still = np.zeros((1, len(joints)))
    heavy = (result.regressor(still, still, still + 1) - result.regressor(still, still, still)).any()
    placed = any(piece.position.any() for piece in result.pieces)
    if not heavy or not placed:
        return []  # what has no mass or no measured place is not simulated
    remarks = []
    for joint in joints:
        if joint.free_run is None or joint.usual_run is None:
            remarks.append(f"Simulated from the measured state, '{joint.joint}' leaves the log within {FREE_RUN:g} s.")
        elif joint.free_run > UNEVEN * joint.usual_run:
            remarks.append(
                f"The free run of '{joint.joint}' hangs on where it begins: {100 * joint.free_run:.1f} % over all "
                f"windows of {FREE_RUN:g} s, {100 * joint.usual_run:.1f} % and less in half of them. Small errors grow "
                "where a pose is unstable (upright), and next to standstill."
            )
    return remarks


def _gravity(result: Identified) -> list[str]:
    """Whether the declared gravity is met in size and sign, joint by joint, where the declaration has values for it."""
    regressor = result.regressor
    remarks = []
    rng = np.random.default_rng(0)
    for number, joint in enumerate(regressor.joints):
        q = rng.uniform(-np.pi, np.pi, (50, len(regressor.joints)))
        standing = regressor(q, np.zeros_like(q), np.zeros_like(q))[:, number]
        declared = standing @ regressor.declared
        estimated = standing @ result.base.whole(result.best.values)
        if np.linalg.norm(declared) < 1e-9 * max(np.linalg.norm(estimated), 1e-12):
            continue
        ratio = float(estimated @ declared / (declared @ declared))
        if ratio < 0:
            remarks.append(
                f"The weight on '{joint}' comes out with the other sign: its effort or its position is reversed."
            )
        elif not 0.2 < ratio < 5:
            remarks.append(
                f"The weight on '{joint}' comes out {ratio:.3g} times the declared one: check the unit of its effort "
                "(N m, on the joint's side of the gear) and of its position (rad)."
            )
    return remarks
