"""k (1 + sum_n q_n (theta - theta_0)^n): something beside the spring pulls at the body at some angles, n = 1 to 4."""

from identification.disturbances.angle import POWER, middle_of_slips
from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import SPRING, DisturbanceTerm, Effect

POWERS = (1, 2, 3, 4)
PULL = Effect(
    "pull",
    POWER.formula,
    lambda order: f"share by which the spring is stiffer, of power {order} of the angle",
    acts=SPRING,
    angular=True,
    limits=POWER.limits,
    width=lambda order: POWER.width(order) / 3,
)
DISTURBANCE = Disturbance(
    words="something beside the spring pulls at the body at some angles: a cable, a magnet, a stop",
    terms=lambda ready, size: [
        DisturbanceTerm(f"pull{order}", PULL, order, None, middle_of_slips(ready)) for order in POWERS
    ],
    told_by="a free decay from a larger angle",
    rank=14,
    mimics="spring",
    unsettles=("k", "k/J"),
    emulated=("cable",),
)
