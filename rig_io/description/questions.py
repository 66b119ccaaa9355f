"""What cannot be known from the logs: one question after the other, each with the form of its answer."""

from dataclasses import dataclass, replace

from fmu_models.base.errors import StickslipError
from rig_io.description import quantities
from rig_io.description.answers import BELT, DRIVES, LASER_BEAM, LASER_LATENCY, LASER_NOISE, SPEED, Answers
from rig_io.description.draft import Draft, check_named, unit_fault
from rig_io.logs.beam import BEAMS
from rig_io.logs.columns import ANGLE_SOURCES, TIME, metres
from rig_io.logs.log import RIG_UNITS

COLUMNS_RIGHT = "columns"
MEANINGS = {
    "J": "moment of inertia of the disc",
    "k": "rotational stiffness of its spring",
    "c": "damping of the disc (a free decay would tell it)",
    "R": "radius of the disc, where the driving disc touches and the laser looks",
    "r": "radius of the driving discs",
    "N0": "normal force of driving disc 0",
    "N1": "normal force of driving disc 1",
}


@dataclass(frozen=True)
class Question:
    """key: what is asked, as it is set by --set (or "columns"); text; form: example of an answer; proposal: taken where
    no answer is given, "" if there is none."""

    key: str
    text: str
    form: str
    proposal: str = ""


def questions(draft: Draft) -> list[Question]:
    """The open questions, in the order to be asked in."""
    asked_for = []
    faults = missing(draft)
    guessed = any(column.guessed for log in draft.logs for file in log.files for column in file.columns)
    guessed = guessed or any(not log.kind_said for log in draft.logs)
    if faults or (guessed and not draft.like):
        text = "Are roles, units and kinds as shown?" if not faults else f"{' '.join(faults)} What is to be changed?"
        asked_for.append(
            Question(COLUMNS_RIGHT, text, "yes, or COLUMN=ROLE UNIT; FILE=free-decay", "" if faults else "yes")
        )
    asked_for += [_instrument(name, draft) for name in _instruments(draft) if draft.instrument(name) is None]
    for log in draft.logs:
        driven = log.kind != "stick-slip" or any(role.startswith("drive") for role in log.roles)
        if not driven and draft.speed(log) is None:
            file = log.files[0].path.name
            text = f"No column of {file} shows the drive (drive0_count or drive0_speed). Its nominal speed?"
            asked_for.append(Question(f"{SPEED}{file}", text, "VALUE ± UNCERTAINTY rad/s (or unknown)"))
    for name in _constants(draft):
        if name not in draft.rig:
            text = f"{name}: {MEANINGS[name]}, with its standard uncertainty?"
            asked_for.append(Question(name, text, f"VALUE ± UNCERTAINTY {RIG_UNITS[name]} (or unknown)"))
    return asked_for


def optional(draft: Draft) -> list[Question]:
    """What a fit can do without: asked where somebody answers, and otherwise not known."""
    driven = (draft.instrument(name) or {} for name in DRIVES)
    text = "Belt between motor and disc, where the encoder sits on the motor: by how much does it creep under load?"
    open_belt = any(one.get("ratio", 1) != 1 and "creep" not in one for one in driven)
    belts = [Question(BELT, text, "0.5 ± 0.2 %, unknown, or gear", "unknown")] if open_belt else []
    if "laser" not in draft.roles:
        return belts
    seen = "; ".join(f"{name} ({beam.words}, {beam.formula})" for name, beam in BEAMS.items())
    asked_for = [Question(LASER_BEAM, f"Laser: what does it see? {seen}.", "arc, or sine 3 deg if tilted", "sine")]
    text = "Laser: rms noise of its readings, from which a fit knows how far the values are from the best possible?"
    asked_for.append(Question(LASER_NOISE, text, "20 um (or unknown)", "unknown"))
    text = "Laser: how late is it beside the counts, by a filter, or since channels are read in turn?"
    asked_for.append(Question(LASER_LATENCY, text, "250 us, or butterworth 4, 50 Hz", "0 s"))
    said = {LASER_BEAM: "beam", LASER_NOISE: "noise", LASER_LATENCY: "latency"}
    return belts + [question for question in asked_for if said[question.key] not in draft.beside]


