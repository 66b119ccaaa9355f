"""FMUs that depart from the standard while they run, or give up: no reset, next events at no time, failures for good,
discarded calls, warnings."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from build import build
from models import FOLDER, MODELS, Models, _one, _three, _two

from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.importer.driver import Driver
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any


@pytest.mark.parametrize("start", [0.0, 0.5])
def test_events_a_rounding_apart_end_the_run(model: Models, start: float) -> None:
    with pytest.raises(MotionError, match="events follow one another at t = ") as caught:
        simulate_any(model("creeping"), 1.0, parameters={"at": start})
    assert caught.value.time == pytest.approx(start, abs=1e-12)


@pytest.mark.parametrize("coupled", [False, True])
def test_a_next_event_at_no_time_is_named(model: Models, coupled: bool) -> None:
    with pytest.raises(MotionError, match=r"nextEventTime.* the value nan at t = 0\.5 s; expected a time") as caught:
        if coupled:
            units = {"one": Unit(model("no_time")), "two": Unit(model("clock"))}
            couple(CoupledSystem("pair", units, (), stop_time=1.0))
        else:
            simulate_any(model("no_time"), 1.0)
    assert caught.value.time == pytest.approx(0.5, abs=1e-12)


def test_a_failure_for_good_is_told_at_its_time(model: Models) -> None:
    with pytest.raises(MotionError, match="Derivatives fails for good at t = ") as caught:
        simulate_any(model("fatal"), 3.0)
    # where it was asked, beyond what it computes: not where that step began
    assert 1.0 < caught.value.time < 3.0


def test_an_fmu_without_reset_is_instantiated_again(tmp_path: Path, fmi: int) -> None:
    described = (_one, _two, _three)[fmi - 1]("dahlquist", MODELS["dahlquist"])
    options = (f"-DFMI={fmi}", "-DPREFIX=dahlquist_", "-Wno-unused-function", "-DNO_RESET")
    path = build(tmp_path / "once.fmu", FOLDER / "dahlquist.c", described, "dahlquist", options=options)
    with Driver(path) as driver:
        assert not driver._instance.calls.function[0]  # it has none
        for k in (1.0, 2.0, 1.0):
            run = driver.run(1.0, parameters={} if k == 1.0 else {"k": k})
            assert run["x"][-1] == pytest.approx(np.exp(-k), rel=1e-7)
    units = {name: Unit(driver.fmu) for name in ("one", "two")}
    for _ in range(2):
        pair = couple(CoupledSystem("pair", units, (), stop_time=1.0))
        assert pair["two.x"][-1] == pytest.approx(np.exp(-1.0), rel=1e-7)


def test_events_of_a_co_simulation_a_rounding_apart_end_the_run(model: Models, fmi: int) -> None:
    if fmi < 3:  # it has no events
        assert simulate_any(model("creeping_stepped"), 1.0)["x"][-1] == pytest.approx(1.0)
        return
    with pytest.raises(MotionError, match=r"1001 events follow one another at t = 0\.5 s without progress"):
        simulate_any(model("creeping_stepped"), 1.0)


@pytest.mark.parametrize(("step", "made"), [(0.5, ", of which it made 0.25 s"), (0.75, "")])
def test_a_discarded_step_says_how_far_it_came(model: Models, step: float, made: str) -> None:
    begun = 0.5 if made else 0.75
    said = rf"discards the communication step of {step} s at t = {begun} s{made}\. Choose a shorter one"
    with pytest.raises(MotionError, match=said):
        simulate_any(model("halting"), 3.0, communication_step=step)
    assert simulate_any(model("halting"), 0.75, communication_step=step)["x"][-1] == 0.75


def test_a_discarded_step_of_a_unit_says_how_far_it_came(model: Models) -> None:
    units = {"one": Unit(model("halting")), "two": Unit(model("integers"))}
    with pytest.raises(
        MotionError, match=r"'one': discards the communication step of 0\.5 s, of which it made 0\.25 s"
    ):
        couple(CoupledSystem("pair", units, (), step=0.5, stop_time=1.0))


@pytest.mark.parametrize("method", ["dop853", "stiff"])
def test_indicators_that_are_discarded_beyond_an_event_are_looked_for_before(model: Models, method: str) -> None:
    run = simulate_any(model("brink"), 2.4, method=method, tolerance=1e-3)
    assert [event.time for event in run.events] == pytest.approx([1.0, 2.0], abs=1e-12)
    assert run["x"][-1] == pytest.approx(0.6, abs=1e-12)


@pytest.mark.parametrize("times", [[2.6, 3.0], [3.0]])
def test_a_variable_without_a_value_is_named_by_its_time(model: Models, fmi: int, times: list[float]) -> None:
    function = ("fmiGetReal", "fmi2GetReal", "fmi3GetFloat64")[fmi - 1]
    with pytest.raises(MotionError, match=rf"{function} gives no value \(discard\) at t = {times[0]:g} s"):
        simulate_any(model("brink"), 3.0, record=["rate"], output_times=times)


def test_warnings_are_told_once(model: Models) -> None:
    warned = r", the FMU warns \d+ times, first: no rates beyond t = 1"
    with Driver(model("warning_grumble")) as driver:
        run = driver.run(2.0)
        assert re.search(f"{warned}$", run.method)
        assert run["x"][-1] == pytest.approx(np.exp(-2.0), rel=1e-6)
        assert "warns" not in driver.run(0.5).method
    pair = {"a": Unit(model("warning_grumble")), "b": Unit(model("dahlquist"))}
    coupled = couple(CoupledSystem("pair", pair, (), stop_time=2.0))
    assert re.search(r", unit 'a': the FMU warns \d+ times, first: no rates beyond t = 1", coupled.method)
