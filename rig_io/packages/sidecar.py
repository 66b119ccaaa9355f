"""What ``datapackage.json`` says of a log, as values, and back.

Its keys: ``PACKAGE_KEYS``, ``LOG_KEYS``, ``QUANTITY_KEYS``, ``EXPERIMENT_KEYS`` and the fields of the calibrations.
Every function that reads takes ``where``, with which its errors begin.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, get_args

from fmu_models.base.errors import StickslipError, nearest, refuse_unknown
from fmu_models.base.unit_names import conversion
from rig_io.logs.arrangement import Arrangement
from rig_io.logs.beam import BEAMS
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.log import (
    RIG_UNITS,
    EncoderCalibration,
    Experiment,
    InstrumentCalibrations,
    LaserCalibration,
    LoadCalibration,
    RigConstants,
    RigLog,
    StatedQuantity,
)
from rig_io.packages.described import files_of
from rig_io.repair.plausible import check_radius

SIDECAR = "datapackage.json"
LOADS = ("load0", "load1")
# what the reference of the manual says of each key
PACKAGE_KEYS = {"resources": "the logs", "rig": "constants of the rig for all of them"}
LOG_KEYS = {
    "path": "its file, beside the sidecar, or a list of its files",
    "name": "of the log; the file's if left out",
    "join": 'how several files belong together: `"columns"` (one file per signal), `"time"` (a recorder that began a '
    'new file) or `"clocks"` (two recorders, each with its own clock)',
    "dialect": "how its files are written, by the options of their reader",
    "sampling_rate": "Hz, of files without a clock",
    "hash": "`sha256:...` of its file, or of each of its files by name; a file that differs is refused",
    "rig": "constants that depart from those of the package",
    "experiment": "what was done",
    "calibration": "of its instruments",
    "schema": "`fields`: its columns",
}
QUANTITY_KEYS = {
    "value": "a number; null for what is not known, which a fit then says",
    "unit": "that of the table above, or another one of the same dimension",
    "standard_uncertainty": "one standard deviation, in the same unit; not known if left out",
}
EXPERIMENT_KEYS = (*(one.name for one in fields(Experiment)), "guessed")
LICENCE = {
    "name": "CC0-1.0",
    "title": "Creative Commons Zero v1.0",
    "path": "https://creativecommons.org/publicdomain/zero/1.0/",
}


def load_json(sidecar: Path) -> dict[str, Any]:
    try:
        package = json.loads(sidecar.read_text(encoding="utf-8-sig"))
    except json.JSONDecodeError as error:
        raise StickslipError(f"'{sidecar}' is not JSON: {error.msg} on line {error.lineno}. Mend it there.") from error
    except (OSError, UnicodeDecodeError, RecursionError) as error:
        raise StickslipError(f"'{sidecar}' cannot be read: {error}. Save it as JSON in UTF-8.") from error
    resources = package.get("resources") if isinstance(package, dict) else None
    if (
        not isinstance(resources, list)
        or not resources
        or not all(isinstance(r, dict) and "path" in r for r in resources)
    ):
        raise StickslipError(f'\'{sidecar}\' lists no logs. Expected "resources": [{{"path": "....csv", ...}}].')
    for resource in resources:
        files = files_of(resource)
        if not files:
            raise StickslipError(f"'{sidecar}' lists a log without a file. Name one in its \"path\".")
        for file in files:
            if file != Path(file).name:
                raise StickslipError(f"'{sidecar}': the path '{file}' leaves the folder. Keep logs beside {SIDECAR}.")
    return package


def mapping(parent: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    entry = parent.get(key, {})
    if not isinstance(entry, dict):
        raise StickslipError(f'{where}: "{key}" holds {entry!r}; expected an object {{...}}.')
    return entry


def _list(parent: Mapping[str, Any], key: str, default: tuple[str, ...], where: str) -> list[Any]:
    entry = parent.get(key, list(default))
    if not isinstance(entry, list):
        raise StickslipError(f'{where}: "{key}" holds {entry!r}; expected a list [...].')
    return entry


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
        raise StickslipError(f"{where} holds {value!r}; expected a finite number.")
    return float(value)


def rig_constants(entries: Mapping[str, Any], where: str) -> RigConstants:
    constants: dict[str, StatedQuantity] = {}
    for name in entries:
        at = f"{where}: rig constant '{name}'"
        refuse_unknown(name, RIG_UNITS, f"{at} is unknown.")
        entry = mapping(entries, name, where)
        if entry.get("value", 0) is None:
            continue  # asked for, and not known
        if "value" not in entry or "unit" not in entry:
            raise StickslipError(f'{at} needs "value" and "unit" ({RIG_UNITS[name]}).')
        factor = conversion(str(entry["unit"]), RIG_UNITS[name], at)
        value = _number(entry["value"], at) * factor
        stated = entry.get("standard_uncertainty")
        sd = None if stated is None else _number(stated, at) * factor
        if value < 0 or (value == 0 and name in ("J", "k", "R", "r")) or (sd is not None and sd < 0):
            raise StickslipError(f"{at} is {StatedQuantity(value, RIG_UNITS[name], sd)}; expected a positive value.")
        if name in ("R", "r"):
            check_radius(at, name, value)
        constants[name] = StatedQuantity(value, RIG_UNITS[name], sd)
    return RigConstants(**constants)


def calibration(entries: Mapping[str, Any], where: str, length: bool = False) -> InstrumentCalibrations:
    """length: whether the laser's column is a length, so that its gain is 1."""
    kinds = {
        f.name: LaserCalibration if f.name == "laser" else EncoderCalibration for f in fields(InstrumentCalibrations)
    }
    instruments: dict[str, Any] = {}
    for instrument in entries:
        at = f"{where}: calibration of '{instrument}'"
        if instrument in LOADS:
            instruments[instrument] = _load(mapping(entries, instrument, where), at)
            continue
        refuse_unknown(instrument, kinds, f"{at}: there is no such instrument.")
        kind, entry = kinds[instrument], dict(mapping(entries, instrument, where))
        # what was asked for and is not known
        entry = {key: value for key, value in entry.items() if value is not None and key != "guessed"}
        if length and instrument == "laser":
            entry = {"gain": 1.0, "gain_deviation": 0.0, **entry}
        names = [f.name for f in fields(kind)]
        if names[0] in entries[instrument] and names[0] not in entry:
            continue  # nobody knows it: what the instrument wrote is not read
        needed = "gain" if instrument == "laser" else "pulses_per_revolution"
        if needed not in entry:
            raise StickslipError(f'{at} lacks "{needed}".')
        for key in entry:
            refuse_unknown(key, names, f"{at} has the unknown entry '{key}'.")
            if key == "beam":
                refuse_unknown(str(entry[key]), BEAMS, f"{at}: there is no beam {entry[key]!r}.")
            elif key != "quadrature":
                entry[key] = _number(entry[key], f"{at}, '{key}'")
                if key == "counter_bits" and entry[key] not in range(4, 65):
                    raise StickslipError(f"{at}, 'counter_bits' is {entry[key]:g}; a counter has 8, 16, 24 or 32.")
            elif not isinstance(entry[key], bool):
                raise StickslipError(f"{at}, 'quadrature' holds {entry[key]!r}; expected true or false.")
        if entry.get("ratio", 1.0) <= 0:
            raise StickslipError(
                f"{at}: a ratio of {entry['ratio']:g} is none. Write its turns in one turn of the disc."
            )
        if not abs(entry.get("creep", 0.0)) < 1:
            raise StickslipError(f"{at}: a creep of {entry['creep']:g} is none. Write the share that the disc lags.")
        if entry[needed] == 0 or (instrument != "laser" and (entry[needed] < 1 or entry[needed] % 1)):
            raise StickslipError(f'{at}: "{needed}" is {entry[needed]:g}; that measures nothing.')
        if instrument != "laser":
            entry |= {key: int(entry[key]) for key in (needed, "counter_bits") if key in entry}
        instruments[instrument] = kind(**entry)
    return InstrumentCalibrations(**instruments)


