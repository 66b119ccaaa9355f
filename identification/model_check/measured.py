"""Measured motions of families of logs: one angle and every drive speed on an even clock, sensors fused over all logs.

Unlike the logs of a fit these need no stick: above the bifurcation the disc slides steadily, and that is a result.
"""

from collections.abc import Sequence

from fmu_models.base.errors import StickslipError
from identification.measurement.disc_motion import fuse
from identification.measurement.free_decay import fit_free_decay
from identification.measurement.motion import SMOOTHING, DiscMotion
from identification.measurement.pooling import at_rest, check_same_rig, motions_in_pieces
from rig_io.logs.log import RigLog

CYCLES = 5  # natural periods: a shorter piece of a log with gaps shows no portrait


def measured_motions(logs: Sequence[RigLog], natural_period: float) -> dict[tuple[str, ...], list[DiscMotion]]:
    """Motions of the stick-slip logs of one rig, by the discs in contact.

    logs: a free decay among them gives the zero of the angle; natural_period: s, scale of the smoothing.

    Raises:
        StickslipError: no such log, different rigs, a log without disc, or one that cannot be read as a motion.
    """
    decays = [log for log in logs if log.kind == "free-decay"]
    sliding = [log for log in logs if log.kind != "free-decay"]
    if not sliding:
        raise StickslipError("There is no stick-slip log among those given. Give those to compare with.")
    check_same_rig([*sliding, *decays])
    for log in sliding:
        if not log.contacts:
            raise StickslipError(
                f"Log '{log.name}' is of kind '{log.kind}', but has no disc in contact. Say which one touches, "
                '"contacts": ["disc0"], or call it a "free-decay".'
            )
    raw, _, _ = motions_in_pieces(sliding, CYCLES * natural_period)
    if decays:
        raw = at_rest(raw, fit_free_decay(decays[0]))
    families: dict[tuple[str, ...], list[DiscMotion]] = {}
    for motion in fuse(raw, SMOOTHING * natural_period)[0]:
        families.setdefault(motion.log.contacts, []).append(motion)
    return families
