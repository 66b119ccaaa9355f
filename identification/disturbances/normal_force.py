"""N (1 + sum_n a_n cos(n phi) + b_n sin(n phi)), phi the angle of the drive by its counter, n = 1, 2."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.turn import NORMAL_FORCE, too_little_turned, turn_terms, unrecorded
from identification.measurement.pooled import Pool


def _hidden(ready: Pool) -> str:
    missing = unrecorded(ready)
    if missing and len(ready.motions) > 1:
        return f"{missing[:-1]}, so that the logs share no angle. Name 'normal-force-each'."
    return too_little_turned(ready)


DISTURBANCE = Disturbance(
    words="the normal force changes with the angle of the drive (run-out of the disc or its shaft)",
    terms=lambda ready, size: tuple(turn_terms(NORMAL_FORCE, "N")),
    hidden=_hidden,
    told_by="a load cell",
    rank=0,
    emulated=("once", "twice"),
)
