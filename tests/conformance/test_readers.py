"""Every reader in rig_io/readers keeps the contract by which logs find it, and reads what other programs write."""

from __future__ import annotations

import importlib.util
import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from damaged_logs import fuzz
from log_formats import FORMATS, ROWS, UNITS, rig_log

from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError
from fmu_models.base.processes import in_processes
from rig_io.logs import guarded
from rig_io.readers import READERS, read_table

NEEDED = {".tdms": "nptdms", ".mf4": "asammdf", ".parquet": "pyarrow", ".xlsx": "openpyxl", ".ods": "odf"}
CASES = int(os.environ.get("STICKSLIP_FUZZ", "400"))  # damaged files for each format
JOB = 20  # of them at once
GUARDED = (".tdms", ".mf4", ".h5", ".mat", ".parquet", ".xlsx", ".ods")  # parsed in a process of their own
FEW = 60  # rows of the file that is damaged


def made(suffix: str, folder: Path, rows: int = ROWS) -> Path:
    """The rig log as a file of a format."""
    module = NEEDED.get(suffix)
    if module is not None and importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed")
    path = folder / f"log{suffix}"
    FORMATS[suffix][0](path, rig_log(rows))
    return path


def test_no_two_readers_claim_one_suffix() -> None:
    suffixes = [s for name in READERS.members() for s in READERS.load(name).suffixes]
    assert len(set(suffixes)) == len(suffixes)
    assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in suffixes)


def test_every_reader_is_tested() -> None:
    for name in READERS.members():
        assert set(READERS.load(name).suffixes) & set(FORMATS), f"{name}: put a writer of it into log_formats.py"


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


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_same_log_comes_out_of_every_format(suffix: str, tmp_path: Path) -> None:
    true = rig_log()
    table = read_table(made(suffix, tmp_path))
    columns = dict(zip(true, table.columns.values(), strict=True)) if table.nameless else table.columns
    assert set(columns) == set(true)
    for name, values in true.items():
        # stored as float64, or printed to the last bit
        np.testing.assert_array_almost_equal_nulp(columns[name], values, nulp=1)
        if FORMATS[suffix][1]:
            assert table.units[name] == UNITS[name]


@pytest.mark.nightly_for(".mf4")
@pytest.mark.parametrize("suffix", FORMATS)
def test_damaged_files_end_in_a_clear_word(suffix: str, tmp_path: Path) -> None:
    if suffix.endswith((".gz", ".zip")):
        pytest.skip("the archive of a format that is tested")
    path = made(suffix, tmp_path, FEW)
    name = next(n for n in READERS.members() if suffix in READERS.load(n).suffixes)
    data = path.read_bytes()
    found, failed = tried(name, suffix, data, [(first, JOB) for first in range(0, CASES, JOB)])
    # a job that took its process down is done again, case by case
    again, crashed = tried(
        name, suffix, data, [(case, 1) for first, count in failed for case in range(first, first + count)]
    )
    found += again
    stopped = found["stopped"] + len(crashed)
    assert sum(found.values()) + len(crashed) == CASES and found["refused"] > 0.05 * CASES
    # a parser that goes down in a process of its own is one refused log for the user; ours may not
    assert stopped <= (0.05 * CASES if suffix in GUARDED else 0), (found, crashed)


def tried(
    name: str, suffix: str, data: bytes, jobs: list[tuple[int, int]]
) -> tuple[Counter[str], list[tuple[int, int]]]:
    """What became of damaged files, and the jobs (first case, number of cases) that took their process down."""
    limits = Limits(30.0, 2048.0 if Limits.default().memory else None)
    found: Counter[str] = Counter()
    failed = []
    for place, outcome in in_processes(
        fuzz, [(name, suffix, data, first, count) for first, count in jobs], processes=1, limits=limits
    ):
        if isinstance(outcome, IsolatedFailure):
            failed.append(jobs[place])
            continue
        assert isinstance(outcome, dict), outcome
        found.update(outcome)
    return found, failed


@pytest.mark.parametrize("suffix", [".csv.gz", ".csv.zip"])
def test_damaged_archives_end_in_a_clear_word(suffix: str, tmp_path: Path) -> None:
    data = made(suffix, tmp_path).read_bytes()
    path = tmp_path / f"broken{suffix}"
    for spot in range(3, len(data), len(data) // 60):
        path.write_bytes(data[:spot] + bytes([data[spot] ^ 0xFF]) + data[spot + 1 : -1 - spot % 2])
        with pytest.raises(StickslipError, match="broken"):
            read_table(path)


@pytest.mark.parametrize("suffix", NEEDED)
def test_a_reader_that_is_missing_names_the_line_that_installs_it(suffix: str, tmp_path: Path, monkeypatch) -> None:
    path = made(suffix, tmp_path)
    monkeypatch.setattr(guarded.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(StickslipError, match=r"pip install 'stickslip\[daq\]'"):
        read_table(path)


def test_groups_and_sheets_are_chosen_by_name(tmp_path: Path) -> None:
    import h5py

    path = tmp_path / "two.h5"
    with h5py.File(path, "w") as file:
        for run in ("one", "two"):
            file[f"{run}/time"] = np.arange(20.0)
            file[f"{run}/laser"] = np.arange(20.0) * (1 if run == "one" else 2)
    with pytest.raises(StickslipError, match=r"groups /one, /two.*--read group="):
        read_table(path)
    assert read_table(path, options={"group": "two"}).columns["laser"][3] == 6
    with pytest.raises(StickslipError, match=r"no group 'tow'.*Did you mean 'two'"):
        read_table(path, options={"group": "tow"})
    with pytest.raises(StickslipError, match=r"no option 'sheet'\. Known are: .*group \("):
        read_table(path, options={"sheet": "two"})


def test_an_archive_of_several_files_asks_which(tmp_path: Path) -> None:
    import zipfile

    path = tmp_path / "runs.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for run in ("a.csv", "b.csv"):
            archive.writestr(run, "time,laser\n" + "\n".join(f"{i},{i * len(run)}" for i in range(20)))
    with pytest.raises(StickslipError, match=r"2 files: a\.csv, b\.csv.*--read member="):
        read_table(path)
    assert read_table(path, options={"member": "b.csv"}).columns["laser"][2] == 10
