"""Slip segments: the stretches of a log where every contact slides in one direction, without the ends.

A sample belongs to a segment where |slip| exceeds a threshold (0.01 m/s: below it lies the micro-slip of the disc_rig
paper, section 3.3) at each disc that touches. Both ends are trimmed by one smoothing window, so that no sample of a
stick has entered. While the disc sticks to one of two driving discs it turns with that one, whatever the friction of
the other, and the force that holds it is unknown: such samples say nothing of either law and are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.measurement.motion import SMOOTHING, DiscMotion
from rig_io.logs.log import stretches

THRESHOLD = 0.01  # m/s
TRIM = 1.0  # smoothing windows at both ends: half of one would leave values chosen by their own noise (p: -2 %)
LEAST_CYCLES = 2


@dataclass(frozen=True, eq=False)
class SlipSegment:
    """One slip: samples first..last-1 of a motion, sliding in direction ``sign`` (+1: the drive overtakes the disc) on
    the first disc of the log."""

    motion: DiscMotion
    first: int
    last: int
    sign: int

    @property
    def angle(self) -> np.ndarray:
        """Angle (m,), rad."""
        return self.motion.angle[self.first : self.last]

    @property
    def drive(self) -> np.ndarray:
        """Speed of the driving disc (m,), rad/s."""
        return self.motion.drive[self.first : self.last]


def slip_segments(
    motion: DiscMotion,
    period: float,
    *,
    threshold: float = THRESHOLD,
    allow_no_stick: bool = False,
    touching: np.ndarray | None = None,
) -> list[SlipSegment]:
    """Slip segments of one log, in order of time; those cut by the ends of the log included.

    period: s, natural period of the disc, the scale of the smoothing; threshold: m/s. allow_no_stick: accept a log in
    which the disc never sticks. touching: (n_discs, n), samples at which each disc touches; None for always.

    Raises:
        StickslipError: the disc never slips, never sticks, or the log is shorter than `LEAST_CYCLES` cycles.
    """
    rig, name = motion.log.rig, motion.log.name
    window = SMOOTHING * period
    slip = motion.slip(rig.value("r"), rig.value("R"), window)
    touching = np.ones(slip.shape, dtype=bool) if touching is None else touching
    slipping = np.all((np.abs(slip) > threshold) | ~touching, axis=0)
    _check_slip(motion, slip, threshold)
    if slipping.all() and not allow_no_stick:
        raise StickslipError(
            f"Log '{name}' shows no stick: the slip speed never falls below {threshold:g} m/s (least "
            f"{np.min(np.abs(slip)):.2g} m/s). Above the speed where stick-slip ends a single sliding speed says "
            "little about the law: drive slower, or leave the log out, or allow it (--allow-no-stick)."
        )
    if not allow_no_stick:
        _check_cycles(motion, slipping)
    trim = round(TRIM * window / motion.step)
    segments = []
    for first, last in stretches(slipping):
        first, last = int(first) + trim * (first > 0), int(last) - trim * (last < len(slipping))
        if last > first and not motion.filled[first:last].any():
            segments.append(SlipSegment(motion, first, last, int(np.sign(slip[0, (first + last) // 2]))))
    if not segments:
        raise StickslipError(
            f"Log '{name}': every slip holds samples that are missing or clipped ({100 * np.mean(motion.filled):.0f} % "
            "of the log). Move the laser so that the whole motion is within its range."
        )
    return segments


def _check_slip(motion: DiscMotion, slip: np.ndarray, threshold: float) -> None:
    """slip: (n_discs, n) m/s. Each disc must slip somewhere, and all of them together."""
    discs = motion.log.contacts
    for contact, row in zip(discs, np.abs(slip), strict=True):
        if not (row > threshold).any():
            raise StickslipError(
                f"Log '{motion.log.name}' shows no slip on {contact}: the slip speed r*w - R*th' stays below "
                f"{threshold:g} m/s (greatest {row.max():.2g} m/s). Friction against speed needs slip: drive slower or "
                "with another load to get stick-slip, and check r, R and the drive's encoder."
            )
    if not np.all(np.abs(slip) > threshold, axis=0).any():
        raise StickslipError(
            f"Log '{motion.log.name}': {' and '.join(discs)} never slip at one time, so that the force of one could be "
            "held by the other. Drive the discs at other speeds."
        )


def _check_cycles(motion: DiscMotion, slipping: np.ndarray) -> None:
    slips = stretches(slipping)
    count = sum(1 for first, last in slips if first > 0 and last < len(slipping))
    if count < LEAST_CYCLES:
        raise StickslipError(
            f"Log '{motion.log.name}' is too short: {motion.time[-1] - motion.time[0]:.3g} s hold {count} whole slips, "
            f"and {LEAST_CYCLES} cycles or more are needed. Record for 20 s or more."
        )


def long_enough(segments: Sequence[SlipSegment], window: float, margin: float = 0.1) -> list[SlipSegment]:
    """Those segments that hold a window (s) and ``margin`` of it more. StickslipError: none does."""
    long = [s for s in segments if (s.last - s.first) * s.motion.step > (1 + margin) * window]
    if not long:
        longest = max((s.last - s.first) * s.motion.step for s in segments) if segments else 0.0
        raise StickslipError(
            f"No slip segment is longer than the window of {window:.3g} s (longest {longest:.3g} s, ends trimmed). "
            "Choose a shorter window, or record at a lower drive speed or load, where slips last longer."
        )
    return long
