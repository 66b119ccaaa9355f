"""k (1 + k3 theta^2): a spring that stiffens or softens as it is turned."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import SPRING, DisturbanceTerm, Effect

CUBIC = Effect(
    "cubic",
    lambda at, order, functions: at.angle**2,
    lambda order: "share by which the spring is stiffer at a radian",
    acts=SPRING,
    angular=True,
    limits=(-10.0, 10.0),
    width=lambda order: 1.0,
)
DISTURBANCE = Disturbance(
    words="the spring is not straight: its stiffness changes with the square of the angle",
    terms=lambda ready, size: [DisturbanceTerm.told("k3", CUBIC, 2, ready.decay and ready.decay.cubic, "free decay")],
    told_by="a free decay from a larger angle",
    rank=6,
    unsettles=("k", "k/J"),
    emulated=("spring",),
)
