"""Angle sensors show theta + z. What they show too much counts as friction k z/(R N), whichever way the disc slips:
drives that all turn one way do not tell it from mu."""

import numpy as np

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import ANGLE, DisturbanceTerm, Effect
from identification.measurement.pooled import Pool

FURTHEST = 0.1  # rad, of what a sensor shows too much
ZERO = Effect(
    "zero",
    lambda at, order, functions: np.ones_like(at.share),
    acts=ANGLE,
    limits=(-FURTHEST, FURTHEST),
    width=lambda order: 0.01,
)


def _hidden(ready: Pool) -> str:
    if ready.slips_both_ways:
        return ""
    return (
        "all drives turn one way, and friction takes up all that a wrong zero does. Add one log with the drive "
        "reversed, or a free decay, which shows the zero at rest."
    )


DISTURBANCE = Disturbance(
    words="the zero of the angle sensor is off, as drives that turn both ways tell",
    terms=lambda ready, size: [DisturbanceTerm("zero_of_angle", ZERO)],
    hidden=_hidden,
    told_by="a free decay, which shows the zero",
    rank=4,
    emulated=("zero",),
)
