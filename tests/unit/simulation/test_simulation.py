"""Runs through an exported FMU: inputs, outputs, events, and every answer to bad input."""

from __future__ import annotations

import csv
import math
import pickle
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from quick_export import quick_export

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation import engine, whole_run
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal, knots
from fmu_models.simulation.trajectory import Events


@pytest.fixture(scope="module")
def rig() -> Fmu:
    return Fmu.open(built("disc_rig", contacts=["disc0"]))


@pytest.fixture(scope="module")
def free() -> Fmu:
    return Fmu.open(built("disc_rig", contacts=[]))


def test_a_free_decay_is_the_closed_form(free: Fmu) -> None:
    J, k, c, theta = 0.05, 2.5, 0.06, 0.2
    run = simulate(free, 10.0, parameters={"J": J, "k": k, "c": c}, start={"theta": theta})
    a, w = c / (2 * J), math.sqrt(k / J - (c / (2 * J)) ** 2)
    t = run.time
    expected = theta * np.exp(-a * t) * (np.cos(w * t) + a / w * np.sin(w * t))
    # steps keep 1e-12 of the state each, some hundred of them
    assert np.abs(run["theta"] - expected).max() < 1e-11 * theta
    assert run.events == ()
    assert run.steps < w * 10.0  # each is more than a radian long
    assert run["der(theta)"] == pytest.approx(run["omega"], abs=0)
    assert run.units["omega"] == "rad/s" and run.units["alpha"] == "rad/s2"


def test_output_times_do_not_change_the_motion(rig: Fmu) -> None:
    fine = simulate(rig, 5.0)
    few = simulate(rig, 5.0, output_times=[2.5, 5.0])
    assert few["theta"].tolist() == fine["theta"][[500, 1000]].tolist()
    assert few.events == fine.events
    assert few.steps == fine.steps
    early = simulate(rig, 5.0, output_times=[0.0, 1.0])
    assert early["theta"].tolist() == fine["theta"][[0, 200]].tolist()
    assert len(early.events) > 4 and early.events == fine.events


def test_a_run_pauses_however_long_it_takes_to_the_next_output(monkeypatch: pytest.MonkeyPatch) -> None:
    """LuGre at 30 m/s: thousands of steps to the one output time; after every hundred an interrupt can come."""
    monkeypatch.setattr(whole_run, "ALLOWANCE", 100)
    fmu = Fmu.open(built("block_on_belt", laws={"belt": "lugre"}))
    calls: list[float] = []
    run = simulate(fmu, 0.01, inputs={"v_belt": 30.0}, output_times=[0.01], progress=calls.append)
    assert len(calls) == pytest.approx(run.steps / 100, abs=2)
    assert len(calls) > 10
    whole = simulate(fmu, 0.01, inputs={"v_belt": 30.0}, output_times=[0.01])
    assert whole["x"].tolist() == run["x"].tolist()


@pytest.mark.nightly
def test_what_would_take_hours_is_refused() -> None:
    """A law too stiff for the time asked for, and crossings that go on every 4e-9 s; each says its pace."""
    stiff = Fmu.open(built("block_on_belt", laws={"belt": "lugre"}))
    with pytest.raises(StickslipError, match=r"so stiff at t = .* would take 1e\+09 steps of 2e-08 s"):
        simulate(stiff, 20.0, inputs={"v_belt": 1e4})
    dense = Fmu.open(built("two_domain_oscillator"))
    fields = {"b1": 0.5, "b2": -0.5, "Q1": 0.0, "Q2": 0.0, "w1": 0.0, "w2": 0.0, "d": 0.0}
    with pytest.raises(StickslipError, match=r"contacts switch 2\.5e\+08 times per second .* ask for a shorter time"):
        simulate(dense, 20.0, parameters=fields, start={"v": 1e-9})
    assert len(simulate(dense, 1e-4, parameters=fields, start={"v": 1e-9}).events) == pytest.approx(25000, abs=2)


