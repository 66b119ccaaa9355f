"""The laser shows sin(theta) of an instant before, over R: later by more than its calibration says, or more and more so
because its clock runs at another rate."""

from types import ModuleType

import numpy as np

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.laser_bend import no_laser
from identification.disturbances.term import LASER, DisturbanceTerm, Effect, Whereabouts
from identification.measurement.pooled import Pool

WIDTHS = (2e-3, 2e-3)  # s; s that the clock goes wrong in a log


def _late(at: Whereabouts, order: int, functions: ModuleType) -> np.ndarray:
    return -at.speed * functions.cos(at.angle) * at.share**order


def _hidden(ready: Pool) -> str:
    return "an encoder is beside the laser and tells its delay." if ready.sensors.lines else no_laser(ready)


LATE = Effect("late", _late, acts=LASER, measure="s", limits=(-0.1, 0.1), width=lambda order: WIDTHS[order])
DISTURBANCE = Disturbance(
    words="the laser is late, or its clock runs at another rate than that of the encoders",
    terms=lambda ready, size: [DisturbanceTerm("late", LATE, 0), DisturbanceTerm("clock", LATE, 1)],
    hidden=_hidden,
    told_by="an encoder beside the laser",
    rank=11,
    emulated=("late",),
)
