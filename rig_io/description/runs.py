"""Runs as they were recorded: what is proposed and said of their columns, how files belong together, of what kind."""

import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.description.answers import KINDS, NONE, Answers
from rig_io.description.example import known_fields
from rig_io.description.names import plain
from rig_io.description.roles import Proposal, proposals
from rig_io.joining.joined import RULES
from rig_io.logs import packed
from rig_io.logs.columns import ANGLE_SOURCES, COLUMNS, TIME
from rig_io.logs.table import Table

TURNS = "a drive turns"  # the one sign of the kind of experiment that needs nobody to confirm it
DECAYED = 0.5  # share of the first third's movement that is left in the last, of a free decay
_DECAY = re.compile(r"decay|ausschwing|abkling|libre|libero|smorz|amort|free|schwingversuch")

# keys of a column that are proposed and said here; others of an earlier sidecar stay
WRITTEN = ("name", "role", "file", "unit", "header_unit", "guessed", "confidence")


@dataclass(frozen=True, eq=False)
class File:
    """One file: its table, and what is proposed or said of its columns."""

    path: Path
    table: Table
    columns: tuple[Proposal, ...]

    def column(self, role: str) -> Proposal | None:
        """The column of a role."""
        return next((column for column in self.columns if column.role == role), None)


@dataclass(frozen=True, eq=False)
class DescribedLog:
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
        return {column.role for file in self.files for column in file.columns if column.role is not None}

    @property
    def contacts(self) -> list[str]:
        """Discs in contact, by the drives that there are."""
        if self.kind == "free-decay":
            return []
        discs = sorted({role[5] for role in self.roles if role.startswith("drive")})
        return [f"disc{number}" for number in discs] or ["disc0"]


def described_file(path: Path, table: Table, answers: Answers, example: Mapping[str, Any]) -> File:
    fields = known_fields(example, path)
    columns = []
    for column in proposals(table, path.stem):
        entry = fields.get(column.name)
        if entry is not None:
            guessed = entry.get("guessed", {})
            stated_role = {"role": entry["role"]} if "role" in entry else {}
            column = replace(
                column,
                unit=entry.get("unit", column.unit),
                guessed=guessed,
                reason="as described before",
                kept={key: value for key, value in entry.items() if key not in WRITTEN},
                **stated_role,
            )
            column = replace(column, confidence=column.confidence if guessed else 1.0)
        columns.append(_said(column, path, answers, len(table.columns)))
    return File(path, table, tuple(_each_once(columns)))


def _said(column: Proposal, path: Path, answers: Answers, columns: int) -> Proposal:
    """A proposal with what the user has said of its column."""
    guessed = {} if answers.confirm else dict(column.guessed)
    role, unit = (
        next((text for key, text in assigned.items() if is_named(key, path, column.name, columns)), None)
        for assigned in (answers.columns, answers.units)
    )
    if role is not None:
        guessed.pop("role", None)
        column = replace(column, role=None if role == NONE else role, confidence=1.0, reason="as said")
        if role != NONE and COLUMNS[role].whole and unit is None:
            column = replace(column, unit="1")
    if unit is not None:
        guessed.pop("unit", None)
        column = replace(column, unit=unit)
    return replace(column, guessed={} if column.role is None else guessed)


def is_named(key: str, path: Path, column: str, columns: int) -> bool:
    """Whether a key names a column: by its name, by the file's (a pattern) if it is the only one, or by both."""
    if key == column:
        return True
    file, mark, column_key = key.rpartition(":")
    if mark and column_key == column and fnmatch(path.name, file):
        return True
    return columns == 1 and fnmatch(path.name, key)


