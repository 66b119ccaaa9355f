"""Answers as people write them: "0.0548 ± 0.0003 kg m²", "0,0548(3)", "2.62 +- 0.5 %", "1000 x4", "unknown"."""

import math
import re
from dataclasses import dataclass
from typing import Any

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.unit_names import conversion
from rig_io.logs.beam import BEAMS

MOST_CREEP = 0.1  # of a belt, as a share
UNKNOWN = ("unknown", "?", "unbekannt", "inconnu", "sconosciuto", "desconocido", "none", "-")
_NUMBER = r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?"
_QUANTITY = re.compile(
    rf"\s*(?P<value>{_NUMBER})(?:\((?P<digits>\d+)\))?"
    rf"(?:\s*(?:±|\+-|\+/-)\s*(?P<sd>{_NUMBER}|unknown|\?)(?P<percent>\s*%)?)?\s*(?P<unit>[^\d±].*?)?\s*"
)
_POWERS = str.maketrans({"²": "2", "³": "3", "⁻": "-", "·": "*", "⋅": "*", "µ": "u", "μ": "u"})


@dataclass(frozen=True)
class Answer:
    """value and standard deviation in the expected unit; None where it is not known."""

    value: float | None
    deviation: float | None


def number(text: str) -> float:
    """A number with a point or a comma."""
    return float(text.replace(",", "."))


def is_unknown(text: str) -> bool:
    """Whether an answer says that nobody knows."""
    return text.strip().lower() in UNKNOWN


def quantity(text: str, unit: str, label: str) -> Answer:
    """A quantity with its standard deviation, converted to ``unit``, which is meant where none is written.
    StickslipError: it is none, or of another dimension; begins with ``what``."""
    if is_unknown(text):
        return Answer(None, None)
    parsed = _QUANTITY.fullmatch(text)
    if parsed is None:
        raise StickslipError(f"{label}: '{text}' is no number with its uncertainty. Write 0.0548 ± 0.0003 {unit}.")
    stated = (parsed["unit"] or unit).translate(_POWERS).strip()
    if match := re.fullmatch(rf"(.*?)\s*(?:±|\+-|\+/-)\s*({_NUMBER})\s*(%?)", stated):
        # the unit stands before the deviation
        return quantity(f"{parsed['value']} ± {match[2]}{match[3]} {match[1]}", unit, label)
    factor = conversion(stated, unit, label)
    value = number(parsed["value"])
    deviation: float | None = None
    if parsed["digits"]:
        places = len(re.split(r"[.,]", re.split(r"[eE]", parsed["value"])[0] + ".")[1])
        exponent = re.search(r"[eE]([-+]?\d+)", parsed["value"])
        deviation = int(parsed["digits"]) * 10.0 ** (-places + (int(exponent[1]) if exponent else 0))
    elif parsed["sd"] and not is_unknown(parsed["sd"]):
        deviation = number(parsed["sd"]) * (abs(value) / 100 if parsed["percent"] else 1.0)
    if deviation is not None and deviation < 0:
        raise StickslipError(f"{label}: an uncertainty of {deviation:g} is none. Write a positive one, or 'unknown'.")
    return Answer(value * factor, None if deviation is None else deviation * abs(factor))


def laser(text: str, label: str) -> dict[str, Any]:
    """The calibration of a laser: "0.01 ± 0.00002 m/V, 5 V": gain and the reading at rest, either of them unknown.
    StickslipError: as in `quantity`, or more than two parts."""
    items = [item.strip() for item in re.split(r"[;]|,(?=\s)|\bat\b", text) if item.strip()]
    if not items or len(items) > 2:
        raise StickslipError(
            f"{label}: '{text}' is no calibration. Write gain and reading at rest: 0.01 ± 0.00002 m/V, 5 V."
        )
    gain = quantity(items[0], "m/V", label)
    zero = quantity(items[1], "V", label).value if len(items) == 2 else None
    if gain.value == 0:
        raise StickslipError(f"{label}: a gain of zero measures nothing. Write metres per volt.")
    relative = None if gain.value is None or gain.deviation is None else abs(gain.deviation / gain.value)
    return {"gain": gain.value, "gain_deviation": relative, "zero": zero}