def test_events_that_speed_up_without_end_are_refused_early(tmp_path: Path) -> None:
    """Two belts push a mass to where they meet: damped, v falls like 1/n, and n grows exponentially with time."""
    m, F = Parameter("m", 1.0, "kg", "mass"), Parameter("F", 1.0, "N", "friction force of a belt")
    b, w = Parameter("b", 20.0, "N s/m", "damping"), Parameter("w", 5.0, "m/s", "speed of the belts")
    q = Coordinate("q", "m", "position", velocity="v")
    mechanism = Mechanism(
        name="two_belts",
        title="A mass between two belts",
        source="textbook",
        coordinates=[q],
        kinetic_energy=m * q.v**2 / 2,
        dissipation=b * q.v**2 / 2,
        contacts=[
            Friction(name="left", slip=q.v - w, law=Coulomb(F, sympy.S.One), where=-q),
            Friction(name="right", slip=q.v + w, law=Coulomb(F, sympy.S.One), where=q),
        ],
    )
    fmu = Fmu.open(quick_export(mechanism, tmp_path / "two_belts.fmu"))
    start = {"q": 0.0, "v": 1.0}
    assert len(simulate(fmu, 1.9, start=start).events) > 500
    with pytest.raises(
        StickslipError, match=r"switches ever faster at t = 2\.\d+: 8192 events, twice as many with every"
    ):
        simulate(fmu, 20.0, start=start)


def test_events_are_kept_as_an_array(rig: Fmu) -> None:
    events = simulate(rig, 20.0).events
    assert isinstance(events, Events) and events.rows.nbytes < 48 * len(events)
    assert [event.time for event in events] == events.rows["time"].tolist()
    assert events[0] == next(iter(events)) and events[-1] == list(events)[-1]
    assert events[2:5] == tuple(events)[2:5] and events != tuple(events)[1:]
    assert events == pickle.loads(pickle.dumps(events))
    with pytest.raises(IndexError):
        events[len(events)]


def test_variables_become_arrays_when_they_are_asked_for(rig: Fmu) -> None:
    run = simulate(rig, 2.0)
    names = [*rig.inputs, "theta", "omega", "der(theta)", "der(omega)", *rig.outputs, "disc0_state"]
    assert list(run.values) == names and len(run.values) == len(names) and "der(w0)" not in run.values
    # what is written into a column stays in it
    for name in ("theta", "disc0_state"):
        run[name][3] = 1
        assert run[name][3] == run.values[name][3] == 1 and run["theta"] is run.values["theta"]
    assert run["disc0_state"].dtype == np.int8 and all(run[name].dtype == float for name in names[:-1])
    copy = pickle.loads(pickle.dumps(run))
    assert all((copy[name] == run[name]).all() for name in names) and list(copy.values) == names
    with pytest.raises(StickslipError, match=r"no variable 'thata'\. Did you mean 'theta'"):
        run["thata"]


def test_a_run_can_be_continued(rig: Fmu) -> None:
    whole = simulate(rig, 4.0, output_times=[2.0, 4.0])
    start = {name: whole[name][0] for name in rig.states}
    rest = simulate(rig, 4.0, start_time=2.0, start=start, output_times=[4.0])
    assert rest["theta"][0] == pytest.approx(whole["theta"][1], abs=1e-12)


def test_values_at_an_event_are_those_after_it(rig: Fmu) -> None:
    event = simulate(rig, 5.0).events[0]
    run = simulate(rig, 5.0, output_times=[event.time])
    assert run["disc0_state"].tolist() == [event.after]


def test_repeated_output_times_repeat_the_row(rig: Fmu) -> None:
    run = simulate(rig, 1.0, output_times=[0.0, 0.0, 0.5, 0.5, 1.0])
    assert run["theta"][2] == run["theta"][3]


