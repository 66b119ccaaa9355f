"""A sidecar in the making: the logs as they were read, what is proposed, said and still open."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import existing, write_whole
from fmu_models.base.registry import Reference
from rig_io.description import quantities
from rig_io.description.answers import INSTRUMENTS, NONE, Answers
from rig_io.description.names import plain
from rig_io.description.roles import Proposal, proposals
from rig_io.joining.joined import RULES
from rig_io.logs import packed
from rig_io.logs.columns import ANGLE_SOURCES, COLUMNS, TIME
from rig_io.logs.log import RIG_UNITS
from rig_io.logs.table import Table
from rig_io.packages import sidecar
from rig_io.packages.described import files_of
from rig_io.packages.sidecar import SIDECAR, file_hash
from rig_io.readers import READERS, read_table

TURNS = "a drive turns"  # the one sign of the kind of experiment that needs nobody to confirm it
DECAYED = 0.5  # share of the first third's movement that is left in the last, of a free decay
_DECAY = re.compile(r"decay|ausschwing|abkling|libre|libero|smorz|amort|free|schwingversuch")


@dataclass(frozen=True, eq=False)
class File:
    """One file: its table, and what is proposed or said of its columns."""

    path: Path
    table: Table
    columns: tuple[Proposal, ...]

    def column(self, role: str) -> Proposal | None:
        """The column of a role."""
        return next((one for one in self.columns if one.role == role), None)


@dataclass(frozen=True, eq=False)
class Log:
    """One run: its files (several if they are joined by ``rule``); kind of experiment and why it is thought so."""

    name: str
    files: tuple[File, ...]
    rule: str | None
    kind: str
    kind_reason: str
    kind_said: bool

    @property
    def roles(self) -> set[str]:
        """Roles of all columns."""
        return {one.role for file in self.files for one in file.columns if one.role is not None}

    @property
    def contacts(self) -> list[str]:
        """Discs in contact, by the drives that there are."""
        if self.kind == "free-decay":
            return []
        discs = sorted({role[5] for role in self.roles if role.startswith("drive")})
        return [f"disc{number}" for number in discs] or ["disc0"]


@dataclass(frozen=True, eq=False)
class Draft:
    """tables: of the files, as read; known: the sidecar that is there already; example: the resource after which the
    logs are described; like: whether that is of a like recorder, so that nothing is asked; answers: all that was said;
    decay: a free decay of the same rig in another folder.
    """

    tables: tuple[tuple[Path, Table], ...]
    known: Mapping[str, Any]
    example: Mapping[str, Any]
    like: bool
    answers: Answers
    decay: Path | None = None

    @property
    def folder(self) -> Path:
        """Of the logs and their sidecar."""
        return self.tables[0][0].parent

    @cached_property
    def logs(self) -> tuple[Log, ...]:
        """The runs, as proposed and said."""
        files = [_file(path, table, self.answers, self.example) for path, table in self.tables]
        rule = _rule(files, self.answers, self.example)
        runs = [[one] for one in files] if rule is None else _runs(files, rule)
        return tuple(_log(run, rule if len(run) > 1 else None, self.answers) for run in runs)

    @property
    def roles(self) -> set[str]:
        """Roles in any log."""
        return {role for log in self.logs for role in log.roles}

    @property
    def rig(self) -> dict[str, Any]:
        """Constants of the rig: those known, and those said now."""
        known = dict(self.known.get("rig", {}))
        for name, unit in RIG_UNITS.items():
            if name in self.answers.values:
                said = quantities.quantity(self.answers.values[name], unit, name)
                known[name] = {"value": said.value, "unit": unit, "standard_uncertainty": said.deviation}
        return known

    def instrument(self, name: str) -> dict[str, Any] | None:
        """Calibration of an instrument, None where it is open."""
        if name in self.answers.values:
            made = quantities.laser if name == "laser" else quantities.encoder
            return made(self.answers.values[name], name)
        return self.example.get("calibration", {}).get(name)


def draft(
    paths: Sequence[Path],
    answers: Answers,
    like: Path | None = None,
    reader: Reference | None = None,
) -> Draft:
    """Read logs and propose what they are.

    like: folder (or sidecar) of another log of the same recorder, whose roles, units, calibration and constants hold
    here; that of the logs themselves if None.

    Raises:
        StickslipError: no files, files of several folders, one that cannot be read, or a column that was named and is
            in none of them.
    """
    files = _files(paths)
    folder = files[0].parent
    if any(path.parent.resolve() != folder.resolve() for path in files):
        raise StickslipError("Logs that are described together lie in one folder, beside their datapackage.json.")
    own = _known(folder, required=False)
    other = own if like is None else _known(like, required=True)
    example = _example(other, files, like is not None)
    answers = answers.over(Answers(read={k: str(v) for k, v in example.get("dialect", {}).items()}))
    tables = tuple((path, read_table(path, reader, answers.read)) for path in files)
    known = {**own, "rig": {**other.get("rig", {}), **own.get("rig", {})}}
    alike = bool(example) and (like is not None or not {path.name for path in files} & set(files_of(example)))
    decay = None if like is None else _decay(like if like.is_dir() else like.parent, other)
    made = Draft(tables, known, example, alike, answers, decay)
    check_named(made)
    return made


def _files(paths: Sequence[Path]) -> list[Path]:
    """The files named, and the logs in the folders named."""
    found: list[Path] = []
    for path in paths:
        if existing(path, "log", " Check the name and the folder.").is_dir():
            inside = log_files(path)
            if not inside:
                known = ", ".join(sorted(_suffixes()))
                raise StickslipError(f"There is no log in '{path}'. Known are files ending in {known}.")
            found += inside
        else:
            found.append(path)
    unique = list(dict.fromkeys(found))
    if not unique:
        raise StickslipError("Name the logs that are to be described.")
    return unique


def log_files(folder: Path) -> list[Path]:
    """The files of a folder that are of a kind that is read, by their names."""
    suffixes = _suffixes()
    return [
        one
        for one in sorted(folder.iterdir())
        if one.suffix.lower() in suffixes and one.is_file() and not one.name.startswith(".")
    ]


def _suffixes() -> set[str]:
    ours = {suffix for name in READERS.members() for suffix in READERS.load(name).suffixes}
    return ours | {*packed.SUFFIXES}


def _known(place: Path, required: bool) -> dict[str, Any]:
    beside = place if place.name == SIDECAR else place / SIDECAR
    if not beside.exists():
        if required:
            raise StickslipError(f"There is no {SIDECAR} in '{place}', after which a log could be described.")
        return {}
    return sidecar.load_json(beside)


def _example(known: Mapping[str, Any], files: Sequence[Path], like: bool) -> dict[str, Any]:
    """What is known of such files: their own resource, or that of a like recorder, with what others know beside."""
    names = {path.name for path in files}
    resources = [dict(one) for one in known.get("resources", [])]
    own = [one for one in resources if names & set(files_of(one))]
    alike = [one for one in resources if one not in own and (like or _same_kind(one, files))]
    # the one with most columns first: a free decay may be recorded without the drive
    ranked = [*own, *sorted(alike, key=lambda one: -len(_fields(one)))]
    if not ranked:
        return {}
    fields = {(one.get("file"), one["name"]): one for resource in reversed(ranked) for one in _fields(resource)}
    calibration = {name: one for resource in reversed(ranked) for name, one in resource.get("calibration", {}).items()}
    return {**ranked[0], "schema": {"fields": list(fields.values())}, "calibration": calibration}


def _decay(folder: Path, package: Mapping[str, Any]) -> Path | None:
    """The first free decay of a package."""
    decays = [one for one in package.get("resources", []) if one.get("experiment", {}).get("kind") == "free-decay"]
    return folder / files_of(decays[0])[0] if decays else None


def _fields(resource: Mapping[str, Any]) -> list[dict[str, Any]]:
    found = resource.get("schema", {}).get("fields", [])
    return [one for one in found if isinstance(one, dict) and "name" in one]


def _same_kind(resource: Mapping[str, Any], files: Sequence[Path]) -> bool:
    return Path(files_of(resource)[0]).suffix == files[0].suffix


def _file(path: Path, table: Table, answers: Answers, example: Mapping[str, Any]) -> File:
    known = _known_fields(example, path)
    columns = []
    for one in proposals(table, path.stem):
        entry = known.get(one.name)
        if entry is not None:
            guessed = entry.get("guessed", {})
            said = {"role": entry["role"]} if "role" in entry else {}
            one = replace(one, unit=entry.get("unit", one.unit), guessed=guessed, reason="as described before", **said)
            one = replace(one, confidence=one.confidence if guessed else 1.0)
        columns.append(_said(one, path, answers, len(table.columns)))
    return File(path, table, tuple(_each_once(columns)))


def _known_fields(example: Mapping[str, Any], path: Path) -> dict[str, dict[str, Any]]:
    """Described fields by name: of the file itself, or of the one in its place in a like recorder's files."""
    fields = _fields(example)
    of_files = [one for one in fields if "file" in one]
    if not of_files:
        return {str(one["name"]): one for one in fields}
    names = list(dict.fromkeys(one["file"] for one in of_files))
    own = path.name if path.name in names else max(names, key=lambda name: _ending(name, path.name))
    return {str(one["name"]): one for one in of_files if one["file"] == own}


