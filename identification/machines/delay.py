"""By how much efforts come late in the logs: one more unknown of the linear problem.

    tau(t) = Y theta (t - d)    tau = Y theta - d d(Y theta)/dt

Rows of joints at rest say of a delay what friction makes of them: they are left out.
"""

from dataclasses import replace

import numpy as np

from identification.inference.problem import Unknown
from identification.machines.identify import Estimated, Identified, least_squares
from identification.machines.motion import JointMotion, stacked
from identification.machines.rows import Rows, balanced

SURE = 5.0  # deviations
STEPS = 0.5  # of the logs: less is within what a clock leaves open


def effort_delay(identified: Identified, moving: Rows, without: Estimated) -> tuple[float, float] | None:
    """Delay of all efforts behind the positions and its deviation, s; None if there is none for sure. moving: as
    `standstill.moving` gives them; without: least squares of these, without a delay."""
    regressor = identified.regressor
    values = identified.base.whole(without.values)

    def rate(motion: JointMotion) -> np.ndarray:
        efforts = regressor(motion.position, motion.velocity, motion.acceleration) @ values
        return np.gradient(efforts, motion.step, axis=0)

    late = Unknown("delay", "s", description="delay of the efforts")
    columns = np.column_stack([moving.columns, -stacked(identified.pieces, rate)])
    with_delay = least_squares(balanced(replace(moving, columns=columns, unknowns=(*moving.unknowns, late))))
    delay, deviation = float(with_delay.values[-1]), float(with_delay.deviation[-1])
    sure = abs(delay) > max(SURE * deviation, STEPS * identified.pieces[0].step)
    return (delay, deviation) if sure else None
