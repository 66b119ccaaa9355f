"""FMUs that depart from the standard while they run: no reset, next events at no time, failures for good."""

from __future__ import annotations

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
