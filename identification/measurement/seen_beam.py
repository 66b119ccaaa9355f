"""What the laser sees, as the encoder beside it tells: not always what the logs are described with.

    angle_edge = angle + a (angle' - angle) + gain, delay and offsets as in `disc_motion`

angle by the beam that is described, angle' by another: a is 0 where the first is right, 1 where the other is. A tilt
shows as a square of the angle in place of that. Which it is decides

    -2 ln L = n ln S + ((a - 1) / its deviation)^2    or    n ln S + (square / its deviation beforehand)^2

S the sum of squares beside a or the square, n the number of lines, whose errors are the noise. Beams differ by cubes of
the angle above all, so that S is much the same for each, and what a is tells them.
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
NEAR = 0.125  # deviation of a by what else bends a little, beside that of the lines
SQUARE = 0.02  # 1/rad, deviation of a square beforehand: a tilt of two degrees
MARGIN = 6.0  # of 2 ln L: one that is worth less by no more than this is not told from the best
TILT = "tilt"


def seen_beam(motions: Sequence[DiscMotion], window: float) -> tuple[str, ...]:
    """Name of the beam with which laser and encoder agree, where it is not that of the calibration, and after it those
    that they do not tell from it, a `TILT` among them; nothing where the calibration is right, nothing tells, a tilt
    explains more, or their gains are apart by more than beams differ. window: s, smoothing."""
    usable = with_lines(motions, window)
    if not usable:
        return ()
    equations, laser = edge_equations(usable, window), usable[0].log.calibration.need("laser")
    seen, lines = np.arctan(equations.design[:, 0]), len(np.unique(equations.line))

    def with_column(column: np.ndarray) -> tuple[float, float, float, float]:
        """n ln S with one more column (n,), its coefficient and deviation, and the gain beside it."""
        design = np.column_stack([column, equations.design])
        solution = np.linalg.lstsq(design, equations.edge, rcond=None)[0]
        residual = design @ solution - equations.edge
        deviation = np.sqrt(clustered_covariance(design, residual, equations.line)[0, 0])
        return lines * float(np.log(residual @ residual)), float(solution[0]), float(deviation), float(solution[1])

    left, square, _, _ = with_column(seen**2 / np.cos(seen))
    misfits = {TILT: left + (square / SQUARE) ** 2}
    for name in BEAMS:
        column = replace(laser, beam=name).angle(laser.shown(seen)) - seen
        if name == laser.beam or not np.isfinite(column).all():
            continue
        left, share, deviation, gain = with_column(column)
        off = ((share - 1) / np.hypot(deviation, NEAR)) ** 2
        if share > SURE * deviation and off < MARGIN and abs(gain) < GAIN_SUSPECT:
            misfits[name] = left + off
    best, *others = sorted(misfits, key=lambda name: misfits[name])
    return () if best == TILT else (best, *(name for name in others if misfits[name] < misfits[best] + MARGIN))


def with_beam(log: RigLog, beam: str) -> RigLog:
    """The log with another beam than it is described with."""
    laser = log.calibration.laser
    seen = None if laser is None else replace(laser, beam=beam)
    return replace(log, calibration=replace(log.calibration, laser=seen))


def beam_words(laser: LaserCalibration, beams: Sequence[str]) -> str:
    """What to say of it. laser: as it was described; beams: as `seen_beam` has them."""
    best, *others = beams
    rivals = " or ".join("a tilt of the beam" if name == TILT else f"laser_beam={name}" for name in others)
    return (
        f"Against the encoder {replace(laser, beam=best).words}, not d = {BEAMS[laser.beam].formula} as described: "
        f"taken so. Describe the logs with laser_beam={best}"
        + (f"; they do not tell it from {rivals}, larger swings would." if rivals else ".")
    )
