"""A small log, and changes to the sidecar of its package."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from rig_io.logs.log import (
    EncoderCalibration,
    Experiment,
    InstrumentCalibrations,
    LaserCalibration,
    RigConstants,
    RigLog,
    StatedQuantity,
)

RIG = RigConstants(
    J=StatedQuantity(0.0548, "kg*m^2", 3e-4), R=StatedQuantity(0.125, "m", 5e-5), N0=StatedQuantity(4.905, "N")
)
CALIBRATION = InstrumentCalibrations(LaserCalibration(0.01, 5.0, lowest=0.0, highest=10.0), EncoderCalibration(1000))


def a_log(samples: int = 50, name: str = "a") -> RigLog:
    """A log whose encoder passes an edge at every tick."""
    time = 0.001 * np.arange(samples)
    columns = {
        "laser": 5.0 + np.round(np.sin(40 * time), 3),
        "encoder_count": 7.0 - np.arange(samples),
        "encoder_edge_time": np.round(time - 4e-4, 6),
    }
    return RigLog(name, time, columns, {}, RIG, CALIBRATION, Experiment(drive_speed=(0.83,)))


def edit_sidecar(package: Path, edit) -> None:
    """Change the sidecar in place by a function of its content."""
    sidecar = package / "datapackage.json"
    content = json.loads(sidecar.read_text())
    edit(content)
    sidecar.write_text(json.dumps(content))
