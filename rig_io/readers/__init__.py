"""Kinds of log files, one file each, with the reader as ``READER``; a new one is found by itself."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.registry import Reference, Registry
from rig_io.logs.table import Reader, Table

READERS: Registry[Reader] = Registry(
    kind="reader",
    package=__name__,
    attribute="READER",
    group="stickslip.readers",
    types=("rig_io.logs.table.Reader",),
)


def check_kind(path: Path, reader: Reference | None = None) -> None:
    """Refuse a file that nobody reads; ``reader`` as for `read_table`.

    Raises:
        StickslipError: no reader knows its suffix.
    """
    _reader_of(path, reader)


def read_table(path: str | os.PathLike[str], reader: Reference | None = None) -> Table:
    """Every column of a log file of any kind, under the names it has there, in the units it has there.

    No column is required, and none is checked: `packages.datapackage.read_log` does, for the disc rig.

    Args:
        reader: the user's own, as ``my_reader.py``; it goes before ours.

    Raises:
        StickslipError: the file cannot be read as a table of numbers; says what was found and what to do.
    """
    name, chosen = _reader_of(Path(path), reader)
    with READERS.running(name):
        found = chosen.read(Path(path))
    return found if name in READERS.members() else _checked(found, os.fspath(name))


def _reader_of(path: Path, own: Reference | None) -> tuple[Reference, Reader]:
    """What reads this kind of file, by its suffix: the user's own, one of ours, or an installed one."""
    known: list[str] = []
    for name in dict.fromkeys((*((own,) if own else ()), *READERS.members(), *READERS.names())):
        reader = READERS.load(name)
        if path.suffix.lower() in reader.suffixes:
            return name, reader
        known += reader.suffixes
    raise StickslipError(f"'{path}' is of no known kind of log. Known are: {', '.join(sorted(set(known)))}.")


def _checked(found: object, name: str) -> Table:
    """What a reader that is not ours has read.

    Raises:
        StickslipError: no table, or columns that are no numbers, one for each sample.
    """
    if not isinstance(found, Table):
        raise StickslipError(f"The reader '{name}' must return a Table, found one of class {type(found).__name__}.")
    columns = {}
    for column, values in found.columns.items():
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
    return Table(found.source, columns, found.units, found.first_line, found.scalars, found.left_out, found.rows)
