"""Logs as real recorders leave them: what is mended and said, what is refused, with the repair that is named."""

from __future__ import annotations

import contextlib
import json
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError, StickslipWarning
from rig_io.logs.log import RigLog
from rig_io.packages.datapackage import read_log

ROWS = 3000
FIELDS = {"time": "s", "laser": "V", "encoder_count": "1", "encoder_edge_time": "s", "drive0_count": "1"}
CALIBRATION = {
    "laser": {"gain": 0.01, "zero": 5.0},
    "encoder": {"pulses_per_revolution": 1000},
    "drive0": {"pulses_per_revolution": 1000},
}


def recording(rate: float = 1000.0, start: float = 0.0, seed: int = 0) -> dict[str, np.ndarray]:
    """A disc that swings by 0.2 rad, and a drive at 0.9 rad/s: true columns."""
    time = start + np.arange(ROWS) / rate
    swing = 0.2 * np.sin(6 * (time - start))
    count = np.floor(swing / (2 * np.pi / 1000))
    edge = np.concatenate([[time[0]], np.where(np.diff(count) != 0, time[1:] - 0.3 / rate, -np.inf)])
    noise = np.random.default_rng(seed).normal(0, 2e-3, ROWS)
    return {
        "time": time,
        "laser": np.round(5 + 12.5 * np.sin(swing) + noise, 3),
        "encoder_count": count,
        "encoder_edge_time": np.maximum.accumulate(edge),
        "drive0_count": np.floor(0.9 * (time - start) / (2 * np.pi / 1000)),
    }


def as_text(columns: Mapping[str, np.ndarray], time: str = "%.9f") -> list[str]:
    """Lines of a CSV file, header first."""
    digits = {"time": time, "encoder_edge_time": "%.9f"}
    cells = [[digits.get(name, "%g") % value for value in values] for name, values in columns.items()]
    return [",".join(columns), *(",".join(row) for row in zip(*cells, strict=True))]


def read(folder: Path, lines: list[str], *, calibration: Mapping[str, object] = CALIBRATION, **options) -> RigLog:
    (folder / "x.csv").write_text("\n".join(lines) + "\n")
    fields = [{"name": name, "unit": unit} for name, unit in FIELDS.items()]
    resource = {"path": "x.csv", "schema": {"fields": fields}, "calibration": calibration}
    (folder / "datapackage.json").write_text(json.dumps({"resources": [resource]}))
    return read_log(folder / "x.csv", **options)


def same_columns(log: RigLog, true: Mapping[str, np.ndarray], but: tuple[str, ...] = ("time",)) -> None:
    for name, values in true.items():
        if name not in but:
            np.testing.assert_allclose(log.column(name), values, rtol=1e-12, atol=1e-9, err_msg=name)


def cells(lines: list[str], rows: list[int], column: str, texts: list[str]) -> list[str]:
    """Lines with other cells; rows from 0, below the header."""
    place = lines[0].split(",").index(column)
    changed = list(lines)
    for row, text in zip(rows, texts, strict=True):
        parts = changed[row + 1].split(",")
        parts[place] = text
        changed[row + 1] = ",".join(parts)
    return changed


WORDS = ["-nan(ind)", "1.#QNAN", "OVER", "nan", "", "inf", "-1.#IND00", "+OVER", "#N/A", "Overflow"]


@pytest.mark.parametrize("decimal", [".", ","])
def test_cells_without_a_number_become_nan_and_are_counted(decimal: str, tmp_path: Path) -> None:
    true = recording()
    rows = [100 + 7 * i for i in range(len(WORDS))]
    lines = cells(as_text(true), rows, "laser", WORDS)
    if decimal == ",":
        lines = [line.replace(",", ";").replace(".", ",") for line in lines]
    with pytest.warns(StickslipWarning, match=r"'laser' has 10 cells without a number \(0\.33 %\), .* line 102"):
        log = read(tmp_path, lines)
    assert np.flatnonzero(np.isnan(log.column("laser"))).tolist() == rows
    assert log.warnings and len(log.pieces()) == 1


def test_a_stamp_that_swallows_the_others_is_refused(tmp_path: Path) -> None:
    lines = as_text(recording())
    # a run of its own beyond all other times, after which the clock seems to be reset
    early = [",".join([f"{1e23 + 1e9 * i:.17g}", *line.split(",")[1:]]) for i, line in enumerate(lines[1:41])]
    with pytest.raises(StickslipError, match=r"time reaches 1e\+23 s on line 41, beside which the steps .* vanish"):
        read(tmp_path, [lines[0], *early, *lines[2:]])


