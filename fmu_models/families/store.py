"""A family of motions on the disk: a Zarr store (version 3) that xarray reads.

    run.zarr           what was found, once it is; attributes: where it comes from, and whether it is finished
      records/log      bytes, by families: the rows of runs, a record per chunk of jobs, or texts of what is found one
                       after the other, a record each

The log is only added to, and a record counts once all of it is there with its checksum: a process that is killed, or a
disk that is full, loses what was being written and no more. A finished store has its records in order: nothing in it
depends on who made which chunk, nor when, and it is the same to the last byte.
"""

from __future__ import annotations

import json
import os
import shutil
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import OVERWRITE, is_there, on_disk
from fmu_models.families.jobs import Jobs
from fmu_models.simulation.rows import RunRows, joined

if TYPE_CHECKING:
    from types import ModuleType

    import xarray
    import zarr
    from numcodecs import Zstd

PROVENANCE, FINISHED, RECORDS = "provenance", "finished", "records/log"
WHAT = -1  # number of the record that says of which jobs a family has the rows
ROOM = 1 << 32  # numbers of one family in the log
FRESH = 64  # chunks that wait in memory to be taken; others are read back
LEVEL = 1  # of the compression
LOOSE = "records.log"  # where the log is until it is finished
CHUNK = "c/0"  # where Zarr keeps the only chunk of an array
WHOLE = 64 << 20  # bytes of a variable that is one chunk


