"""Packed logs: one file in a gzip or zip archive, unpacked beside nothing that is the user's."""

import gzip
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from fmu_models.base.errors import StickslipError, refuse_unknown

SUFFIXES = (".gz", ".zip")
LARGEST = 4 << 30  # bytes that a log may have unpacked
MEMBER = "member"  # option that names one of several files in an archive
_PIECE = 1 << 20


@contextmanager
def unpacked(path: Path, member: str | None = None) -> Iterator[Path]:
    """A packed log as a file of its own name, which is removed afterwards; errors name the archive in its place.
    StickslipError: the archive is damaged, encrypted, holds none or several files, or unpacks to more than
    `LARGEST`."""
    with tempfile.TemporaryDirectory(prefix="stickslip-") as room:
        try:
            inner = _gzip(path, Path(room)) if path.suffix.lower() == ".gz" else _zip(path, Path(room), member)
        except (OSError, EOFError, zlib.error, zipfile.BadZipFile, RuntimeError, NotImplementedError, ValueError) as e:
            raise StickslipError(f"'{path}' cannot be unpacked: {e}. Copy it again from its source.") from e
        try:
            yield inner
        except StickslipError as error:
            raise type(error)(str(error).replace(str(inner), str(path))) from error


def _gzip(path: Path, room: Path) -> Path:
    target = room / path.with_suffix("").name
    with gzip.open(path, "rb") as packed:
        _copy(path, packed, target)  # type: ignore[arg-type]
    return target


def _zip(path: Path, room: Path, member: str | None) -> Path:
    with zipfile.ZipFile(path) as archive:
        files = {entry.filename: entry for entry in archive.infolist() if not entry.is_dir()}
        if member is None and len(files) != 1:
            raise StickslipError(
                f"'{path}' holds {len(files)} files: {', '.join(list(files)[:8])}. Say which one: stickslip describe "
                f"FILE --read {MEMBER}=NAME, or unpack it."
            )
        name = member or next(iter(files))
        refuse_unknown(name, files, f"'{path}' holds no file '{name}'.")
        target = room / Path(name).name
        with archive.open(files[name]) as packed:
            _copy(path, packed, target)
    return target


def _copy(path: Path, packed: IO[bytes], target: Path) -> None:
    size = 0
    with open(target, "wb") as file:
        while piece := packed.read(_PIECE):
            size += len(piece)
            if size > min(LARGEST, shutil.disk_usage(target.parent).free):
                raise StickslipError(f"'{path}' unpacks to more than there is room for. Unpack it elsewhere.")
            file.write(piece)
