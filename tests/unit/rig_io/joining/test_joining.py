"""Several files of one run: by columns, by time, by two clocks; and the reasons why some do not fit."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from rig_io.joining.joined import joined
from rig_io.logs.table import Table

RATE = 1000.0
PITCH = 2 * np.pi / 1000


def table(name: str, **columns: np.ndarray) -> Table:
    units = {"time": "s", "laser": "V", "drive0_speed": "rad/s", "angle": "rad"}
    return Table(f"'{name}'", columns, {k: units.get(k, "1") for k in columns}, 2)


def motion(time: np.ndarray) -> np.ndarray:
    """A motion that does not repeat itself."""
    return 0.1 * np.sin(6 * time + 2 * np.sin(0.31 * time)) + 0.03 * np.sin(1.7 * np.abs(time) ** 1.1)


def two(offset: float, drift: float, seed: int = 0, seconds: float = 20.0) -> tuple[Table, Table]:
    """A laser by one clock, an encoder by another: t_first = offset + (1 + drift) t_second."""
    rng = np.random.default_rng(seed)
    first = np.arange(round(seconds * RATE)) / RATE
    second = np.arange(round(seconds * RATE) - 700) / RATE
    laser = 5 + 12.5 * np.sin(motion(first)) + 2e-3 * rng.standard_normal(len(first))
    count = np.floor(motion(offset + (1 + drift) * second) / PITCH)
    return table("a", time=first, laser=laser), table("b", time=second, encoder_count=count)


@pytest.mark.parametrize(("offset", "drift"), [(0.4, 0.0), (-0.1234, 150e-6), (0.65, -300e-6)])
def test_offset_and_drift_of_two_clocks_are_found(offset: float, drift: float) -> None:
    first, second = two(offset, drift)
    run = joined((first, second), "clocks", {})
    clock = run.clock
    assert clock is not None and clock.signals == ("laser", "encoder_count")
    # the line is stated in the middle of the second recording
    assert clock.middle == pytest.approx(second.columns["time"].mean(), rel=1e-12)
    true = offset + drift * clock.middle
    assert abs(clock.offset - true) < 4 * clock.offset_deviation < 1e-3
    assert abs(clock.drift - drift) < 4 * clock.drift_deviation < 1e-4
    # what is carried over is where it belongs: a count at most one tick of its clock late
    count = run.table.columns["encoder_count"]
    assert np.mean(count == np.floor(motion(run.table.columns["time"]) / PITCH)) > 0.95
    assert {"encoder_edge_time", "laser"} <= set(run.table.columns)


@pytest.mark.parametrize("signal", ["laser", "drive0_count"])
def test_one_signal_in_both_recordings_is_found_again(signal: str) -> None:
    """A laser that both read, each with its own noise; a drive that turns on and on, by its unevenness."""
    offset, drift = 0.3, 90e-6
    rng = np.random.default_rng(2)

    def recorded(name: str, time: np.ndarray, true: np.ndarray) -> Table:
        if signal == "laser":
            shown = 5 + motion(true) + 2e-3 * rng.standard_normal(len(true))
        else:
            shown = np.floor((3.0 * true + motion(true)) / PITCH)
        return table(name, **{"time": time, signal: shown})

    time = np.arange(8000) / RATE
    clock = joined([recorded("a", time, time), recorded("b", time, offset + (1 + drift) * time)], "clocks", {}).clock
    assert clock is not None and clock.signals == (signal, signal)
    assert abs(clock.offset - offset - drift * clock.middle) < 4 * clock.offset_deviation < 1e-3
    assert abs(clock.drift - drift) < 4 * clock.drift_deviation < 1e-3


def test_stated_deviations_of_offset_and_drift_hold() -> None:
    scores = []
    for seed in range(12):
        clock = joined(two(0.3, 80e-6, seed, 10.0), "clocks", {}).clock
        assert clock is not None
        true = 0.3 + 80e-6 * clock.middle
        scores += [(clock.offset - true) / clock.offset_deviation, (clock.drift - 80e-6) / clock.drift_deviation]
    assert 0.4 < np.sqrt(np.mean(np.square(scores))) < 1.8


def test_a_trigger_joins_what_nothing_else_does() -> None:
    time = np.arange(5000) / RATE
    marks = (np.mod(time, 0.9) < 0.3 + 0.1 * np.floor(time)).astype(float)
    shifted = np.interp(time + 0.25, time, marks) > 0.5
    one = table("a", time=time, laser=np.sin(time), trigger=marks)
    other = table("b", time=time, drive0_speed=np.ones(5000), trigger=shifted.astype(float))
    clock = joined([one, other], "clocks", {}).clock
    assert clock is not None and clock.signals == ("trigger", "trigger")
    assert clock.offset == pytest.approx(0.25, abs=2e-3)


def test_clocks_that_cannot_be_compared_are_refused_with_the_reason() -> None:
    time = np.arange(5000) / RATE
    laser = table("a", time=time, laser=np.sin(6 * time))
    with pytest.raises(StickslipError, match=r"no signal in common.*trigger"):
        joined([laser, table("b", time=time, drive0_speed=1 + 0 * time)], "clocks", {})
    with pytest.raises(StickslipError, match="the signal repeats itself"):
        joined([laser, table("b", time=time, encoder_count=np.floor(30 * np.sin(6 * time + 1)))], "clocks", {})
    noise = np.floor(30 * np.random.default_rng(1).standard_normal(5000))
    with pytest.raises(StickslipError, match="do not agree at any shift"):
        joined([laser, table("b", time=time, encoder_count=noise)], "clocks", {})


@pytest.mark.parametrize("order", [1, -1])
def test_a_decay_needs_the_size_of_the_motion(order: int) -> None:
    time = np.arange(8000) / RATE
    swing = 0.15 * np.exp(-0.5 * time) * np.cos(6.9 * time)
    later = np.interp(time + 1.3, time, swing)
    count = table("a", time=time, encoder_count=np.floor(swing / PITCH))
    logs = [count, table("b", time=time, laser=5 + 12.5 * later)][::order]
    with pytest.raises(StickslipError, match="repeats itself"):
        joined(logs, "clocks", {})
    clock = joined(logs, "clocks", {"encoder_count": PITCH, "laser": 1 / 12.5}).clock
    assert clock is not None and clock.offset == pytest.approx(order * 1.3, abs=2e-3)


def test_signals_side_by_side() -> None:
    time = np.arange(100) / RATE
    run = joined([table("b", laser=np.sin(time)), table("a", time=time)], "columns", {}).table
    assert list(run.columns) == ["time", "laser"]
    with pytest.raises(StickslipError, match=r"one number of rows, found 'a' 100, 'b' 90"):
        joined([table("a", time=time), table("b", laser=np.sin(time[:90]))], "columns", {})
    with pytest.raises(StickslipError, match="and so does a file before it"):
        joined([table("a", time=time, laser=time), table("b", laser=time)], "columns", {})
    with pytest.raises(StickslipError, match=r"another clock.*--join clocks"):
        joined([table("a", time=time, laser=time), table("b", time=time + 1, angle=time)], "columns", {})


def test_files_of_one_recorder_are_put_in_order() -> None:
    time = np.arange(100) / RATE
    stamped = [
        replace(table(name, time=86400.0 * early + time, laser=time), begin=begin, stamps=("time",))
        for name, begin, early in (("late", datetime(2025, 3, 2), 0), ("early", datetime(2025, 3, 1), 0.9))
    ]
    run = joined(stamped, "time", {})
    assert np.all(np.diff(run.table.columns["time"]) > 0) and "'early', 'late'" in run.said[0]
    zoned = replace(stamped[0], begin=datetime(2025, 3, 2, tzinfo=UTC))
    with pytest.raises(StickslipError, match="time zone"):
        joined([zoned, stamped[1]], "time", {})
    with pytest.raises(StickslipError, match=r"different columns.*angle"):
        joined([table("a", time=time, laser=time), table("b", time=time, laser=time, angle=time)], "time", {})


def test_times_of_day_pass_midnight_between_files() -> None:
    time = np.arange(100) / RATE
    parts = [
        replace(table(name, time=begin + time, laser=time), stamps=("time",))
        for name, begin in (("a", 86399.8), ("b", 86399.9), ("c", 0.0), ("d", 0.1))
    ]
    run = joined(parts, "time", {}).table
    np.testing.assert_allclose(run.columns["time"], 86399.8 + np.arange(400) / RATE, rtol=0, atol=1e-9)


def test_what_is_not_said_is_asked() -> None:
    with pytest.raises(StickslipError, match=r"how they belong together is not said"):
        joined([table("a", time=np.arange(9.0)), table("b", laser=np.arange(9.0))], None, {})


def test_clocks_in_milliseconds_are_joined_in_seconds_with_the_edges_that_they_time() -> None:
    time = np.arange(100.0)
    parts = [
        replace(
            table(
                name, time=begin + time, encoder_edge_time=begin + time + 0.5, drive0_edge_time=1e-3 * (begin + time)
            ),
            units={"time": "ms", "encoder_edge_time": "ms", "drive0_edge_time": "s"},
        )
        for name, begin in (("a", 0.0), ("b", 100.0))
    ]
    run = joined(parts, "time", {}).table
    seconds = 1e-3 * np.arange(200.0)
    assert run.columns["time"] == pytest.approx(seconds, rel=1e-12)
    assert run.columns["encoder_edge_time"] == pytest.approx(seconds + 5e-4, rel=1e-12)
    assert run.columns["drive0_edge_time"] == pytest.approx(seconds, rel=1e-12)
    assert [run.units[name] for name in ("time", "encoder_edge_time", "drive0_edge_time")] == ["s", "s", "s"]
