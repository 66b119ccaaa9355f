"""The laser shows sin(theta) + b_2 theta^2 + b_3 theta^3 over R: its beam does not meet the arm at a right angle, or it
shows R theta, or R tan(theta)."""

from collections.abc import Sequence

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import LASER, DisturbanceTerm, Effect
from identification.measurement.disc_motion import angle_sensor
from identification.measurement.motion import BENDS
from identification.measurement.pooled import Pool

BEND = Effect(
    "bend",
    lambda at, order, functions: at.angle**order,
    acts=LASER,
    limits=(-1.0, 1.0),
    width=lambda order: 0.02 * 10.0 ** (order - BENDS[0]),
)


def no_laser(ready: Pool) -> str:
    """Why logs without a laser show nothing of it; nothing where they have one."""
    return "" if any(angle_sensor(motion.log) == "laser" for motion in ready.motions) else "no laser shows their angle."


def beam_of(ready: Pool, terms: Sequence[DisturbanceTerm], values: Sequence[float]) -> str:
    """The beam that would explain the bend, where slips told its values."""
    laser = next((m.log.calibration.laser for m in ready.motions if m.log.calibration.laser), None)
    named = laser.bent(*values) if laser and values else ""
    return f"; {named}" if named else ""


def taken_off(ready: Pool) -> str:
    """Why logs with an encoder beside the laser show no drift of it; nothing where there is none."""
    return "an encoder is beside the laser, and what drift it showed has been taken off." if ready.sensors.lines else ""


DISTURBANCE = Disturbance(
    words="the laser is not straight: what it shows bends with the angle (a tilted beam, or one that meets an arc)",
    terms=lambda ready, size: [
        DisturbanceTerm.told(f"laser_bend{power}", BEND, power, told, "laser against encoder")
        for power, told in zip(BENDS, ready.sensors.bend or [None] * len(BENDS), strict=True)
    ],
    hidden=no_laser,
    remark=beam_of,
    told_by="an encoder beside the laser",
    rank=10,
    unsettles=("gain",),
    emulated=("laser_bend",),
)