def _load(entry: Mapping[str, Any], at: str) -> LoadCalibration:
    for key in entry:
        if key != "gain_deviation":
            raise StickslipError(f"{at} has the unknown entry '{key}'. Expected 'gain_deviation', relative.")
    deviation = entry.get("gain_deviation")
    deviation = None if deviation is None else _number(deviation, f"{at}, 'gain_deviation'")
    if deviation is not None and deviation < 0:
        raise StickslipError(f"{at}: a gain_deviation of {deviation:g} is none. Give a positive share of the gain.")
    return LoadCalibration(deviation)


def experiment(entry: Mapping[str, Any], where: str) -> Experiment:
    for key in entry:
        refuse_unknown(key, EXPERIMENT_KEYS, f"{where}: an experiment has no key '{key}'.")
    kind = entry.get("kind", "stick-slip")
    if kind not in ("stick-slip", "free-decay"):
        raise StickslipError(f"{where}: experiment kind {kind!r} is unknown. Expected 'stick-slip' or 'free-decay'.")
    contacts = tuple(str(c) for c in _list(entry, "contacts", () if kind == "free-decay" else ("disc0",), where))
    if not set(contacts) <= {"disc0", "disc1"}:
        raise StickslipError(f"{where}: contacts {list(contacts)} are unknown. Expected 'disc0', 'disc1' or both.")
    speeds, deviations = (
        tuple(_number(v, f"{where}: {key}") for v in _list(entry, key, (), where))
        for key in ("drive_speed", "drive_speed_uncertainty")
    )
    if speeds and len(speeds) != len(contacts):
        raise StickslipError(
            f"{where}: {len(speeds)} drive speeds for {len(contacts)} discs. Give one for each contact."
        )
    if deviations and (len(deviations) != len(speeds) or min(deviations) < 0):
        raise StickslipError(
            f"{where}: drive_speed_uncertainty holds {list(deviations)} for the drive speeds {list(speeds)}. Give a "
            "positive one for each, in rad/s."
        )
    materials = tuple(str(m) for m in _list(entry, "materials", (), where))
    arrangement = entry.get("arrangement", "together")
    if arrangement not in get_args(Arrangement):
        raise StickslipError(
            f"{where}: arrangement {arrangement!r} is unknown.{nearest(str(arrangement), get_args(Arrangement))}"
        )
    if arrangement != "together" and len(contacts) != 2:
        raise StickslipError(
            f"{where}: discs arranged '{arrangement}' are two, but contacts are {list(contacts)}. Give both discs, or "
            "leave the arrangement out."
        )
    return Experiment(kind, contacts, materials, speeds, arrangement, deviations, mapping(entry, "emulation", where))


def package(name: str, logs: list[RigLog], work: Path, title: str, description: str) -> dict[str, Any]:
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


def _present(record: RigConstants | LaserCalibration | EncoderCalibration | LoadCalibration) -> dict[str, Any]:
    """Fields of a dataclass as JSON values, without those that are absent or infinite."""
    return {k: v for k, v in asdict(record).items() if v is not None and v not in (float("inf"), -float("inf"))}


def _resource(log: RigLog, work: Path, rig: dict[str, Any]) -> dict[str, Any]:
    file = work / f"{log.name}.csv"
    experiment = {k: v for k, v in asdict(log.experiment).items() if v or k in ("kind", "contacts")}
    if len(log.contacts) < 2:
        del experiment["arrangement"]
    instruments = [
        i for i in ("laser", "encoder", "drive0", "drive1", *LOADS) if getattr(log.calibration, i) is not None
    ]
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


def file_hash(path: Path) -> str:
    """Checksum as the data package writes it: ``sha256:<hex>``."""
    with open(path, "rb") as file:
        return "sha256:" + hashlib.file_digest(file, "sha256").hexdigest()
