"""The drive of a disc against the closed form of its critically damped answer."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal


def test_the_speed_droops_critically_damped():
    motor = Fmu.open(built("drive_motor"))
    K, T, r, F = 2.0, 0.05, 0.06, 3.0
    run = simulate(motor, 0.5, parameters={"K": K, "T": T, "r": r}, inputs={"w_set": 0.83, "F": F}, start={"w": 0.83})
    expected = 0.83 - r * F / K * (1 - (1 + run.time / T) * np.exp(-run.time / T))
    assert run["speed"] == pytest.approx(expected, abs=1e-13)
    assert run["acceleration"] == pytest.approx(-r * F / K * run.time / T**2 * np.exp(-run.time / T), abs=1e-11)


def test_the_speed_follows_a_ramp_with_its_lag():
    motor = Fmu.open(built("drive_motor"))
    T, rate = 0.05, 0.2
    knots = np.array([0.0, 0.5, 1.5, 2.0])
    ramp = Signal(knots, 0.5 + knots * rate)
    run = simulate(motor, 2.0, parameters={"T": T}, inputs={"w_set": ramp, "F": 0.0}, start={"w": 0.5})
    assert run["w_set"] == pytest.approx(0.5 + run.time * rate, abs=1e-15)
    assert run["speed"][-1] == pytest.approx(0.5 + rate * (2.0 - 2.0 * T), abs=1e-12)


def test_each_input_follows_its_own_signal():
    motor = Fmu.open(built("drive_motor"))
    speed, force = Signal([0.0, 1.0, 2.0], [0.5, 0.6, 0.5]), Signal([0.0, 0.5, 2.0], [0.0, 3.0, 1.0])
    run = simulate(motor, 2.0, inputs={"w_set": speed, "F": force})
    for name, signal in (("w_set", speed), ("F", force)):
        assert run[name] == pytest.approx(np.interp(run.time, signal.time, signal.value), abs=1e-14)
