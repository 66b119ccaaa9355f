"""Changes of the normal force with the angle of the drive: run-out of a disc once per turn, of a bent shaft twice."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from identification.disturbances.term import DisturbanceTerm, Effect
from identification.measurement.disc_motion import nominal_drives
from identification.measurement.pooled import Pool

HARMONICS = (1, 2)
LEAST_TURN = np.pi  # rad that a drive turns in slip, the least that shows what its angle does


def harmonics(name: str, of: str, factor: str, **how: Any) -> tuple[Effect, Effect]:
    """Cosine and sine of an angle of the drive. name: before theirs; of: what changes, for their meanings; how: further
    attributes of an `Effect`."""

    def effect(wave: str) -> Effect:
        return Effect(
            f"{name}{wave}",
            lambda at, order, functions: getattr(functions, wave)(order * at.turned),
            lambda order: f"of the {of}{wave} of {order} turns of the drive",
            factor=factor,
            **how,
        )

    return effect("cos"), effect("sin")


NORMAL_FORCE = harmonics("", "", "turn")


def turn_terms(effects: tuple[Effect, Effect], letter: str, log: int | None = None) -> Iterator[DisturbanceTerm]:
    """The terms of one log, or of all, called after a letter."""
    suffix = "" if log is None else f"_{log + 1}"
    for order in HARMONICS:
        for wave, effect in zip(("cos", "sin"), effects, strict=True):
            yield DisturbanceTerm(f"{letter}_{wave}{order}{suffix}", effect, order, log)


def unrecorded(ready: Pool) -> str:
    """Which logs did not record how their drives turned, in a sentence; nothing where all did."""
    logs = [motion.log.name for motion in ready.motions if nominal_drives(motion.log)]
    return f"how the drive turned is not recorded in {' and '.join(logs)}." if logs else ""


def too_little_turned(ready: Pool) -> str:
    """Why drives that hardly turn show nothing of it; nothing where they do."""
    turned = sum(abs(float(np.sum(segment.drive))) * segment.motion.step for segment in ready.segments)
    if turned < LEAST_TURN:
        return f"the drive turns by {turned:.2g} rad in all slips together. Record for a turn or more."
    return ""
