"""Derivatives of whole runs against differences of tight runs; kept runs, and those over one window, among them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from close_columns import close
from lazy_fmu import LazyFmu
from steady_cycle import disc_rig

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun, Sensitivity
from fmu_models.simulation.signal import Signal

pytestmark = pytest.mark.digits

RIG_ON_ONE = LazyFmu("disc_rig", contacts=("disc0",))


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """A run to be compared with differences; ``by`` gives the step of each."""

    fmu: Callable[[], Fmu]
    stop: float
    by: Mapping[str, float]
    recorded: list[str]
    start: Mapping[str, float] = dataclasses.field(default_factory=dict)
    parameters: Mapping[str, float] = dataclasses.field(default_factory=dict)
    inputs: Mapping[str, float | Signal] = dataclasses.field(default_factory=dict)

    def moved(self, name: str, step: float) -> dict[str, Any]:
        """Arguments of a run with one of them moved."""
        fmu = self.fmu()
        start, parameters, inputs = dict(self.start), dict(self.parameters), dict(self.inputs)
        into: dict[str, Any] = start if name in fmu.states else parameters if name in fmu.parameters else inputs
        value = into.get(name, float(fmu.variables[name].start or 0))
        into[name] = Signal(value.time, value.value + step) if isinstance(value, Signal) else value + step
        return {"start": start, "parameters": parameters, "inputs": inputs}

    def differences(self, name: str, times: np.ndarray) -> tuple[np.ndarray, list[float]]:
        """Fourth-order differences (n, n_recorded) of tight runs, and those of the times of events."""
        step, values, events = self.by[name], 0.0, 0.0
        for factor, weight in ((1, 8), (-1, -8), (2, -1), (-2, 1)):
            run = simulate(
                self.fmu(), self.stop, output_times=times, tolerance=1e-15, **self.moved(name, factor * step)
            )
            values = values + weight * np.stack([run[n] for n in self.recorded], axis=1) / (12 * step)
            events = events + weight * np.array([event.time for event in run.events]) / (12 * step)
        return np.asarray(values), list(np.atleast_1d(events))


def ripple(mean: float, stop: float, *, jump: float = 0.0) -> Signal:
    """A drive with once per revolution and eighth harmonic, a knot every 20 ms; half way it may jump."""
    time = np.arange(0.0, stop + 0.03, 0.02)
    value = mean * (1 + 0.004 * np.sin(mean * time) + 0.001 * np.sin(8 * mean * time))
    half = time.size // 2
    time, value = np.insert(time, half, time[half]), np.insert(value, half, value[half])
    return Signal(time, value + jump * (np.arange(time.size) > half))


def lugre() -> Fmu:
    return Fmu.open(built("disc_rig", contacts=("disc0",), laws={"disc0": "lugre"}))


FRICTION = {"mu_s0": 1e-5, "mu_k0": 1e-5, "p0": 1e-3}
BODY = {"theta": 1e-6, "omega": 1e-5, "k": 1e-4, "c": 1e-5, "J": 1e-6}
CASES = {
    "one disc": Case(
        lambda: RIG_ON_ONE,
        3.0,
        {**FRICTION, **BODY, "w0": 1e-5},
        ["theta", "omega", "F0", "alpha"],
        {"theta": 0.05},
        inputs={"w0": ripple(0.41, 3.0)},
    ),
    "one disc, a drive that jumps": Case(
        lambda: RIG_ON_ONE,
        2.0,
        {**FRICTION, **BODY, "w0": 1e-5},
        ["theta", "omega"],
        {"theta": 0.05},
        inputs={"w0": ripple(0.83, 2.0, jump=-0.3)},
    ),
    "two discs": Case(
        lambda: disc_rig(("disc0", "disc1")),
        2.5,
        {**FRICTION, "mu_s1": 1e-5, "p1": 1e-3, **BODY, "w0": 1e-5, "w1": 1e-5},
        ["theta", "omega", "F0", "F1"],
        {"theta": 0.05},
        inputs={"w0": 1.4, "w1": ripple(0.83, 2.5)},
    ),
    "two discs in turn": Case(
        lambda: Fmu.open(built("disc_rig_sequential")),
        2.5,
        {"theta_s": 1e-6, **FRICTION, "mu_s1": 1e-5, "mu_k1": 1e-5, **BODY, "w1": 1e-5},
        ["theta", "omega"],
        {"theta": 0.0},
        {"N0": 5.5, "N1": 5.5, "mu_s0": 0.5, "mu_k0": 0.33, "p0": 20.0, "mu_s1": 0.5, "mu_k1": 0.33, "p1": 20.0},
    ),
    "bristles": Case(
        lugre,
        1.5,
        {"mu_s0": 1e-5, "p0": 1e-3, "theta": 1e-6, "c": 1e-5, "sigma00": 1.0, "sigma10": 1e-2, "z0": 1e-9, "w0": 1e-5},
        ["theta", "omega", "z0", "F0"],
        {"theta": 0.05},
        {"sigma00": 5e4, "sigma10": 100.0},
        {"w0": ripple(0.41, 1.5)},
    ),
    "a support that relaxes": Case(
        lambda: Fmu.open(built("discontinuous_support")),
        8.0,
        {name: 1e-4 for name in ("x", "v", "k", "c", "f0", "omega", "ks", "cs", "g")},
        ["x", "v"],
    ),
    "a shaken table": Case(
        lambda: Fmu.open(built("bouncing_ball")),
        0.45,
        {"x": 1e-7, "v": 1e-6, "A": 1e-7, "omega": 1e-4, "phi0": 1e-5, "e": 1e-5, "g": 1e-4},
        ["x", "v", "gap"],
    ),
}


@pytest.mark.nightly_for("two discs in turn", "two discs", "a shaken table", "a support that relaxes", "bristles")
@pytest.mark.parametrize("case", CASES.values(), ids=list(CASES))
def test_runs_agree_with_differences(case):
    """Values, their derivatives and those of the times of events; the differences are good to 1e-7 or so."""
    times = np.linspace(0.0, case.stop, 301)
    with SensitiveRun(case.fmu(), by=list(case.by), recorded=case.recorded) as kept:
        found = kept.run(times, start=case.start, parameters=case.parameters, inputs=case.inputs)
    plain = simulate(
        case.fmu(), case.stop, output_times=times, start=case.start, parameters=case.parameters, inputs=case.inputs
    )
    assert len(found.events) == len(plain.events) >= 4
    assert [event.after for event in found.events] == [event.after for event in plain.events]
    assert close(found.values, np.stack([plain[name] for name in case.recorded], axis=1), 1e-10)
    # what is before an event in one run and after it in another has no difference
    at = np.array([event.time for event in found.events])
    apart = np.abs(times[:, None] - at).min(axis=1) > 1e-4
    for k, name in enumerate(case.by):
        rough, rough_events = case.differences(name, times)
        assert close(found.derivative[apart, :, k], rough[apart], 1e-6), name
        assert close(found.event_derivative[:, k], rough_events, 1e-6), name


def same(one: Sensitivity, other: Sensitivity) -> bool:
    """Whether two runs are the same to the last bit."""
    arrays = ("time", "values", "derivative", "event_derivative")
    return one.events == other.events and all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in arrays
    )


def test_a_kept_instance_forgets_the_run_before(monkeypatch):
    """A run after others, one of which failed, is that of a new instance; so is one made in pieces."""
    fmu, by, times = RIG_ON_ONE, ["theta", "mu_s0", "w0"], np.arange(0.0, 2.0, 0.001)
    run = {"start": {"theta": 0.05}, "inputs": {"w0": ripple(0.41, 2.0)}}
    with SensitiveRun(fmu, by=by, recorded=["theta", "omega", "F0"]) as new:
        first = new.run(times, **run)
        other = new.run(times[:700] + 1.0, start_time=0.9, parameters={"mu_s0": 0.5, "N0": 3.0}, inputs={"w0": 0.83})
        with pytest.raises(StickslipError, match="mu_k0 exceeds mu_s0"):
            new.run([1.0], parameters={"mu_k0": 0.7})
        again = new.run(times, **run)
    assert len(first.events) >= 4 and not np.array_equal(first.values[:700], other.values)
    assert same(first, again)
    monkeypatch.setattr(whole_run, "ALLOWANCE", 48)
    with SensitiveRun(fmu, by=by, recorded=["theta", "omega", "F0"]) as pieces:
        assert same(first, pieces.run(times, **run))


def test_runs_over_one_window_are_those_made_alone():
    """With derivatives and without, also when one of them is refused."""
    times, inputs = np.arange(0.0, 2.0, 0.01), {"w0": ripple(0.41, 2.0)}
    start, recorded = {"theta": 0.05}, ["theta", "omega"]
    with SensitiveRun(RIG_ON_ONE, by=["theta", "mu_s0"], recorded=recorded) as kept:
        window = kept.window(times, inputs=inputs)
        for values in ({"mu_s0": 0.5}, {"mu_s0": 0.6}):
            plain = simulate(RIG_ON_ONE, 1.99, parameters=values, start=start, inputs=inputs, output_times=times)
            seen, events = kept.values(window, values, start)
            assert np.array_equal(seen, np.column_stack([plain[name] for name in recorded]))
            assert events == plain.events and len(events) >= 4
            assert same(
                kept.over(window, values, start), kept.run(times, parameters=values, start=start, inputs=inputs)
            )
            with pytest.raises(StickslipError, match="mu_k0 exceeds mu_s0"):
                kept.values(window, {"mu_k0": 0.7}, start)