def test_the_slope_of_a_signal_is_the_rate_of_the_input(rig: Fmu) -> None:
    """In stick the body follows the drive: R omega' = r w', and the friction force carries J omega'."""
    ramp = Signal([0.0, 1.0], [0.2, 0.3])
    run = simulate(rig, 0.2, inputs={"w0": ramp}, start={"omega": 0.06 * 0.2 / 0.125})
    assert run["disc0_state"].tolist() == [0] * 1001
    assert run["w0"] == pytest.approx(0.2 + 0.1 * run.time, abs=1e-15)
    assert run["alpha"] == pytest.approx(np.full(1001, 0.06 * 0.1 / 0.125), rel=1e-13)
    force = (0.0548 * run["alpha"] + 0.055 * run["omega"] + 2.62 * run["theta"]) / 0.125
    assert run["F0"] == pytest.approx(force, rel=1e-12)


def test_a_jump_of_an_input_takes_effect_at_its_time(rig: Fmu) -> None:
    jump = Signal([0.0, 1.0, 1.0, 2.0], [0.5, 0.5, -5.0, -5.0])
    run = simulate(rig, 2.0, inputs={"w0": jump}, output_times=[0.999999, 1.0, 2.0])
    assert run["w0"].tolist() == [0.5, -5.0, -5.0]
    # the slip speed jumps through zero
    assert run["disc0_state"][1] == -1


def test_many_knots_are_passed(rig: Fmu) -> None:
    time = np.linspace(0, 5, 5001)
    steady = simulate(rig, 5.0, inputs={"w0": 0.7})
    chopped = simulate(rig, 5.0, inputs={"w0": Signal(time, np.full(time.size, 0.7))})
    assert chopped["theta"] == pytest.approx(steady["theta"], abs=1e-11)
    assert len(chopped.events) == len(steady.events)


