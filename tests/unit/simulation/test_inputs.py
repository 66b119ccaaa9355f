"""What an input may be given as: every form becomes the same Signal, and what does not do is answered."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate
from fmu_models.simulation.inputs import TOLERANCE, signal_of
from fmu_models.simulation.measured import read_measured
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal, knots

TIME = np.linspace(0.0, 3.0, 61)
SPEED = 0.4 + 0.1 * TIME  # rad/s
TURNS = SPEED * 60 / (2 * np.pi)  # rpm


@pytest.fixture(scope="module")
def rig() -> Fmu:
    return Fmu.open(built("disc_rig", contacts=["disc0"]))


def log(folder: Path, columns: dict[str, Any], fields: list[dict[str, Any]] | None = None) -> Path:
    """A log with its sidecar, if its columns are described."""
    path = folder / "log.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    if fields is not None:
        resource = {"path": path.name, "schema": {"fields": fields}}
        (folder / "datapackage.json").write_text(json.dumps({"resources": [resource]}))
    return path


def test_a_level_that_goes_on_ends_no_step():
    level = Signal.held([0.0, 1.0, 2.0, 3.0], [2.0, 2.0, 5.0, 5.0])
    np.testing.assert_array_equal(level.bends, [0.0, 2.0, 2.0, 3.0])
    times, values, slopes = knots({"w": level, "u": Signal([0.0, 1.5, 3.0], [0.0, 1.5, 3.0])}, 0.5, 3.0)
    np.testing.assert_array_equal(times, [0.5, 1.5, 2.0])
    np.testing.assert_array_equal(values, [[2.0, 0.5], [2.0, 1.5], [5.0, 2.0]])
    np.testing.assert_array_equal(slopes, [[0.0, 1.0]] * 3)


FORMS: dict[str, Callable[[Path], Any]] = {
    "log": lambda folder: f"{log(folder, {'time [ms]': 1000 * TIME, 'speed [rpm]': TURNS})}:speed",
    "sidecar": lambda folder: (
        f"{log(folder, {'t': TIME, 'n': TURNS}, [{'name': 'n', 'unit': 'rpm', 'variable': 'speed'}])}:speed"
    ),
    "pair": lambda _: (TIME, SPEED),
    "lists": lambda _: [TIME.tolist(), SPEED.tolist()],
    "columns": lambda _: np.column_stack([TIME, SPEED]),
    "series": lambda _: pd.Series(SPEED, index=TIME),
    "series of another unit": lambda _: pd.DataFrame({"n": TURNS}, index=TIME).pipe(_with_units)["n"],
    "durations": lambda _: pd.Series(SPEED, index=pd.to_timedelta(TIME, unit="s")),
    "dates": lambda _: pd.Series(SPEED, index=pd.Timestamp("2026-01-01") + pd.to_timedelta(TIME, unit="s")),
    "function": lambda _: lambda t: 0.4 + 0.1 * t,
}


def _with_units(table: pd.DataFrame) -> pd.DataFrame:
    table.attrs["units"] = {"n": "rpm"}
    return table


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_the_same_run(rig: Fmu, tmp_path: Path, form: str) -> None:
    expected = simulate(rig, 3.0, inputs={"w0": Signal([0.0, 3.0], [0.4, 0.7])})
    run = simulate(rig, 3.0, inputs={"w0": FORMS[form](tmp_path)})
    assert run["theta"] == pytest.approx(expected["theta"], abs=1e-12)
    assert len(run.events) == len(expected.events)


def test_the_master_and_derivatives_take_them_too(rig: Fmu, tmp_path: Path) -> None:
    column = FORMS["log"](tmp_path)
    expected = simulate(rig, 3.0, inputs={"w0": Signal([0.0, 3.0], [0.4, 0.7])})
    for options in ({"method": "dop853", "tolerance": 1e-11}, {"method": "co-simulation", "communication_step": 1e-3}):
        run = simulate(rig, 3.0, inputs={"w0": column}, **options)
        assert np.interp(TIME, run.time, run["theta"]) == pytest.approx(
            np.interp(TIME, expected.time, expected["theta"]), abs=1e-5
        )
    with SensitiveRun(rig, by=["J"]) as sensitive:
        states = [sensitive.run([3.0], inputs={"w0": w0}).values for w0 in (column, lambda t: 0.4 + 0.1 * t)]
    assert states[0] == pytest.approx(states[1], abs=1e-12)


def test_values_that_hold_jump_at_the_next_one(tmp_path: Path) -> None:
    path = log(tmp_path, {"time": TIME, "w": SPEED}, [{"name": "w", "unit": "rad/s", "hold": True}])
    signal = signal_of(f"{path}:w", 0.0, 3.0)
    assert isinstance(signal, Signal)
    assert signal.piece(TIME)[0].tolist() == SPEED.tolist()
    assert signal.piece(TIME[1:] - 1e-9)[0] == pytest.approx(SPEED[:-1], abs=0)
    assert not signal.piece(TIME)[1].any()


def test_a_signal_rises_no_further_at_its_end() -> None:
    values, slopes = Signal([0.0, 1.0, 3.0], [0.0, 2.0, 3.0]).piece(np.array([0.5, 1.0, 2.0, 3.0]))
    assert values.tolist() == [1.0, 2.0, 2.5, 3.0]
    assert slopes.tolist() == [2.0, 0.5, 0.5, 0.0]


@given(st.sets(st.integers(-(10**6), 10**6), min_size=2, max_size=30), st.data())
def test_samples_come_back_from_every_form(microseconds: set[int], data: st.DataObject) -> None:
    times = np.array(sorted(microseconds)) * 1e-6
    values = data.draw(arrays(float, times.size, elements=st.floats(-1e6, 1e6)))
    for given_as in ((times, values), pd.Series(values, index=times), Signal.held(times, values)):
        signal = signal_of(given_as, times[0], times[-1])
        assert isinstance(signal, Signal)
        assert signal.piece(times)[0] == pytest.approx(values, abs=0)


@settings(deadline=None)
@given(st.floats(0.2, 8.0), st.floats(-3.0, 3.0), st.floats(0.1, 2.9), st.floats(-5.0, 5.0))
@example(rate=6.863865006136481, phase=0.7306125098871127, jump=1.0, height=0.71875)
def test_a_function_is_met_within_the_tolerance(rate: float, phase: float, jump: float, height: float) -> None:
    def function(time: float) -> float:
        return float(np.sin(rate * time + phase)) + (height if time >= jump else 0.0)

    signal = signal_of(function, 0.0, 3.0)
    assert isinstance(signal, Signal)
    times = np.setdiff1d(np.linspace(0.0, 3.0, 1777), [jump])
    times = times[np.abs(times - jump) > 1e-9]
    largest = np.abs(signal.value).max()
    between = 1.15  # a cubic may miss its line by so much of what the three points of a piece show
    met = between * TOLERANCE * largest + 1e-9
    assert signal.piece(times)[0] == pytest.approx([function(t) for t in times], abs=met)
    assert signal.time[0] == 0.0 and signal.time[-1] == 3.0


BAD_LOGS: dict[str, tuple[dict[str, Any], str]] = {
    "column": ({"time": TIME, "speeed [rad/s]": SPEED}, "no column 'speed', wanted for input 'w0'. Did you mean"),
    "unit": ({"time": TIME, "speed [V]": SPEED}, "is in 'V', which cannot be converted to rad/s"),
    "angle": ({"time": TIME, "speed [1/min]": SPEED}, "Write rad/s, deg/s, turn/s or rpm"),
    "end": ({"time": TIME / 2, "speed [rad/s]": SPEED}, "covers 0 s to 1.5 s, the run 0 s to 3 s"),
    "back": ({"time": TIME[::-1], "speed [rad/s]": SPEED}, "the times run back on line 3"),
    "gap": ({"time": TIME, "speed [rad/s]": np.where(TIME > 2.94, np.nan, SPEED)}, "no number on line 61 (2 times)"),
    "no clock": ({"speed [rad/s]": SPEED, "x": SPEED}, "no column of times among 'speed', 'x'"),
}


@pytest.mark.parametrize("fault", BAD_LOGS)
def test_a_log_that_does_not_do_is_answered(rig: Fmu, tmp_path: Path, fault: str) -> None:
    columns, message = BAD_LOGS[fault]
    with pytest.raises(StickslipError) as caught:
        simulate(rig, 3.0, inputs={"w0": f"{log(tmp_path, columns)}:speed"})
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([1, 2, 3], "input 'w0' must be a finite number, found [1, 2, 3]. What changes with time is (times, values)"),
        (None, "found None"),
        (np.linspace(0, 1, 500), "found ndarray without times"),
        ("nowhere.csv:speed", "no log 'nowhere.csv'"),
        ((TIME[::-1], SPEED), "times of input 'w0' run back at row 1 (3 s to 2.95 s)"),
        ((TIME, np.where(TIME > 1, np.nan, SPEED)), "no finite number in row 22 (40 times)"),
        (pd.Series(["a", "b"]), "found 2 of type"),
        (lambda t: 1 / t, "fails at t = 0 s: float division by zero"),
        (lambda t: float("nan"), "gives nan at t = 0 s"),
        (lambda t: np.sin(1 / (t + 1e-9)), "changes too fast"),
    ],
)
def test_what_is_no_input_is_answered(rig: Fmu, value: Any, message: str) -> None:
    with pytest.raises(StickslipError) as caught:
        simulate(rig, 3.0, inputs={"w0": value})
    assert message.lower() in str(caught.value).lower()


def test_a_model_is_run_by_its_name_and_only_the_master_takes_its_own_options() -> None:
    assert simulate("block_on_belt", 1.0)["x"][-1] == simulate(Fmu.open(built("block_on_belt")), 1.0)["x"][-1]
    with pytest.raises(StickslipError, match="'max_step' belongs to the master"):
        simulate("block_on_belt", 1.0, max_step=0.1)


def test_a_sampled_log_has_the_times_of_its_rate(tmp_path: Path) -> None:
    path = log(tmp_path, {"w": SPEED})
    (tmp_path / "datapackage.json").write_text(json.dumps({"resources": [{"path": path.name, "sampling_rate": 20}]}))
    assert read_measured(path).time == pytest.approx(TIME)


def test_what_an_input_changes_at_its_knot_is_an_event() -> None:
    """A belt that jumps tears off a block that it carries, at that instant: in a run, and in one with derivatives."""
    block = Fmu.open(built("block_on_belt"))
    values: dict[str, Any] = {"inputs": {"v_belt": Signal([0.0, 0.3, 0.3, 1.0], [0.1, 0.1, 0.5, 0.5])}}
    values["start"] = {"x": 0.0, "v": 0.1}
    with SensitiveRun(block, by=["x", "v"], recorded=["x"]) as sensitive:
        slopes = sensitive.run([0.5], **values)
    for events in (simulate(block, 0.5, **values).events, slopes.events):
        assert [(event.time, event.contact, event.before, event.after) for event in events] == [(0.3, "belt", 0, -1)]
    np.testing.assert_array_equal(slopes.event_derivative, np.zeros((1, 2)))
