"""Text files of numbers in the shapes that recorders write: the layout is found, and the numbers are the right ones."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError, StickslipWarning
from rig_io.logs.table import Table
from rig_io.readers import read_table

TIME = 0.001 * np.arange(40)
LASER = np.round(5 + np.sin(300 * TIME), 4)


def read(folder: Path, text: str, name: str = "log.csv", **options: str) -> Table:
    path = folder / name
    path.write_bytes(text.encode())
    return read_table(path, options=options)


def rows(separator: str = ",", comma: bool = False, end: str = "") -> str:
    lines = [f"{t:.4f}{separator}{v:.4f}{end}" for t, v in zip(TIME, LASER, strict=True)]
    made = "\n".join(lines) + "\n"
    return made.replace(".", ",") if comma else made


SHAPES = {
    "point and comma": "time,laser\n" + rows(),
    "decimal comma, semicolon": "time;laser\n" + rows(";", True),
    "decimal comma, tab": "time\tlaser\n" + rows("\t", True),
    "bars": "time|laser\n" + rows("|"),
    "blanks": "time laser\n" + rows("   "),
    "blanks before": "time laser\n" + rows(" ").replace("\n", "\n  "),
    "trailing separators": "time;laser;\n" + rows(";", True, ";"),
    "trailing separators without one in the header": "time;laser\n" + rows(";", True, ";"),
    "lines above": "Recorder X;;\nRate: 1000 Hz;;\n;;\ntime;laser\n" + rows(";", True),
    "a table of settings above": "Gain;3\nRange;10\n\ntime;laser\n" + rows(";", True),
    "units in round brackets": "time (s),laser (V)\n" + rows(),
    "a row of units": "time,laser\n[s],[V]\n" + rows(),
    "Windows": "time,laser\r\n" + rows().replace("\n", "\r\n"),
    "old Mac": "time,laser\r" + rows().replace("\n", "\r"),
    "no line end": "time,laser\n" + rows()[:-1],
    "quoted decimal commas between commas": "time,laser\n"
    + "".join(f'"{t:.4f}","{v:.4f}"\n'.replace(".", ",") for t, v in zip(TIME, LASER, strict=True))
    .replace('","', '" "')
    .replace('" "', '","'),
}


@pytest.mark.parametrize("text", SHAPES.values(), ids=SHAPES)
def test_shapes_of_text_are_told_apart(tmp_path: Path, text: str) -> None:
    table = read(tmp_path, text)
    assert list(table.columns) == ["time", "laser"]
    np.testing.assert_array_equal(table.columns["time"], np.round(TIME, 4))
    np.testing.assert_array_equal(table.columns["laser"], LASER)
    if "unit" in text or "[s]" in text or "(s)" in text:
        assert dict(table.units) == {"time": "s", "laser": "V"}


@pytest.mark.parametrize("name", ["log.t", "log.dat", "log.txt"])
def test_columns_without_names_are_numbered(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, rows(" "), name)
    assert list(table.columns) == ["column 1", "column 2"] and table.nameless
    np.testing.assert_array_equal(table.columns["column 2"], LASER)


def test_one_signal_with_a_decimal_comma_is_one_column(tmp_path: Path) -> None:
    table = read(tmp_path, "\n".join(f"{v:.4f}".replace(".", ",") for v in LASER))
    np.testing.assert_array_equal(table.columns["column 1"], LASER)


def test_whole_numbers_with_a_gap_are_two_columns(tmp_path: Path) -> None:
    """Not one number with a decimal comma, of which '7,nan' would be none."""
    table = read(tmp_path, "".join(f"{i},{'nan' if i == 7 else 100 + i}\n" for i in range(40)))
    expected = np.array([np.nan if i == 7 else 100 + i for i in range(40)])
    np.testing.assert_array_equal(table.columns["column 2"], expected)


def test_doubled_nameless_and_wordy_columns(tmp_path: Path) -> None:
    lines = [f"{i},{t:.4f},{v:.4f},{-v:.4f},ok" for i, (t, v) in enumerate(zip(TIME, LASER, strict=True))]
    table = read(tmp_path, ",time,laser,laser,status\n" + "\n".join(lines) + "\n")
    assert list(table.columns) == ["column 1", "time", "laser", "laser (2)"]
    assert table.doubled == ("laser",) and table.left_out == {"status": "a column of words"}
    np.testing.assert_array_equal(table.columns["laser (2)"], -LASER)


def stamped(cells: list[str], column: str = "stamp") -> str:
    return f"{column};laser\n" + "".join(f"{c};{v:.4f}\n" for c, v in zip(cells, LASER, strict=True))


BEGIN = 86399.99


def moments() -> list[datetime]:
    """40 ms around midnight."""
    return [datetime(2025, 11, 3, 23, 59, 59, 990_000) + timedelta(milliseconds=i) for i in range(40)]


STAMPS = {
    "ISO": lambda m: m.isoformat(sep=" ", timespec="microseconds"),
    "ISO with a T": lambda m: m.isoformat(timespec="microseconds"),
    "German": lambda m: m.strftime("%d.%m.%Y %H:%M:%S,%f"),
    "American": lambda m: m.strftime("%m/%d/%Y %I:%M:%S.%f %p"),
    "slashes, year first": lambda m: m.strftime("%Y/%m/%d %H:%M:%S.%f"),
}


@pytest.mark.parametrize("form", STAMPS.values(), ids=STAMPS)
def test_stamps_become_seconds(tmp_path: Path, form) -> None:
    table = read(tmp_path, stamped([form(m) for m in moments()]))
    np.testing.assert_allclose(table.columns["stamp"], BEGIN + TIME, rtol=0, atol=1e-9)
    assert table.begin == datetime(2025, 11, 3) and table.units["stamp"] == "s"


def test_a_time_of_day_goes_on_after_midnight(tmp_path: Path) -> None:
    table = read(tmp_path, stamped([m.strftime("%H:%M:%S.%f") for m in moments()]))
    np.testing.assert_allclose(table.columns["stamp"], BEGIN + TIME, rtol=0, atol=1e-9)
    assert table.begin is None


def test_date_and_time_of_day_in_two_columns_are_joined(tmp_path: Path) -> None:
    lines = [f"{m:%d.%m.%Y};{m:%H:%M:%S,%f};{v:.4f}" for m, v in zip(moments(), LASER, strict=True)]
    table = read(tmp_path, "Datum;Uhrzeit;laser\n" + "\n".join(lines) + "\n")
    np.testing.assert_allclose(table.columns["Datum Uhrzeit"], BEGIN + TIME, rtol=0, atol=1e-9)
    assert table.begin == datetime(2025, 11, 3)


def test_a_change_of_summer_time_is_no_leap(tmp_path: Path) -> None:
    before = [f"2025-10-26T02:59:59.{i:03d}+02:00" for i in range(980, 1000)]
    after = [f"2025-10-26T02:00:00.{i:03d}+01:00" for i in range(20)]
    table = read(tmp_path, stamped(before + after))
    np.testing.assert_allclose(np.diff(table.columns["stamp"]), 0.001, atol=1e-9)
    assert table.begin == datetime(2025, 10, 26, tzinfo=UTC)


def test_stamps_with_and_without_a_zone_are_refused(tmp_path: Path) -> None:
    cells = [f"2025-10-26T02:00:00.{i:03d}{'Z' if i < 30 else ''}" for i in range(40)]
    with pytest.raises(StickslipError, match=r"column 'stamp'.*without a time zone.*one zone"):
        read(tmp_path, stamped(cells))


def test_the_order_of_day_and_month_can_be_said(tmp_path: Path) -> None:
    cells = [f"03/04/2025 10:00:00.{i:03d}" for i in range(40)]
    assert read(tmp_path, stamped(cells)).begin == datetime(2025, 3, 4)
    assert read(tmp_path, stamped(cells), dates="day").begin == datetime(2025, 4, 3)


def test_a_cell_of_the_other_decimal_mark_names_the_flag(tmp_path: Path) -> None:
    text = "time;laser\n" + rows(";") + "0.0400;5,1\n"
    with pytest.raises(StickslipError, match=r"line 42, column 'laser' holds '5,1'.*--read decimal=comma"):
        read(tmp_path, text)


def test_what_the_file_does_not_tell_can_be_said(tmp_path: Path) -> None:
    text = "names on this line are none\ntime;laser\nfirst;second\n" + rows(";", True)
    table = read(tmp_path, text, header="2", separator="semicolon", decimal="comma")
    assert list(table.columns) == ["time", "laser"]
    with pytest.raises(StickslipError, match=r"separator 'semikolon' is unknown.*'semicolon'"):
        read(tmp_path, text, separator="semikolon")
    with pytest.raises(StickslipError, match="header is said to be on line 90"):
        read(tmp_path, text, header="90")
    with pytest.raises(StickslipError, match="no encoding 'latin-99'"):
        read(tmp_path, text, encoding="latin-99")


def test_large_files_are_read_block_by_block(tmp_path: Path, monkeypatch) -> None:
    from rig_io.readers import csv_log

    whole = read(tmp_path, "time,laser\n" + rows())
    for size in (7, 64, 300):
        monkeypatch.setattr(csv_log, "BLOCK", size)
        table = read(tmp_path, "time,laser\n" + rows() + "\n\n")
        np.testing.assert_array_equal(table.columns["laser"], whole.columns["laser"])
        with pytest.raises(StickslipError, match="line 30 has 1 cells"):
            read(tmp_path, ("time,laser\n" + rows()).replace(f"{TIME[28]:.4f},", f"{TIME[28]:.4f} "))
        with pytest.warns(StickslipWarning, match="line 42 is cut off"):
            read(tmp_path, "time,laser\n" + rows() + "0.04")


def test_what_stands_in_round_brackets_and_is_no_unit_belongs_to_the_name(tmp_path: Path) -> None:
    table = read(tmp_path, "time [s],laser (left side)\n" + "".join(f"{i / 10},{i}\n" for i in range(20)))
    assert list(table.columns) == ["time", "laser (left side)"]
