"""Logs of the bench of `tests/oracle`, as ours would be read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from oracle.bench import Bench, Drive, Ruling, free_decay, slips_and_sticks

from rig_io.logs.columns import COLUMNS
from rig_io.logs.log import (
    EncoderCalibration,
    Experiment,
    InstrumentCalibrations,
    LaserCalibration,
    RigConstants,
    RigLog,
    StatedQuantity,
)

STATED = {
    "J": StatedQuantity(0.0548, "kg*m^2", 3e-4),
    "k": StatedQuantity(2.62, "N*m/rad", 0.015),
    "c": StatedQuantity(0.055, "N*m*s/rad", 1e-3),
    "R": StatedQuantity(0.125, "m", 5e-5),
    "r": StatedQuantity(0.06, "m", 5e-5),
    "N": StatedQuantity(4.905, "N", 5e-3),
}
NOISE, STEP = 20e-6, 10e-6  # m, of the laser
SET = 4e-3  # relative deviation of a drive's speed that is set and not recorded
RIG = RigConstants(**{{"N": "N0"}.get(name, name): quantity for name, quantity in STATED.items()})


def with_drawn_constants(bench: Bench, rng: np.random.Generator) -> Bench:
    """The bench with constants that differ from what is stated as the stated uncertainties say."""
    drawn = {
        name: quantity.value + (quantity.standard_uncertainty or 0.0) * float(rng.standard_normal())
        for name, quantity in STATED.items()
    }
    return replace(bench, **drawn)


@dataclass(frozen=True)
class Faults:
    """Of instruments. drive, body: (angle) -> what its encoder shows too much, rad; laser: (time, angle of the body) ->
    what it shows too much over R; late: time -> by how much the laser is, s; lost: times at which the body's encoder
    loses a count, s; without: instruments that there are not: "encoder", "laser", "drive" (of which the speed is known
    to `SET`)."""

    drive: Callable[[np.ndarray], np.ndarray] = np.zeros_like
    body: Callable[[np.ndarray], np.ndarray] = np.zeros_like
    late: Callable[[np.ndarray], np.ndarray] = np.zeros_like
    without: str = ""
    laser: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda time, angle: 0 * time
    lost: tuple[float, ...] = ()


def foreign_logs(
    bench: Bench,
    seed: int,
    speeds: Sequence[float] = (0.41, 0.83, 1.4),
    duration: float = 10.0,
    faults: Faults | None = None,
) -> list[RigLog]:
    """A log for each drive speed in rad/s, and a free decay."""
    faults = faults or Faults()
    rng = np.random.default_rng(seed)
    body, shaft, gain = Ruling(rng), Ruling(rng), 1 + 0.002 * rng.standard_normal()
    without, speeds_set = tuple(faults.without.split()), np.random.default_rng([seed, 1])
    ticks = np.round(np.arange(round(1000 * duration) + 1) / 1000, 9)
    logs = []
    for number, speed in enumerate((*speeds, None)):
        columns: dict[str, np.ndarray] = {}
        if speed is None:
            time, angle = free_decay(bench, duration + 0.2)
            experiment = Experiment("free-decay", contacts=())
        else:
            drive = Drive(bench, speed, duration + 0.2, rng)
            time, angle = slips_and_sticks(bench, drive, duration + 0.2, number)
            edges = shaft.read(drive.time, drive.angle + faults.drive(drive.angle), ticks)
            columns |= dict(zip(("drive0_count", "drive0_edge_time"), edges, strict=True))
            nominal = speed / (1 + SET * float(speeds_set.standard_normal()))
            experiment = Experiment(
                drive_speed=(speed if "drive" not in faults.without else nominal,),
                drive_speed_uncertainty=(SET * abs(nominal),) if "drive" in faults.without else (),
            )
        turned = np.interp(ticks - faults.late(ticks), time, angle)
        shown = gain * bench.R * (np.sin(turned) + faults.laser(ticks, turned)) + NOISE * rng.standard_normal(
            len(ticks)
        )
        columns |= {"laser": np.round(5 + STEP * np.round(shown / STEP) / 0.01, 9)}
        edges = body.read(time, angle + faults.body(angle), ticks)
        columns |= dict(zip(("encoder_count", "encoder_edge_time"), edges, strict=True))
        columns["encoder_count"] = columns["encoder_count"] - np.searchsorted(faults.lost, ticks)
        columns = {name: column for name, column in columns.items() if not name.startswith(without)}
        calibration = InstrumentCalibrations(
            LaserCalibration(0.01, 5.0, 0.0, NOISE, 0.0, 10.0, gain_deviation=0.002 if "encoder" in without else None),
            EncoderCalibration(1000),
            None if speed is None else EncoderCalibration(1000),
        )
        units = {name: COLUMNS[name].unit for name in ("time", *columns)}
        name = "decay" if speed is None else f"log-{speed:g}"
        logs.append(RigLog(name, ticks, columns, units, RIG, calibration, experiment))
    return logs
