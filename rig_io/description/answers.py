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
encoder = "1000 x4"
[kinds]
"run7.csv" = "free-decay"
[read]                               # how the files are written, by the options of their reader
decimal = "comma"
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import existing
from fmu_models.base.toml_document import Document, read_document
from rig_io.joining.joined import RULES
from rig_io.logs.columns import COLUMNS
from rig_io.logs.log import RIG_UNITS

INSTRUMENTS = ("laser", "encoder", "drive0", "drive1")
LASER_NOISE = "laser_noise"
VALUES = (*RIG_UNITS, *INSTRUMENTS, LASER_NOISE, "sampling_rate")
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
            if kind not in KINDS:
                raise StickslipError(f"'{file}': there is no kind of experiment '{kind}'.{nearest(kind, KINDS)}")
        if self.join is not None and self.join not in (*RULES, NONE):
            raise StickslipError(f"There is no way to join files '{self.join}'.{nearest(self.join, (*RULES, NONE))}")

    def over(self, others: Answers) -> Answers:
        """These answers, and those of others where these are silent."""
        return Answers(
            {**others.columns, **self.columns},
            {**others.units, **self.units},
            {**others.values, **self.values},
            {**others.kinds, **self.kinds},
            {**others.read, **self.read},
            self.join or others.join,
            self.confirm or others.confirm,
        )

    def with_columns(self, text: str) -> Answers:
        """With roles (and units) that were typed: "Weg=laser V; Zeit=time ms; run7.csv=free-decay".

        Raises:
            StickslipError: not of that form, or an unknown role.
        """
        columns, units, kinds = dict(self.columns), dict(self.units), dict(self.kinds)
        for part in filter(None, (part.strip() for part in text.split(";"))):
            name, said = assignment(part, "COLUMN=ROLE UNIT, such as Weg=laser V")
            if said in KINDS:
                kinds[name] = said
                continue
            columns[name], unit = role_and_unit(name, said)
            if unit:
                units[name] = unit
        return replace(self, columns=columns, units=units, kinds=kinds)


def assignment(text: str, form: str) -> tuple[str, str]:
    """Name and what it is set to, of "NAME=SOMETHING"; a name may hold a '='.

    Raises:
        StickslipError: not of that form.
    """
    name, equals, said = (part.strip() for part in text.rpartition("="))
    if not equals or not name or not said:
        raise StickslipError(f"'{text}' is not of the form {form}.")
    return name.strip("'\""), said.strip("'\"")


def role_and_unit(name: str, said: str) -> tuple[str, str]:
    """Role and unit of "laser V"; an unknown role is refused, with the nearest one."""
    role, _, unit = said.partition(" ")
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
    """Answers of the options of the command.

    Raises:
        StickslipError: one is not of the form NAME=SOMETHING, or names something that is not known.
    """
    found = Answers(join=join, confirm=confirm).with_columns(";".join(mapped or ()))
    stated = dict(assignment(text, "COLUMN=UNIT") for text in units or ())
    given = {}
    for text in values or ():
        name, equals, said = (part.strip() for part in text.partition("="))
        if not equals or not said:
            raise StickslipError(
                f"A value is given as NAME=VALUE±UNCERTAINTY UNIT, such as J=0.0548±0.0003; not '{text}'."
            )
        given[name] = said
    for text in uncertainties or ():
        name, said = assignment(text, "NAME=UNCERTAINTY")
        if name not in given:
            raise StickslipError(f"The uncertainty of '{name}' is given, but not its value: --set {name}=VALUE.")
        given[name] = f"{given[name]} ± {said}"
    return replace(
        found,
        units={**found.units, **stated},
        values=given,
        kinds={**found.kinds, **dict(assignment(text, "FILE=KIND") for text in kinds or ())},
        read=dict(assignment(text, "OPTION=VALUE, such as decimal=comma") for text in read or ()),
    )


def from_file(path: Path) -> Answers:
    """Answers of a TOML file.

    Raises:
        StickslipError: no such file, or what is wrong in it, with its line.
    """
    document = read_document(existing(path, "answers file"))
    document.check_keys(("columns", "values", "kinds", "read", "join", "confirm"))
    columns, units = {}, {}
    for name, said in _texts(document, "columns").items():
        try:
            columns[name], unit = role_and_unit(name, said)
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
    found = document.table(table)
    for name, value in found.items():
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise document.fault(f"'{name}' holds {value!r}; expected a text or a number.", table, name)
    return {name: str(value) for name, value in found.items()}
