"""A sidecar in the making: the logs as they were read, what is proposed, said and still open."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError, nearest, refuse_unknown
from fmu_models.base.files import write_whole
from fmu_models.base.registry import Reference
from fmu_models.base.unit_names import scale_of
from rig_io.description import quantities
from rig_io.description.answers import BELT, DRIVES, INSTRUMENTS, LASER_BEAM, LASER_LATENCY, LASER_NOISE, SPEED, Answers
from rig_io.description.example import example_of, free_decay, kinds_alike, log_paths, package_at
from rig_io.description.roles import Proposal
from rig_io.description.runs import DescribedLog, File, described_file, described_log, is_named, rule_of, runs_of, slug
from rig_io.logs.columns import COLUMNS, metres
from rig_io.logs.log import RIG_UNITS
from rig_io.logs.table import Table
from rig_io.packages.described import files_of
from rig_io.packages.sidecar import SIDECAR, file_hash, mapping
from rig_io.readers import read_table
from rig_io.repair.table import COUNTED

SPEEDS = ("drive_speed", "drive_speed_uncertainty")


@dataclass(frozen=True, eq=False)
class Draft:
    """tables: of the files, as read; known: the sidecar that is there already; example: the resource after which the
    logs are described; like: whether that is of a like recorder, so that nothing is asked; answers: all that was said;
    decay: a free decay of the same rig in another folder; before: resources that were described before, there or here.
    """

    tables: tuple[tuple[Path, Table], ...]
    known: Mapping[str, Any]
    example: Mapping[str, Any]
    like: bool
    answers: Answers
    decay: Path | None = None
    before: Sequence[Mapping[str, Any]] = ()

    @property
    def folder(self) -> Path:
        """The folder of the logs and their sidecar."""
        return self.tables[0][0].parent

    @cached_property
    def logs(self) -> tuple[DescribedLog, ...]:
        """The runs, as proposed and said."""
        files = [described_file(path, table, self.answers, self.example) for path, table in self.tables]
        rule = rule_of(files, self.answers, self.example)
        runs = [[file] for file in files] if rule is None else runs_of(files, rule)
        return tuple(
            described_log(
                run,
                rule if len(run) > 1 else None,
                self.answers,
                self._experiment(run),
                kinds_alike([file.table.columns for file in run], self.before),
            )
            for run in runs
        )

    def _experiment(self, files: Sequence[File]) -> dict[str, Any]:
        """The sidecar's entry on the experiment of a run."""
        names, where = {file.path.name for file in files}, f"'{self.folder / SIDECAR}'"
        resources = (resource for resource in self.known.get("resources", []) if names & set(files_of(resource)))
        return next((mapping(resource, "experiment", where) for resource in resources), {})

    @property
    def roles(self) -> set[str]:
        """Roles in any log."""
        return {role for log in self.logs for role in log.roles}

    @property
    def rig(self) -> dict[str, Any]:
        """Constants of the rig: those known, and those said now."""
        constants = dict(self.known.get("rig", {}))
        for name, unit in RIG_UNITS.items():
            if name in self.answers.values:
                answer = quantities.quantity(self.answers.values[name], unit, name)
                constants[name] = {"value": answer.value, "unit": unit, "standard_uncertainty": answer.deviation}
        return constants

    def instrument(self, name: str) -> dict[str, Any] | None:
        """Calibration of an instrument, None where it is open."""
        before = self.example.get("calibration", {}).get(name)
        if name in self.answers.values:
            parse = quantities.laser if name == "laser" else quantities.encoder
            creep = {key: value for key, value in (before or {}).items() if key.startswith("creep")}
            before = {**creep, **parse(self.answers.values[name], name)}
        if before and name in DRIVES and before.get("ratio", 1) != 1 and BELT in self.answers.values:
            before = {**before, **quantities.belt(self.answers.values[BELT], BELT)}
        return before

    def speed(self, log: DescribedLog) -> dict[str, Any] | None:
        """What is said of the speed of a drive that a log does not record, as its experiment has it; None: nothing."""
        names = [file.path.name for file in log.files]
        text_of_speed = next((text for name in names if (text := self.answers.values.get(SPEED + name))), None)
        if text_of_speed is None:
            experiment = self.done(log)
            return {key: experiment[key] for key in SPEEDS if key in experiment} if SPEEDS[0] in experiment else None
        speed = quantities.quantity(text_of_speed, "rad/s", f"The speed of the drive in {names[0]}")
        return {
            key: [number]
            for key, number in zip(SPEEDS, (speed.value, speed.deviation), strict=True)
            if number is not None
        }

    def done(self, log: DescribedLog) -> dict[str, Any]:
        """What the sidecar that is there says of the experiment, where the discs are the same."""
        experiment = self._experiment(log.files)
        return experiment if experiment.get("contacts") == log.contacts else {}

    @property
    def beside(self) -> dict[str, Any]:
        """Entries of the laser's calibration that hold its noise, beam and latency, as far as somebody was asked."""
        calibration = self.example.get("calibration", {}).get("laser", {})
        known = {key: calibration[key] for key in ("noise", "beam", "tilt", "latency") if key in calibration}
        said = self.answers.values
        if LASER_NOISE in said:
            known["noise"] = quantities.noise(said[LASER_NOISE], LASER_NOISE)
        if LASER_LATENCY in said:
            known["latency"] = quantities.latency(said[LASER_LATENCY], LASER_LATENCY)
        return known | (quantities.beam(said[LASER_BEAM], LASER_BEAM) if LASER_BEAM in said else {})


