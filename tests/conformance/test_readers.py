"""Every reader in rig_io/readers keeps the contract by which logs find it."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

import pytest

import rig_io.readers
from fmu_models.base.errors import StickslipError

READERS = [module.name for module in pkgutil.iter_modules(rig_io.readers.__path__)]


def test_no_two_readers_claim_one_suffix() -> None:
    suffixes = [s for name in READERS for s in importlib.import_module(f"rig_io.readers.{name}").SUFFIXES]
    assert len(set(suffixes)) == len(suffixes)
    assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in suffixes)


@pytest.mark.parametrize("name", READERS)
def test_a_reader_names_a_file_that_is_missing_empty_or_no_log(name: str, tmp_path: Path) -> None:
    reader = importlib.import_module(f"rig_io.readers.{name}")
    assert reader.__doc__
    path = tmp_path / f"log{reader.SUFFIXES[0]}"
    with pytest.raises(StickslipError, match="There is no log"):
        reader.read(path)
    for content in (b"", bytes(range(256))):
        path.write_bytes(content)
        with pytest.raises(StickslipError, match=path.name):
            reader.read(path)
