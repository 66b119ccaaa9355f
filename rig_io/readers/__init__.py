"""Kinds of log files, one file each, with the reader as ``READER``; a new one is found by itself."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing
from fmu_models.base.registry import Reference, Registry
from rig_io.logs import packed
from rig_io.logs.table import Reader, Table

READERS: Registry[Reader] = Registry(
    kind="reader", package=__name__, attribute="READER", group="stickslip.readers", types=("rig_io.logs.table.Reader",)
)


def check_kind(path: Path, reader: Reference | None = None) -> None:
    """Refuse a file that nobody reads; ``reader`` as for `read_table`. StickslipError: no reader knows its suffix."""
    if _reader_of(path, reader) is None and path.suffix.lower() not in packed.SUFFIXES:
        raise _unknown(path, reader)


def read_table(
    path: str | os.PathLike[str], reader: Reference | None = None, options: Mapping[str, str] = MappingProxyType({})
) -> Table:
    """Every column of a log file of any kind, under the names it has there, in the units it has there.

    No column is required, and none is checked: `packages.datapackage.read_log` does, for the disc rig.

    Args:
        reader: the user's own, as ``my_reader.py``; it goes before ours.
        options: how the file is written, by the names that its reader knows; the file tells what is left out.

    Raises:
        StickslipError: the file cannot be read as a table of numbers; says what was found and what to do.
    """
    path = Path(path)
    match = _reader_of(path, reader)
    if match is None and path.suffix.lower() in packed.SUFFIXES:
        existing(path, "log")
        settings = {name: value for name, value in options.items() if name != packed.MEMBER}
        with packed.unpacked(path, options.get(packed.MEMBER)) as inner:
            if inner.suffix.lower() in packed.SUFFIXES:
                raise StickslipError(f"'{inner}' is an archive in an archive. Unpack it.")
            return replace(read_table(inner, reader, settings), source=f"'{path}'")
    if match is None:
        raise _unknown(path, reader)
    name, chosen = match
    for option in options:
        if option not in chosen.options:
            choices = ", ".join(f"{key} ({meaning})" for key, meaning in chosen.options.items()) or "none"
            raise StickslipError(f"'{path}': its kind of file has no option '{option}'. Known are: {choices}.")
    with READERS.running(name):
        table = chosen.read(path, **options)
    return table if name in READERS.members() else _checked(table, os.fspath(name))


def _reader_of(path: Path, preferred: Reference | None) -> tuple[Reference, Reader] | None:
    """What reads this kind of file, by its suffix: the user's own, one of ours, or an installed one."""
    for name, reader in _readers(preferred):
        if path.suffix.lower() in reader.suffixes:
            return name, reader
    return None


def _readers(preferred: Reference | None) -> Iterator[tuple[Reference, Reader]]:
    for name in dict.fromkeys((*((preferred,) if preferred else ()), *READERS.members(), *READERS.names())):
        yield name, READERS.load(name)


def _unknown(path: Path, preferred: Reference | None) -> StickslipError:
    if path.is_dir():
        return StickslipError(f"'{path}' is a folder, where one log is wanted. Name the file.")
    suffixes = sorted({suffix for _, reader in _readers(preferred) for suffix in reader.suffixes} | {*packed.SUFFIXES})
    return StickslipError(f"'{path}' is of no known kind of log. Known are: {', '.join(suffixes)}.")


def _checked(table: object, name: str) -> Table:
    """What a reader that is not ours has read."""
    if not isinstance(table, Table):
        raise StickslipError(f"The reader '{name}' must return a Table, found one of class {type(table).__name__}.")
    columns = {}
    for column, values in table.columns.items():
        try:
            columns[column] = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise StickslipError(f"Reader '{name}': column '{column}' is not of numbers: {error}.") from error
    shapes = {column: values.shape for column, values in columns.items()}
    if len(set(shapes.values())) != 1 or any(len(shape) != 1 for shape in shapes.values()):
        raise StickslipError(
            f"Reader '{name}': all columns have one shape (n_samples,), found "
            f"{', '.join(f'{column} {shape}' for column, shape in shapes.items()) or 'no column'}."
        )
    return replace(table, columns=columns)
