"""A trajectory in a file: CSV for a spreadsheet, HDF5 for everything that is known of the run.

    run.h5   attributes: format, version, tool, method, steps, evaluations
      time                      (n,), unit "s"
      values/<variable>         (n,), attributes name, unit, description
      events/<field>            (k,), one column per field, of states (k, n_states); attribute kind
      texts/<variable>          (2,), texts or bytes after initialization and at the end; attribute name
      provenance                attributes: which FMU by name, token and hash, which tool, method, tolerance, interval
        parameters, start, inputs   what was set: one number, text or bytes per name, in the unit of the FMU

CSV has the variables that are numbers and their units alone. The file is written whole or not at all.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.child_process import IsolatedFailure
from fmu_models.base.errors import StickslipError, WriteError
from fmu_models.base.files import existing, write_whole
from fmu_models.base.processes import isolated
from fmu_models.base.shown import Shown
from fmu_models.base.version import version
from fmu_models.fmu.elements import element_names
from fmu_models.simulation.trajectory import Event, ForeignEvent, Trajectory

if TYPE_CHECKING:
    import h5py

    from fmu_models.fmu.fmu import Fmu

FORMAT = "stickslip trajectory"
VERSION = 2
SUFFIXES = (".csv", ".h5", ".hdf5")
SEAL = b"\nstickslip sha256 "  # and the hash of all before it, at the end of the file, where HDF5 looks at nothing
EVENT_KINDS: dict[str, type[Any]] = {kind.__name__: kind for kind in (Event, ForeignEvent)}
LONGEST = 8192  # characters of a text: an attribute of HDF5 has room for 64 kB
SETTINGS = ("parameters", "start", "inputs")


@dataclass(frozen=True)
class Provenance(Shown):
    """Where a trajectory comes from.

    Attributes:
        fmu, model: name of the file and of the model in it.
        token: instantiation token (FMI 3) or GUID (FMI 2).
        sha256: of the file.
        fmi_version: of the FMU.
        generation_tool: that made the FMU, as it says.
        tool: that made the run, with its version.
        method: of integration, as it was asked for.
        tolerance: relative; nan where none applies.
        step: communication step of a co-simulation, s; nan where none applies.
        start_time, stop_time: s.
        parameters, start, inputs: what was set, in the units of the FMU.
    """

    fmu: str
    model: str
    token: str
    sha256: str
    fmi_version: str
    generation_tool: str
    method: str
    start_time: float
    stop_time: float
    tolerance: float = float("nan")
    step: float = float("nan")
    tool: str = field(default_factory=lambda: f"stickslip {version()}")
    parameters: Mapping[str, float | str | bytes] = field(default_factory=dict)
    start: Mapping[str, float | str | bytes] = field(default_factory=dict)
    inputs: Mapping[str, float | str | bytes] = field(default_factory=dict)

    @classmethod
    def of(cls, fmu: Fmu, method: str, start_time: float, stop_time: float, **others: Any) -> Provenance:
        """The provenance of a run of ``fmu``; ``others`` are attributes by name."""
        attributes = "modelName", "instantiationToken", "fmiVersion", "generationTool"
        model, token, fmi_version, generation_tool = (getattr(fmu.description, name) or "" for name in attributes)
        named = fmu.path.name, model, token, fmu.sha256, fmi_version, generation_tool
        return cls(*named, method, start_time, stop_time, **others)


@dataclass(frozen=True, eq=False)
class Recording(Shown):
    """A trajectory, a description per variable that has one, and where it comes from, or what finds that out: a model
    that is not built yet has to be, for the hash of its file."""

    trajectory: Trajectory
    descriptions: Mapping[str, str]
    origin: Provenance | Callable[[], Provenance] | None

    @cached_property
    def provenance(self) -> Provenance | None:
        """Where it comes from, if that is known."""
        return self.origin() if callable(self.origin) else self.origin

    def write(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write it as CSV or HDF5; errors as for ``write_trajectory``."""
        write_trajectory(
            self.trajectory, path, provenance=self.provenance, descriptions=self.descriptions, overwrite=overwrite
        )


def check_suffix(path: str | os.PathLike[str] | None) -> None:
    """Refuse before the run what could not be written after it. None stands for a file that is not asked for.
    StickslipError: the suffix says neither CSV nor HDF5."""
    if path is not None and Path(path).suffix.lower() not in SUFFIXES:
        raise StickslipError(f"'{path}' must end in one of {', '.join(SUFFIXES)}, by which the format is chosen.")


