"""Logs of a bench as points beside the motions of a scene, which has its own values: nothing is fitted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.scene.kinds.kind import Row
from fmu_models.scene.scene import Scene
from identification.measurement.motion import SMOOTHING
from identification.model_check.processing import measured_motions
from rig_io.logs.log import RigLog

PERIODS, POINTS = 5, 300  # natural periods at the end of a log that are shown; points of them
SAME = 0.02  # relative: a log's speed is the scene's


@dataclass(frozen=True, eq=False)
class BenchPoints:
    """Points of one log.

    Attributes:
        at: speed of the drive that the scene varies, rad/s.
        log: its name.
        angle, speed: (n,) rad, rad/s.
        distance: of the points from the scene's motion, the root of their mean square, in its half range.
    """

    at: float
    log: str
    angle: np.ndarray
    speed: np.ndarray
    distance: float


def bench_points(scene: Scene, rows: Sequence[Row], logs: Sequence[RigLog]) -> list[BenchPoints | None]:
    """What logs show beside each row of a scene that varies a drive; None where no log is of its speed. StickslipError:
    a scene that varies no drive or whose rows are no motions, logs of none of its speeds, and as
    ``measured_motions``."""
    over = scene.compute.over
    if over not in scene.drives or any(row.trajectory is None for row in rows):
        raise StickslipError(
            f"{scene.path}: points of a bench stand beside motions at speeds of a drive, as kind 'cycle'."
        )
    rig = logs[0].rig
    if rig.J is None or rig.k is None:
        raise StickslipError(
            "The logs do not state J and k of their rig, which say how the angle is smoothed. State them."
        )
    period = float(2.0 * np.pi * np.sqrt(rig.J.value / rig.k.value))
    motions = [motion for family in measured_motions(logs, period).values() for motion in family]
    disc = int(str(over)[-1])
    speeds = np.array([dict(enumerate(motion.log.experiment.drive_speed)).get(disc, np.inf) for motion in motions])
    points: list[BenchPoints | None] = []
    for row in rows:
        at, run = float(row.at or 0.0), row.trajectory
        assert run is not None
        nearest = int(np.argmin(np.abs(speeds - at)))
        if abs(speeds[nearest] - at) > SAME * abs(at):
            points.append(None)
            continue
        motion, window = motions[nearest], SMOOTHING * period
        last = np.linspace(motion.time[-1] - PERIODS * period, motion.time[-1] - window, POINTS)
        angle, speed = (np.interp(last, motion.time, motion.smoothed(window, derivative=d)) for d in (0, 1))
        half = [0.5 * np.ptp(run[name]) or 1.0 for name in ("theta", "omega")]
        away = [
            (x[:, None] - run[name]) / h for x, name, h in zip((angle, speed), ("theta", "omega"), half, strict=True)
        ]
        nearest_square = (away[0] ** 2 + away[1] ** 2).min(axis=1)
        points.append(BenchPoints(at, motion.log.name, angle, speed, float(np.sqrt(nearest_square.mean()))))
    if not any(points):
        raise StickslipError(
            f"No log is of a speed of {scene.name}, {over} = {', '.join(f'{row.at:g}' for row in rows)}."
        )
    return points
