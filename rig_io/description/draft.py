"""A sidecar in the making: the logs as they were read, what is proposed, said and still open."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import write_whole
from fmu_models.base.registry import Reference
from rig_io.description import quantities
from rig_io.description.answers import INSTRUMENTS, LASER_NOISE, SPEED, Answers
from rig_io.description.example import example_of, free_decay, log_paths, package_at
from rig_io.description.roles import Proposal
from rig_io.description.runs import File, Log, described_file, described_log, is_named, rule_of, runs_of, slug
from rig_io.logs.columns import COLUMNS
from rig_io.logs.log import RIG_UNITS
from rig_io.logs.table import Table
from rig_io.packages.described import files_of
from rig_io.packages.sidecar import SIDECAR, file_hash, mapping
from rig_io.readers import read_table
from rig_io.repair.table import COUNTED, conversion

SPEEDS = ("drive_speed", "drive_speed_uncertainty")


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
        files = [described_file(path, table, self.answers, self.example) for path, table in self.tables]
        rule = rule_of(files, self.answers, self.example)
        runs = [[one] for one in files] if rule is None else runs_of(files, rule)
        return tuple(
            described_log(run, rule if len(run) > 1 else None, self.answers, self._experiment(run)) for run in runs
        )

    def _experiment(self, files: Sequence[File]) -> dict[str, Any]:
        """What the sidecar that is there says of the experiment of a run."""
        names, where = {file.path.name for file in files}, f"'{self.folder / SIDECAR}'"
        known = (one for one in self.known.get("resources", []) if names & set(files_of(one)))
        return next((mapping(one, "experiment", where) for one in known), {})

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

    def speed(self, log: Log) -> dict[str, Any] | None:
        """What is said of the speed of a drive that a log does not record, as its experiment has it; None: nothing."""
        names = [file.path.name for file in log.files]
        said = next((text for name in names if (text := self.answers.values.get(SPEED + name))), None)
        if said is None:
            known = self.done(log)
            return {key: known[key] for key in SPEEDS if key in known} if SPEEDS[0] in known else None
        found = quantities.quantity(said, "rad/s", f"The speed of the drive in {names[0]}")
        return {key: [one] for key, one in zip(SPEEDS, (found.value, found.deviation), strict=True) if one is not None}

    def done(self, log: Log) -> dict[str, Any]:
        """What the sidecar that is there says of the experiment, where the discs are the same."""
        known = self._experiment(log.files)
        return known if known.get("contacts") == log.contacts else {}

    @property
    def noise(self) -> dict[str, Any]:
        """The entry of the laser's calibration that holds its noise; empty where nobody was asked."""
        if LASER_NOISE in self.answers.values:
            return {"noise": quantities.noise(self.answers.values[LASER_NOISE], LASER_NOISE)}
        known = self.example.get("calibration", {}).get("laser", {})
        return {"noise": known["noise"]} if "noise" in known else {}


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
    files = log_paths(paths)
    folder = files[0].parent
    if any(path.parent.resolve() != folder.resolve() for path in files):
        raise StickslipError("Logs that are described together lie in one folder, beside their datapackage.json.")
    own = package_at(folder, required=False)
    other = own if like is None else package_at(like, required=True)
    example = example_of(other, files, like is not None)
    answers = answers.over(Answers(read={k: str(v) for k, v in example.get("dialect", {}).items()}))
    tables = tuple((path, read_table(path, reader, answers.read)) for path in files)
    known = {**own, "rig": {**other.get("rig", {}), **own.get("rig", {})}}
    alike = bool(example) and (like is not None or not {path.name for path in files} & set(files_of(example)))
    decay = None if like is None else free_decay(like if like.is_dir() else like.parent, other)
    made = Draft(tables, known, example, alike, answers, decay)
    check_named(made)
    return made


def check_named(made: Draft) -> None:
    """Raises StickslipError: a column or a log that the user named is not there, or a column cannot have the unit."""
    names = {name for _, table in made.tables for name in table.columns}
    files = [path.name for path, _ in made.tables]
    for key in (*made.answers.columns, *made.answers.units):
        if not any(is_named(key, path, name, len(t.columns)) for path, t in made.tables for name in t.columns):
            raise StickslipError(f"There is no column '{key}' in the logs.{nearest(key, sorted(names))}")
    for name in made.answers.kinds:
        if name not in files:
            raise StickslipError(f"There is no log '{name}'.{nearest(name, files)}")
    for name in made.answers.values:
        if name.startswith(SPEED) and name.removeprefix(SPEED) not in files:
            raise StickslipError(f"'{name}': there is no such log.{nearest(name.removeprefix(SPEED), files)}")
    for file in (file for log in made.logs for file in log.files):
        for one in file.columns:
            said = any(is_named(key, file.path, one.name, len(file.columns)) for key in made.answers.units)
            if said and (fault := unit_fault(one)):
                raise StickslipError(fault)


def unit_fault(one: Proposal) -> str:
    """Why a column of its role cannot be written in its unit; "" where it can."""
    if one.role is None or one.unit is None:
        return ""
    if COLUMNS[one.role].unit == "1":
        if one.unit in COUNTED:
            return ""
        return (
            f"Column '{one.name}' ({one.role}) is in '{one.unit}', but counts have no unit. Write 1, or say what it "
            f"is: --map '{one.name}=ROLE'."
        )
    if one.role == "laser" and is_length(one.unit):
        return ""
    try:
        conversion(one.unit, COLUMNS[one.role].unit, f"Column '{one.name}' ({one.role})")
    except StickslipError as error:
        return str(error)
    return ""


def package_of(made: Draft) -> dict[str, Any]:
    """The whole sidecar: resources of other logs stay as they are."""
    described = {name for log in made.logs for name in (file.path.name for file in log.files)}
    others = [one for one in made.known.get("resources", []) if not described & set(files_of(one))]
    kept = {key: value for key, value in made.known.items() if key not in ("resources", "rig")}
    title = {"profile": "tabular-data-package", "name": slug(made.folder.resolve().name)}
    resources = [_resource(made, log) for log in made.logs]
    return {**title, **kept, "rig": made.rig, "resources": [*others, *resources]}


def _resource(made: Draft, log: Log) -> dict[str, Any]:
    names = [file.path.name for file in log.files]
    several = len(names) > 1
    kept = {key: value for key, value in made.done(log).items() if key not in (*SPEEDS, "guessed")}
    speed = made.speed(log) or {}
    experiment: dict[str, Any] = {**kept, **speed, "kind": log.kind, "contacts": log.contacts}
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
    calibration = {name: one for name, one in instruments.items() if one is not None}
    if made.noise and "laser" in log.roles and ("laser" in calibration or not _measured(log, "laser")):
        calibration["laser"] = {**calibration.get("laser", {}), **made.noise}
    resource["calibration"] = calibration
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
