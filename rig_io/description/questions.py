"""What cannot be known from the logs: one question after the other, each with the form of its answer."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fmu_models.base.errors import StickslipError
from rig_io.description import quantities
from rig_io.description.answers import LASER_NOISE, SPEED, Answers
from rig_io.description.draft import Draft, check_named, is_length, unit_fault
from rig_io.description.runs import Log
from rig_io.logs.columns import ANGLE_SOURCES, TIME
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


def questions(made: Draft) -> list[Question]:
    """What is open, in the order to be asked in."""
    found = []
    faults = missing(made)
    guessed = any(one.guessed for log in made.logs for file in log.files for one in file.columns)
    guessed = guessed or any(not log.kind_said for log in made.logs)
    if faults or (guessed and not made.like):
        text = "Are roles, units and kinds as shown?" if not faults else f"{' '.join(faults)} What is to be changed?"
        found.append(
            Question(COLUMNS_RIGHT, text, "yes, or COLUMN=ROLE UNIT; FILE=free-decay", "" if faults else "yes")
        )
    found += [_instrument(name, made) for name in _instruments(made) if made.instrument(name) is None]
    found += [_speed(log) for log in made.logs if _lacks_drive(log) and made.speed(log) is None]
    return found + [_constant(name) for name in _constants(made) if name not in made.rig]


def _lacks_drive(log: Log) -> bool:
    return log.kind == "stick-slip" and not any(role.startswith("drive") for role in log.roles)


def _speed(log: Log) -> Question:
    file = log.files[0].path.name
    text = f"No column of {file} shows the drive (drive0_count or drive0_speed). Its nominal speed?"
    return Question(f"{SPEED}{file}", text, "VALUE ± UNCERTAINTY rad/s (or unknown)")


def optional(made: Draft) -> list[Question]:
    """What a fit can do without: asked where somebody answers, and otherwise not known."""
    if "laser" not in made.roles or made.noise:
        return []
    text = "Laser: rms noise of its readings, from which a fit knows how far the values are from the best possible?"
    return [Question(LASER_NOISE, text, "20 um (or unknown)", "unknown")]


def missing(made: Draft) -> list[str]:
    """Sentences on what a log lacks to be read."""
    found = []
    for log in made.logs:
        names = " and ".join(file.path.name for file in log.files)
        if TIME.name not in log.roles and "sampling_rate" not in made.answers.values:
            found.append(f"No column of {names} is the time (or say the sampling_rate).")
        if not log.roles & set(ANGLE_SOURCES):
            found.append(f"No column of {names} shows the disc (laser, encoder_count or angle).")
        columns = [one for file in log.files for one in file.columns]
        found += [
            f"The unit of '{one.name}' ({one.role}) is not known." for one in columns if one.role and one.unit is None
        ]
        found += [fault for one in columns if (fault := unit_fault(one))]
    return list(dict.fromkeys(found))


def _instruments(made: Draft) -> list[str]:
    found = [name for name in ("encoder", "drive0", "drive1") if f"{name}_count" in made.roles]
    lasers = [one for log in made.logs for file in log.files if (one := file.column("laser")) is not None]
    return (["laser"] if any(not is_length(one.unit) for one in lasers) else []) + found


def _instrument(name: str, made: Draft) -> Question:
    if name == "laser":
        return Question(
            name, "Laser: metres per volt, and volts when the disc is at rest?", "0.01 ± 0.00002 m/V, 5 V (or unknown)"
        )
    what = "the encoder of the disc" if name == "encoder" else f"the encoder of driving disc {name[-1]}"
    known = made.instrument("encoder" if name != "encoder" else "drive0")
    return Question(name, f"Lines per revolution of {what}?", "1000, or 1000 x4 where all edges count", _as_text(known))


def _as_text(known: dict | None) -> str:
    if not known or known.get("pulses_per_revolution") is None:
        return ""
    return f"{known['pulses_per_revolution']}{' x4' if known.get('quadrature') else ''}"


def _constants(made: Draft) -> list[str]:
    """Constants that a fit needs; k and c come from a free decay."""
    sliding = [log for log in made.logs if log.kind == "stick-slip"]
    if not sliding:
        return ["R"] if "laser" in made.roles else []
    decay = any(log.kind == "free-decay" for log in made.logs) or any(
        one.get("experiment", {}).get("kind") == "free-decay" for one in made.known.get("resources", [])
    )
    decay = decay or made.decay is not None
    forces = sorted({f"N{contact[-1]}" for log in sliding for contact in log.contacts})
    return ["J", *(() if decay else ("k", "c")), "R", "r", *forces]


def _constant(name: str) -> Question:
    unit = RIG_UNITS[name]
    text = f"{name}: {MEANINGS[name]}, with its standard uncertainty?"
    return Question(name, text, f"VALUE ± UNCERTAINTY {unit} (or unknown)")


def answered(made: Draft, question: Question, text: str) -> Answers:
    """The answers with one more.

    Raises:
        StickslipError: the answer is not of the form that is asked for.
    """
    said = text.strip() or question.proposal
    if not said:
        raise StickslipError(f"An answer is needed: {question.form}.")
    answers = made.answers
    if question.key == COLUMNS_RIGHT:
        if said.lower() in ("yes", "y", "ja", "j", "oui", "si", "sí"):
            if missing(made):
                raise StickslipError(f"{' '.join(missing(made))} Say {question.form}.")
            return replace(answers, confirm=True)
        changed = replace(answers.with_columns(said), confirm=True)
        check_named(replace(made, answers=changed))
        return changed
    if question.key == "laser":
        quantities.laser(said, "laser")
    elif question.key.startswith(SPEED):
        quantities.quantity(said, "rad/s", question.key)
    elif question.key == LASER_NOISE:
        quantities.noise(said, LASER_NOISE)
    elif question.key in RIG_UNITS:
        quantities.quantity(said, RIG_UNITS[question.key], question.key)
    else:
        quantities.encoder(said, question.key)
    return replace(answers, values={**answers.values, question.key: said})
