"""c (1 + c2 |omega|): drag that grows with the square of the speed, as that of air does."""

from __future__ import annotations

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DAMPING, DisturbanceTerm, Effect
from identification.inference.problem import Prior
from identification.measurement.pooled import Pool

SLOW = 1e-3  # rad/s, below which |omega| is rounded off, for a model is smooth
QUADRATIC = Effect(
    "quadratic",
    lambda at, order, functions: functions.sqrt(at.speed**2 + SLOW**2),
    lambda order: "share by which damping is greater at a radian per second",
    acts=DAMPING,
    measure="s/rad",
    limits=(-10.0, 10.0),
    width=lambda order: 0.2,
)


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    told = None if ready.decay is None else ready.decay.drag
    prior = None if told is None else Prior("c2", told[0], "s/rad", told[1], "free decay")
    return [DisturbanceTerm("c2", QUADRATIC, 1, prior=prior)]


DISTURBANCE = Disturbance(
    words="damping grows with the speed, as the drag of air does",
    terms=_terms,
    rank=7,
    unsettles=("c", "c/J"),
)
