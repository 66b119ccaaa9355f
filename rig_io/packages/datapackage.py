"""Packages of logs on disk: CSV files and the ``datapackage.json`` that describes them."""

import json
import os
import re
import shutil
import tempfile
import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError, StickslipWarning, WriteError, nearest
from fmu_models.base.files import FULL, OVERWRITE, existing, write_whole
from fmu_models.base.registry import Reference
from fmu_models.base.unit_names import conversion
from rig_io.joining.joined import Joined, joined
from rig_io.logs.columns import COLUMNS, TIME, metres
from rig_io.logs.log import Experiment, InstrumentCalibrations, LaserCalibration, RigConstants, RigLog
from rig_io.logs.table import Table
from rig_io.packages import sidecar
from rig_io.packages.described import Field, fields_of, files_of, with_roles, with_units
from rig_io.packages.sidecar import SIDECAR, mapping
from rig_io.readers import check_kind, csv_log, read_table
from rig_io.repair.counters import counted
from rig_io.repair.table import Checked, check_edges, checked

LASER = "laser"
# the calibration that a column needs
_INSTRUMENTS = {"laser": "laser", "encoder_count": "encoder", "drive0_count": "drive0", "drive1_count": "drive1"}


def read_log(
    path: str | os.PathLike[str],
    *,
    rig: RigConstants | None = None,
    calibration: InstrumentCalibrations | None = None,
    experiment: Experiment | None = None,
    repair: Collection[str] = (),
    reader: Reference | None = None,
) -> RigLog:
    """Read one log and its entry in the ``datapackage.json`` beside it.

    What is given here takes the place of the sidecar's; with ``rig`` given and units in the header (``time [s]``) a log
    needs no sidecar. What is mended is said in a `StickslipWarning` and kept in `RigLog.warnings`.

    Args:
        repair: what may be mended that is refused otherwise, "sort" (rows by time), "duplicates" (the first of rows
            with one time is kept).
        reader: as for `rig_io.readers.read_table`.

    Raises:
        StickslipError: the file or its sidecar cannot be used; says what was found and what to do.
    """
    path = Path(path)
    if path.is_dir() or path.name == SIDECAR:
        raise StickslipError(f"'{path}' is a package of logs, not one log. Name a CSV file in it, or read the package.")
    beside = sorted(path.parent.glob(f"*{path.suffix}")) if path.suffix and path.parent.is_dir() else []
    existing(path, "log", nearest(path.name, [file.name for file in beside]))
    check_kind(path, reader)
    package, resource = _description(path, required=rig is None)
    where = f"'{path.parent / SIDECAR}', resource '{path.name}'"
    constants = {**mapping(package, "rig", where), **mapping(resource, "rig", where)}
    run = _run(path, resource, where, reader, _sizes(resource, constants, where))
    table = checked(run.table, repair)
    length = table.units[LASER] != COLUMNS[LASER].unit if LASER in table.units else False
    instruments = calibration or sidecar.calibration(mapping(resource, "calibration", where), where, length)
    if LASER in table.columns and length and instruments.laser is None:
        instruments = replace(instruments, laser=LaserCalibration(1.0, gain_deviation=0.0))
    table, unread = _calibrated(table, instruments, mapping(resource, "calibration", where))
    values, breaks, mended = counted(table.columns, table.breaks, instruments, table.table.source, table.table.place)
    check_edges(table.table, values, breaks)
    clock = () if run.clock is None else (run.clock.sentence(),)
    remarks = (*run.said, *clock, *table.said, *unread, *mended, *_guesses(resource, where))
    for warning in remarks:
        warnings.warn(f"{run.table.source}: {warning}", StickslipWarning, stacklevel=2)
    time = values.pop(TIME.name)
    return RigLog(
        name=str(resource.get("name", path.stem)),
        time=time,
        columns=values,
        units={name: table.units[name] for name in (TIME.name, *values)},
        rig=rig or sidecar.rig_constants(constants, where),
        calibration=instruments,
        experiment=experiment or sidecar.experiment(mapping(resource, "experiment", where), where),
        path=path,
        breaks=breaks,
        warnings=remarks,
        clock_deviation=0.0 if run.clock is None else run.clock.spread,
    )


def read_columns(path: str | os.PathLike[str], *, reader: Reference | None = None) -> Table:
    """Every column of one file under its own name; a ``datapackage.json`` beside it says how it is written, in which
    units, and what its checksum is.

    reader: as in `read_log`.

    Raises:
        StickslipError: as in `rig_io.readers.read_table`; a unit that is not the file's; another checksum.
    """
    return described_columns(existing(path, "log"), reader)[0]


