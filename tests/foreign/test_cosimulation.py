"""Co-Simulation of foreign FMUs: communication points as asked, event mode and early return."""

from __future__ import annotations

import numpy as np
import pytest
from models import Models

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import Connection
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any
from fmu_models.simulation.signal import Signal


def test_the_communication_step_is_the_one_asked_for(model: Models) -> None:
    run = simulate_any(model("integers"), 5.0, communication_step=0.5)
    assert run.time == pytest.approx(np.arange(11) * 0.5)
    assert run["x"] == pytest.approx(0.25 + run.time, abs=1e-12)
    assert run["count"][-1] == 5
    assert run["steps"][-1] == 10
    assert run.method == "co-simulation"


def test_early_returns_are_events(model: Models, fmi: int) -> None:
    run = simulate_any(model("integers"), 5.0, communication_step=0.5)
    events = [(event.kind, event.time) for event in run.events]
    # FMI 2 has no events in a co-simulation
    assert events == ([("state", 0.75 + k) for k in range(5)] if fmi == 3 else [])


def test_an_event_mode_that_is_declared_and_refused(model: Models, fmi: int) -> None:
    run = simulate_any(model("integers_refusing"), 5.0, communication_step=0.5)
    assert run["x"] == pytest.approx(0.25 + run.time, abs=1e-12)
    assert run["count"].tolist() == np.floor(run["x"]).tolist()
    said = ", without the event mode that the FMU declares and refuses" if fmi == 3 else ""
    assert (run.method, run.events) == (f"co-simulation{said}", ())
    pair = {"a": Unit(model("integers_refusing")), "b": Unit(model("integers"))}
    coupled = couple(CoupledSystem("pair", pair, [Connection("a.x", "b.u")], step=0.5, stop_time=5.0))
    assert coupled["a.x"][-1] == pytest.approx(5.25, abs=1e-12)
    assert ("; a: no inputs, without the event mode" in coupled.method) == (fmi == 3)


def test_inputs_jump_at_a_communication_point(model: Models) -> None:
    u = Signal([0.0, 1.25, 1.25, 5.0], [1.0, 1.0, 3.0, 3.0])
    times = [0.0, 1.25, 2.6, 5.0]
    run = simulate_any(model("integers"), 5.0, communication_step=0.5, inputs={"u": u}, output_times=times)
    assert run["x"] == pytest.approx([0.25, 1.5, 1.5 + 3 * 1.35, 1.5 + 3 * 3.75], abs=1e-9)
    assert run["u"].tolist() == [1.0, 3.0, 3.0, 3.0]


def test_a_run_that_the_fmu_ends(model: Models, fmi: int) -> None:
    if fmi == 1:
        # it cannot say more than that it does not go on
        with pytest.raises(MotionError, match=r"discards the communication step of 0\.4 s at t = 2 s"):
            simulate_any(model("integers"), 5.0, communication_step=0.4, parameters={"last": 2.0})
        return
    run = simulate_any(model("integers"), 5.0, communication_step=0.4, parameters={"last": 2.0})
    assert run.time[-1] == 2.0
    assert "the FMU ended the run at t = 2 s" in run.method


def test_an_fmu_with_steps_of_one_length_only(model: Models) -> None:
    run = simulate_any(model("integers_fixed"), 5.0, communication_step=0.5)
    assert run["count"][-1] == 5
    with pytest.raises(StickslipError, match=r"one length only, and t = 5 s .* no multiple of 0\.4 s"):
        simulate_any(model("integers_fixed"), 5.0, communication_step=0.4)


def test_an_fmu_without_model_exchange_asked_for_a_method(model: Models) -> None:
    with pytest.raises(StickslipError, match=r"offers Co-Simulation, but no Model Exchange.*'co-simulation'"):
        simulate_any(model("integers"), 5.0, method="stiff")
    with pytest.raises(StickslipError, match="offers Model Exchange, but no Co-Simulation"):
        simulate_any(model("ball"), 5.0, method="co-simulation")


def test_a_ball_that_falls_through_is_told_where_its_impacts_are(model: Models, fmi: int) -> None:
    fall = np.sqrt(2 / 9.81)
    limit = fall * (1 + 0.7) / (1 - 0.7)
    if fmi < 3:
        # no events, and outputs at communication points tell a fall from a flight in no other way than the model does
        assert simulate_any(model("ball_steps"), 3.0, communication_step=0.01)["h"][-1] < -0.1
        return
    with pytest.raises(MotionError, match=r"events of the FMU accumulate at t = 2\.5586.*--on-zeno continue") as caught:
        simulate_any(model("ball_steps"), 3.0, communication_step=0.01)
    assert (caught.value.kind, caught.value.time) == ("zeno", pytest.approx(limit, abs=1e-6))
    run = simulate_any(model("ball_steps"), 3.0, communication_step=0.01, on_zeno="continue")
    assert "events accumulate at t = 2.5586" in run.method
    assert run["h"][-1] < -0.1
    # until shortly before it is a run as any other
    assert simulate_any(model("ball_steps"), 2.5, communication_step=0.01)["bounces"][-1] > 8


def test_our_own_ball_comes_to_rest_in_co_simulation() -> None:
    fmu = Fmu.open(built("bouncing_ball", fmi_version="3.0"))
    run = simulate_any(fmu, 10.0, method="co-simulation", communication_step=0.05)
    assert "accumulate" not in run.method


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan")])
def test_a_communication_step_that_is_none(model: Models, step: float) -> None:
    with pytest.raises(StickslipError, match="must be a positive number of seconds"):
        simulate_any(model("integers"), 5.0, communication_step=step)