def test_rows_without_a_time_are_left_out(tmp_path: Path) -> None:
    true = recording()
    with pytest.warns(StickslipWarning, match="2 rows without a time were left out, the first on line 52"):
        log = read(tmp_path, cells(as_text(true), [50, 900], "time", ["nan", "OVER"]))
    keep = np.delete(np.arange(ROWS), [50, 900])
    np.testing.assert_allclose(log.time, true["time"][keep], atol=1e-9)
    same_columns(log, {name: values[keep] for name, values in true.items()})


@pytest.mark.parametrize(
    ("rate", "start", "time", "shared"),
    [
        (20_000.0, 100.0, "%.6g", "up to 2[01] rows share a stamp"),  # six digits: 1 ms at 100 s
        (1000.0, 998.0, "%.6g", "up to 1[01] rows share a stamp"),  # coarse only after 1000 s
        (1200.0, 0.0, "%.3f", "up to 2 rows share a stamp"),
        (300.0, 0.0, "%.3f", "steps are uneven"),
    ],
)
def test_a_clock_printed_too_coarsely_is_rebuilt(
    rate: float, start: float, time: str, shared: str, tmp_path: Path
) -> None:
    true = recording(rate, start)
    with pytest.warns(StickslipWarning, match=rf"time is printed to 0\.0\d* s only, so that {shared}: it was rebuilt"):
        log = read(tmp_path, as_text(true, time))
    # a common shift within the last digit stays unknown, the interval does not
    error = log.time - true["time"]
    assert np.ptp(error) < 0.3 / rate and abs(error.mean()) < 0.6e-3
    same_columns(log, true)


def test_a_clock_cut_off_instead_of_rounded_is_rebuilt(tmp_path: Path) -> None:
    true = recording(20_000.0)
    printed = {**true, "time": np.floor(true["time"] * 1000 + 1e-6) / 1000}
    with pytest.warns(StickslipWarning, match="up to 20 rows share a stamp"):
        log = read(tmp_path, as_text(printed))
    assert np.ptp(log.time - true["time"]) < 1e-6  # of 50 us


def test_a_coarse_clock_keeps_its_gaps(tmp_path: Path) -> None:
    true = {name: np.delete(values, np.s_[1000:2000]) for name, values in recording(20_000.0, 100.0).items()}
    with pytest.warns(StickslipWarning, match="rebuilt"):
        log = read(tmp_path, as_text(true, "%.6g"))
    assert [len(piece.time) for piece in log.pieces()] == [1000, 1000]
    assert log.time[1000] - log.time[999] == pytest.approx(0.05, abs=1e-3)


def test_lost_rows_are_not_taken_for_a_coarse_clock(tmp_path: Path) -> None:
    true = {name: np.delete(values, np.s_[100::250]) for name, values in recording().items()}
    log = read(tmp_path, as_text(true, "%.3f"))
    np.testing.assert_allclose(log.time, true["time"], atol=1e-9)
    assert log.warnings == () and len(log.pieces()) == 1


def test_doubled_rows_are_refused_and_repaired(tmp_path: Path) -> None:
    true = recording()
    lines = as_text(true)
    every = [lines[0], *(line for line in lines[1:] for _ in range(2))]
    for doubled in ([*lines[:700], lines[699], *lines[700:]], every):
        with pytest.raises(StickslipError, match=r"line \d+ repeats the time .*--repair duplicates"):
            read(tmp_path, doubled)
        with pytest.warns(StickslipWarning, match="rows with the time of the row before were left out"):
            log = read(tmp_path, doubled, repair=["duplicates"])
        same_columns(log, true)
        np.testing.assert_allclose(log.time, true["time"], atol=1e-9)


def test_unsorted_rows_are_refused_and_repaired(tmp_path: Path) -> None:
    true = recording()
    lines = as_text(true)
    swapped = [*lines[:500], lines[501], lines[500], *lines[502:]]
    shuffled = [lines[0], *np.random.default_rng(1).permutation(lines[1:]).tolist()]
    for mixed in (swapped, shuffled):
        with pytest.raises(StickslipError, match=r"time falls .*out of order.*--repair sort"):
            read(tmp_path, mixed)
        with pytest.warns(StickslipWarning, match="rows were moved to sort them"):
            log = read(tmp_path, mixed, repair=["sort"])
        np.testing.assert_allclose(log.time, true["time"], atol=1e-9)
        same_columns(log, true)
    with pytest.raises(StickslipError, match=r"no repair 'sorted'.*Did you mean 'sort'"):
        read(tmp_path, lines, repair=["sorted"])


