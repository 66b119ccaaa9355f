"""w (1 - s f): the belt between the encoder on the motor and the disc creeps by a share s, f its load over the mean."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DRIVE, DisturbanceTerm, Effect
from identification.disturbances.turn import unrecorded
from identification.measurement.pooled import Pool
from rig_io.logs.log import EncoderCalibration

CREEP = Effect(
    "creep",
    lambda at, order, functions: -at.load,
    lambda order: "share by which the belt turns the disc less than its ratio says",
    acts=DRIVE,
    limits=(-0.2, 0.2),
    width=lambda order: 0.02,
)


def _encoders(ready: Pool) -> list[EncoderCalibration | None]:
    """That of the drive, in each log."""
    return [getattr(motion.log.calibration, f"drive{ready.contacts[0][-1]}") for motion in ready.motions]


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    encoder = _encoders(ready)[0]
    known = encoder and encoder.creep_deviation
    return [DisturbanceTerm.told("creep", CREEP, 0, None if known is None else (0.0, known), "belt as described")]


def _hidden(ready: Pool) -> str:
    if reason := unrecorded(ready):
        return reason
    if all(encoder is not None and encoder.may_creep for encoder in _encoders(ready)):
        return ""
    return "the encoder of the drive sits on the disc, or behind a gear (its ratio, and --set belt, say so)."


DISTURBANCE = Disturbance(
    words="the belt between motor and disc creeps: the disc turns more slowly than the encoder on the motor shows",
    terms=_terms,
    hidden=_hidden,
    told_by="an encoder on the driving disc itself, or its radius r measured again",
    rank=8,
    emulated=("belt",),
)
