"""w (1 + sum_n e_n cos(n phi) + f_n sin(n phi)): the encoder of the drive is eccentric (n = 1) or oval (n = 2), so that
the disc does not turn as it shows."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DRIVE
from identification.disturbances.turn import harmonics, too_little_turned, turn_terms, unrecorded

SPEED = harmonics("drive_", "speed, with the ", "drive", acts=DRIVE, width=lambda order: 5e-3)
DISTURBANCE = Disturbance(
    words="the encoder of the drive, or the disc, is eccentric: its border moves at another speed than is shown",
    terms=lambda ready, size: tuple(turn_terms(SPEED, "w")),
    hidden=lambda ready: unrecorded(ready) or too_little_turned(ready),
    told_by="a tachometer on the drive",
    rank=9,
    emulated=("drive_encoder",),
)
