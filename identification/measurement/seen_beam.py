"""What the laser sees, as the encoder beside it tells: not always what the logs are described with.

    angle_edge = angle + a (angle' - angle) + gain, delay and offsets as in `disc_motion`

angle by the beam that is described, angle' by another: a is 0 where the first is right, 1 where the other is. A tilt
shows as a square of the angle in place of that; which it is decides n ln S, S the sum of squares, n the number of
lines, whose errors are the noise, plus what is known beforehand of a tilt: (square / its deviation)^2.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.inference.uncertainty import clustered_covariance
from identification.measurement.disc_motion import GAIN_SUSPECT, edge_equations, with_lines
from identification.measurement.motion import DiscMotion
from rig_io.logs.beam import BEAMS
from rig_io.logs.log import LaserCalibration, RigLog

SURE = 4.0  # standard deviations of a
NEAR = 0.25  # of a from 1, beside two deviations
SQUARE = 0.02  # 1/rad, deviation of a square beforehand: a tilt of two degrees


def seen_beam(motions: Sequence[DiscMotion], window: float) -> str:
    """Name of the beam with which laser and encoder agree, where it is not that of the calibration; "" where that is
    right, nothing tells, a tilt explains as much, or their gains are apart by more than beams differ. window: s,
    smoothing."""
    usable = with_lines(motions, window)
    if not usable:
        return ""
    equations, laser = edge_equations(usable, window), usable[0].log.calibration.need("laser")
    seen = np.arctan(equations.design[:, 0])

    def with_column(column: np.ndarray) -> tuple[float, float, float, float]:
        """Sum of squares with one more column (n,), its coefficient and deviation, and the gain beside it."""
        design = np.column_stack([column, equations.design])
        solution = np.linalg.lstsq(design, equations.edge, rcond=None)[0]
        residual = design @ solution - equations.edge
        deviation = np.sqrt(clustered_covariance(design, residual, equations.line)[0, 0])
        return float(residual @ residual), float(solution[0]), float(deviation), float(solution[1])

    lines, match = len(np.unique(equations.line)), ""
    left, square, _, _ = with_column(seen**2 / np.cos(seen))
    least = left * np.exp((square / SQUARE) ** 2 / lines)
    for name in BEAMS:
        column = replace(laser, beam=name).angle(laser.shown(seen)) - seen
        if name == laser.beam or not np.isfinite(column).all():
            continue
        left, share, deviation, gain = with_column(column)
        whole = share > SURE * deviation and abs(share - 1) < NEAR + 2 * deviation
        if whole and left < least and abs(gain) < GAIN_SUSPECT:
            least, match = left, name
    return match


def with_beam(log: RigLog, beam: str) -> RigLog:
    """The log with another beam than it is described with."""
    laser = log.calibration.laser
    seen = None if laser is None else replace(laser, beam=beam)
    return replace(log, calibration=replace(log.calibration, laser=seen))


def beam_words(laser: LaserCalibration, beam: str) -> str:
    """What to say of it. laser: as it was described."""
    return (
        f"Against the encoder {replace(laser, beam=beam).words}, not d = {BEAMS[laser.beam].formula} as described: "
        f"taken so. Describe the logs with laser_beam={beam}."
    )
