"""What an importer can miss of a black box, and what bounds it: a longest step, and a second run at other places."""

from __future__ import annotations

import math

import numpy as np
import pytest
from models import Models
from scipy.optimize import root_scalar

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.importer.experiment import FmuExperiment
from fmu_models.importer.flow import FlowDriver
from fmu_models.importer.second_run import perform_twice
from fmu_models.importer.simulate import simulate_any

METHODS = ("dopri5", "dop853", "stiff", "auto")
EDGES = [7.2995, 7.3005]  # of the pulse


@pytest.mark.parametrize("method", METHODS)
def test_a_narrow_pulse_is_seen_with_a_longest_step(model: Models, method: str) -> None:
    # missed in silence: an importer sees an FMU at the nodes of its steps
    assert simulate_any(model("pulse"), 10.0, method=method)["x"][-1] == 0.0
    run = simulate_any(model("pulse"), 10.0, method=method, max_step=4e-3)
    assert [event.time for event in run.events] == pytest.approx(EDGES, abs=1e-12)
    assert run["x"][-1] == pytest.approx(1.0, abs=1e-9)
    assert "steps of at most 0.004 s (as asked for)" in run.method


def test_the_fmu_states_the_longest_step(model: Models) -> None:
    run = simulate_any(model("pulse_stepped"), 10.0)
    assert [event.time for event in run.events] == pytest.approx(EDGES, abs=1e-12)
    assert "steps of at most 0.002 s (by the FMU's own experiment)" in run.method
    # 500 steps of an experiment of half a second
    assert "steps of at most 0.001 s (by the FMU's own experiment)" in simulate_any(model("pulse_stopped"), 10.0).method
    # of a run that is longer by orders than its author thought of
    assert "steps of at most 10 s (the run / 10000)" in simulate_any(model("pulse_stopped"), 1e5).method
    free = simulate_any(model("pulse_stepped"), 10.0, max_step=math.inf)
    assert "at most" not in free.method and free["x"][-1] == 0.0


def test_couplings_keep_to_it_and_flows_have_none(model: Models) -> None:
    for name, end in (("pulse", 0.0), ("pulse_stepped", 1.0)):
        run = couple(CoupledSystem("one", {"p": Unit(model(name))}, (), stop_time=10.0))
        assert run["p.x"][-1] == pytest.approx(end, abs=1e-9)
    # the accuracy of a branch is told from flows at several tolerances, which a bound would make the same
    driver = FlowDriver(model("pulse_stepped"))
    assert driver.follow({"x": 0.0}, 0.0, 10.0).states == pytest.approx([0.0], abs=1e-9)
    driver.close()


def test_a_longest_step_belongs_to_methods_of_integration(model: Models) -> None:
    with pytest.raises(StickslipError, match="belongs to methods of integration, found co-simulation"):
        simulate_any(model("integers"), 1.0, max_step=0.1)


def test_a_second_run_finds_what_the_first_missed(model: Models) -> None:
    times = np.linspace(0.0, 10.0, 102)  # none within the pulse
    _, second = perform_twice(model("pulse"), FmuExperiment(10.0, output_times=times))
    assert not second.agrees
    assert [(e.kind, e.indicator, e.run) for e in second.events] == [("state", 0, "second")] * 2
    assert [e.time for e in second.events] == pytest.approx(EDGES, abs=1e-12)
    (difference,) = second.variables
    assert (difference.variable, difference.time) == ("x", times[74])
    assert difference.most == pytest.approx(1.0, abs=1e-9)
    assert second.lasts < 1e-3
    # and has nothing to say where both saw it
    _, second = perform_twice(model("pulse"), FmuExperiment(10.0, output_times=times, max_step=4e-3))
    assert second.agrees and second.max_step < 4e-3
    _, second = perform_twice(model("ball"), FmuExperiment(2.4))
    assert second.agrees, second


@pytest.mark.parametrize("method", METHODS)
def test_an_indicator_of_time_is_watched_though_nothing_moves(model: Models, method: str) -> None:
    run = simulate_any(model("waver"), 60.0, method=method)
    # all zeros of 1.5 - t / 50 - sin(50 t), from signs on a fine grid and by Newton's method
    t = np.linspace(0.0, 60.0, 600_001)
    z = 1.5 - 0.02 * t - np.sin(50.0 * t)
    zeros = t[:-1][(z[:-1] > 0) != (z[1:] > 0)]
    for _ in range(8):
        zeros = zeros - (1.5 - 0.02 * zeros - np.sin(50.0 * zeros)) / (-0.02 - 50.0 * np.cos(50.0 * zeros))
    times = np.array([event.time for event in run.events])
    assert times.size == zeros.size == 558
    assert np.abs(times - zeros).max() < 1e-12


def test_a_dip_of_an_indicator_is_met_where_it_begins(model: Models) -> None:
    """Though the polynomial through its samples errs there, or the indicator jumps soon after."""
    least = (math.acos(-0.002) + 2.0 * math.pi * np.arange(40)) / 50.0
    for a in np.linspace(1.2, 1.3, 46):
        dips = a - 0.1 * least - np.sin(50.0 * least) <= 0.0
        first = least[dips][0]
        begins = root_scalar(
            lambda t, a: a - 0.1 * t - math.sin(50.0 * t),
            args=(a,),
            bracket=(first - math.pi / 50.0, first),
            xtol=1e-15,
        ).root
        for falls in (1e9, begins + 0.006):
            run = simulate_any(model("waver"), 3.5, parameters={"a": a, "b": 0.1, "falls": falls})
            assert run.events[0].time == pytest.approx(begins, abs=1e-10)


@pytest.mark.nightly_for("fmi3")
def test_an_indicator_that_no_step_can_follow_is_told(model: Models) -> None:
    run = simulate_any(model("waver"), 60.0, parameters={"a": 2.5, "w": 1e9})
    assert "event indicator 0 changes from t = " in run.method and "events of it may be missed" in run.method
