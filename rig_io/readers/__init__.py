"""Kinds of log files, one file each: ``SUFFIXES`` and ``read(path) -> Table``; a new one is found by itself."""

from __future__ import annotations

import importlib
import os
import pkgutil
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from rig_io.logs.table import Table


def reader_of(path: Path) -> Any:
    """The module that reads this kind of file, by its suffix.

    Raises:
        StickslipError: no reader knows the suffix.
    """
    known: dict[str, Any] = {}
    for module in pkgutil.iter_modules(__path__):
        reader = importlib.import_module(f"{__name__}.{module.name}")
        known.update(dict.fromkeys(reader.SUFFIXES, reader))
    if path.suffix.lower() not in known:
        raise StickslipError(f"'{path}' is of no known kind of log. Known are: {', '.join(sorted(known))}.")
    return known[path.suffix.lower()]


def read_table(path: str | os.PathLike[str]) -> Table:
    """Every column of a log file of any kind, under the names it has there, in the units it has there.

    No column is required, and none is checked: `packages.datapackage.read_log` does, for the disc rig.

    Raises:
        StickslipError: the file cannot be read as a table of numbers; says what was found and what to do.
    """
    return reader_of(Path(path)).read(Path(path))
