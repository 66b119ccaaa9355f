"""As `normal_force`, with amplitudes a_n, b_n of each log: the counter of the drive was reset between them, or there
is none."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.turn import NORMAL_FORCE, too_little_turned, turn_terms
from identification.measurement.pooled import Pool


def _hidden(ready: Pool) -> str:
    return "there is one log. Name 'normal-force'." if len(ready.motions) == 1 else too_little_turned(ready)


DISTURBANCE = Disturbance(
    words="the normal force changes with the angle of the drive, which its logs do not share",
    terms=lambda ready, size: tuple(
        term for log in range(len(ready.motions)) for term in turn_terms(NORMAL_FORCE, "N", log)
    ),
    hidden=_hidden,
    told_by="a load cell",
    rank=1,
    same_as="normal-force",
    emulated=("once", "twice"),
)
