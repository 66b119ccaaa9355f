"""Where an impact without rebound begins to leave its wall at once, or to stay at it.

What comes after such an impact is decided by the force with which the contact would be held. While it pushes, the
contact stays; where it would pull, the contact leaves at an acceleration a > 0, and lands again after about 3 a / j, j
its jerk. Both go to zero at the same motion, which so is found from either side, each with its own multipliers.

Motions are smooth in that force, or acceleration, and not always in the parameter: after a release from another wall
the sleeve of a woodpecker comes to rest at the end of each swing, and where it lands there, both go with the third root
of the parameter. So polynomials in them, and no tangent, go to zero.
"""

from itertools import islice, pairwise

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node, extrapolated
from fmu_models.continuation.problem.problem import Passing, Vector
from fmu_models.continuation.special.discontinuous import Touch, shrinking

# steps towards the point, at most; how well limits of polynomials through neighbouring ones agree there, in u, and have
# to where motions cannot be followed as near as that
STEPS, AGREE, ENOUGH = 40, 1e-12, 1e-9
LAST = 6  # motions through which a polynomial goes
MEET = 1e-6  # how far apart, in u, the point is that is found from both sides


def from_vanishing(start: Node, miss: Passing) -> Touch:
    """The point where the force, or the acceleration, that begins a state of a motion is zero, or the time between two
    of its events. Lost: the way there leaves the word of the motion."""
    trail, limits, matrices = [], [], []
    for nearer in islice(shrinking(start, miss, LAST), STEPS):
        trail.append(nearer)
        values = np.array([force.value for force, _ in trail[-LAST:]])
        limits.append(extrapolated(values, np.array([neighbour.u for _, neighbour in trail[-LAST:]])))
        matrices.append(extrapolated(values, np.array([neighbour.seen.monodromy for _, neighbour in trail[-LAST:]])))
        if len(limits) > 1 and np.abs(limits[-1] - limits[-2]).max() < AGREE:
            break
    # nearest to the point motions, and before them their matrices, lose their digits
    limit, matrix = _steadiest(limits), _steadiest(matrices)
    if limit is None or matrix is None or limit[1] > ENOUGH:
        raise Lost("it does not vanish on the way")
    last_force, node = trail[-1]
    nodes = tuple(neighbour for _, neighbour in trail[1:])
    return Touch(node, limit[0] * node.scales, last_force, (), np.nan, matrix[0], nodes)


def _steadiest(values: list[Vector]) -> tuple[Vector, float] | None:
    """That which differs least from the one before it, and by how much; None of a single one."""
    changes = [float(np.abs(after - before).max()) for before, after in pairwise(values)]
    index = int(np.argmin(changes)) if changes else 0
    return (values[index + 1], changes[index]) if changes else None


def from_other_side(touch: Touch, node: Node) -> Touch | None:
    """The same point from a motion beyond it, whose tangent leads away; None if it is not found."""
    begins = [miss for miss in node.seen.misses if miss.begins and miss.contact == touch.miss.contact]
    for miss in sorted(begins, key=lambda candidate: abs(candidate.time - touch.miss.time)):
        try:
            opposite = from_vanishing(node.turned(), miss)
        except Lost:
            continue
        if np.abs(opposite.u - touch.u).max() < MEET:
            return opposite
    return None
