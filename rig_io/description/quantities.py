"""Answers as people write them: "0.0548 ± 0.0003 kg m²", "0,0548(3)", "2.62 +- 0.5 %", "1000 x4", "unknown"."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from fmu_models.base.errors import StickslipError
from rig_io.repair.table import conversion

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


def quantity(text: str, unit: str, what: str) -> Answer:
    """A quantity with its standard deviation, converted to ``unit``, which is meant where none is written.

    Raises:
        StickslipError: it is none, or of another dimension; begins with ``what``.
    """
    if is_unknown(text):
        return Answer(None, None)
    found = _QUANTITY.fullmatch(text)
    if found is None:
        raise StickslipError(f"{what}: '{text}' is no number with its uncertainty. Write 0.0548 ± 0.0003 {unit}.")
    given = (found["unit"] or unit).translate(_POWERS).strip()
    if match := re.fullmatch(rf"(.*?)\s*(?:±|\+-|\+/-)\s*({_NUMBER})\s*(%?)", given):
        # the unit stands before the deviation
        return quantity(f"{found['value']} ± {match[2]}{match[3]} {match[1]}", unit, what)
    factor = conversion(given, unit, what)
    value = number(found["value"])
    deviation: float | None = None
    if found["digits"]:
        places = len(re.split(r"[.,]", re.split(r"[eE]", found["value"])[0] + ".")[1])
        exponent = re.search(r"[eE]([-+]?\d+)", found["value"])
        deviation = int(found["digits"]) * 10.0 ** (-places + (int(exponent[1]) if exponent else 0))
    elif found["sd"] and not is_unknown(found["sd"]):
        deviation = number(found["sd"]) * (abs(value) / 100 if found["percent"] else 1.0)
    if deviation is not None and deviation < 0:
        raise StickslipError(f"{what}: an uncertainty of {deviation:g} is none. Write a positive one, or 'unknown'.")
    return Answer(value * factor, None if deviation is None else deviation * abs(factor))


def laser(text: str, what: str) -> dict[str, Any]:
    """The calibration of a laser: "0.01 ± 0.00002 m/V, 5 V": gain and the reading at rest, either of them unknown.

    Raises:
        StickslipError: as in `quantity`, or more than two parts.
    """
    parts = [part.strip() for part in re.split(r"[;]|,(?=\s)|\bat\b", text) if part.strip()]
    if not parts or len(parts) > 2:
        raise StickslipError(
            f"{what}: '{text}' is no calibration. Write gain and reading at rest: 0.01 ± 0.00002 m/V, 5 V."
        )
    gain = quantity(parts[0], "m/V", what)
    zero = quantity(parts[1], "V", what).value if len(parts) == 2 else None
    if gain.value == 0:
        raise StickslipError(f"{what}: a gain of zero measures nothing. Write metres per volt.")
    relative = None if gain.value is None or gain.deviation is None else abs(gain.deviation / gain.value)
    return {"gain": gain.value, "gain_deviation": relative, "zero": zero}


def noise(text: str, what: str) -> float | None:
    """The rms noise of a laser, m; None where it is not known.

    Raises:
        StickslipError: as in `quantity`, or none at all.
    """
    found = quantity(text, "m", what).value
    if found is not None and found <= 0:
        raise StickslipError(f"{what}: no laser has a noise of {found:g} m. Write its rms, 20 um, or 'unknown'.")
    return found


def encoder(text: str, what: str) -> dict[str, Any]:
    """An encoder: "1000", "1000 x4" (all four edges of a line are counted), "1000, 16 bit".

    Raises:
        StickslipError: it is none.
    """
    if is_unknown(text):
        return {"pulses_per_revolution": None}
    found = re.fullmatch(
        r"\s*(\d+)\s*(?:lines|pulses|striche|traits|ppr|cpr)?\s*(?P<four>[x*]\s*4|quadrature)?\s*,?\s*"
        r"(?:(?P<bits>\d+)\s*bits?)?\s*",
        text.replace("\N{MULTIPLICATION SIGN}", "x"),
        re.IGNORECASE,
    )
    if found is None or not int(found[1]):
        raise StickslipError(
            f"{what}: '{text}' is no encoder. Write its lines per revolution, 1000, or 1000 x4 where all edges count."
        )
    made: dict[str, Any] = {"pulses_per_revolution": int(found[1]), "quadrature": found["four"] is not None}
    return made | ({"counter_bits": int(found["bits"])} if found["bits"] else {})
