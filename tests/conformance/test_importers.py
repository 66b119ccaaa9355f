"""fmpy takes inputs, long steps and events as the native run does; that the motions are the same, the farm judges."""

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
COARSE, FINE = 1e-8, 1e-10  # relative tolerances of CVode


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


def sampled(fmu: Fmu, result: np.ndarray | Trajectory, times: np.ndarray) -> np.ndarray:
    """(n_states, n_times) of a result in nominal values, which CVode's absolute tolerance is relative to."""
    # at the time of an event fmpy records the state before and after it
    found = result.time if isinstance(result, Trajectory) else result["time"]
    at = np.searchsorted(found, times - 1e-9)
    assert np.allclose(found[at], times, atol=1e-9)
    nominal = [float(fmu.variables[name].nominal or 1.0) for name in fmu.states]
    return np.array([result[name][at] / size for name, size in zip(fmu.states, nominal, strict=True)])


def assert_converging(coarse: np.ndarray, fine: np.ndarray, native: np.ndarray) -> None:
    """The finer of two runs by another solver is nearer to ours than half its distance to the coarser one.

    Between them lies a factor of 100 in CVode's tolerance and, where inputs move, of 16 in the interval over which
    fmpy holds them. The error of a hold falls as the interval, that of smooth motion as the tolerance or nearly so, and
    that of a release, whose slip grows from zero acceleration, as its root: each by ten at least, so that the finer run
    of a right model is off by a ninth of the distance or less. What is beyond rounding of some thousand steps counts.
    """
    size = np.maximum(1.0, np.abs(native).max(axis=1, keepdims=True))
    off, distance = (np.abs((fine - other) / size).max() for other in (native, coarse))
    assert off < 0.5 * distance + 1e-12


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
    grid = np.arange(0.0, 4.0 + 1 / 128, 1 / 64)
    native = simulate(fmu, 4.0, inputs=signals, output_times=grid)

    def by_fmpy(tolerance: float, interval: float) -> np.ndarray:
        result = simulate_fmu(
            str(path),
            fmi_type=interface,
            stop_time=4.0,
            relative_tolerance=tolerance,
            output_interval=interval,
            input=table,
            output=fmu.states,
        )
        return sampled(fmu, result, grid)

    expected = sampled(fmu, native, grid)
    if interface == "ModelExchange":
        assert_converging(by_fmpy(COARSE, 1 / 64), by_fmpy(FINE, 1 / 1024), expected)
    else:
        # the interpolated inputs are rounded at every step
        size = np.maximum(1.0, np.abs(expected).max(axis=1, keepdims=True))
        assert np.abs((by_fmpy(FINE, 1 / 64) - expected) / size).max() < 1e-10