def _ending(one: str, other: str) -> int:
    """Length of the common end of two names."""
    length = 0
    while length < min(len(one), len(other)) and one[-1 - length] == other[-1 - length]:
        length += 1
    return length


def _said(one: Proposal, path: Path, answers: Answers, columns: int) -> Proposal:
    """A proposal with what the user has said of its column."""
    guessed = {} if answers.confirm else dict(one.guessed)
    role, unit = (
        next((said for key, said in known.items() if _names(key, path, one.name, columns)), None)
        for known in (answers.columns, answers.units)
    )
    if role is not None:
        guessed.pop("role", None)
        one = replace(one, role=None if role == NONE else role, confidence=1.0, reason="as said")
        if role != NONE and COLUMNS[role].whole and unit is None:
            one = replace(one, unit="1")
        elif unit is None and one.header is None and one.unit is None and role not in (NONE, TIME.name):
            one = replace(one, unit=None)
    if unit is not None:
        guessed.pop("unit", None)
        one = replace(one, unit=unit)
    return replace(one, guessed={} if one.role is None else guessed)


def _names(key: str, path: Path, column: str, columns: int) -> bool:
    """Whether a key names a column: by its name, by the file's (a pattern) if it is the only one, or by both."""
    if key == column:
        return True
    file, mark, own = key.rpartition(":")
    if mark and own == column and fnmatch(path.name, file):
        return True
    return columns == 1 and fnmatch(path.name, key)


