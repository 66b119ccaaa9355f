"""What the sidecar says of how a column was measured, for a model that is held against it."""

import math
import re
from collections.abc import Mapping
from typing import Any, TypeGuard

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.measured import IDEAL, ROLES, Instrument, SensorConstant

FREE = "free"
FORMS = f'a number, "value +- sd" or "{FREE}"'
# what the reference of the manual says of each key of a field
INSTRUMENT_KEYS = {
    "noise": f'standard deviation of a measured column, in its unit; by what a fit leaves if left out or "{FREE}"',
    "gain": f"of the sensor, which shows gain x(t - delay) + offset: {FORMS}, which is found; 1 if left out",
    "offset": f"of the sensor, in the unit of the column: {FORMS}; 0 if left out",
    "delay": f"of the sensor, s: {FORMS}; 0 if left out",
    "clip": "least and greatest value that the sensor shows, [low, high]",
}


def instrument_of(entry: Mapping[str, Any], where: str) -> Instrument:
    """How the column of an entry was measured.

    Raises:
        StickslipError: another form than those allowed; names the file, the column and the key.
    """

    def fault(key: str, value: object, form: str) -> StickslipError:
        return StickslipError(f"{where}: \"{key}\" of column '{entry['name']}' is {value!r}; expected {form}.")

    role = entry.get("role")
    found = {key: entry.get(key) for key in INSTRUMENT_KEYS}
    constants = {}
    for key, ideal in IDEAL.items():
        if found[key] is not None:
            constant = _constant(found[key], ideal)
            if constant is None:
                raise fault(key, found[key], FORMS)
            constants[key] = constant
    noise, clip = found["noise"], found["clip"]
    if noise is not None and noise != FREE and not (_is_number(noise) and noise > 0):
        raise fault("noise", noise, f'a number above 0 or "{FREE}"')
    if clip is not None and not _is_range(clip):
        raise fault("clip", clip, "two ascending numbers, [low, high]")
    return Instrument(
        role if role in ROLES else "" if role is None and "role" in entry else None,
        float(noise) if _is_number(noise) else None,
        constants,
        (float(clip[0]), float(clip[1])) if clip is not None else None,
    )


def _constant(value: object, ideal: float) -> SensorConstant | None:
    """None of what has none of the forms."""
    if value == FREE:
        return SensorConstant(ideal, math.inf)
    if _is_number(value):
        return SensorConstant(float(value))
    parts = re.split(r"±|\+-|\+/-", value) if isinstance(value, str) else []
    try:
        number, deviation = (float(part) for part in parts)
    except ValueError:
        return None
    return SensorConstant(number, deviation) if math.isfinite(number) and 0 < deviation < math.inf else None


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_range(value: object) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(_is_number, value)) and value[0] < value[1]