def write_trajectory(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    *,
    provenance: Provenance | None = None,
    descriptions: Mapping[str, str] | None = None,
    overwrite: bool = False,
) -> None:
    """Write ``trajectory`` as CSV or HDF5, by the suffix of ``path``; texts are cut after 8192 characters.

    Raises:
        StickslipError: another suffix, ``path`` exists and ``overwrite`` is false, or cannot be written.
    """
    check_suffix(path)
    try:
        if Path(path).suffix.lower() == ".csv":
            trajectory.write_csv(path, overwrite=overwrite)
            return
        import h5py

        # made in memory: the library of HDF5 crashes where a disk has no room left when it closes a file
        buffer = io.BytesIO()
        with h5py.File(buffer, "w") as file:
            _write(file, trajectory, provenance, descriptions or {})
        with write_whole(path, overwrite=overwrite) as temporary:
            temporary.write_bytes(buffer.getvalue() + SEAL + sha256(buffer.getbuffer()).hexdigest().encode())
    except OSError as error:
        reason = error.strerror or error
        raise WriteError(f"'{path}' cannot be written: {reason}. Is the disk full?") from error


def _write(
    file: h5py.File, trajectory: Trajectory, provenance: Provenance | None, descriptions: Mapping[str, str]
) -> None:
    file.attrs.update(format=FORMAT, version=VERSION, tool=f"stickslip {version()}")
    counts = {"steps": trajectory.steps, "evaluations": trajectory.evaluations}
    file.attrs.update(method=trajectory.method[:LONGEST], **counts)
    _column(file, "time", trajectory.time).attrs["unit"] = "s"
    values = file.create_group("values", track_order=True)
    columns, units = _whole_arrays(trajectory)
    for name, data in columns.items():
        attributes = _column(values, _key(name), data).attrs
        attributes["name"] = name
        attributes["unit"] = units[name]
        if name in descriptions:
            attributes["description"] = descriptions[name][:LONGEST]
    events = file.create_group("events", track_order=True)
    kind = type(trajectory.events[0]) if trajectory.events else Event
    events.attrs["kind"] = kind.__name__
    for name in (f.name for f in fields(kind)):
        _column(events, name, _array([getattr(event, name) for event in trajectory.events]))
    if trajectory.texts:
        group = file.create_group("texts", track_order=True)
        for name, texts in trajectory.texts.items():
            _texts(group, _key(name), texts).attrs["name"] = name
    if provenance:
        _write_provenance(file.create_group("provenance"), provenance)