def described_columns(path: Path, reader: Reference | None = None) -> tuple[Table, tuple[Field, ...], float | None]:
    """As `read_columns`, with what the sidecar says of the columns, and the rate (Hz) of a file without a clock."""
    _, resource = _description(path, required=False)
    where = f"'{path.parent / SIDECAR}', resource '{path.name}'"
    fields = tuple(field for field in fields_of(resource, where) if field.file in (None, path.name)) if resource else ()
    table = with_units(read_table(path, reader, _dialect(resource, where)), fields)
    return table, fields, _rate(resource, where)


def _dialect(resource: Mapping[str, Any], where: str) -> dict[str, str]:
    return {key: str(value) for key, value in mapping(resource, "dialect", where).items()}


def _sizes(resource: Mapping[str, Any], constants: Mapping[str, Any], where: str) -> dict[str, float]:
    """rad per unit of the columns that show the disc, as far as they are calibrated."""
    fields = {field.role: field for field in fields_of(resource, where)} if resource else {}
    calibration = sidecar.calibration(mapping(resource, "calibration", where), where, length=True)
    sizes = {"encoder_count": calibration.encoder.pitch} if calibration.encoder else {}
    radius = sidecar.rig_constants({"R": constants["R"]} if "R" in constants else {}, where).R
    laser = fields.get(LASER)
    if laser is not None and laser.unit and radius is not None:
        unit = metres(laser.unit) or (calibration.laser.gain if calibration.laser else None)
        sizes |= {LASER: abs(unit) / radius.value} if unit else {}
    angle = fields.get("angle")
    return sizes | (
        {"angle": conversion(angle.unit, "rad", f"{where}: column '{angle.name}'")} if angle and angle.unit else {}
    )


def _run(
    path: Path, resource: Mapping[str, Any], where: str, reader: Reference | None, sizes: Mapping[str, float]
) -> Joined:
    """The files of a log as one table, its columns by their roles."""
    fields = fields_of(resource, where)
    options = _dialect(resource, where)
    rate = _rate(resource, where)
    tables = []
    for file in files_of(resource) if resource else (path.name,):
        existing(path.parent / file, "log")
        file_fields = [field for field in fields if field.file in (None, file)]
        table = read_table(path.parent / file, reader, options)
        tables.append(with_roles(table, file_fields, where, rate))
    rule = resource.get("join")
    return joined(tables, rule if rule is None else str(rule), sizes)


def _rate(resource: Mapping[str, Any], where: str) -> float | None:
    """Hz, of files without a clock."""
    rate = resource.get("sampling_rate")
    if rate is not None and (isinstance(rate, bool) or not isinstance(rate, int | float) or not 0 < rate < 1e9):
        raise StickslipError(f'{where}: "sampling_rate" holds {rate!r}; expected a number of Hz.')
    return None if rate is None else float(rate)


def _calibrated(
    table: Checked, instruments: InstrumentCalibrations, stated: Mapping[str, Any]
) -> tuple[Checked, tuple[str, ...]]:
    """Columns whose instrument is calibrated; and what to say of those whose calibration nobody knows."""
    columns, remarks = dict(table.columns), []
    for column, instrument in _INSTRUMENTS.items():
        if column not in columns:
            continue
        if instrument in stated and getattr(instruments, instrument) is None:
            del columns[column]
            columns.pop(f"{instrument}_edge_time", None)
            remarks.append(f"'{column}' is not read: its calibration is not known.")
        else:
            instruments.need(instrument)
    return replace(table, columns=columns), tuple(remarks)


def _guesses(resource: Mapping[str, Any], where: str) -> tuple[str, ...]:
    """Entries of the sidecar that nobody has confirmed, or that are not known."""
    guessed = [f"the {guess} of '{field.name}'" for field in fields_of(resource, where) for guess in field.guessed]
    guessed += [str(key) for key in mapping(mapping(resource, "experiment", where), "guessed", where)]
    remarks = []
    if guessed:
        verb = "is" if len(guessed) == 1 else "are"
        remarks.append(f"{', '.join(guessed)} {verb} guessed; confirm it: stickslip describe FILES --confirm.")
    laser = mapping(mapping(resource, "calibration", where), "laser", where)
    if laser.get("zero", 0) is None:
        remarks.append("the laser's reading at rest is not known: 0 was taken, and a free decay must show it.")
    return tuple(remarks)


