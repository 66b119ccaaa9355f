"""As `drive_encoder`, with amplitudes e_n, f_n of each log: drives that nobody recorded turn evenly but for this."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.drive_encoder import SPEED
from identification.disturbances.term import DisturbanceTerm
from identification.disturbances.turn import too_little_turned, turn_terms, unrecorded
from identification.measurement.disc_motion import nominal_drives
from identification.measurement.pooled import Pool


def _terms(ready: Pool, size: float | None) -> tuple[DisturbanceTerm, ...]:
    logs = [log for log, motion in enumerate(ready.motions) if nominal_drives(motion.log)]
    return tuple(term for log in logs for term in turn_terms(SPEED, "w", log))


def _hidden(ready: Pool) -> str:
    return too_little_turned(ready) if unrecorded(ready) else "how the drives turned is recorded. Name 'drive-encoder'."


DISTURBANCE = Disturbance(
    words="the drive, whose speed was not recorded, turns unevenly with its angle",
    terms=_terms,
    hidden=_hidden,
    told_by="an encoder on the drive",
    rank=9,
    emulated=("drive_encoder",),
)
