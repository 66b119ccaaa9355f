"""Events of foreign FMUs: when they are, that none is missed, and what the FMU sees of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from models import Models

from fmu_models.base.errors import StickslipError
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any
from fmu_models.simulation.signal import Signal

METHODS = ("dopri5", "dop853", "stiff", "auto")
G, E = 9.81, 0.7
FIRST = math.sqrt(2 / G)


def bounces(n: int) -> np.ndarray:
    """Times of the first n bounces from 1 m: the k-th flight takes 2 E^k as long as the first fall."""
    return FIRST * (1 + 2 * np.concatenate([[0], np.cumsum(E ** np.arange(1, n))]))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["ball", "ball_edge", "ball_sign"])
def test_bounces(model: Models, name: str, method: str) -> None:
    run = simulate_any(model(name), 2.4, method=method)
    times = np.array([event.time for event in run.events])
    assert run["bounces"][-1] == times.size == 8
    assert abs(times[0] - FIRST) < 1e-12
    assert np.abs(times - bounces(8)).max() < 1e-11
    assert {event.kind for event in run.events} == {"state"}
    first = run.events[0]
    assert first.indicator == 0
    assert first.states_before[1] == pytest.approx(-math.sqrt(2 * G), rel=1e-12)
    assert first.states_after[1] == pytest.approx(E * math.sqrt(2 * G), rel=1e-12)


def test_the_value_at_an_event_is_the_one_after_it(model: Models) -> None:
    time = simulate_any(model("ball"), 1.0).events[0].time
    run = simulate_any(model("ball"), 1.0, output_times=[0.4, time, 1.0])
    assert run["v"][1] > 0


@pytest.mark.parametrize("method", METHODS)
def test_a_ball_without_rest_is_zeno(model: Models, method: str) -> None:
    with pytest.raises(MotionError, match=r"accumulate at t = 2\.5586.* comes to rest") as caught:
        simulate_any(model("ball"), 10.0, method=method)
    assert caught.value.kind == "zeno"
    assert caught.value.indicator == 0
    # the geometric series of all flights
    assert abs(caught.value.time - FIRST * (1 + 2 * E / (1 - E))) < 1e-6


@pytest.mark.parametrize("name", ["ball", "ball_sign"])
@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.7, 0.9, 0.98])
def test_zeno_whatever_the_restitution(model: Models, name: str, restitution: float) -> None:
    exact = FIRST * (1 + 2 * restitution / (1 - restitution))
    with pytest.raises(MotionError) as caught:
        simulate_any(model(name), exact + 1.0, parameters={"e": restitution})
    assert caught.value.kind == "zeno"
    assert abs(caught.value.time - exact) < 1e-6 * max(1.0, exact)


LIMIT = FIRST * (1 + 2 * E / (1 - E))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["ball", "ball_edge", "ball_sign"])
def test_a_zeno_motion_is_held_at_its_limit(model: Models, name: str, method: str) -> None:
    run = simulate_any(model(name), 10.0, method=method, on_zeno="hold", output_times=[0.1, 2.5, 2.6, 10.0])
    assert run["h"][0] == pytest.approx(1 - G / 2 * 0.1**2, abs=1e-12)
    assert run["h"][1] > 0
    assert run["h"][2:] == pytest.approx(0.0, abs=1e-12)
    assert run["v"][2:] == pytest.approx(0.0, abs=1e-7)
    assert (run.events[-1].kind, run.events[-1].indicator) == ("rest", 0)
    assert run.events[-1].time == pytest.approx(LIMIT, abs=1e-7)
    assert "events accumulate at t = 2.5586339" in run.method and "held from there on" in run.method


@pytest.mark.parametrize("name", ["ball", "ball_edge", "ball_sign"])
def test_a_zeno_motion_that_goes_on(model: Models, name: str) -> None:
    run = simulate_any(model(name), 3.0, on_zeno="continue")
    # none of these has a floor below the limit
    assert run["h"][-1] == pytest.approx(-G / 2 * (3.0 - LIMIT) ** 2, abs=1e-6)
    assert "events accumulate at t = 2.5586339" in run.method and "continued as the FMU does" in run.method


def test_what_else_moves_is_not_held(model: Models) -> None:
    with pytest.raises(MotionError, match=r"accumulate at t = 2\.5586.* cannot be held there: the state 's' goes on"):
        simulate_any(model("ball_rolling"), 10.0, on_zeno="hold")
    with pytest.raises(MotionError, match=r"accumulate at t = 2\.5586.* held there, or go on as the FMU does"):
        simulate_any(model("ball_rolling"), 10.0)


def test_choices_where_events_accumulate(model: Models) -> None:
    with pytest.raises(StickslipError, match="can stop, hold, continue; found 'rest'"):
        simulate_any(model("ball"), 1.0, on_zeno="rest")
    with pytest.raises(StickslipError, match="belongs to methods of integration"):
        simulate_any(model("integers"), 1.0, on_zeno="hold")


@pytest.mark.parametrize("method", METHODS)
def test_a_ball_that_comes_to_rest_is_not_zeno(model: Models, method: str) -> None:
    run = simulate_any(model("ball_rest"), 5.0, method=method)
    # the n-th bounce leaves E^n sqrt(2 G), below 0.1 for the first time with the eleventh
    assert run["bounces"][-1] == 11
    assert (run["h"][-1], run["v"][-1]) == (0.0, 0.0)


@pytest.mark.parametrize("method", METHODS)
def test_a_grazing_pair_inside_one_step(model: Models, method: str) -> None:
    run = simulate_any(model("graze"), 2.0, method=method)
    assert [event.time for event in run.events] == pytest.approx([0.5 - 5e-7, 0.5 + 5e-7], abs=1e-12)
    assert run["entries"][-1] == 1
    # both within one step, unless the first had cut it: there are not enough steps to come so near by chance
    assert run.steps < 60


def test_time_events_are_met_exactly_and_never_overstepped(model: Models) -> None:
    run = simulate_any(model("clock"), 5.0, output_times=[0.05, 0.1, 4.95, 5.0])
    assert [event.time for event in run.events] == [(k + 1) * 0.1 for k in range(50)]
    assert {event.kind for event in run.events} == {"time"}
    assert run["ticks"][-1] == 50
    assert run["late"][-1] == 0
    assert run["x"] == pytest.approx([0.05, 0.0, 0.05, 0.0], abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_an_fmu_without_states(model: Models, method: str) -> None:
    run = simulate_any(model("ticker"), 2.1, method=method, output_times=[0.0, 0.24, 0.25, 2.1])
    assert run["ticks"].tolist() == [0, 0, 1, 8]
    assert run.steps < 40


def test_every_step_is_completed(model: Models) -> None:
    run = simulate_any(model("wrap"), 5.0, max_step=0.3)
    assert run["steps"][-1] == run.steps
    kinds = [event.kind for event in run.events]
    assert kinds == ["step"] * int(run["wraps"][-1])
    assert run["wraps"][-1] >= 3
    assert run["x"][-1] == pytest.approx(5.0 - run["wraps"][-1], abs=1e-12)


def test_an_fmu_that_ends_the_run(model: Models) -> None:
    run = simulate_any(model("ending"), 5.0, output_times=np.linspace(0, 5, 51))
    assert run.time[-1] == pytest.approx(1.0, abs=0.11)
    assert run.events[-1].kind == "end"
    assert run.events[-1].time == pytest.approx(1.0, abs=1e-12)
    assert "the FMU ended the run at t = 1 s" in run.method


def test_discrete_states_that_never_settle(model: Models) -> None:
    with pytest.raises(MotionError, match="ever more updates of its discrete states at t = 1 s"):
        simulate_any(model("restless"), 5.0)


@pytest.mark.parametrize("method", METHODS)
def test_jumps_of_inputs_are_events_and_bends_end_steps(model: Models, method: str) -> None:
    u = Signal([0.0, 1.0, 1.0, 2.0, 5.0], [0.0, 1.0, 3.0, 0.0, 0.0])
    run = simulate_any(model("driven"), 5.0, method=method, inputs={"u": u, "step": 2.0}, output_times=[1.0, 2.0, 5.0])
    # the integral of two triangles and of the constant
    assert run["x"] == pytest.approx([0.5 + 2.0, 0.5 + 1.5 + 4.0, 2.0 + 10.0], abs=1e-12)
    assert [(event.kind, event.time) for event in run.events] == [("input", 1.0)]
    assert run["u"] == pytest.approx([3.0, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("steps", [1e-3, 0.7])
def test_the_length_of_steps_does_not_hide_events(model: Models, steps: float) -> None:
    run = simulate_any(model("ball"), 2.0, max_step=steps)
    assert run["bounces"][-1] == 4
