"""Runge-Kutta-Fehlberg 4(5): six stages, the solution of order 5 goes on, the one of order 4 tells the error.

Source: Fehlberg, Low-order classical Runge-Kutta formulas with stepsize control, NASA TR R-315 (1969), table III.
SciPy has no such method; it is here because the switch model was published with it.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.arrays import Vector
from fmu_models.validation.methods.result import NotTreated

NODES = (0.0, 1 / 4, 3 / 8, 12 / 13, 1.0, 1 / 2)
STAGES = (
    np.array([]),
    np.array([1 / 4]),
    np.array([3 / 32, 9 / 32]),
    np.array([1932, -7200, 7296]) / 2197,
    np.array([439 / 216, -8.0, 3680 / 513, -845 / 4104]),
    np.array([-8 / 27, 2.0, -3544 / 2565, 1859 / 4104, -11 / 40]),
)
FIFTH = np.array([16 / 135, 0.0, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55])
ERROR = FIFTH - np.array([25 / 216, 0.0, 1408 / 2565, 2197 / 4104, -1 / 5, 0.0])
SMALLEST = 1e-15  # of the run: a step below it leads nowhere
MOST = 3_000_000  # steps: a method that chatters must not hang

Field = Callable[[float, Vector], ArrayLike]
Step = tuple[float, float, Vector, Vector, Vector, Vector]


def steps(
    field_at: Callable[[float, Vector], Field], z: Vector, stop: float, tolerance: float, size: Vector
) -> Iterator[Step]:
    """Accepted steps (t0, t1, z0, z1, f0, f1) from time 0 on.

    Args:
        field_at: the field to be used in a step that begins at a time and state.
        tolerance: error of a step in fractions of ``size`` (n,) or of the state, if that is larger.

    Raises:
        NotTreated: the step has become too small, or there are too many.
    """
    t, h = 0.0, min(stop, 1e-3 * stop)
    n = z.size
    k = np.empty((6, n))
    for _ in range(MOST):
        if t >= stop:
            return
        h = min(h, stop - t)
        field = field_at(t, z)
        k[0] = field(t, z)
        for i in range(1, 6):
            k[i] = field(t + NODES[i] * h, z + h * (STAGES[i] @ k[:i]))
        error = float(np.max(np.abs(h * (ERROR @ k)) / (tolerance * np.maximum(size, np.abs(z)))))
        if error <= 1.0:
            new = z + h * (FIFTH @ k)
            end = t + h if h < stop - t else stop
            yield t, end, z, new, k[0].copy(), k[5]
            t, z = end, new
        h *= min(4.0, max(0.1, 0.9 * error**-0.2)) if error > 0.0 else 4.0
        if not h > SMALLEST * stop:
            raise NotTreated(f"its steps shrink to nothing at {t:g} s: the field jumps under every stage.")
    raise NotTreated(f"more than {MOST} steps by {t:g} s.")
