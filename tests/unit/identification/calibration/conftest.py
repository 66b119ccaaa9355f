"""One calibration that all tests of calibrations share."""

from __future__ import annotations

import pytest
from noisy_belt import FREE, OFF, noisy

from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
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
