"""The laser shows sin(theta) + sum_n w_in cos(n pi (u + 1/2)) over R: it walks at random.

w_in is normal with deviation a_i/n, of the size that sticks show (`measurement.laser_walk`); w_i0 with twice the
deviation of the walk in a log, since a free decay has had another zero.
"""

import numpy as np

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.drift import FURTHEST
from identification.disturbances.term import LASER, DisturbanceTerm, Effect
from identification.measurement.laser_drift import SHIFTED
from identification.measurement.laser_walk import KNOT
from identification.measurement.pooled import Pool


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    terms = []
    for log, motion in enumerate(ready.motions):
        count = max(round((motion.time[-1] - motion.time[0]) / KNOT), 1)
        largest = float(np.sqrt(2 * count)) * motion.wander
        walk = Effect(
            "walk",
            lambda at, order, functions: functions.cos(order * np.pi * (at.share + 0.5)),
            acts=LASER,
            limits=(-FURTHEST, FURTHEST),
            width=lambda order, a=largest: a / order if order else SHIFTED * a * np.pi / np.sqrt(12),
        )
        terms += [DisturbanceTerm(f"walk{n}_{log + 1}", walk, n, log, random=True) for n in range(count + 1)]
    return terms


def _hidden(ready: Pool) -> str:
    if ready.sensors.lines:
        return "an encoder is beside the laser, and how it walked has been taken off."
    return "" if any(motion.wander for motion in ready.motions) else "sticks show no laser that walks."


DISTURBANCE = Disturbance(
    words="the laser walks at random, and no encoder shows how",
    terms=_terms,
    hidden=_hidden,
    rank=14,
    told_by="an encoder beside the laser",
    evident=True,
    same_as="drift",
    emulated=("walk",),
)
