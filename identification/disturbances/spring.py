"""k (1 + k3 theta^2): a spring that stiffens or softens as it is turned."""

from __future__ import annotations

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import SPRING, DisturbanceTerm, Effect
from identification.inference.problem import Prior
from identification.measurement.pooled import Pool

CUBIC = Effect(
    "cubic",
    lambda at, order, functions: at.angle**2,
    lambda order: "share by which the spring is stiffer at a radian",
    acts=SPRING,
    angular=True,
    limits=(-10.0, 10.0),
    width=lambda order: 1.0,
)


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    told = None if ready.decay is None else ready.decay.cubic
    prior = None if told is None else Prior("k3", told[0], "1/rad^2", told[1], "free decay")
    return [DisturbanceTerm("k3", CUBIC, 2, prior=prior)]


DISTURBANCE = Disturbance(
    words="the spring is not straight: its stiffness changes with the square of the angle",
    terms=_terms,
    rank=6,
    unsettles=("k", "k/J"),
)