def test_joined_runs_are_split(tmp_path: Path) -> None:
    first, second = recording(seed=1), recording(seed=2)
    with pytest.warns(StickslipWarning, match=r"time falls to 0 s on line 3002: the clock was reset"):
        log = read(tmp_path, as_text(first) + as_text(second)[1:])
    assert np.all(np.diff(log.time) > 0)
    one, two = log.pieces()
    assert (one.name, two.name) == ("x", "x, part 2")
    same_columns(one, first)
    same_columns(two, {**second, "encoder_edge_time": second["encoder_edge_time"] + 3.0})
    np.testing.assert_allclose(two.time - two.time[0], second["time"], atol=1e-8)


def test_a_clock_that_stands_and_falls_is_refused_for_its_repeats(tmp_path: Path) -> None:
    lines = as_text({name: values[:100] for name, values in recording().items()})
    stuck = cells(lines, list(range(100)), "time", ["5"] * 50 + ["3"] * 50)
    with pytest.raises(StickslipError, match=r"line 3 repeats the time 5 .*--repair duplicates"):
        read(tmp_path, stuck)


def test_gaps_split_and_jitter_keeps_the_true_times(tmp_path: Path) -> None:
    true = {name: np.delete(values, np.s_[1000:1100]) for name, values in recording().items()}
    jitter = np.random.default_rng(0).uniform(-2e-4, 2e-4, len(true["time"]))
    true["time"] = true["time"] + jitter
    log = read(tmp_path, as_text(true))
    np.testing.assert_allclose(log.time, true["time"], atol=1e-9)
    one, two = log.pieces()
    assert (len(one.time), len(two.time)) == (1000, 1900) and two.time[0] == pytest.approx(1.1, abs=1e-3)


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("stated", [True, False])
def test_counters_that_wrap_are_unwrapped(bits: int, stated: bool, tmp_path: Path) -> None:
    true = recording()
    true["drive0_count"] += 2**bits - 200  # wraps within the log; the disc's count does so by its sign
    raw = {n: values % 2**bits if n.endswith("count") else values for n, values in true.items()}
    calibration = json.loads(json.dumps(CALIBRATION))
    if stated:
        for encoder in ("encoder", "drive0"):
            calibration[encoder]["counter_bits"] = bits
        log = read(tmp_path, as_text(raw), calibration=calibration)
    else:
        with pytest.warns(StickslipWarning) as said:
            log = read(tmp_path, as_text(raw))
        taken = [str(warning.message).partition(": ")[2] for warning in said]
        assert (
            all(f"was taken for a counter of {bits} bits and unwrapped" in text for text in taken) and len(taken) == 2
        )
    for name in ("encoder_count", "drive0_count"):
        np.testing.assert_array_equal(np.diff(log.column(name)), np.diff(true[name]))


def test_a_stated_width_must_hold_the_counts(tmp_path: Path) -> None:
    narrow = {**CALIBRATION, "drive0": {"pulses_per_revolution": 1000, "counter_bits": 8}}
    with pytest.raises(StickslipError, match="'drive0_count' runs from 0 to 429, which a counter of 8 bits"):
        read(tmp_path, as_text(recording()), calibration=narrow)
    odd = {**CALIBRATION, "drive0": {"pulses_per_revolution": 1000, "counter_bits": 1.5}}
    with pytest.raises(StickslipError, match=r"'counter_bits' is 1\.5"):
        read(tmp_path, as_text(recording()), calibration=odd)


def test_an_excursion_of_a_count_is_held(tmp_path: Path) -> None:
    true = recording()
    raw = {name: values.copy() for name, values in true.items()}
    raw["encoder_count"][1500:1503] += 400
    with pytest.warns(StickslipWarning, match=r"'encoder_count' leaps and comes back.* 3 samples .* line 1502"):
        log = read(tmp_path, as_text(raw))
    held = np.r_[1500:1503]
    np.testing.assert_array_equal(log.column("encoder_count")[held], true["encoder_count"][1499])
    np.testing.assert_array_equal(np.delete(log.column("encoder_count"), held), np.delete(true["encoder_count"], held))
    assert log.breaks == ()


def test_a_count_that_leaps_in_the_first_samples_takes_the_value_after(tmp_path: Path) -> None:
    true = recording()
    lines = cells(as_text(true), [0, 1, 2], "drive0_count", ["900", "901", "902"])
    with pytest.warns(StickslipWarning, match=r"3 samples were held at the count beside, the first on line 2"):
        log = read(tmp_path, lines)
    expected = np.concatenate([np.full(3, true["drive0_count"][3]), true["drive0_count"][3:]])
    np.testing.assert_array_equal(log.column("drive0_count"), expected)


