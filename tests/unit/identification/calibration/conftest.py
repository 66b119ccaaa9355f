"""A calibration and a drift that several tests share."""

from __future__ import annotations

import numpy as np
import pytest
from noisy_belt import FREE, OFF, noisy

from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate
from identification.calibration.calibrate import calibrate
from identification.calibration.result import Calibration


@pytest.fixture(scope="session")
def belt() -> Fmu:
    return load("forced_stick_slip")


@pytest.fixture(scope="session")
def found(belt: Fmu) -> Calibration:
    """From half off, with a log held out."""
    return calibrate(
        "forced_stick_slip", noisy(belt, 3), free=FREE, parameters=OFF, held_out=[noisy(belt, 4, 40.0, 401)]
    )


@pytest.fixture(scope="session")
def drifting(belt: Fmu) -> dict[str, np.ndarray]:
    """Places and speeds while the breakaway force grows by a fifth, piece by piece of 1 s."""
    time = np.linspace(0, 60.0, 601)
    columns = {"x": np.zeros(601), "v": np.zeros(601)}
    start: dict[str, float] = {}
    for part in np.split(np.arange(600), 60):
        rows = [*part, part[-1] + 1]
        force = {"a0": 1.5 * (1 + 0.2 * float(time[rows].mean()) / 60.0)}
        run = simulate(
            belt,
            float(time[rows[-1]]),
            start_time=float(time[rows[0]]),
            output_times=time[rows],
            parameters=force,
            start=start,
        )
        for name, values in columns.items():
            values[rows] = run[name]
        start = {name: float(run[name][-1]) for name in columns}
    return {"time": time, **columns}