def noise(text: str, label: str) -> float | None:
    """The rms noise of a laser, m; None where it is not known. StickslipError: as in `quantity`, or none at all."""
    deviation = quantity(text, "m", label).value
    if deviation is not None and deviation <= 0:
        raise StickslipError(f"{label}: no laser has a noise of {deviation:g} m. Write its rms, 20 um, or 'unknown'.")
    return deviation


def latency(text: str, label: str) -> float:
    """How late a laser is, s: "250 us", or by a filter faster than the motion: "butterworth 4, 50 Hz". StickslipError:
    as in `quantity`, or of no order."""
    match = re.fullmatch(r"\s*butterworth\s+(\d+)\s*,?\s*(.+)", text, re.IGNORECASE)
    if match is None:
        return quantity(text, "s", label).value or 0.0
    corner = quantity(match[2], "Hz", label).value
    if not int(match[1]) or not corner or corner <= 0:
        raise StickslipError(f"{label}: '{text}' is no filter. Write its order and its corner: butterworth 4, 50 Hz.")
    # sum of 1/(2 sin) over the poles
    return 1.0 / (2 * math.pi * corner * math.sin(math.pi / (2 * int(match[1]))))


def beam(text: str, label: str) -> dict[str, Any]:
    """How a laser meets the disc: "arc", "sine, 3 deg"; its tilt is 0 where none is written. StickslipError: as in
    `quantity`, or there is no such beam."""
    name, _, tilt = text.strip().replace(",", " ").partition(" ")
    refuse_unknown(name.lower(), BEAMS, f"{label}: there is no beam '{name}'.")
    return {"beam": name.lower(), "tilt": quantity(tilt.strip() or "0", "rad", label).value or 0.0}


def belt(text: str, label: str) -> dict[str, Any]:
    """How much a belt creeps: "0.5 ± 0.2 %", "unknown", or "gear", which does not. StickslipError: as in `quantity`."""
    if text.strip().lower() == "gear":
        return {"creep": 0.0, "creep_deviation": 0.0}
    unit = 0.01 if "%" in text else 1.0
    creep = quantity(text.replace("%", ""), "1", label)
    if creep.value is not None and not abs(unit * creep.value) <= MOST_CREEP:
        raise StickslipError(f"{label}: no belt creeps by {text}. Write its share, 0.5 ± 0.2 %, unknown, or gear.")
    deviation = None if creep.deviation is None else unit * creep.deviation
    return {"creep": unit * (creep.value or 0.0), "creep_deviation": deviation}


def encoder(text: str, label: str) -> dict[str, Any]:
    """An encoder: "1000", "1000 x4" (all four edges of a line are counted), "1000, 16 bit", "1000, ratio 3.2" (its
    turns in one of the disc). StickslipError: it is none."""
    if is_unknown(text):
        return {"pulses_per_revolution": None}
    match = re.fullmatch(
        r"\s*(\d+)\s*(?:lines|pulses|striche|traits|ppr|cpr)?\s*(?P<four>[x*]\s*4|quadrature)?\s*,?\s*"
        rf"(?:(?P<bits>\d+)\s*bits?)?\s*,?\s*(?:ratio\s*(?P<ratio>{_NUMBER}))?\s*",
        text.replace("\N{MULTIPLICATION SIGN}", "x"),
        re.IGNORECASE,
    )
    if match is None or not int(match[1]):
        raise StickslipError(
            f"{label}: '{text}' is no encoder. Write its lines per revolution, 1000, 1000 x4 where all edges count, or "
            "1000, ratio 3.2 where it turns 3.2 times as often as the disc."
        )
    calibration: dict[str, Any] = {"pulses_per_revolution": int(match[1]), "quadrature": match["four"] is not None}
    calibration |= {"ratio": number(match["ratio"])} if match["ratio"] else {}
    return calibration | ({"counter_bits": int(match["bits"])} if match["bits"] else {})
