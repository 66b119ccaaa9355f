"""Logs and their ``datapackage.json`` (Frictionless data package): reading, checking, writing.

Package level: ``rig``: {name: {value, unit, standard_uncertainty}}. Per resource: ``experiment`` (kind, contacts,
materials, drive_speed in rad/s), ``calibration`` (laser, encoder, drive0, drive1), ``rig`` where a log departs from the
package's constants, and ``hash``.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import pkgutil
import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from fmu_models.errors import StickslipError, nearest
from fmu_models.files import write_whole
from rig_io.columns import COLUMNS, TIME
from rig_io.log import (
    RIG_UNITS,
    Calibration,
    EncoderCalibration,
    Experiment,
    LaserCalibration,
    Quantity,
    RigConstants,
    RigLog,
)
from rig_io.table import checked, conversion

SIDECAR = "datapackage.json"
LICENCE = {
    "name": "CC0-1.0",
    "title": "Creative Commons Zero v1.0",
    "path": "https://creativecommons.org/publicdomain/zero/1.0/",
}


def load_log(
    path: Path, rig: RigConstants | None, calibration: Calibration | None, experiment: Experiment | None
) -> RigLog:
    """See `rig_io.log.read_log`."""
    if path.is_dir() or path.name == SIDECAR:
        raise StickslipError(f"'{path}' is a package of logs, not one log. Name a CSV file in it, or read the package.")
    reader = _reader(path)
    if not path.exists():
        folder = (
            [p.name for p in sorted(path.parent.glob("*")) if p.suffix == path.suffix] if path.parent.is_dir() else []
        )
        raise StickslipError(f"There is no log '{path}'.{nearest(path.name, folder)}")
    sidecar = path.parent / SIDECAR
    package: dict[str, Any] = {}
    resource: dict[str, Any] = {}
    if sidecar.exists():
        package = _load_json(sidecar)
        resources = {str(r["path"]): r for r in package["resources"]}
        if path.name not in resources and rig is None:
            raise StickslipError(
                f"'{sidecar}' says nothing of '{path.name}'. Add a resource for it.{nearest(path.name, resources)}"
            )
        resource = resources.get(path.name, {})
    elif rig is None:
        raise StickslipError(
            f"There is no {SIDECAR} beside '{path}', so the rig's constants are unknown. Write one (copy "
            f"data/rigs/paper_rubber/{SIDECAR}), or give the constants and put units into the header, as in 'time [s]'."
        )
    _check_hash(path, resource, sidecar)
    where = f"'{sidecar}', resource '{path.name}'"
    values = checked(reader.read(path), _units(resource, where))
    time = values.pop(TIME.name)
    log = RigLog(
        name=str(resource.get("name", path.stem)),
        time=time,
        columns=values,
        units={name: COLUMNS[name].unit for name in (TIME.name, *values)},
        rig=rig
        if rig is not None
        else _rig({**_mapping(package, "rig", where), **_mapping(resource, "rig", where)}, where),
        calibration=calibration
        if calibration is not None
        else _calibration(_mapping(resource, "calibration", where), where),
        experiment=experiment
        if experiment is not None
        else _experiment(_mapping(resource, "experiment", where), where),
        path=path,
    )
    for column, instrument in _INSTRUMENTS.items():
        if log.has(column):
            log.calibration.need(instrument)
    return log


_INSTRUMENTS = {"laser": "laser", "encoder_count": "encoder", "drive0_count": "drive0", "drive1_count": "drive1"}


def load_package(path: Path) -> list[RigLog]:
    """See `rig_io.log.read_package`."""
    sidecar = path / SIDECAR if path.is_dir() else path
    if not sidecar.exists():
        raise StickslipError(f"There is no {SIDECAR} in '{path}'. Name a folder that holds one.")
    if sidecar.name != SIDECAR:
        raise StickslipError(f"'{path}' is not a package of logs. Expected a folder or its {SIDECAR}.")
    return [load_log(sidecar.parent / r["path"], None, None, None) for r in _load_json(sidecar)["resources"]]


def save_package(folder: Path, logs: list[RigLog], title: str, description: str, overwrite: bool) -> Path:
    """See `rig_io.log.write_package`."""
    from rig_io.readers import csv_log

    if not logs:
        raise StickslipError("A package needs at least one log.")
    for log in logs:
        if not re.fullmatch(r"[a-z0-9][a-z0-9._-]*", log.name):
            raise StickslipError(
                f"The log name '{log.name}' cannot be a file name. Use lower-case letters, digits, '_', '-', '.'."
            )
    if len({log.name for log in logs}) < len(logs):
        raise StickslipError(f"Two logs have one name among {', '.join(log.name for log in logs)}. Name them apart.")
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not overwrite)):
        raise StickslipError(f"'{folder}' exists already. Choose another name, or allow it to be overwritten.")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        room = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as error:
        raise StickslipError(
            f"'{folder}' cannot be written: {error.strerror}. Choose a folder you may write to."
        ) from error
    try:
        work = room / folder.name  # a folder of the usual rights, which mkdtemp's is not
        work.mkdir()
        for log in logs:
            csv_log.write(work / f"{log.name}.csv", {TIME.name: log.time, **log.columns})
        package = _package(folder.name, logs, work, title, description)
        (work / SIDECAR).write_text(json.dumps(package, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        if not folder.exists() or not any(folder.iterdir()):
            if folder.exists():
                folder.rmdir()
            work.rename(folder)
            return folder
        for file in (*(f"{log.name}.csv" for log in logs), SIDECAR):  # the sidecar last: until then the old one rules
            with write_whole(folder / file, overwrite=True) as target:
                (work / file).replace(target)
    finally:
        shutil.rmtree(room, ignore_errors=True)
    return folder


def file_hash(path: Path) -> str:
    """Checksum as the data package writes it: ``sha256:<hex>``."""
    return "sha256:" + hashlib.sha256(path.read_bytes()).hexdigest()


def _reader(path: Path) -> Any:
    """The module of `rig_io.readers` for this kind of file, by its suffix."""
    import rig_io.readers

    known: dict[str, Any] = {}
    for module in pkgutil.iter_modules(rig_io.readers.__path__):
        reader = importlib.import_module(f"rig_io.readers.{module.name}")
        known.update(dict.fromkeys(reader.SUFFIXES, reader))
    if path.suffix.lower() not in known:
        raise StickslipError(f"'{path}' is of no known kind of log. Known are: {', '.join(sorted(known))}.")
    return known[path.suffix.lower()]


def _load_json(sidecar: Path) -> dict[str, Any]:
    try:
        package = json.loads(sidecar.read_text(encoding="utf-8-sig"))
    except json.JSONDecodeError as error:
        raise StickslipError(f"'{sidecar}' is not JSON: {error.msg} on line {error.lineno}. Mend it there.") from error
    except (OSError, UnicodeDecodeError) as error:
        raise StickslipError(f"'{sidecar}' cannot be read: {error}. Save it as JSON in UTF-8.") from error
    resources = package.get("resources") if isinstance(package, dict) else None
    if (
        not isinstance(resources, list)
        or not resources
        or not all(isinstance(r, dict) and "path" in r for r in resources)
    ):
        raise StickslipError(f'\'{sidecar}\' lists no logs. Expected "resources": [{{"path": "....csv", ...}}].')
    for resource in resources:
        if str(resource["path"]) != Path(str(resource["path"])).name:
            raise StickslipError(
                f"'{sidecar}': the path '{resource['path']}' leaves the folder. Keep logs beside {SIDECAR}."
            )
    return package


def _mapping(parent: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    found = parent.get(key, {})
    if not isinstance(found, dict):
        raise StickslipError(f'{where}: "{key}" holds {found!r}; expected an object {{...}}.')
    return found


def _list(parent: Mapping[str, Any], key: str, default: tuple[str, ...], where: str) -> list[Any]:
    found = parent.get(key, list(default))
    if not isinstance(found, list):
        raise StickslipError(f'{where}: "{key}" holds {found!r}; expected a list [...].')
    return found


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
        raise StickslipError(f"{where} holds {value!r}; expected a finite number.")
    return float(value)


def _check_hash(path: Path, resource: Mapping[str, Any], sidecar: Path) -> None:
    stated = resource.get("hash")
    if stated is None:
        return
    found = file_hash(path)
    if stated != found:
        raise StickslipError(
            f"'{path}' is not the file that '{sidecar}' describes: its checksum is {found}, stated is {stated}. "
            'Restore the file, or, if the change is meant, write the new checksum into "hash" (or leave "hash" out).'
        )


def _units(resource: Mapping[str, Any], where: str) -> dict[str, str]:
    described = _list(_mapping(resource, "schema", where), "fields", (), where)
    return {str(f["name"]): str(f["unit"]) for f in described if isinstance(f, dict) and "name" in f and "unit" in f}


def _rig(entries: Mapping[str, Any], where: str) -> RigConstants:
    constants: dict[str, Quantity] = {}
    for name in entries:
        at = f"{where}: rig constant '{name}'"
        if name not in RIG_UNITS:
            raise StickslipError(f"{at} is unknown.{nearest(name, RIG_UNITS)}")
        entry = _mapping(entries, name, where)
        if "value" not in entry or "unit" not in entry:
            raise StickslipError(f'{at} needs "value" and "unit" ({RIG_UNITS[name]}).')
        factor = conversion(str(entry["unit"]), RIG_UNITS[name], at)
        value = _number(entry["value"], at) * factor
        sd = _number(entry.get("standard_uncertainty", 0.0), at) * factor
        if value < 0 or (value == 0 and name in ("J", "k", "R", "r")) or sd < 0:
            raise StickslipError(f"{at} is {value:g} +- {sd:g} {RIG_UNITS[name]}; expected a positive value.")
        constants[name] = Quantity(value, RIG_UNITS[name], sd)
    return RigConstants(**constants)


def _calibration(entries: Mapping[str, Any], where: str) -> Calibration:
    kinds = {f.name: LaserCalibration if f.name == "laser" else EncoderCalibration for f in fields(Calibration)}
    made: dict[str, Any] = {}
    for instrument in entries:
        at = f"{where}: calibration of '{instrument}'"
        if instrument not in kinds:
            raise StickslipError(f"{at}: there is no such instrument.{nearest(instrument, kinds)}")
        kind, entry = kinds[instrument], dict(_mapping(entries, instrument, where))
        known = [f.name for f in fields(kind)]
        needed = "gain" if instrument == "laser" else "pulses_per_revolution"
        if needed not in entry:
            raise StickslipError(f'{at} lacks "{needed}".')
        for key in entry:
            if key not in known:
                raise StickslipError(f"{at} has the unknown entry '{key}'.{nearest(key, known)}")
            if key != "quadrature":
                entry[key] = _number(entry[key], f"{at}, '{key}'")
            elif not isinstance(entry[key], bool):
                raise StickslipError(f"{at}, 'quadrature' holds {entry[key]!r}; expected true or false.")
        if entry[needed] == 0 or (instrument != "laser" and (entry[needed] < 1 or entry[needed] % 1)):
            raise StickslipError(f'{at}: "{needed}" is {entry[needed]:g}; that measures nothing.')
        if instrument != "laser":
            entry[needed] = int(entry[needed])
        made[instrument] = kind(**entry)
    return Calibration(**made)


def _experiment(entry: Mapping[str, Any], where: str) -> Experiment:
    kind = entry.get("kind", "stick-slip")
    if kind not in ("stick-slip", "free-decay"):
        raise StickslipError(f"{where}: experiment kind {kind!r} is unknown. Expected 'stick-slip' or 'free-decay'.")
    contacts = tuple(str(c) for c in _list(entry, "contacts", () if kind == "free-decay" else ("disc0",), where))
    if not set(contacts) <= {"disc0", "disc1"}:
        raise StickslipError(f"{where}: contacts {list(contacts)} are unknown. Expected 'disc0', 'disc1' or both.")
    speeds = tuple(_number(v, f"{where}: drive_speed") for v in _list(entry, "drive_speed", (), where))
    if speeds and len(speeds) != len(contacts):
        raise StickslipError(
            f"{where}: {len(speeds)} drive speeds for {len(contacts)} discs. Give one for each contact."
        )
    materials = tuple(str(m) for m in _list(entry, "materials", (), where))
    return Experiment(kind, contacts, materials, speeds, _mapping(entry, "emulation", where))


def _package(name: str, logs: list[RigLog], work: Path, title: str, description: str) -> dict[str, Any]:
    """The sidecar; constants that all logs share stand at the package, the others at their log."""
    rigs = [_present(log.rig) for log in logs]
    shared = {key: value for key, value in rigs[0].items() if all(rig.get(key) == value for rig in rigs)}
    slug = re.sub(r"[^a-z0-9._-]+", "-", name.lower()).strip("-") or "logs"
    return {
        "profile": "tabular-data-package",
        "name": slug,
        "title": title or slug,
        "description": description or "Logs of a disc rig.",
        "licenses": [LICENCE],
        "rig": shared,
        "resources": [
            _resource(log, work, {k: v for k, v in rig.items() if k not in shared})
            for log, rig in zip(logs, rigs, strict=True)
        ],
    }


def _present(record: Any) -> dict[str, Any]:
    """Fields of a dataclass as JSON values, without those that are absent or infinite."""
    return {k: v for k, v in asdict(record).items() if v is not None and v not in (float("inf"), -float("inf"))}


def _resource(log: RigLog, work: Path, rig: dict[str, Any]) -> dict[str, Any]:
    file = work / f"{log.name}.csv"
    experiment = {k: v for k, v in asdict(log.experiment).items() if v or k in ("kind", "contacts")}
    instruments = [i for i in ("laser", "encoder", "drive0", "drive1") if getattr(log.calibration, i) is not None]
    resource: dict[str, Any] = {
        "profile": "tabular-data-resource",
        "name": log.name,
        "path": file.name,
        "format": "csv",
        "mediatype": "text/csv",
        "encoding": "utf-8",
        "bytes": file.stat().st_size,
        "hash": file_hash(file),
        "experiment": experiment,
        "calibration": {name: _present(getattr(log.calibration, name)) for name in instruments},
        "schema": {"fields": [_field(name) for name in (TIME.name, *log.columns)]},
    }
    return resource | ({"rig": rig} if rig else {})


def _field(name: str) -> dict[str, Any]:
    column = COLUMNS[name]
    return {
        "name": name,
        "type": "integer" if column.whole else "number",
        "unit": column.unit,
        "description": column.description,
    }
