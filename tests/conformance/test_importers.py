"""fmpy simulates every FMU in both ways of its version, and agrees with the native run."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Trajectory

STOP = 5.0
INTERVAL = 1 / 512  # exact in binary: output times of both sides agree to the last digit


@pytest.fixture(scope="module")
def stop(fmu: Fmu) -> float:
    """End of the runs, s; later where nothing happens before."""
    return STOP if simulate(fmu, STOP).events or not fmu.contacts else 4 * STOP


@pytest.fixture(scope="module")
def native(fmu: Fmu, stop: float) -> Trajectory:
    return simulate(fmu, stop, output_times=np.arange(0, stop + INTERVAL / 2, INTERVAL))


def changes(found: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Contact states without repetitions: a bounce changes none."""
    return [found[0], *(after for before, after in pairwise(found) if after != before)]


def sequence(fmu: Fmu, result: np.ndarray | Trajectory) -> list[tuple[int, ...]]:
    """Contact states at the output times of a result, in the order in which they occur."""
    columns = [np.asarray(result[f"{name}_state"]).astype(int).tolist() for name in fmu.contacts]
    return changes(list(zip(*columns, strict=True)) or [()])


def native_sequence(fmu: Fmu, native: Trajectory) -> list[tuple[int, ...]]:
    """The same from the events of a run, however close; events at one instant count once."""
    state = {name: int(native[f"{name}_state"][0]) for name in fmu.contacts}
    found, time = [tuple(state.values())], -1.0
    for event in native.events:
        state[event.contact] = event.after
        if event.time == time:
            found.pop()
        found.append(tuple(state.values()))
        time = event.time
    return changes(found)


@pytest.mark.parametrize("interface", ["ModelExchange", "CoSimulation"])
def test_fmpy_agrees_with_the_native_run(path: Path, fmu: Fmu, native: Trajectory, stop: float, interface: str) -> None:
    names = [*fmu.states, *(f"{name}_state" for name in fmu.contacts)]
    # an impact multiplies the error of its time by the jump of the velocity
    cvode = 1e-10 if fmu.impacts else 1e-8
    result = simulate_fmu(
        str(path), fmi_type=interface, stop_time=stop, relative_tolerance=cvode, output_interval=INTERVAL, output=names
    )
    assert len(native.events) > 0 or not fmu.contacts
    for name in fmu.states:
        # at the time of an event fmpy records the state before and after it
        at = np.searchsorted(result["time"], native.time - 1e-9)
        assert np.allclose(result["time"][at], native.time, atol=1e-9)
        # CVode's absolute tolerance is relative to the nominal value
        scale = max(float(fmu.variables[name].nominal or 1.0), np.abs(native[name]).max())
        # CVode keeps a global error well below this over 5 s; Co-Simulation runs our engine, from one communication
        # point to the next: impacts enlarge what that rounds
        own = 1e-10 if fmu.impacts else 1e-11
        tolerance = 1e-5 if interface == "ModelExchange" else own
        assert np.abs(result[name][at] - native[name]).max() < tolerance * scale, name
    if interface == "ModelExchange":
        assert sequence(fmu, result) == native_sequence(fmu, native)
    else:
        assert sequence(fmu, result) == sequence(fmu, native)


def test_step_length_of_co_simulation_does_not_matter(path: Path, fmu: Fmu, native: Trajectory, stop: float) -> None:
    result = simulate_fmu(str(path), fmi_type="CoSimulation", stop_time=stop, output_interval=1.25, output=fmu.states)
    for name in fmu.states:
        scale = np.abs(native[name]).max()
        assert result[name][-1] == pytest.approx(native[name][-1], abs=1e-10 * scale)


def test_events_end_steps_early_in_event_mode(path: Path, fmu: Fmu, native: Trajectory, stop: float) -> None:
    if fmu.fmi == 2:
        pytest.skip("FMI 2.0 has no event mode in Co-Simulation")
    names = [f"{name}_state" for name in fmu.contacts]
    result = simulate_fmu(
        str(path),
        fmi_type="CoSimulation",
        stop_time=stop,
        output_interval=0.5,
        output=names,
        use_event_mode=True,
        early_return_allowed=True,
    )
    times = sorted({event.time for event in native.events})
    regular = np.arange(0, stop + 0.25, 0.5)
    extra = [t for t in np.unique(result["time"]) if np.abs(regular - t).min() > 1e-12]
    # both sides solve the same polynomials but cut their steps at other places
    assert extra == pytest.approx(times, abs=1e-9)
    assert sequence(fmu, result) == native_sequence(fmu, native)


@pytest.mark.parametrize("interface", ["ModelExchange", "CoSimulation"])
def test_inputs_that_move_agree_too(path: Path, fmu: Fmu, interface: str) -> None:
    """fmpy interpolates the inputs and their rates; the native run takes the slopes of the signals."""
    base = [float(fmu.variables[name].start or 0.0) for name in fmu.inputs]
    times, factors = np.array([0.0, 2.0, 2.0, 4.0]), np.array([1.0, 1.2, 1.2, 0.9])
    rates = np.array([0.1, 0.1, -0.15, -0.15])
    names = [*fmu.inputs, *(f"{name}_rate" for name in fmu.inputs)]
    table = np.zeros(4, dtype=[("time", "f8"), *((name, "f8") for name in names)])
    table["time"] = times
    for name, value in zip(fmu.inputs, base, strict=True):
        table[name], table[f"{name}_rate"] = value * factors, value * rates
    signals = {name: Signal(times, table[name]) for name in fmu.inputs}
    native = simulate(fmu, 4.0, inputs=signals, output_times=[4.0])
    result = simulate_fmu(
        str(path),
        fmi_type=interface,
        stop_time=4.0,
        relative_tolerance=1e-9,
        output_interval=1 / 64,
        input=table,
        output=fmu.states,
    )
    for name in fmu.states:
        # a release grows from zero acceleration, so CVode's error in its time counts more where inputs move: 3e-5 here,
        # shrinking with its tolerance; in Co-Simulation the interpolated inputs are rounded at every step
        # fmpy holds inputs over a step of CVode: a model that they push directly (the drive) is off by their change
        exchanged = 3e-3 if fmu.description.modelName == "drive_motor" else 1e-4
        tolerance = exchanged if interface == "ModelExchange" else 1e-10
        scale = max(1.0, float(fmu.variables[name].nominal or 1.0))
        assert result[name][-1] == pytest.approx(native[name][0], abs=tolerance * scale), name