def _each_once(columns: Sequence[Proposal]) -> list[Proposal]:
    """A role that the user gave to one column is taken from those that were only guessed."""
    proposals = list(columns)
    by_role: dict[str, list[Proposal]] = {}
    for column in proposals:
        if column.role is not None:
            by_role.setdefault(column.role, []).append(column)
    for role, several in by_role.items():
        sure = [column for column in several if column.reason == "as said"]
        if len(sure) > 1:
            names = " and ".join(f"'{column.name}'" for column in sure)
            raise StickslipError(
                f"Columns {names} are both said to be '{role}'. A role has one column: map one to none."
            )
        keep = (sure or several)[0]
        proposals = [
            replace(column, role=None, guessed={}) if column.role == role and column is not keep else column
            for column in proposals
        ]
    return proposals


def rule_of(files: Sequence[File], answers: Answers, example: Mapping[str, Any]) -> str | None:
    """How the files belong together: as said, as before, or as their columns say; None: each is a log of its own."""
    if answers.join is not None:
        return None if answers.join == NONE else answers.join
    if len(files) < 2:
        return None
    if example.get("join") in RULES:
        return str(example["join"])
    roles = [{column.role for column in file.columns if column.role} for file in files]
    complete = [bool(present & set(ANGLE_SOURCES)) and TIME.name in present for present in roles]
    if any(complete):
        return None
    lengths = [{len(next(iter(file.table.columns.values()), [])) for file in run} for run in runs_of(files, "columns")]
    return "columns" if all(len(distinct) == 1 for distinct in lengths) else None


def runs_of(files: Sequence[File], rule: str) -> list[list[File]]:
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


def described_log(
    files: Sequence[File], rule: str | None, answers: Answers, experiment: Mapping[str, Any], alike: Set[str]
) -> DescribedLog:
    """experiment: what was said of it before; alike: kinds that somebody confirmed of logs with the same columns."""
    name = _stem(files[0].path) if len(files) == 1 else _common(files)
    stated_kind = next((answers.kinds[file.path.name] for file in files if file.path.name in answers.kinds), None)
    kind, reason = (stated_kind, "as said") if stated_kind else _kind(files)
    if (
        not stated_kind
        and reason != TURNS
        and experiment.get("kind") in KINDS
        and "kind" not in experiment.get("guessed", {})
    ):
        stated_kind, kind, reason = experiment["kind"], experiment["kind"], "as described before"
    if not stated_kind and kind in alike:
        stated_kind, reason = kind, f"{reason}, as in logs described before"
    return DescribedLog(
        slug(name), tuple(files), rule, kind, reason, stated_kind is not None or answers.confirm or reason == TURNS
    )


def _stem(path: Path) -> str:
    return path.with_suffix("").stem if path.suffix.lower() in packed.SUFFIXES else path.stem


def _common(files: Sequence[File]) -> str:
    """The part that the names of a run's files have in common."""
    names = [_stem(file.path) for file in files]
    length = next((i for i, letters in enumerate(zip(*names, strict=False)) if len(set(letters)) > 1), len(names[0]))
    return names[0][:length].strip("_- .") or files[0].path.parent.resolve().name or names[0]


def slug(name: str) -> str:
    return re.sub(r"[^a-z0-9._-]+", "-", plain(name)).strip("-._") or "log"


def _kind(files: Sequence[File]) -> tuple[str, str]:
    """Kind of experiment, and why it is thought so."""
    drives = [
        file.table.columns[column.name]
        for file in files
        for column in file.columns
        if column.role and re.fullmatch(r"drive\d_(count|speed)", column.role)
    ]
    if any(np.nanmax(values) > np.nanmin(values) for values in drives if np.isfinite(values).any()):
        return "stick-slip", TURNS
    by_name = _DECAY.search(plain(files[0].path.name))
    for file in files:
        for role in ("angle", "laser", "encoder_count"):
            count_column = file.column(role)
            if count_column is not None and not drives and (_decays(file.table.columns[count_column.name]) or by_name):
                return "free-decay", "no drive, and the movement dies away"
    return ("free-decay", "its name") if by_name and not drives else ("stick-slip", "nothing speaks for a free decay")


def _decays(values: np.ndarray) -> bool:
    values = values[np.isfinite(values)]
    third = len(values) // 3
    return third > 10 and float(np.std(values[-third:])) < DECAYED * float(np.std(values[:third]))
