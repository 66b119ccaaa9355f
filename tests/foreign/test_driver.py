"""An FMU loaded once and run many times, and what is refused before or during a run."""

from __future__ import annotations

import ctypes
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hostile_models import hostile
from models import Models

from fmu_models.base.errors import StickslipError
from fmu_models.importer.driver import Driver
from fmu_models.importer.instance import F
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate, simulate_any
from fmu_models.simulation.signal import Signal


def test_runs_of_one_driver_are_the_same_as_runs_of_new_ones(model: Models) -> None:
    with Driver(model("ball")) as driver:
        driver.run(2.0, parameters={"e": 0.9})
        with pytest.raises(MotionError):
            driver.run(5.0)
        again = driver.run(2.0)
    new = simulate_any(model("ball"), 2.0)
    assert all(np.array_equal(again[name], new[name]) for name in new.values)
    assert again.events == new.events


def test_one_call_runs_a_path_and_an_fmu_with_inputs_of_any_form(model: Models, tmp_path: Path) -> None:
    times, values = np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0, 1.0])
    (tmp_path / "log.csv").write_text("time [ms],force [1]\n0,0\n1000,2\n2000,1\n")
    expected = simulate_any(model("driven"), 2.0, inputs={"u": Signal(times, values)})
    forms = (f"{tmp_path}/log.csv:force", (times, values), pd.Series(values, index=times))
    for form in (*forms, lambda t: np.interp(t, times, values)):
        for fmu in (model("driven"), str(model("driven").path)):
            assert simulate(fmu, 2.0, inputs={"u": form})["x"] == pytest.approx(expected["x"], abs=1e-6)
    with Driver(model("driven")) as driver:
        table, _ = driver.batch(2.0, ("x",), inputs={"u": forms[0]}).runs(np.zeros((1, 1)))
    assert table[0, -1, 0] == pytest.approx(expected["x"][-1], abs=1e-6)


def test_a_batch_is_the_runs_one_by_one(model: Models) -> None:
    rows = np.array([[0.3, 1.0], [0.9, 2.0], [0.5, 0.5]])
    with Driver(model("ball")) as driver:
        batch = driver.batch(2.0, ("e", "h"), output_times=[1.0, 2.0])
        table, failures = batch.runs(rows)
        single = driver.run(2.0, parameters={"e": 0.9}, start={"h": 2.0}, output_times=[1.0, 2.0])
    by_name = {name: table[:, :, column] for column, name in enumerate(batch.recorded)}
    assert np.array_equal(by_name["h"][1], single["h"])
    assert np.array_equal(by_name["bounces"][1], single["bounces"])
    # with 0.3 and 0.5 it would have come to rest before the end
    assert sorted(failures) == [0, 2]
    assert "accumulate" in failures[0]
    assert np.isnan(by_name["h"][0, -1])


def test_a_batch_looks_at_the_values_of_each_call(model: Models) -> None:
    with Driver(model("ball")) as driver:
        batch = driver.batch(1.0, ("e", "h"))
        table, failures = batch.runs(np.array([[0.9, 1.0], [0.8, 1.0]]))
        with pytest.raises(StickslipError, match="'e' must be a finite number"):
            batch.runs(np.array([[np.nan, 1.0]]))
        assert np.array_equal(batch.runs(np.array([[0.9, 1.0]]))[0][0], table[0])
        assert (
            not failures and table[0, 0, batch.recorded.index("h")] == driver.run(1.0, parameters={"e": 0.9})["h"][-1]
        )


@pytest.mark.skipif(sys.platform != "linux", reason="resident memory is read from /proc")
def test_many_runs_take_no_memory(model: Models) -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    def loop(n: int) -> None:
        for _ in range(n):
            driver.run(1.0, output_times=[1.0])

    with Driver(model("ball")) as driver:
        loop(1000)
        sizes = [resident()]
        for _ in range(4):
            loop(2500)
            sizes.append(resident())
        # Python takes memory by the megabyte, now and then; one event kept of each run would take as much every time
        assert min(np.diff(sizes)) < 1 << 16


