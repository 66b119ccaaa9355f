"""What the sidecar says of the columns of a log's files: the role of each, its unit, what is still a guess, and
how it was measured, for a model that is held against it."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeGuard

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.unit_names import conversion
from fmu_models.simulation.measured import IDEAL, ROLES, UNSTATED, Instrument, SensorConstant
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.table import Table
from rig_io.logs.text_layout import unit_like

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
    """How the column of an entry was measured. StickslipError: another form than those allowed; names the file, the
    column and the key."""

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


# what the reference of the manual says of each key of a field
FIELD_KEYS = {
    "name": "in the file",
    "role": "what the column is, as listed below; for a model `input`, `measured` or `event` (times at which the "
    "contact `variable` began to touch or to slip); null: it is not to be read; its name is its role if left out",
    "unit": "of the column; that which the file states if left out",
    "header_unit": "which the file states, and which `unit` overrules",
    "file": "that it stands in, where the log has several",
    "variable": "of a model that the column measures; its name if left out",
    **INSTRUMENT_KEYS,
    "hold": "as an input of a model: true where a value holds until the next one; straight lines if left out",
    "guessed": "what of it nobody has confirmed, and why it was guessed",
}
COUNT_UNITS = ("", "1", "-", "count", "counts", "pulses")


@dataclass(frozen=True)
class Field:
    """One column as described; role: of a rig, None where a rig's log does not read it."""

    name: str
    role: str | None
    unit: str | None = None
    header_unit: str | None = None
    file: str | None = None
    explicit: bool = False
    guessed: tuple[str, ...] = ()
    variable: str | None = None
    hold: bool = False
    instrument: Instrument = UNSTATED


def files_of(resource: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the files of a resource, beside its sidecar."""
    path = resource["path"]
    return tuple(map(str, path)) if isinstance(path, list) else (str(path),)


def fields_of(resource: Mapping[str, Any], where: str) -> tuple[Field, ...]:
    """The columns that a resource describes. StickslipError: an unknown role, or two columns for one role; begins with
    ``where``."""
    schema = resource.get("schema", {})
    entries = schema.get("fields", []) if isinstance(schema, dict) else []
    if not isinstance(entries, list):
        raise StickslipError(f'{where}: "fields" holds {entries!r}; expected a list [...].')
    fields = [_field(entry, where) for entry in entries if isinstance(entry, dict) and "name" in entry]
    shared = resource.get("join") in ("clocks", "columns", "time")
    taken: dict[tuple[str | None, str], Field] = {}
    for field in fields:
        if field.role is None:
            continue
        previous = taken.setdefault((field.file if shared else None, field.role), field)
        if previous is not field and (field.explicit or previous.explicit):
            raise StickslipError(
                f"{where}: two columns, '{previous.name}' and '{field.name}', have the role '{field.role}'. Keep one: "
                f"stickslip describe FILE --map '{previous.name}=none'."
            )
    return tuple(fields)


def _field(entry: Mapping[str, Any], where: str) -> Field:
    name = str(entry["name"])
    explicit = "role" in entry
    role = entry["role"] if explicit else name if name in COLUMNS else None
    if role is not None and role not in (*COLUMNS, *ROLES):
        near = nearest(str(role), (*COLUMNS, *ROLES))
        raise StickslipError(f"{where}: column '{name}' has the unknown role {role!r}.{near}")
    guesses = entry.get("guessed", {})
    unit, header, file, variable = (
        None if entry.get(key) is None else str(entry[key]) for key in ("unit", "header_unit", "file", "variable")
    )
    hold = entry.get("hold", False)
    if not isinstance(hold, bool):
        raise StickslipError(f"{where}: \"hold\" of column '{name}' is {hold!r}; expected true or false.")
    guessed = tuple(map(str, guesses)) if isinstance(guesses, dict) else ()
    of_rig, instrument = None if role in ROLES else role, instrument_of(entry, where)
    return Field(name, of_rig, unit, header, file, explicit, guessed, variable, hold, instrument)


def with_roles(table: Table, fields: Sequence[Field], where: str, rate: float | None = None) -> Table:
    """The columns of one file that have a role, by their roles, units stated by sidecar or file.

    rate: Hz, of files without a clock.

    Raises:
        StickslipError: a column with a role is not there, has no name of its own, or a unit that is not the file's.
    """
    described = any(field.explicit for field in fields)
    roles = {field.name: field for field in fields if field.role is not None}
    if not described:
        _check_names(table, roles)
        roles |= {name: Field(name, name) for name in table.columns if name in COLUMNS and name not in roles}
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for name, field in roles.items():
        assert field.role is not None
        if name not in table.columns:
            if field.explicit:
                raise _missing(table, field, where)
            continue
        columns[field.role] = table.columns[name]
        unit = _unit(table, field)
        if unit is not None:
            units[field.role] = unit
    if rate and TIME.name not in columns and columns:
        length = len(next(iter(columns.values())))
        columns = {TIME.name: np.arange(length) / rate, **columns}
        units[TIME.name] = TIME.unit
    stamps = tuple(field.role for name, field in roles.items() if name in table.stamps and field.role)
    others = dict.fromkeys((name for name in table.columns if name not in roles), "a column without a role")
    return replace(table, columns=columns, units=units, left_out={**table.left_out, **others}, stamps=stamps)


def with_units(table: Table, fields: Sequence[Field]) -> Table:
    """A table under its own names, with the units that the sidecar states. StickslipError: a unit that is not the
    file's."""
    stated = {field.name: _unit(table, field) for field in fields if field.name in table.columns}
    return replace(table, units={**table.units, **{name: unit for name, unit in stated.items() if unit is not None}})


def _check_names(table: Table, roles: Mapping[str, Field]) -> None:
    say = "Say what they are: stickslip describe FILE."
    if table.nameless:
        raise StickslipError(
            f"{table.source} begins with numbers: its {len(table.columns)} columns have no names. {say}"
        )
    for name in table.doubled:
        if name in COLUMNS:
            raise StickslipError(f"{table.source} has two columns named '{name}'. Rename or remove one, or: {say}")


def _missing(table: Table, field: Field, where: str) -> StickslipError:
    if field.name in table.left_out:
        return StickslipError(
            f"{table.source}: column '{field.name}' is to be '{field.role}', but it is {table.left_out[field.name]}. "
            f"Map another one: stickslip describe FILE --map COLUMN={field.role}."
        )
    listing = ", ".join(f"'{name}'" for name in table.columns)
    return StickslipError(
        f"{table.source} has no column '{field.name}', which {where} calls '{field.role}'; its columns are {listing}. "
        f"Map one of them: stickslip describe FILE --map COLUMN={field.role}."
    )


def _unit(table: Table, field: Field) -> str | None:
    """The unit of a column: the sidecar's, or the file's; both must be one unless the user has overruled the file."""
    stated, header = field.unit, table.units.get(field.name)
    if stated is None or header is None or stated == header or field.header_unit == header:
        return header if stated is None else stated
    if field.role is not None and COLUMNS[field.role].whole and header in COUNT_UNITS and stated in COUNT_UNITS:
        return stated
    if not unit_like(header):
        return stated  # brackets around something else
    try:
        same = abs(conversion(header, stated, "") - 1) < 1e-12
    except StickslipError:
        same = False
    if same:
        return stated
    raise StickslipError(
        f"{table.source}: column '{field.name}' is in '{header}' by its header and in '{stated}' by datapackage.json. "
        f"Say which holds: stickslip describe FILE --unit '{field.name}={header}'."
    )