def test_events_beyond_the_buffer_are_all_kept(rig: Fmu, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = simulate(rig, 60.0)
    monkeypatch.setattr(engine, "EVENT_CAPACITY", 1008)
    fractions: list[float] = []
    pieces = simulate(Fmu.open(rig.path), 60.0, progress=fractions.append)
    assert pieces.events == whole.events and len(whole.events) > 100
    assert np.array_equal(pieces["theta"], whole["theta"])
    assert fractions == sorted(fractions) and fractions[-1] == 1.0 and len(fractions) > len(whole.events) / 9


def test_both_versions_of_fmi_give_the_same_run(rig: Fmu) -> None:
    two = Fmu.open(built("disc_rig", contacts=["disc0"], fmi_version="2.0"))
    assert np.array_equal(simulate(two, 5.0)["theta"], simulate(rig, 5.0)["theta"])


BAD = [
    ({"parameters": {"JJ": 1.0}}, "no parameter 'JJ'. Did you mean 'J'?"),
    ({"inputs": {"w": 1.0}}, "no input 'w'. Did you mean 'w0'?"),
    ({"inputs": {"w0_rate": 1.0}}, "no input 'w0_rate'"),
    ({"start": {"thetta": 1.0}}, "no state 'thetta'. Did you mean 'theta'?"),
    ({"parameters": {"J": math.nan}}, "finite number, found nan"),
    ({"parameters": {"N0": -1.0}}, "at least 0.0 N, found -1"),
    ({"parameters": {"J": 0.0}}, "J"),
    ({"parameters": {"mu_k0": 0.9}}, "mu_k0 exceeds mu_s0"),
    ({"start": {"theta": math.inf}}, "finite number, found inf"),
    ({"inputs": {"w0": math.inf}}, "finite number"),
    ({"inputs": {"w0": "fast"}}, "finite number, found 'fast'"),
    ({"start_time": 2.0}, "must end after it starts"),
    ({"start_time": math.nan}, "must end after it starts"),
    ({"tolerance": 0.0}, "tolerance must be a positive number"),
    ({"output_times": [0.0, 0.5, 0.2]}, "ascending"),
    ({"output_times": [0.0, 1.5]}, "leave the run"),
    ({"output_times": []}, "list of numbers"),
    ({"output_times": [[0.0, 1.0]]}, "list of numbers"),
    ({"output_times": [0.0, math.nan]}, "finite"),
    ({"inputs": {"w0": Signal([0.1, 2.0], [1.0, 1.0])}}, "covers 0.1 s to 2 s"),
    ({"inputs": {"w0": Signal([0.0, 0.9], [1.0, 1.0])}}, "covers 0 s to 0.9 s"),
    ({"parameters": {"N0": Signal([0.0, 2.0], [1.0, 1.0])}}, "'N0' is a parameter and takes a number, found a Signal"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD)
def test_bad_input_is_answered(rig: Fmu, arguments: dict, message: str) -> None:
    with pytest.raises(StickslipError) as caught:
        simulate(rig, 1.0, **arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("time", "value", "message"),
    [
        ([0.0], [1.0], "at least two"),
        ([0.0, 1.0], [1.0], "one value per time"),
        ([[0.0, 1.0]], [[1.0, 1.0]], "shapes"),
        ([0.0, math.nan], [1.0, 1.0], "not finite"),
        ([0.0, 1.0], [1.0, math.inf], "not finite"),
        ([0.0, 2.0, 1.0], [1.0, 1.0, 1.0], "descend at row 2"),
    ],
)
def test_bad_signals(time: list, value: list, message: str) -> None:
    with pytest.raises(StickslipError, match=message):
        Signal(time, value)


@given(
    st.lists(st.integers(0, 20), min_size=2, max_size=8),
    st.lists(st.integers(0, 20), min_size=2, max_size=8),
    st.data(),
)
def test_the_table_of_knots_is_the_signals(a: list[int], b: list[int], data: st.DataObject) -> None:
    """Between knots every signal is its table's straight line."""
    signals = {}
    for name, times in (("a", a), ("b", b)):
        times = sorted([-1, 21, *times])
        values = data.draw(st.lists(st.integers(-5, 5), min_size=len(times), max_size=len(times)))
        signals[name] = Signal(times, values)
    times, values, slopes = knots(signals, 0.0, 20.0)
    assert times[0] == 0.0 and (np.diff(times) > 0).all()
    for t in np.arange(0.125, 20, 0.25):  # never at a knot, where a signal may jump
        row = np.searchsorted(times, t, side="right") - 1
        for column, signal in enumerate(signals.values()):
            expected = np.interp(t, signal.time, signal.value)
            assert values[row, column] + slopes[row, column] * (t - times[row]) == pytest.approx(expected, abs=1e-12)


def test_a_trajectory_is_written_and_read_back(rig: Fmu, tmp_path: Path) -> None:
    run = simulate(rig, 1.0)
    path = tmp_path / "run.csv"
    run.write_csv(path)
    with path.open(encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    assert header[0] == "time [s]" and "theta [rad]" in header and "disc0_state [1]" in header
    column = header.index("theta [rad]")
    assert [float(row[column]) for row in rows] == run["theta"].tolist()
    with pytest.raises(StickslipError, match="exists already"):
        run.write_csv(path)
    frame = run.frame
    assert frame.index.name == "time" and frame["theta"].tolist() == run["theta"].tolist()
    with pytest.raises(StickslipError, match="Did you mean 'theta'"):
        run["thetta"]
    assert run["time"] is run.time


def test_many_rows_take_little_more_than_their_array():
    fmu = Fmu.open(built("disc_rig"))
    times = np.linspace(0.0, 5.0, 50_000)
    few = simulate(fmu, 5.0, inputs={"w0": 0.83}, output_times=times[::100])
    tracemalloc.start()
    run = simulate(fmu, 5.0, inputs={"w0": 0.83}, output_times=times)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1.2 * 8 * len(run.values) * times.size
    assert all((run[name][::100] == few[name]).all() for name in few.values)