def test_drivers_side_by_side(model: Models) -> None:
    with Driver(model("ball")) as one, Driver(model("ball")) as other:
        a = one.run(1.0, parameters={"e": 0.6})
        b = other.run(1.0)
        assert a["v"][-1] != b["v"][-1]
        assert one.run(1.0)["v"][-1] == b["v"][-1]


def test_a_closed_driver(model: Models) -> None:
    driver = Driver(model("ball"))
    driver.close()
    driver.close()
    with pytest.raises(StickslipError, match="closed"):
        driver.run(1.0)


def test_what_is_recorded(model: Models) -> None:
    run = simulate_any(model("ball"), 1.0, record=["bounces", "g"])
    assert list(run.values) == ["h", "v", "bounces", "g"]
    assert run["g"].tolist() == [9.81] * 1001
    assert run["bounces"].dtype == np.int64


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "dop835"}, "no method 'dop835'. Did you mean 'dop853'"),
        ({"tolerance": -1e-6}, "tolerance must lie between"),
        ({"tolerance": math.nan}, "tolerance must lie between"),
        ({"parameters": {"ee": 0.5}}, "no parameter 'ee'"),
        ({"parameters": {"h": 0.5}}, "no parameter 'h'"),
        ({"parameters": {"e": math.inf}}, "must be a finite number"),
        ({"start": {"hh": 0.5}}, "no variable 'hh' to start from. Did you mean 'h'"),
        ({"start": {"der(h)": 0.5}}, "computed by the FMU"),
        ({"inputs": {"u": 1.0}}, "no input 'u'. It has no inputs"),
        ({"output_times": [0.5, 0.2]}, "ascending"),
        ({"output_times": [0.5, 5.0]}, "leave the run"),
        ({"record": ["hh"]}, "no variable 'hh' to record. Did you mean 'h'"),
        ({"max_step": -1.0}, "longest step must be a positive number"),
        ({"communication_step": 0.1}, "belongs to the method 'co-simulation'"),
        ({"start_time": 3.0}, "must end after it starts"),
    ],
)
def test_bad_requests_are_refused_in_words(model: Models, options: dict[str, Any], message: str) -> None:
    with pytest.raises(StickslipError, match=message.replace("(", r"\(")):
        simulate_any(model("ball"), 1.0, **options)


def test_derivatives_that_are_no_numbers(tmp_path: Path) -> None:
    with pytest.raises(MotionError, match=r"derivative of the state 'x' is not a finite number at t = (1|0\.99999)"):
        simulate_any(hostile("not_a_number", tmp_path), 2.0)


def test_an_error_of_the_fmu_comes_with_what_it_said(model: Models, fmi: int) -> None:
    function = ("fmiGetDerivatives", "fmi2GetDerivatives", "fmi3GetContinuousStateDerivatives")[fmi - 1]
    with pytest.raises(MotionError, match=rf"{function} fails at t = .*The FMU says: no rates beyond t = 1"):
        simulate_any(model("grumble"), 2.0)


def test_a_run_ends_with_its_time(model: Models) -> None:
    run = simulate_any(model("ball"), 1.0, start_time=0.25)
    assert (run.time[0], run.time[-1]) == (0.25, 1.0)
    assert run.events[0].time == pytest.approx(0.25 + math.sqrt(2 / 9.81), abs=1e-12)


def test_a_state_that_the_fmu_makes_infinite_is_named(model: Models) -> None:
    def lie(_instance: int, states: Any, _n: int) -> int:
        states[0] = math.inf
        return 0

    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_double), ctypes.c_size_t)
    liar = kind(lie)
    with Driver(model("clock")) as driver:
        driver._instance.calls.function[F.GET_STATES] = ctypes.cast(liar, ctypes.c_void_p).value
        with pytest.raises(MotionError, match="the FMU gives the state 'x' the value inf in its event at t = 0 s"):
            driver.run(1.0)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "stiff"])
def test_rates_that_differ_between_two_calls_end_the_run(model: Models, method: str) -> None:
    with pytest.raises(
        MotionError, match=r"two calls at t = .* derivatives of the state 'x' that differ by 5"
    ) as caught:
        simulate_any(model("fickle"), 2.0, method=method)
    assert caught.value.kind == "rates differ"