class Store:
    """A folder with the runs of one analysis, and what it has found.

    Attributes:
        path: the folder.
        finished: whether all is there.
    """

    def __init__(self, path: Path, root: zarr.Group) -> None:
        self.path, self._root = path, root
        self._families = 0
        loose, packed = path / LOOSE, path / RECORDS / CHUNK
        with on_disk(path):  # beside the arrays of the store, or in one of them, where finishing has put it
            self._log = RunLog(packed if packed.is_file() and not loose.is_file() else loose)

    @property
    def finished(self) -> bool:
        """See the class."""
        return bool(self._root.attrs.get(FINISHED))

    @classmethod
    def open(cls, path: Path, provenance: Mapping[str, Any], resume: bool, overwrite: bool) -> Store:
        """The store at a path, new if there is none.

        Args:
            provenance: what it is made of, as JSON.
            resume: go on with one that is not finished.
            overwrite: replace one of another plan, or, without ``resume``, one that is not finished.

        Raises:
            StickslipError: something else is there; a store of another plan, version or model, with the difference; one
                that is not finished, if neither ``resume`` nor ``overwrite``.
            WriteError: the disk is full.
        """
        zarr = _zarr()
        if is_there(path) and not _is_empty(path):
            existing = cls._existing(path)
            differences = list(_differences(json.loads(str(existing._root.attrs[PROVENANCE])), provenance))
            if not differences and (resume or existing.finished):
                for partial in path.rglob("*.partial"):  # by a process that was killed
                    partial.unlink()
                return existing
            if not overwrite and differences:
                raise StickslipError(f"'{path}' was made otherwise: {'; '.join(differences)}. {OVERWRITE}")
            if not overwrite:
                raise StickslipError(
                    f"'{path}' is not finished. Go on with it: --resume (in Python resume=True). {OVERWRITE}"
                )
            shutil.rmtree(path)
        with on_disk(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            attributes = {PROVENANCE: told(provenance), FINISHED: False}
            return cls(path, zarr.create_group(path, zarr_format=3, attributes=attributes))

    @classmethod
    def _existing(cls, path: Path) -> Store:
        zarr = _zarr()
        try:
            root = zarr.open_group(path, mode="r+", zarr_format=3)
            provenance = PROVENANCE in root.attrs
        except (OSError, ValueError, KeyError):
            provenance, root = False, None
        if root is None or not provenance:
            raise StickslipError(f"'{path}' is no store of runs. Choose another name.")
        return cls(path, root)

    def stage(self, jobs: Jobs) -> Stage:
        """Where the next family of runs is kept."""
        return Stage(self.path, self._next(), jobs)

    def chain(self) -> Chain:
        """Where the next way is kept whose points are found one after the other."""
        return Chain(self.path, self._next())

    def runs(self) -> list[RunRows]:
        """The rows of all runs, one for each family."""
        families = [Family(self._log, index) for index in sorted({k // ROOM for k in self._log.numbers})]
        pieces = [[_unpacked(f.get(k)) for k in f.numbers if k != WHAT] for f in families if WHAT in f]
        return [
            joined(some, np.cumsum([0, *(len(piece.filled) for piece in some[:-1])]).tolist())
            for some in pieces
            if some
        ]

    def _next(self) -> Family:
        """The records of the next family."""
        self._families += 1
        return Family(self._log, self._families - 1)

    def finish(self, result: xarray.Dataset) -> None:
        """Keep what was found, a data set, in the root."""
        if self.finished:
            return
        with on_disk(self.path):
            if self._log.numbers:
                self._log.sort()
                loose, packed = self.path / LOOSE, self.path / RECORDS / CHUNK
                os.replace(self._log.path, loose)  # where a process that was killed as it finished had packed it
                size = loose.stat().st_size
                self._root.create_array(
                    RECORDS, shape=(size,), chunks=(size,), dtype="uint8", compressors=None, overwrite=True
                )
                packed.parent.mkdir(exist_ok=True)
                os.replace(loose, packed)
            found = result.assign_attrs({PROVENANCE: self._root.attrs[PROVENANCE]})
            for variable in found.variables.values():
                if variable.ndim and 0 < variable.nbytes <= WHOLE:
                    variable.encoding["chunks"] = variable.shape
            found.to_zarr(self.path, mode="a", zarr_format=3, consolidated=False)
            # opened anew: the group does not see what others have written in its attributes
            Store._existing(self.path)._root.attrs[FINISHED] = True


class RunLog:
    """Records that are only added to a file: number, length, checksum, content. Of two with one number the last counts.

    What follows a record that is not whole counts for nothing, and the next one takes its place.

    Attributes:
        path: of the file, which need not be there yet.
    """

    HEAD = struct.Struct("<qQI")

    def __init__(self, path: Path) -> None:
        self.path, self._end = path, 0
        self._places: dict[int, tuple[int, int]] = {}
        if path.is_file():
            with path.open("rb") as file:
                while len(head := file.read(self.HEAD.size)) == self.HEAD.size:
                    number, length, checksum = self.HEAD.unpack(head)
                    if length > path.stat().st_size or crc32(file.read(length)) != checksum:
                        break
                    self._end = file.tell()
                    self._places[number] = self._end - length, length

    @property
    def numbers(self) -> list[int]:
        """Those of the records that there are, ascending."""
        return sorted(self._places)

    def put(self, number: int, content: bytes) -> None:
        """Add a record."""
        self.path.parent.mkdir(exist_ok=True)
        with self.path.open("r+b" if self.path.is_file() else "xb") as file:
            file.seek(self._end)
            begin = self._end + file.write(self.HEAD.pack(number, len(content), crc32(content)))
            end = begin + file.write(content)
            file.truncate()
        self._places[number], self._end = (begin, len(content)), end

    def get(self, number: int) -> bytes:
        """Content of a record that is there."""
        begin, length = self._places[number]
        with self.path.open("rb") as file:
            file.seek(begin)
            return file.read(length)

    def sort(self) -> None:
        """Bring the records into the order of their numbers, each once."""
        length = sum(self.HEAD.size + length for _, length in self._places.values())
        if list(self._places) == self.numbers and self.path.stat().st_size == length:
            return
        path = self.path.with_suffix(".partial")
        path.unlink(missing_ok=True)
        ordered = RunLog(path)
        for number in self.numbers:
            ordered.put(number, self.get(number))
        os.replace(path, self.path)
        self._places, self._end = ordered._places, ordered._end


class Family:
    """The records of one family in the log of a store, by numbers of its own from ``WHAT`` on.

    Attributes:
        index: which family it is.
    """

    def __init__(self, log: RunLog, index: int) -> None:
        self.index, self._log, self._zero = index, log, index * ROOM - WHAT
        self._there = {k - self._zero for k in log.numbers if k // ROOM == index}

    @property
    def numbers(self) -> list[int]:
        """Those of the records that there are, ascending."""
        return sorted(self._there)

    def __len__(self) -> int:
        return len(self._there)

    def __contains__(self, number: int) -> bool:
        return number in self._there

    def put(self, number: int, content: bytes) -> None:
        """Add a record."""
        self._log.put(self._zero + number, content)
        self._there.add(number)

    def get(self, number: int) -> bytes:
        """Content of a record that is there."""
        return self._log.get(self._zero + number)


class Stage:
    """One family of runs in a store."""

    def __init__(self, path: Path, log: Family, jobs: Jobs) -> None:
        self.path, self._log = path, log
        self._fresh: dict[int, RunRows] = {}
        what = jobs.digest().encode()
        if WHAT not in log:
            with on_disk(path):
                log.put(WHAT, what)
        elif log.get(WHAT) != what:
            raise StickslipError(
                f"'{path}' goes on otherwise than here: the runs of family {log.index} are others. It was made by a "
                f"computer whose arithmetic differs in the last digit. {OVERWRITE}"
            )

    @property
    def count(self) -> int:
        """How many chunks are there."""
        return len(self._log) - 1

    def has(self, k: int) -> bool:
        """Whether a chunk is there."""
        return k in self._log

    def has_room(self) -> bool:
        """There always is, on the disk."""
        return True

    def put(self, k: int, rows: RunRows) -> None:
        """Keep a chunk. WriteError: the disk is full."""
        with on_disk(self.path):
            self._log.put(k, _packed(rows))
        if len(self._fresh) < FRESH:
            self._fresh[k] = rows

    def get(self, k: int) -> RunRows:
        """A chunk that is there."""
        return self._fresh[k] if k in self._fresh else _unpacked(self._log.get(k))

    def forget(self, k: int) -> None:
        """A chunk has been taken; it stays on the disk."""
        self._fresh.pop(k, None)


class Chain:
    """Texts of which each says how to go on from there.

    Attributes:
        texts: those that are there.
    """

    def __init__(self, path: Path, log: Family) -> None:
        self.path, self._log = path, log
        self.texts = [log.get(number).decode() for number in log.numbers]

    def put(self, text: str) -> None:
        """Keep the next one. WriteError: the disk is full."""
        with on_disk(self.path):
            self._log.put(len(self.texts), text.encode())
        self.texts.append(text)


def stored_runs(path: str | os.PathLike[str]) -> list[RunRows]:
    """The rows of all runs in a store, one for each of its families of runs, in the order of their making.

    Raises:
        StickslipError: there is no store.
    """
    return Store._existing(Path(path)).runs()


def _packed(rows: RunRows) -> bytes:
    """Rows as bytes: the length of a head, the head (JSON: type and shape of each array, the messages), the arrays."""
    arrays = [np.ascontiguousarray(array) for array in rows.arrays().values()]
    head = json.dumps([[(array.dtype.str, array.shape) for array in arrays], rows.messages]).encode()
    parts = [len(head).to_bytes(8, "little"), head, *(array.tobytes() for array in arrays)]
    return _compressor().encode(b"".join(parts))


def _unpacked(content: bytes) -> RunRows:
    """The rows that ``_packed`` wrote."""
    data = memoryview(_compressor().decode(content))
    at = 8 + int.from_bytes(data[:8], "little")
    kinds, messages = json.loads(bytes(data[8:at]))
    arrays = []
    for dtype, shape in kinds:
        array = np.empty(shape, dtype)
        array.reshape(-1).view(np.uint8)[:] = data[at : at + array.nbytes]
        arrays.append(array)
        at += array.nbytes
    return RunRows(*arrays, messages={int(i): text for i, text in messages.items()})


def _is_empty(path: Path) -> bool:
    """Whether a folder holds nothing, or what a process left that was killed as it made it."""
    return path.is_dir() and all(file.suffix == ".partial" for file in path.iterdir())


def told(provenance: Mapping[str, Any]) -> str:
    """Where something comes from, as text for an attribute."""
    return json.dumps(provenance, sort_keys=True)


def _differences(stored: object, present: object, name: str = "") -> Iterator[str]:
    """Differences between two trees of JSON, a sentence each."""
    if isinstance(stored, Mapping) and isinstance(present, Mapping):
        for key in dict.fromkeys([*stored, *present]):
            yield from _differences(stored.get(key), present.get(key), f"{name}.{key}" if name else str(key))
    elif json.dumps(stored) != json.dumps(present):
        yield f"{name} = {_short(stored)} there, {_short(present)} here"


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:36]} ..."


def _compressor() -> Zstd:
    from numcodecs import Zstd  # with zarr, which is not loaded without a store

    return Zstd(level=LEVEL)


def _zarr() -> ModuleType:
    try:
        import xarray  # noqa: F401
        import zarr
    except ImportError as error:
        raise StickslipError("A store needs zarr and xarray. Install them: pip install 'stickslip[store]'") from error
    return zarr