def test_a_count_that_leaps_for_good_splits_the_log(tmp_path: Path) -> None:
    raw = recording()
    raw["drive0_count"][2000:] += 50
    with pytest.warns(StickslipWarning, match=r"'drive0_count' leaps by 50 on line 2002 and stays there"):
        log = read(tmp_path, as_text(raw))
    assert log.breaks == (2000,) and len(log.pieces()) == 2


def test_a_quick_shaft_is_believed(tmp_path: Path) -> None:
    """At 60 rad/s ten edges pass within a tick, which no counter has lost."""
    true = recording()
    true["drive0_count"] = np.floor(60 * true["time"] * 1000 / (2 * np.pi))
    log = read(tmp_path, as_text(true))
    same_columns(log, true)
    assert log.warnings == ()


def test_a_number_cut_off_at_the_end_is_no_count(tmp_path: Path) -> None:
    lines = as_text(recording())
    lines[-1] = lines[-1][:-2]  # drive0_count 429 became 4
    with pytest.warns(StickslipWarning, match=r"'drive0_count' leaps .* line 3001"):
        log = read(tmp_path, lines)
    assert log.column("drive0_count")[-1] == log.column("drive0_count")[-2]


def test_a_counter_out_of_its_senses_is_refused(tmp_path: Path) -> None:
    raw = recording()
    raw["drive0_count"] = raw["drive0_count"] + 1000.0 * (np.arange(ROWS) % 40 == 0)
    with pytest.raises(StickslipError, match="'drive0_count' steps faster than a shaft can turn at 75 samples"):
        read(tmp_path, as_text(raw))


SIZES = {
    "milliseconds in s": ({"time": 1000.0, "encoder_edge_time": 1000.0}, "'time' steps by 1 s.*Milliseconds"),
    "seconds in ms": ({"time": 1e-3, "encoder_edge_time": 1e-3}, "'time' steps by 1e-06 s"),
    "edge times in us": ({"encoder_edge_time": 1e6}, "'encoder_edge_time' runs ahead of the tick.*unit"),
    "edge times in ks": ({"encoder_edge_time": 1e-3}, "'encoder_edge_time' lies ticks before.*unit"),
}


@pytest.mark.parametrize(("factors", "message"), SIZES.values(), ids=SIZES)
def test_sizes_that_no_rig_has_are_refused(factors: dict[str, float], message: str, tmp_path: Path) -> None:
    raw = {name: factors.get(name, 1.0) * values for name, values in recording().items()}
    with pytest.raises(StickslipError, match=message):
        read(tmp_path, as_text(raw))


@pytest.mark.parametrize(
    ("column", "size", "message"),
    [
        ("angle [rad]", 11.5, "'angle' goes 1[15].* rad to one side.*Degrees"),
        ("drive0_speed [rad/s]", 300.0, "'drive0_speed' reaches 300 rad/s.*Revolutions per minute"),
    ],
)
def test_converted_columns_of_another_unit_are_refused(column: str, size: float, message: str, tmp_path: Path) -> None:
    time = np.arange(200) / 100
    columns = {"time": time, "angle [rad]": 0.1 * np.sin(time), "drive0_speed [rad/s]": 0.5 + 0 * time}
    columns[column] = size * np.sin(5 * time)
    with pytest.raises(StickslipError, match=message):
        read(tmp_path, as_text(columns))


def test_a_radius_in_millimetres_is_refused(tmp_path: Path) -> None:
    lines = as_text(recording())
    read(tmp_path, lines)
    sidecar = tmp_path / "datapackage.json"
    content = json.loads(sidecar.read_text())
    content["rig"] = {"R": {"value": 125, "unit": "m"}}
    sidecar.write_text(json.dumps(content))
    with pytest.raises(StickslipError, match=r"'R' is 125 m.*Millimetres"):
        read_log(tmp_path / "x.csv")


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_cells_break_the_reader(tmp_path_factory, data) -> None:
    lines = as_text({name: values[:60] for name, values in recording().items()})
    words = st.sampled_from([*WORDS, "-1", "0", "1e400", "255", "0.0301", "99999999999", "-0.5"]) | st.text(max_size=3)
    number = data.draw(st.integers(1, 8))
    rows = data.draw(st.lists(st.integers(0, 59), min_size=number, max_size=number))
    column = data.draw(st.sampled_from(list(FIELDS)))
    changed = cells(lines, rows, column, data.draw(st.lists(words, min_size=number, max_size=number)))
    folder = tmp_path_factory.getbasetemp()
    repair = data.draw(st.sampled_from([(), ("sort",), ("duplicates",), ("sort", "duplicates")]))
    with contextlib.suppress(StickslipError), warnings.catch_warnings():
        warnings.simplefilter("ignore", StickslipWarning)
        for piece in read(folder, changed, repair=repair).pieces():
            assert np.all(np.diff(piece.time) > 0)