def draft(paths: Sequence[Path], answers: Answers, like: Path | None = None, reader: Reference | None = None) -> Draft:
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
    package = package_at(folder, required=False)
    model_package = package if like is None else package_at(like, required=True)
    example = example_of(model_package, files, like is not None)
    answers = answers.over(Answers(read={k: str(v) for k, v in example.get("dialect", {}).items()}))
    tables = tuple((path, read_table(path, reader, answers.read)) for path in files)
    merged = {**package, "rig": {**model_package.get("rig", {}), **package.get("rig", {})}}
    same_recorder = bool(example) and (like is not None or not {path.name for path in files} & set(files_of(example)))
    decay = None if like is None else free_decay(like if like.is_dir() else like.parent, model_package)
    before = model_package.get("resources", [])
    drafted = Draft(tables, merged, example, same_recorder, answers, decay, before)
    check_named(drafted)
    return drafted


def check_named(draft: Draft) -> None:
    """Raises StickslipError: a column or a log that the user named is not there, or a column cannot have the unit."""
    names = {name for _, table in draft.tables for name in table.columns}
    files = [path.name for path, _ in draft.tables]
    for key in (*draft.answers.columns, *draft.answers.units):
        if not any(is_named(key, path, name, len(t.columns)) for path, t in draft.tables for name in t.columns):
            raise StickslipError(f"There is no column '{key}' in the logs.{nearest(key, sorted(names))}")
    for name in draft.answers.kinds:
        refuse_unknown(name, files, f"There is no log '{name}'.")
    for name in draft.answers.values:
        if name.startswith(SPEED) and name.removeprefix(SPEED) not in files:
            raise StickslipError(f"'{name}': there is no such log.{nearest(name.removeprefix(SPEED), files)}")
    ratios = [(draft.instrument(name) or {}).get("ratio", 1) for name in DRIVES]
    if BELT in draft.answers.values and set(ratios) == {1}:
        raise StickslipError(
            "A belt is said, and no encoder of a drive sits on the motor. Say its ratio: --set 'drive0=1000, ratio 3'."
        )
    for file in (file for log in draft.logs for file in log.files):
        for column in file.columns:
            stated = any(is_named(key, file.path, column.name, len(file.columns)) for key in draft.answers.units)
            if stated and (fault := unit_fault(column)):
                raise StickslipError(fault)