def _each_once(columns: Sequence[Proposal]) -> list[Proposal]:
    """A role that the user gave to one column is taken from those that were only guessed.

    Raises:
        StickslipError: the user gave it to two.
    """
    made = list(columns)
    by_role: dict[str, list[Proposal]] = {}
    for one in made:
        if one.role is not None:
            by_role.setdefault(one.role, []).append(one)
    for role, several in by_role.items():
        sure = [one for one in several if one.reason == "as said"]
        if len(sure) > 1:
            names = " and ".join(f"'{one.name}'" for one in sure)
            raise StickslipError(
                f"Columns {names} are both said to be '{role}'. A role has one column: map one to none."
            )
        keep = (sure or several)[0]
        made = [replace(one, role=None, guessed={}) if one.role == role and one is not keep else one for one in made]
    return made


def check_named(made: Draft) -> None:
    """Raises StickslipError: a column or a log that the user named is not there."""
    names = {name for _, table in made.tables for name in table.columns}
    files = [path.name for path, _ in made.tables]
    for key in (*made.answers.columns, *made.answers.units):
        if not any(_names(key, path, name, len(t.columns)) for path, t in made.tables for name in t.columns):
            raise StickslipError(f"There is no column '{key}' in the logs.{nearest(key, sorted(names))}")
    for name in made.answers.kinds:
        if name not in files:
            raise StickslipError(f"There is no log '{name}'.{nearest(name, files)}")


def _rule(files: Sequence[File], answers: Answers, example: Mapping[str, Any]) -> str | None:
    """How the files belong together: as said, as before, or as their columns say; None: each is a log of its own."""
    if answers.join is not None:
        return None if answers.join == NONE else answers.join
    if len(files) < 2:
        return None
    if example.get("join") in RULES:
        return str(example["join"])
    roles = [{one.role for one in file.columns if one.role} for file in files]
    complete = [bool(one & set(ANGLE_SOURCES)) and TIME.name in one for one in roles]
    if any(complete):
        return None
    lengths = [{len(next(iter(file.table.columns.values()), [])) for file in run} for run in _runs(files, "columns")]
    return "columns" if all(len(one) == 1 for one in lengths) else None


def _runs(files: Sequence[File], rule: str) -> list[list[File]]:
    """The files of each run, by what stands before (or behind) the last (first) mark in their names: run3_laser.dat."""
    size = 2 if rule == "clocks" else None
    for parted in (str.rpartition, str.partition):
        groups: dict[str, list[File]] = {}
        for file in files:
            stem = re.sub(r"[-. ]", "_", file.path.stem)
            head, mark, tail = parted(stem, "_")
            groups.setdefault((head if parted is str.rpartition else tail) if mark else "", []).append(file)
        counts = {len(run) for run in groups.values()}
        if len(groups) > 1 and min(counts) > 1 and (size is None or counts == {size}):
            return list(groups.values())
    return [list(files)]


def _log(files: Sequence[File], rule: str | None, answers: Answers) -> Log:
    name = _stem(files[0].path) if len(files) == 1 else _common(files)
    said = next((answers.kinds[file.path.name] for file in files if file.path.name in answers.kinds), None)
    kind, reason = (said, "as said") if said else _kind(files)
    return Log(_slug(name), tuple(files), rule, kind, reason, said is not None or answers.confirm or reason == TURNS)


