"""Measured motions of a family of logs: one angle and every drive speed on an even clock, sensors fused over all logs.

Unlike the logs of a fit these need no stick: above the bifurcation the disc slides steadily, and that is a result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.errors import StickslipError
from identification.free_decay import FreeDecay, fit_free_decay
from identification.kinematics import SMOOTHING, DiscMotion, disc_motion, fuse, smooth_drive, zeroed
from identification.pooling import check_same_rate, check_same_rig
from rig_io.log import RigLog


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """Motion in one log. time: (n,) s, even; angle: (n,) rad, unsmoothed; drives: by contact (n,) rad/s."""

    log: RigLog
    time: np.ndarray
    angle: np.ndarray
    drives: Mapping[str, np.ndarray]

    @property
    def drive_speeds(self) -> dict[str, float]:
        """Mean drive speeds by contact, rad/s."""
        return {contact: float(np.mean(speed)) for contact, speed in self.drives.items()}


def measured_motions(
    logs: Sequence[RigLog], natural_period: float, free_decay: FreeDecay | None = None
) -> list[MeasuredMotion]:
    """Motions of the stick-slip logs of one rig with the same discs in contact.

    logs: a free decay among them gives the zero of the angle, if ``free_decay`` is not given; natural_period: s.

    Raises:
        StickslipError: no such log, different rigs or discs, a log without disc, or one that cannot be read as a motion.
    """
    decays = [log for log in logs if log.kind == "free-decay"]
    sliding = [log for log in logs if log.kind != "free-decay"]
    if not sliding:
        raise StickslipError("There is no stick-slip log among those given. Give those to compare with.")
    check_same_rig([*sliding, *decays])
    found = sorted({log.contacts for log in sliding})
    if len(found) > 1 or not found[0]:
        named = ", ".join(" and ".join(contacts) or "none" for contacts in found)
        raise StickslipError(f"These logs have as discs in contact: {named}. Compare those of the same discs by themselves.")
    contacts = found[0]
    raw = [disc_motion(log, int(contacts[0][-1])) for log in sliding]
    check_same_rate(raw)
    if free_decay is None and decays:
        free_decay = fit_free_decay(decays[0])
    if free_decay is not None:
        raw = [zeroed(motion, free_decay.rest) for motion in raw]
    return [_with_drives(motion, contacts) for motion in fuse(raw, SMOOTHING * natural_period)[0]]


def _with_drives(motion: DiscMotion, contacts: Sequence[str]) -> MeasuredMotion:
    others = {contact: smooth_drive(motion.log, motion.time, int(contact[-1])) for contact in contacts[1:]}
    return MeasuredMotion(motion.log, motion.time, motion.angle, {contacts[0]: motion.drive, **others})
