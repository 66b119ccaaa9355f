"""What the user has said: in an answers file (TOML), by options, on a terminal.

confirm = true                       # what is guessed is right
join = "columns"
[columns]                            # role and perhaps unit; "none": not to be read
"Weg Laser" = "laser V"
[values]
J = "0.0548 ± 0.0003 kg*m^2"
c = "unknown"
"w:run3.csv" = "0.83 ± 0.01 rad/s"   # speed of a drive that is not recorded
laser = "0.01 ± 0.00002 m/V, 5 V"
laser_noise = "20 um"
laser_beam = "arc"
laser_latency = "250 us"
encoder = "1000 x4"
drive0 = "1000, ratio 3.2"
belt = "0.5 ± 0.2 %"
[kinds]
"run7.csv" = "free-decay"
[read]                               # how the files are written, by the options of their reader
decimal = "comma"
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fmu_models.base.errors import StickslipError, nearest, refuse_unknown
from fmu_models.base.files import existing
from fmu_models.base.toml_document import Document, read_document
from rig_io.joining.joined import RULES
from rig_io.logs.columns import COLUMNS
from rig_io.logs.log import RIG_UNITS

DRIVES = ("drive0", "drive1")
INSTRUMENTS = ("laser", "encoder", *DRIVES)
LASER_NOISE, LASER_BEAM, LASER_LATENCY = "laser_noise", "laser_beam", "laser_latency"
BELT = "belt"  # creep of those behind which encoders of drives sit
VALUES = (*RIG_UNITS, *INSTRUMENTS, LASER_NOISE, LASER_BEAM, LASER_LATENCY, BELT, "sampling_rate")
SPEED = "w:"  # before the name of a log
KINDS = ("stick-slip", "free-decay")
NONE = "none"


@dataclass(frozen=True)
class Answers:
    """columns: name (or file, or file:name) -> role, "" where only the unit is said; units: likewise; values: name ->
    text; kinds: file -> kind; read: option -> text; join: rule, None to be found; confirm: all guesses are right."""

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, str] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    read: Mapping[str, str] = field(default_factory=dict)
    join: str | None = None
    confirm: bool = False

    def __post_init__(self) -> None:
        """Raises StickslipError: an unknown role, value, kind or rule."""
        for column, role in self.columns.items():
            if role != NONE and role not in COLUMNS:
                raise StickslipError(f"Column '{column}': there is no role '{role}'.{nearest(role, COLUMNS)}")
        for name in self.values:
            if name not in VALUES and not name.startswith(SPEED):
                raise StickslipError(f"There is no value '{name}' to be set.{nearest(name, (*VALUES, f'{SPEED}FILE'))}")
        for file, kind in self.kinds.items():
            refuse_unknown(kind, KINDS, f"'{file}': there is no kind of experiment '{kind}'.")
        if self.join is not None and self.join not in (*RULES, NONE):
            raise StickslipError(f"There is no way to join files '{self.join}'.{nearest(self.join, (*RULES, NONE))}")

    def over(self, others: Answers) -> Answers:
        """These answers, and those of others where these are silent."""
        tables = ("columns", "units", "values", "kinds", "read")
        merged = {table: {**getattr(others, table), **getattr(self, table)} for table in tables}
        return Answers(**merged, join=self.join or others.join, confirm=self.confirm or others.confirm)

    def with_columns(self, text: str) -> Answers:
        """The answers with roles (and units) that were typed: "Weg=laser V; Zeit=time ms; run7.csv=free-decay".
        StickslipError: not of that form, or an unknown role."""
        columns, units, kinds = dict(self.columns), dict(self.units), dict(self.kinds)
        for item in filter(None, (item.strip() for item in text.split(";"))):
            name, assigned = assignment(item, "COLUMN=ROLE UNIT, such as Weg=laser V")
            if assigned in KINDS:
                kinds[name] = assigned
                continue
            columns[name], unit = role_and_unit(name, assigned)
            if unit:
                units[name] = unit
        return replace(self, columns=columns, units=units, kinds=kinds)


def assignment(text: str, form: str) -> tuple[str, str]:
    """Name and what it is set to, of "NAME=SOMETHING"; a name may hold a '='. StickslipError: not of that form."""
    name, equals, value = (side.strip() for side in text.rpartition("="))
    if not equals or not name or not value:
        raise StickslipError(f"'{text}' is not of the form {form}.")
    return name.strip("'\""), value.strip("'\"")


def role_and_unit(name: str, text: str) -> tuple[str, str]:
    """Role and unit of "laser V"; an unknown role is refused, with the nearest one."""
    role, _, unit = text.partition(" ")
    if role != NONE and role not in COLUMNS:
        raise StickslipError(f"Column '{name}': there is no role '{role}'.{nearest(role, (*COLUMNS, NONE))}")
    return role, unit.strip().strip("[]")


def from_options(
    mapped: Sequence[str] | None,
    units: Sequence[str] | None,
    values: Sequence[str] | None,
    uncertainties: Sequence[str] | None,
    kinds: Sequence[str] | None,
    read: Sequence[str] | None,
    join: str | None,
    confirm: bool,
) -> Answers:
    """Answers of the options of the command. StickslipError: one is not of the form NAME=SOMETHING, or names something
    that is not known."""
    answers = Answers(join=join, confirm=confirm).with_columns(";".join(mapped or ()))
    stated = dict(assignment(text, "COLUMN=UNIT") for text in units or ())
    stated_values = {}
    for text in values or ():
        name, equals, value = (side.strip() for side in text.partition("="))
        if not equals or not value:
            raise StickslipError(
                f"A value is given as NAME=VALUE±UNCERTAINTY UNIT, such as J=0.0548±0.0003; not '{text}'."
            )
        stated_values[name] = value
    for text in uncertainties or ():
        name, value = assignment(text, "NAME=UNCERTAINTY")
        if name not in stated_values:
            raise StickslipError(f"The uncertainty of '{name}' is given, but not its value: --set {name}=VALUE.")
        stated_values[name] = f"{stated_values[name]} ± {value}"
    return replace(
        answers,
        units={**answers.units, **stated},
        values=stated_values,
        kinds={**answers.kinds, **dict(assignment(text, "FILE=KIND") for text in kinds or ())},
        read=dict(assignment(text, "OPTION=VALUE, such as decimal=comma") for text in read or ()),
    )


def from_file(path: Path) -> Answers:
    """Answers of a TOML file. StickslipError: no such file, or what is wrong in it, with its line."""
    document = read_document(existing(path, "answers file"))
    document.check_keys(("columns", "values", "kinds", "read", "join", "confirm"))
    columns, units = {}, {}
    for name, assigned in _texts(document, "columns").items():
        try:
            columns[name], unit = role_and_unit(name, assigned)
        except StickslipError as error:
            raise document.fault(str(error), "columns", name) from error
        if unit:
            units[name] = unit
    join = document.text("join") if "join" in document.data else None
    confirm = document.flag("confirm") if "confirm" in document.data else False
    values, kinds, read = (_texts(document, table) for table in ("values", "kinds", "read"))
    return Answers(columns, units, values, kinds, read, join, confirm)


def _texts(document: Document, table: str) -> dict[str, str]:
    if table not in document.data:
        return {}
    entries = document.table(table)
    for name, value in entries.items():
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise document.fault(f"'{name}' holds {value!r}; expected a text or a number.", table, name)
    return {name: str(value) for name, value in entries.items()}