def missing(draft: Draft) -> list[str]:
    """Sentences on what a log lacks to be read."""
    faults = []
    for log in draft.logs:
        names = " and ".join(file.path.name for file in log.files)
        if TIME.name not in log.roles and "sampling_rate" not in draft.answers.values:
            faults.append(f"No column of {names} is the time (or say the sampling_rate).")
        if not log.roles & set(ANGLE_SOURCES):
            faults.append(f"No column of {names} shows the disc (laser, encoder_count or angle).")
        columns = [column for file in log.files for column in file.columns]
        faults += [
            f"The unit of '{column.name}' ({column.role}) is not known."
            for column in columns
            if column.role and column.unit is None
        ]
        faults += [fault for column in columns if (fault := unit_fault(column))]
    return list(dict.fromkeys(faults))


def _instruments(draft: Draft) -> list[str]:
    encoders = [name for name in ("encoder", "drive0", "drive1") if f"{name}_count" in draft.roles]
    lasers = [laser for log in draft.logs for file in log.files if (laser := file.column("laser")) is not None]
    return (["laser"] if any(not metres(laser.unit) for laser in lasers) else []) + encoders


def _instrument(name: str, draft: Draft) -> Question:
    if name == "laser":
        return Question(
            name, "Laser: metres per volt, and volts when the disc is at rest?", "0.01 ± 0.00002 m/V, 5 V (or unknown)"
        )
    label = "the encoder of the disc" if name == "encoder" else f"the encoder of driving disc {name[-1]}"
    like = draft.instrument("encoder" if name != "encoder" else "drive0") or {}
    lines = like.get("pulses_per_revolution")
    proposal = "" if lines is None else f"{lines}{' x4' if like.get('quadrature') else ''}"
    return Question(
        name,
        f"Lines per revolution of {label}?",
        "1000, 1000 x4 where all edges count, or 1000, ratio 3.2 behind a gear",
        proposal,
    )


def _constants(draft: Draft) -> list[str]:
    """Constants that a fit needs; k and c come from a free decay."""
    sliding = [log for log in draft.logs if log.kind == "stick-slip"]
    if not sliding:
        return ["R"] if "laser" in draft.roles else []
    decay = any(log.kind == "free-decay" for log in draft.logs) or any(
        resource.get("experiment", {}).get("kind") == "free-decay" for resource in draft.known.get("resources", [])
    )
    decay = decay or draft.decay is not None
    forces = sorted({f"N{contact[-1]}" for log in sliding for contact in log.contacts})
    return ["J", *(() if decay else ("k", "c")), "R", "r", *forces]


def answered(draft: Draft, question: Question, text: str) -> Answers:
    """The answers with one more. StickslipError: the answer is not of the form that is asked for."""
    answer = text.strip() or question.proposal
    if not answer:
        raise StickslipError(f"An answer is needed: {question.form}.")
    answers = draft.answers
    if question.key == COLUMNS_RIGHT:
        if answer.lower() in ("yes", "y", "ja", "j", "oui", "si", "sí"):
            if missing(draft):
                raise StickslipError(f"{' '.join(missing(draft))} Say {question.form}.")
            return replace(answers, confirm=True)
        changed = replace(answers.with_columns(answer), confirm=True)
        check_named(replace(draft, answers=changed))
        return changed
    if question.key == "laser":
        quantities.laser(answer, "laser")
    elif question.key.startswith(SPEED):
        quantities.quantity(answer, "rad/s", question.key)
    elif question.key == LASER_NOISE:
        quantities.noise(answer, LASER_NOISE)
    elif question.key == LASER_LATENCY:
        quantities.latency(answer, LASER_LATENCY)
    elif question.key == BELT:
        quantities.belt(answer, BELT)
    elif question.key == LASER_BEAM:
        quantities.beam(answer, LASER_BEAM)
    elif question.key in RIG_UNITS:
        quantities.quantity(answer, RIG_UNITS[question.key], question.key)
    else:
        quantities.encoder(answer, question.key)
    return replace(answers, values={**answers.values, question.key: answer})
