"""w (1 + sum_n e_n cos(n phi) + f_n sin(n phi)): the encoder of the drive is eccentric (n = 1) or oval (n = 2), so that
the disc does not turn as it shows."""

from __future__ import annotations

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DRIVE, DisturbanceTerm, Effect
from identification.disturbances.turn import HARMONICS, too_little_turned

COSINE = Effect(
    "drive_cos",
    lambda at, order, functions: functions.cos(order * at.turned),
    lambda order: f"of the speed, with the cos of {order} turns of the drive",
    factor="drive",
    acts=DRIVE,
    width=lambda order: 5e-3,
)
SINE = Effect(
    "drive_sin",
    lambda at, order, functions: functions.sin(order * at.turned),
    lambda order: f"of the speed, with the sin of {order} turns of the drive",
    factor="drive",
    acts=DRIVE,
    width=lambda order: 5e-3,
)
DISTURBANCE = Disturbance(
    words="the encoder of the drive is eccentric: the disc turns at another speed than it shows",
    terms=lambda ready, size: [
        DisturbanceTerm(f"w_{effect.name.removeprefix('drive_')}{order}", effect, order)
        for order in HARMONICS
        for effect in (COSINE, SINE)
    ],
    hidden=too_little_turned,
    rank=9,
)