def _stem(path: Path) -> str:
    return path.with_suffix("").stem if path.suffix.lower() in packed.SUFFIXES else path.stem


def _common(files: Sequence[File]) -> str:
    """What the names of a run's files have in common."""
    names = [_stem(file.path) for file in files]
    length = next((i for i, letters in enumerate(zip(*names, strict=False)) if len(set(letters)) > 1), len(names[0]))
    return names[0][:length].strip("_- .") or files[0].path.parent.resolve().name or names[0]


def _slug(name: str) -> str:
    return re.sub(r"[^a-z0-9._-]+", "-", plain(name)).strip("-._") or "log"


def _kind(files: Sequence[File]) -> tuple[str, str]:
    """Kind of experiment, and why it is thought so."""
    drives = [
        file.table.columns[one.name]
        for file in files
        for one in file.columns
        if one.role and re.fullmatch(r"drive\d_(count|speed)", one.role)
    ]
    if any(np.nanmax(values) > np.nanmin(values) for values in drives if np.isfinite(values).any()):
        return "stick-slip", TURNS
    by_name = _DECAY.search(plain(files[0].path.name))
    for file in files:
        for role in ("angle", "laser", "encoder_count"):
            found = file.column(role)
            if found is not None and not drives and (_decays(file.table.columns[found.name]) or by_name):
                return "free-decay", "no drive, and the movement dies away"
    return ("free-decay", "its name") if by_name and not drives else ("stick-slip", "nothing speaks for a free decay")


def _decays(values: np.ndarray) -> bool:
    values = values[np.isfinite(values)]
    third = len(values) // 3
    return third > 10 and float(np.std(values[-third:])) < DECAYED * float(np.std(values[:third]))


def package_of(made: Draft) -> dict[str, Any]:
    """The whole sidecar: resources of other logs stay as they are."""
    described = {name for log in made.logs for name in (file.path.name for file in log.files)}
    others = [one for one in made.known.get("resources", []) if not described & set(files_of(one))]
    kept = {key: value for key, value in made.known.items() if key not in ("resources", "rig")}
    title = {"profile": "tabular-data-package", "name": _slug(made.folder.resolve().name)}
    resources = [_resource(made, log) for log in made.logs]
    return {**title, **kept, "rig": made.rig, "resources": [*others, *resources]}


def _resource(made: Draft, log: Log) -> dict[str, Any]:
    names = [file.path.name for file in log.files]
    several = len(names) > 1
    experiment: dict[str, Any] = {"kind": log.kind, "contacts": log.contacts}
    if not log.kind_said:
        experiment["guessed"] = {"kind": log.kind_reason}
    resource: dict[str, Any] = {
        "name": log.name,
        "path": names if several else names[0],
        **({"join": log.rule} if several else {}),
        "hash": {name: file_hash(made.folder / name) for name in names} if several else file_hash(log.files[0].path),
        **({"dialect": dict(made.answers.read)} if made.answers.read else {}),
        "experiment": experiment,
    }
    if "sampling_rate" in made.answers.values:
        resource["sampling_rate"] = quantities.quantity(made.answers.values["sampling_rate"], "Hz", "rate").value
    instruments = {name: made.instrument(name) for name in INSTRUMENTS if _measured(log, name)}
    resource["calibration"] = {name: one for name, one in instruments.items() if one is not None}
    fields = [_field(file, one, several) for file in log.files for one in file.columns]
    return {**resource, "schema": {"fields": fields}}


def _measured(log: Log, instrument: str) -> bool:
    """Whether a log has a column that needs the instrument's calibration."""
    if instrument != "laser":
        return f"{instrument}_count" in log.roles
    column = next((found for file in log.files if (found := file.column("laser"))), None)
    return column is not None and not is_length(column.unit)


def is_length(unit: str | None) -> bool:
    """Whether a unit is one of length."""
    from rig_io.repair.table import conversion

    try:
        return unit is not None and bool(conversion(unit, "m", ""))
    except StickslipError:
        return False


def _field(file: File, one: Proposal, several: bool) -> dict[str, Any]:
    made: dict[str, Any] = {"name": one.name, "role": one.role}
    if several:
        made["file"] = file.path.name
    if one.unit is not None:
        made["unit"] = one.unit
    if one.header is not None and one.unit != one.header:
        made["header_unit"] = one.header
    if one.guessed:
        made["guessed"] = dict(one.guessed)
        made["confidence"] = round(one.confidence, 2)
    return made


def write(made: Draft) -> Path:
    """Write the sidecar, whole or not at all; returns its path."""
    target = made.folder / SIDECAR
    with write_whole(target, overwrite=True) as temporary:
        text = json.dumps(package_of(made), indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")
    return target
