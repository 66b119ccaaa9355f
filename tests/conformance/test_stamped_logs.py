"""Files whose clock is dates, times of day or a rate: the same seconds come out of every format that keeps them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from rig_io.readers import read_table

ROWS = 40
TIME = 0.001 * np.arange(ROWS)
LASER = 5 + np.sin(300 * TIME)
# 10 ms before midnight
MOMENTS = [datetime(2025, 11, 3, 23, 59, 59, 990_000) + timedelta(milliseconds=i) for i in range(ROWS)]
SECONDS = 86399.99 + TIME


def test_a_waveform_counts_from_the_midnight_before_it_began(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed")
    even = {"wf_increment": 0.001, "wf_start_offset": 0.25, "unit_string": "V"}
    for name, properties, begin, first in (
        ("bare", even, None, 0.25),
        ("stamped", even | {"wf_start_time": np.datetime64(MOMENTS[0])}, datetime(2025, 11, 3, tzinfo=UTC), 86400.24),
    ):
        with nptdms.TdmsWriter(tmp_path / f"{name}.tdms") as writer:
            writer.write_segment([nptdms.ChannelObject("Run", "laser", LASER, properties)])
        table = read_table(tmp_path / f"{name}.tdms")
        np.testing.assert_allclose(table.columns["time"], first + TIME, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(table.columns["laser"], LASER)
        assert table.begin == begin and table.stamps == (() if begin is None else ("time",))
        assert dict(table.units) == {"time": "s", "laser": "V"}


def test_a_channel_of_another_rate_is_left_out_with_the_reason(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed")
    channels = {"time": TIME, "laser": LASER, "room": np.full(4, 21.5)}
    with nptdms.TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("Run", name, values) for name, values in channels.items()])
    table = read_table(tmp_path / "log.tdms")
    assert list(table.columns) == ["time", "laser"]
    assert dict(table.left_out) == {"room": f"of another rate: 4 values, not {ROWS}"}


@pytest.mark.parametrize("zone", [None, "UTC"])
def test_stamps_of_a_parquet_file_count_from_their_midnight(tmp_path: Path, zone: str | None) -> None:
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    files = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    stamps = pyarrow.array(MOMENTS, pyarrow.timestamp("us", tz=zone))
    files.write_table(pyarrow.table({"stamp": stamps, "laser": LASER}), tmp_path / "log.parquet")
    table = read_table(tmp_path / "log.parquet")
    np.testing.assert_allclose(table.columns["stamp"], SECONDS, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(table.columns["laser"], LASER)
    assert table.begin == datetime(2025, 11, 3, tzinfo=None if zone is None else UTC) and table.stamps == ("stamp",)


@pytest.mark.parametrize("kind", ["dates and times", "times of day"])
def test_stamps_of_a_spreadsheet_become_seconds(tmp_path: Path, kind: str) -> None:
    openpyxl = pytest.importorskip("openpyxl", reason="openpyxl is not installed")
    begin = datetime(2025, 11, 3, 13, 47, 29, 250_000)
    moments = [begin + timedelta(milliseconds=i) for i in range(12)]
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["stamp", "laser [V]"])
    for moment, value in zip(moments, LASER, strict=False):
        sheet.append([moment if kind == "dates and times" else moment.time(), float(value)])
    book.save(tmp_path / "log.xlsx")
    table = read_table(tmp_path / "log.xlsx")
    # a spreadsheet keeps days, to a few microseconds
    expected = 13 * 3600 + 47 * 60 + 29.25 + TIME[:12]
    np.testing.assert_allclose(table.columns["stamp"], expected, rtol=0, atol=1e-5)
    assert table.units["stamp"] == "s" and table.stamps == ("stamp",)
    assert table.begin == (datetime(2025, 11, 3) if kind == "dates and times" else None)