def unit_fault(column: Proposal) -> str:
    """Why a column of its role cannot be written in its unit; "" where it can."""
    if column.role is None or column.unit is None:
        return ""
    if COLUMNS[column.role].unit == "1":
        if column.unit in COUNTED:
            return ""
        return (
            f"Column '{column.name}' ({column.role}) is in '{column.unit}', but counts have no unit. Write 1, or say "
            f"what it is: --map '{column.name}=ROLE'."
        )
    if column.role == "laser" and metres(column.unit):
        return ""
    try:
        scale_of(column.unit, COLUMNS[column.role].unit, f"Column '{column.name}' ({column.role})")
    except StickslipError as error:
        return str(error)
    return ""


def package_of(draft: Draft) -> dict[str, Any]:
    """The whole sidecar: resources of other logs stay as they are."""
    described = {name for log in draft.logs for name in (file.path.name for file in log.files)}
    others = [resource for resource in draft.known.get("resources", []) if not described & set(files_of(resource))]
    entries = {key: value for key, value in draft.known.items() if key not in ("resources", "rig")}
    title = {"profile": "tabular-data-package", "name": slug(draft.folder.resolve().name)}
    resources = [_resource(draft, log) for log in draft.logs]
    return {**title, **entries, "rig": draft.rig, "resources": [*others, *resources]}


def _resource(draft: Draft, log: DescribedLog) -> dict[str, Any]:
    names = [file.path.name for file in log.files]
    several = len(names) > 1
    previous = {key: value for key, value in draft.done(log).items() if key not in (*SPEEDS, "guessed")}
    speed = draft.speed(log) or {}
    experiment: dict[str, Any] = {**previous, **speed, "kind": log.kind, "contacts": log.contacts}
    if not log.kind_said:
        experiment["guessed"] = {"kind": log.kind_reason}
    resource: dict[str, Any] = {
        "name": log.name,
        "path": names if several else names[0],
        **({"join": log.rule} if several else {}),
        "hash": {name: file_hash(draft.folder / name) for name in names} if several else file_hash(log.files[0].path),
        **({"dialect": dict(draft.answers.read)} if draft.answers.read else {}),
        "experiment": experiment,
    }
    if "sampling_rate" in draft.answers.values:
        resource["sampling_rate"] = quantities.quantity(draft.answers.values["sampling_rate"], "Hz", "rate").value
    instruments = {name: draft.instrument(name) for name in INSTRUMENTS if _measured(log, name)}
    calibration = {name: entry for name, entry in instruments.items() if entry is not None}
    if draft.beside and "laser" in log.roles and ("laser" in calibration or not _measured(log, "laser")):
        calibration["laser"] = {**calibration.get("laser", {}), **draft.beside}
    resource["calibration"] = calibration
    fields = [_field(file, column, several) for file in log.files for column in file.columns]
    return {**resource, "schema": {"fields": fields}}


def _measured(log: DescribedLog, instrument: str) -> bool:
    """Whether a log has a column that needs the instrument's calibration."""
    if instrument != "laser":
        return f"{instrument}_count" in log.roles
    column = next((laser for file in log.files if (laser := file.column("laser"))), None)
    return column is not None and not metres(column.unit)


def _field(file: File, column: Proposal, several: bool) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": column.name, "role": column.role, **column.kept}
    if several:
        entry["file"] = file.path.name
    if column.unit is not None:
        entry["unit"] = column.unit
    if column.header is not None and column.unit != column.header:
        entry["header_unit"] = column.header
    if column.guessed:
        entry["guessed"] = dict(column.guessed)
        entry["confidence"] = round(column.confidence, 2)
    return entry


def write(draft: Draft) -> Path:
    """Write the sidecar, whole or not at all; returns its path."""
    target = draft.folder / SIDECAR
    with write_whole(target, overwrite=True) as temporary:
        text = json.dumps(package_of(draft), indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")
    return target