def _description(path: Path, required: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    """The package beside a log and the log's resource in it; both empty where none is there nor required."""
    beside = path.parent / SIDECAR
    if not beside.exists():
        if required:
            raise StickslipError(
                f"There is no {SIDECAR} beside '{path}', so the rig's constants are unknown. Have one "
                "written: stickslip describe FILES. Or give the constants and put units into the "
                "header: 'time [s]'."
            )
        return {}, {}
    package = sidecar.load_json(beside)
    resources = {file: resource for resource in package["resources"] for file in files_of(resource)}
    if path.name not in resources:
        if required:
            hint = nearest(path.name, resources)
            raise StickslipError(f"'{beside}' says nothing of '{path.name}'. Add a resource for it.{hint}")
        return package, {}
    for file in files_of(resources[path.name]):
        _check_hash(path.parent / file, resources[path.name], beside)
    return package, resources[path.name]


def read_package(
    path: str | os.PathLike[str], *, repair: Collection[str] = (), reader: Reference | None = None
) -> list[RigLog]:
    """Read every log of a data package (its folder or its ``datapackage.json``), in the package's order.

    repair, reader: as in `read_log`. Errors as for `read_log`.
    """
    path = Path(path)
    sidecar_path = path / SIDECAR if existing(path, "package of logs").is_dir() else path
    if not sidecar_path.exists():
        raise StickslipError(f"There is no {SIDECAR} in '{path}'. Have one written: stickslip describe {path}.")
    if sidecar_path.name != SIDECAR:
        raise StickslipError(f"'{path}' is not a package of logs. Expected a folder or its {SIDECAR}.")
    resources = sidecar.load_json(sidecar_path)["resources"]
    return [read_log(sidecar_path.parent / files_of(r)[0], repair=repair, reader=reader) for r in resources]


def check_target(folder: Path, names: Sequence[str], overwrite: bool) -> None:
    """Refuse before the work what `write_package` would refuse after it. StickslipError: no name, a name that cannot be
    a file's, two alike, or a folder that holds something already."""
    if not names:
        raise StickslipError("A package needs at least one log.")
    for name in names:
        if not re.fullmatch(r"[a-z0-9][a-z0-9._-]*", name):
            raise StickslipError(
                f"The log name '{name}' cannot be a file name. Use lower-case letters, digits, '_', '-', '.'."
            )
    if len(set(names)) < len(names):
        raise StickslipError(f"Two logs have one name among {', '.join(names)}. Name them apart.")
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not overwrite)):
        raise StickslipError(f"'{folder}' exists already. {OVERWRITE}")


def write_package(
    folder: str | os.PathLike[str],
    logs: Iterable[RigLog],
    *,
    title: str = "",
    description: str = "",
    overwrite: bool = False,
) -> Path:
    """Write logs as CSV files with ``datapackage.json``, whole or not at all; returns the folder.

    With ``overwrite`` files of the same names are replaced one by one, ``datapackage.json`` last; others stay.

    Raises:
        StickslipError: the folder holds something already (and ``overwrite`` is false) or cannot be written, there is
            no log, or two have one name.
    """
    folder, logs = Path(folder), list(logs)
    check_target(folder, [log.name for log in logs], overwrite)

    def fill(work: Path) -> dict[str, Any]:
        for log in logs:
            csv_log.write(work / f"{log.name}.csv", {TIME.name: log.time, **log.columns})
        return sidecar.package(work.name, logs, work, title, description)

    return write_folder(folder, [f"{log.name}.csv" for log in logs], fill)


def write_folder(folder: Path, files: Sequence[str], fill: Callable[[Path], Mapping[str, Any]]) -> Path:
    """Write what ``fill`` writes into a folder, ``files`` and the sidecar that it returns, whole or not at all.

    Raises:
        StickslipError: the folder cannot be written.
    """
    target = folder.resolve()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        room = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    except OSError as error:
        raise _unwritable(folder, error) from error
    try:
        work = room / target.name  # a folder of the usual rights, which mkdtemp's is not
        work.mkdir()
        package = fill(work)
        (work / SIDECAR).write_text(json.dumps(package, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        if not target.exists():
            work.rename(target)
            return folder
        for file in (*files, SIDECAR):  # the sidecar last: until then the old one rules
            with write_whole(target / file, overwrite=True) as temporary:
                (work / file).replace(temporary)
    except OSError as error:
        raise _unwritable(folder, error) from error
    finally:
        shutil.rmtree(room, ignore_errors=True)
    return folder


def _unwritable(folder: Path, error: OSError) -> StickslipError:
    kind = WriteError if error.errno in FULL else StickslipError
    return kind(
        f"'{folder}' cannot be written: {error.strerror or error}. Choose a folder you may write to, with room left."
    )


def _check_hash(path: Path, resource: Mapping[str, Any], beside: Path) -> None:
    stated = resource.get("hash")
    if isinstance(stated, dict):
        stated = stated.get(path.name)
    if stated is None or not path.exists():
        return
    digest = sidecar.file_hash(path)
    if stated != digest:
        raise StickslipError(
            f"'{path}' is not the file that '{beside}' describes: its checksum is {digest}, stated is {stated}. "
            'Restore the file, or, if the change is meant, write the new checksum into "hash" (or leave "hash" out).'
        )
