"""A family of motions on the disk: a Zarr store (version 3) that xarray reads.

    run.zarr           what was found, once it is; attributes: where it comes from, and whether it is finished
      runs/0           the rows of the first family of runs, one Zarr chunk per chunk of jobs
        done           which chunks there are
      runs/1 ...       of the next one
      links/0 ...      texts of what is found one after the other, one Zarr chunk each

Every file is written under another name and renamed, and a chunk counts once all its files are there: a process that
is killed, or a disk that is full, loses what was being made and no more. Nothing in a store depends on who made which
chunk, nor when: it is the same to the last byte.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import FULL, OVERWRITE, disk_error, is_there
from fmu_models.families.jobs import Chunk, Jobs
from fmu_models.simulation.rows import RunRows

PROVENANCE, FINISHED = "provenance", "finished"
# of the rows of a run
DIMENSIONS = {
    "points": ("row", "number"),
    "times": ("row",),
    "held": ("row", "contact"),
    "began": ("row", "contact"),
    "growth": ("row", "tangent"),
    "derivatives": ("row", "number", "by"),
}


class Store:
    """A folder with the runs of one analysis, and what it has found.

    Attributes:
        path: the folder.
        finished: whether all is there.
    """

    def __init__(self, path: Path, root: Any) -> None:
        self.path, self._root, self._stages = path, root, 0

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
            differences = list(_differences(json.loads(existing._root.attrs[PROVENANCE]), provenance))
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
        with _disk(path):
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
        if not provenance:
            raise StickslipError(f"'{path}' exists already and is no store of runs. Choose another name.")
        return cls(path, root)

    def stage(self, jobs: Jobs, chunks: Sequence[Chunk]) -> Stage:
        """Where the next family of runs is kept."""
        name = f"runs/{self._stages}"
        self._stages += 1
        with _disk(self.path):
            return Stage(self.path, self._root, name, jobs, chunks)

    def chain(self) -> Chain:
        """Where the next way is kept whose points are found one after the other."""
        name = f"links/{self._stages}"
        self._stages += 1
        with _disk(self.path):
            return Chain(self.path, self._root, name)

    def finish(self, result: Any) -> None:
        """Keep what was found, a data set, in the root."""
        if self.finished:
            return
        with _disk(self.path):
            result.assign_attrs({PROVENANCE: self._root.attrs[PROVENANCE]}).to_zarr(
                self.path, mode="a", zarr_format=3, consolidated=False
            )
            # opened anew: the group does not see what others have written in its attributes
            Store._existing(self.path)._root.attrs[FINISHED] = True


class Stage:
    """One family of runs in a store.

    Attributes:
        count: how many chunks are there.
    """

    def __init__(self, path: Path, root: Any, name: str, jobs: Jobs, chunks: Sequence[Chunk]) -> None:
        self.path, self._root, self._name, self._chunks = path, root, name, chunks
        self._jobs, self._hash = jobs, jobs.digest()
        self._group: Any = root[name] if f"{name}/done" in root else None
        self._done = np.zeros(len(chunks), bool)
        if self._group is not None:
            if self._group.attrs["jobs"] != self._hash:
                raise StickslipError(
                    f"'{path}' goes on otherwise than here: the runs in {name} are others. It was made by a computer "
                    f"whose arithmetic differs in the last digit. {OVERWRITE}"
                )
            self._done = self._group["done"][:]

    @property
    def count(self) -> int:
        """See the class."""
        return int(self._done.sum())

    def has(self, k: int) -> bool:
        """Whether a chunk is there."""
        return bool(self._done[k])

    def has_room(self) -> bool:
        """There always is, on the disk."""
        return True

    def put(self, k: int, rows: RunRows) -> None:
        """Keep a chunk.

        Raises:
            WriteError: the disk is full.
        """
        where = self._where(k)
        with _disk(self.path):
            group = self._created(rows)
            for name, array in rows.arrays().items():
                if array[:1].size:
                    group[name][where] = array
            if rows.messages:
                group["messages"][where] = np.array([rows.messages.get(i, "") for i in range(len(rows.filled))], object)
            self._done[k] = True
            group["done"][:] = self._done

    def get(self, k: int) -> RunRows:
        """A chunk that is there."""
        where, group = self._where(k), self._group
        arrays: dict[str, NDArray[Any]] = {
            n: group[n][where] for n in group.array_keys() if n not in ("done", "messages")
        }
        texts = group["messages"][where]
        rows, width = arrays["points"].shape[1:]
        empty = RunRows.empty(len(texts), rows, width, 0)
        return replace(empty, **arrays, messages={int(i): str(texts[i]) for i in np.flatnonzero(texts != "")})

    def forget(self, k: int) -> None:
        """A chunk that was taken stays."""

    def _where(self, k: int) -> tuple[Any, ...]:
        """Place of a chunk in an array: of runs, or of runs in their chain."""
        chunk, chain = self._chunks[k], self._jobs.chain
        if chain == 1:
            return (slice(chunk.begin, chunk.end),)
        first = chunk.begin // chain * chain
        return (first // chain, slice(chunk.begin - first, chunk.end - first))

    def _created(self, rows: RunRows) -> Any:
        """The group with its arrays, of the shapes of these rows; the mask is the last, and says that all are there."""
        if self._group is not None:
            return self._group
        chain, size = self._jobs.chain, self._chunks[0].end
        runs = (len(self._jobs),) if chain == 1 else (len(self._jobs) // chain, chain)
        lead = ("run",) if chain == 1 else ("chain", "run")
        group = self._root.create_group(self._name, overwrite=True, attributes={"jobs": self._hash})
        for name, array in {**rows.arrays(), "messages": np.empty(0, object)}.items():
            inner = array.shape[1:]
            if name != "messages" and not array[:1].size:
                continue
            group.create_array(
                name,
                shape=(*runs, *inner),
                chunks=(*(1,) * (len(runs) - 1), size, *inner),
                dtype="string" if name == "messages" else array.dtype,
                chunk_key_encoding={"name": "default", "separator": "."},
                dimension_names=(*lead, *DIMENSIONS.get(name, ())),
            )
        group.create_array("done", shape=self._done.shape, dtype=bool, dimension_names=("chunk",))
        self._group = group
        return group


class Chain:
    """Texts of which each says how to go on from there.

    Attributes:
        texts: those that are there.
    """

    def __init__(self, path: Path, root: Any, name: str) -> None:
        self.path = path
        exists = name in root
        self._array: Any = (
            root[name]
            if exists
            else root.create_array(name, shape=(0,), chunks=(1,), dtype="string", dimension_names=("link",))
        )
        # the last may lack its text: its process was killed between the two
        self.texts = [text for text in self._array[:].tolist() if text]

    def put(self, text: str) -> None:
        """Keep the next one.

        Raises:
            WriteError: the disk is full.
        """
        with _disk(self.path):
            if len(self.texts) == self._array.shape[0]:
                self._array.resize((len(self.texts) + 1,))
            self._array[len(self.texts)] = text
        self.texts.append(text)


def _is_empty(path: Path) -> bool:
    """Whether a folder holds nothing, or what a process left that was killed as it made it."""
    return path.is_dir() and all(file.suffix == ".partial" for file in path.iterdir())


def told(provenance: Mapping[str, Any]) -> str:
    """Where something comes from, as text for an attribute."""
    return json.dumps(provenance, sort_keys=True)


def _differences(stored: Any, present: Any, name: str = "") -> Iterator[str]:
    """Differences between two trees of JSON, a sentence each."""
    if isinstance(stored, Mapping) and isinstance(present, Mapping):
        for key in dict.fromkeys([*stored, *present]):
            yield from _differences(stored.get(key), present.get(key), f"{name}.{key}" if name else str(key))
    elif json.dumps(stored) != json.dumps(present):
        yield f"{name} = {_short(stored)} there, {_short(present)} here"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:36]} ..."


@contextmanager
def _disk(path: Path) -> Iterator[None]:
    """Say what a disk says that takes no more."""
    try:
        yield
    except OSError as error:
        if error.errno in FULL:
            raise disk_error(error, path) from error
        raise StickslipError(
            f"'{path}' cannot be written: {error.strerror}. Choose a folder you may write to."
        ) from error


def _zarr() -> Any:
    try:
        import xarray  # noqa: F401
        import zarr
    except ImportError as error:
        raise StickslipError("A store needs zarr and xarray. Install them: pip install 'stickslip[store]'") from error
    return zarr
