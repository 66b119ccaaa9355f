"""The laser shows sin(theta) + b theta^2 over R: its beam does not meet the arm at a right angle."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import LASER, DisturbanceTerm, Effect
from identification.measurement.disc_motion import angle_sensor
from identification.measurement.pooled import Pool

BEND = Effect(
    "bend", lambda at, order, functions: at.angle**2, acts=LASER, limits=(-1.0, 1.0), width=lambda order: 0.02
)


def no_laser(ready: Pool) -> str:
    """Why logs without a laser show nothing of it; nothing where they have one."""
    return "" if any(angle_sensor(motion.log) == "laser" for motion in ready.motions) else "no laser shows their angle."


DISTURBANCE = Disturbance(
    words="the laser is not straight: what it shows bends with the angle (its beam is tilted)",
    terms=lambda ready, size: [
        DisturbanceTerm.told("laser_bend", BEND, 2, ready.sensors.bend, "laser against encoder")
    ],
    hidden=no_laser,
    told_by="an encoder beside the laser",
    rank=10,
    unsettles=("gain",),
    emulated=("laser_bend",),
)
