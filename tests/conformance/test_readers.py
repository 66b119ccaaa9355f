"""Every reader in rig_io/readers keeps the contract by which logs find it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fmu_models.base.errors import StickslipError
from rig_io.readers import READERS


def test_no_two_readers_claim_one_suffix() -> None:
    suffixes = [s for name in READERS.members() for s in READERS.load(name).suffixes]
    assert len(set(suffixes)) == len(suffixes)
    assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in suffixes)


@pytest.mark.parametrize("name", READERS.members())
def test_a_reader_names_a_file_that_is_missing_empty_or_no_log(name: str, tmp_path: Path) -> None:
    reader = READERS.load(name)
    path = tmp_path / f"log{reader.suffixes[0]}"
    with pytest.raises(StickslipError, match="There is no log"):
        reader.read(path)
    for content in (b"", bytes(range(256))):
        path.write_bytes(content)
        with pytest.raises(StickslipError, match=path.name):
            reader.read(path)
