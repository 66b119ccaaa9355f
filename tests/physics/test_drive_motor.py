"""The drive of a disc against the closed form of its critically damped answer."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.codegen.package import built
from fmu_models.simulation.fmu import Fmu
from fmu_models.simulation.system import simulate


def test_the_speed_droops_critically_damped():
    motor = Fmu.open(built("drive_motor"))
    K, T, r, F = 2.0, 0.05, 0.06, 3.0
    run = simulate(motor, 0.5, parameters={"K": K, "T": T, "r": r}, inputs={"w_set": 0.83, "F": F}, start={"w": 0.83})
    expected = 0.83 - r * F / K * (1 - (1 + run.time / T) * np.exp(-run.time / T))
    assert run["speed"] == pytest.approx(expected, abs=1e-13)
    assert run["acceleration"] == pytest.approx(-r * F / K * run.time / T**2 * np.exp(-run.time / T), abs=1e-11)
