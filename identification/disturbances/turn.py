"""Changes of the normal force with the angle of the drive: run-out of a disc once per turn, of a bent shaft twice."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identification.disturbances.term import DisturbanceTerm, Effect
from identification.measurement.pooled import Pool

HARMONICS = (1, 2)
LEAST_TURN = np.pi  # rad that a drive turns in slip, the least that shows what its angle does
COSINE = Effect(
    "cos",
    lambda at, order, functions: functions.cos(order * at.turned),
    lambda order: f"of the cos of {order} turns of the drive",
    factor="turn",
)
SINE = Effect(
    "sin",
    lambda at, order, functions: functions.sin(order * at.turned),
    lambda order: f"of the sin of {order} turns of the drive",
    factor="turn",
)


def turn_terms(log: int | None = None) -> Iterator[DisturbanceTerm]:
    """The terms of one log, or of all."""
    suffix = "" if log is None else f"_{log + 1}"
    for order in HARMONICS:
        for effect in (COSINE, SINE):
            yield DisturbanceTerm(f"N_{effect.name}{order}{suffix}", effect, order, log)


def too_little_turned(ready: Pool) -> str:
    """Why drives that hardly turn show nothing of it; nothing where they do."""
    turned = sum(abs(float(np.sum(segment.drive))) * segment.motion.step for segment in ready.segments)
    if turned < LEAST_TURN:
        return f"the drive turns by {turned:.2g} rad in all slips together. Record for a turn or more."
    return ""
