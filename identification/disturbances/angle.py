"""mu (1 + sum_n g_n (theta - theta_0)^n), theta the angle of the body, n = 1, 2, 3; theta_0 in the middle of the
slips."""

import numpy as np

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import WIDTH, DisturbanceTerm, Effect
from identification.measurement.pooled import Pool
from identification.measurement.pooling import SAME_SPEED

POWERS = (1, 2, 3)
LEAST_SWING = 5e-3  # rad that the body turns in slip, the least that shows what its angle does
USUAL_SWING = 0.1  # rad, either way
POWER = Effect(
    "angle",
    lambda at, order, functions: at.angle**order,
    lambda order: f"of power {order} of the angle",
    angular=True,
    limits=(-np.inf, np.inf),
    width=lambda order: WIDTH / USUAL_SWING**order,
)


def _angles(ready: Pool) -> np.ndarray:
    return np.concatenate([segment.angle for segment in ready.segments])


def middle_of_slips(ready: Pool) -> float:
    """Angle in the middle of all slips, rad."""
    angles = _angles(ready)
    return round(0.5 * float(angles.min() + angles.max()), 2)


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    return [DisturbanceTerm(f"angle{order}", POWER, order, None, middle_of_slips(ready)) for order in POWERS]


def _hidden(ready: Pool) -> str:
    swing = float(np.ptp(_angles(ready)))
    if swing < LEAST_SWING:
        return f"in slip the body turns by {1e3 * swing:.2g} mrad only. Record with lower drive speeds."
    speeds = np.array([np.mean(motion.drive) for motion in ready.motions])
    if np.ptp(speeds) < SAME_SPEED * np.max(np.abs(speeds)):
        return (
            "all are at one drive speed, where the same slip speeds always come at the same angles. Add logs at other "
            "drive speeds."
        )
    if ready.decay is not None and ready.decay.pull:
        return "a torque acts at some angles of the body without any contact, as the free decay shows."
    return ""


DISTURBANCE = Disturbance(
    words="friction depends on the angle of the body (a worn or dirty place)",
    terms=_terms,
    hidden=_hidden,
    told_by="logs at another load: friction follows it, a torque beside does not",
    rank=2,
    remark=lambda ready, terms, values: f"; the law is that at {terms[0].reference:g} rad",
    emulated=("angle",),
)