def _whole_arrays(trajectory: Trajectory) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Columns and units with each array as one, (n, ...), in place of its elements."""
    columns, units = dict(trajectory.values), dict(trajectory.units)
    for name, shape in trajectory.arrays.items():
        elements = element_names(name, shape)
        pieces = [columns.pop(element) for element in elements]
        if pieces:
            columns[name] = np.stack(pieces, axis=1).reshape(-1, *shape)
            units[name] = units[elements[0]]
    return columns, units


def _write_provenance(group: h5py.Group, provenance: Provenance) -> None:
    for name in (f.name for f in fields(provenance)):
        value = getattr(provenance, name)
        if name in SETTINGS:
            subgroup = group.create_group(name, track_order=True)
            for key, setting in value.items():
                if isinstance(setting, (str, bytes)):
                    dataset = _texts(subgroup, _key(key), [setting])
                else:
                    dataset = subgroup.create_dataset(_key(key), data=float(setting))
                dataset.attrs["name"] = key
        else:
            group.attrs[name] = value[:LONGEST] if isinstance(value, str) else value


def _texts(group: h5py.Group, name: str, values: Sequence[Any]) -> h5py.Dataset:
    """Texts, or bytes as numbers: a text of HDF5 ends at its first zero."""
    import h5py

    if isinstance(values[0], str):
        return group.create_dataset(name, data=np.array(values, dtype=object), dtype=h5py.string_dtype())
    dataset = group.create_dataset(name, (len(values),), dtype=h5py.vlen_dtype(np.uint8))
    for row, value in enumerate(values):
        dataset[row] = np.frombuffer(value, dtype=np.uint8)
    return dataset


def _read_texts(data: h5py.Dataset) -> list[str] | list[bytes]:
    import h5py

    return (
        np.asarray(data.asstr()[()]).tolist()
        if h5py.check_string_dtype(data.dtype)
        else [row.tobytes() for row in data[()]]
    )


def _column(group: h5py.Group, name: str, data: np.ndarray) -> h5py.Dataset:
    # a chunk needs a length; deflate after shuffle halves smooth curves and all but removes constant ones
    packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if data.size else {}
    if data.dtype.kind == "O":
        import h5py

        return group.create_dataset(name, data=data, dtype=h5py.string_dtype())
    return group.create_dataset(name, data=data, **packed)


def _array(values: list[Any]) -> np.ndarray:
    """A column of numbers, or of texts as objects."""
    array = np.array(values)
    return np.array(values, dtype=object) if array.dtype.kind == "U" else array


def _key(name: str) -> str:
    """A name as HDF5 takes it: there '/' leads to a subgroup and '.' is the group itself."""
    key = name.replace("%", "%25").replace("/", "%2F")
    return {"": "%", ".": "%2E"}.get(key, key)


def read_trajectory(path: str | os.PathLike[str]) -> Recording:
    """Read what ``write_trajectory`` wrote as HDF5.

    Raises:
        StickslipError: no such file, or not a trajectory.
    """
    if existing(path).suffix.lower() == ".csv":
        raise StickslipError(f"'{path}': CSV holds neither events nor origin; write the run as .h5 to read it again.")
    if _is_sealed(Path(path)):
        return _recording(path)
    try:
        # the library of HDF5 crashes on some damaged files
        return isolated(_recording, os.fspath(path))
    except IsolatedFailure as error:
        raise StickslipError(f"'{path}' cannot be read as a trajectory: {error} Run the simulation again.") from error


def _is_sealed(path: Path) -> bool:
    """Whether the file is, to the last bit, as it was written."""
    length = path.stat().st_size - len(SEAL) - 64
    digest = sha256()
    try:
        with path.open("rb") as file:
            while length > 0 and (block := file.read(min(length, 1 << 20))):
                digest.update(block)
                length -= len(block)
            return length == 0 and file.read() == SEAL + digest.hexdigest().encode()
    except OSError:
        return False


def _recording(path: str | os.PathLike[str]) -> Recording:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            if file.attrs.get("format") != FORMAT:
                raise StickslipError(f"'{path}' is an HDF5 file, but not a trajectory written by stickslip.")
            if file.attrs.get("version") != VERSION:
                raise StickslipError(f"'{path}' was written by another version of stickslip. Run the simulation again.")
            return _read(file)
    except (OSError, KeyError, TypeError, AttributeError, RuntimeError, ValueError) as error:
        raise StickslipError(f"'{path}' cannot be read as a trajectory: {error}. Run the simulation again.") from error


def _read(opened: h5py.File) -> Recording:
    file: Any = opened  # of what it holds h5py knows no more than that it may be anything
    values, units, descriptions, arrays = {}, {}, {}, {}
    for data in file["values"].values():
        name, shape = str(data.attrs["name"]), data.shape[1:]
        elements = element_names(name, shape)
        values |= zip(elements, data[()].reshape(len(data), -1).T, strict=True) if shape else {name: data[()]}
        units |= dict.fromkeys(elements, str(data.attrs["unit"]))
        if shape:
            arrays[name] = shape
        if "description" in data.attrs:
            descriptions[name] = str(data.attrs["description"])
    stored = file["events"]
    kind = EVENT_KINDS[stored.attrs["kind"]]
    columns = [stored[f.name] for f in fields(kind)]
    lists = [(c.asstr()[()] if c.dtype.kind == "O" else c[()]).tolist() for c in columns]
    rows = zip(*lists, strict=True)
    events = tuple(kind(*(tuple(cell) if isinstance(cell, list) else cell for cell in row)) for row in rows)
    steps, evaluations, method = int(file.attrs["steps"]), int(file.attrs["evaluations"]), str(file.attrs["method"])
    time = np.asarray(file["time"][()])
    if time.ndim != 1 or any(c.shape != time.shape or c.dtype.kind not in "fiub" for c in values.values()):
        raise ValueError("every variable needs a number at each time")
    pairs = {str(data.attrs["name"]): _read_texts(data) for data in file.get("texts", {}).values()}
    texts = {name: (first, last) for name, (first, last) in pairs.items()}
    trajectory = Trajectory(time, values, units, events, steps, evaluations, method, arrays=arrays, texts=texts)
    return Recording(trajectory, descriptions, _read_provenance(file["provenance"]) if "provenance" in file else None)


def _read_provenance(opened: h5py.Group) -> Provenance:
    group: Any = opened
    settings: dict[str, Any] = {}
    for name in (f.name for f in fields(Provenance)):
        if name in SETTINGS:
            settings[name] = {
                str(data.attrs["name"]): _read_texts(data)[0] if data.shape else float(data[()])
                for data in group[name].values()
            }
        else:
            value = group.attrs[name]
            settings[name] = value if isinstance(value, str) else float(value)
    return Provenance(**settings)
