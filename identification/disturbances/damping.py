"""c (1 + c2 |omega|): drag that grows with the square of the speed, as that of air does."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DAMPING, DisturbanceTerm, Effect

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
DISTURBANCE = Disturbance(
    words="damping grows with the speed, as the drag of air does",
    terms=lambda ready, size: [
        DisturbanceTerm.told("c2", QUADRATIC, 1, ready.decay and ready.decay.drag, "free decay")
    ],
    told_by="a free decay from a larger angle",
    rank=7,
    unsettles=("c", "c/J"),
    emulated=("damping",),
)
