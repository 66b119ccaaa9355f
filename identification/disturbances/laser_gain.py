"""The laser shows sin(theta) (1 + sum_n l_n (exp(-t/T_n) - mean)) over R, T_n as in `warm_up`: it grows warm."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.laser_bend import no_laser, taken_off
from identification.disturbances.term import LASER, DisturbanceTerm, Effect
from identification.disturbances.warm_up import TIMES, fade

GAIN = Effect(
    "laser_gain",
    lambda at, order, functions: functions.sin(at.angle) * fade(at, order, functions),
    lambda order: f"of the laser's gain, what fades within {TIMES[order]:g} s of a log",
    acts=LASER,
    limits=(-0.5, 0.5),
    width=lambda order: 5e-3,
)
DISTURBANCE = Disturbance(
    words="the gain of the laser drifts within each log, as that of one that grows warm does",
    terms=lambda ready, size: [DisturbanceTerm(f"laser_gain{n + 1}", GAIN, n) for n in range(len(TIMES))],
    hidden=lambda ready: taken_off(ready) or no_laser(ready),
    told_by="an encoder beside the laser",
    rank=15,
    emulated=("laser_gain",),
)
