"""Whether two motions are the same one, begun at another phase or another period of the forcing."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node, parameter, solved, tangent_of
from fmu_models.continuation.problem.problem import Problem, Vector

NEXT = 1e-4  # how far along a branch, in u, its sense is looked up after a change of the phase
CLOSED = 1e-6  # a branch that comes so near to a motion again has passed it


def turned(after: Problem, node: Node) -> Vector:
    """The motion of a node at the phase, and in the segments, of another problem of the same family."""
    return node.z if node.problem is after else node.problem.shifted(node.z, node.seen, after.phase, after)


def begun_at(node: Node, problem: Problem, z: Vector) -> Node:
    """The motion of a node as that of a problem at another phase, z about its unknowns there. Lost: Newton's method
    does not find it, or with other events."""
    scales = problem.scales_like(node.scales)
    placed = solved(problem, scales, z / scales, parameter(node.value), reach=0.05)
    if placed.word != node.word:
        raise Lost("another motion begins there")
    # period and parameter change alike at all phases
    along = np.append(np.zeros(problem.width), node.tangent[node.problem.width :])
    towards = along if problem.autonomous else _ahead(node, placed)
    return replace(placed, tangent=tangent_of(placed.seen, scales, towards))


def _ahead(node: Node, placed: Node) -> Vector:
    """Direction of u ahead of a node, as that of another problem of the same family, where it is placed."""
    for distance in (NEXT, -NEXT):  # the branch may end ahead
        border = node.arclength(distance)
        with suppress(Lost):
            solution = solved(node.problem, node.scales, node.u + distance * node.tangent, border, word=node.word)
            moved = turned(placed.problem, solution) / placed.scales - placed.u
            return moved if distance > 0.0 else -moved
    raise Lost("it has no neighbour")


def images(node: Node, other: Node) -> Iterator[Vector]:
    """The same motion at the phase of another, begun one period of the forcing later and later; angles on its lap."""
    problem = other.problem
    yield problem.beside(turned(problem, node), other.z)
    for later in range(1, problem.turns):
        yield problem.beside(node.problem.shifted(node.z, node.seen, problem.phase + later, problem), other.z)


def between(before: Node, after: Node, u: Vector) -> bool:
    """Whether a motion u lies on the branch between two neighbours."""
    step, chord = u - before.u, after.u - before.u
    share = float(step @ chord / (chord @ chord))
    if not 0.0 <= share <= 1.0 or np.linalg.norm(step - share * chord) > np.linalg.norm(chord):
        return False
    try:
        node = before.corrected(before.u + share * chord, before.arclength(float(before.tangent @ step)))
    except Lost:
        return False
    return bool(np.abs(node.u - u).max() <= CLOSED)


def passes(nodes: Sequence[Node], node: Node) -> bool:
    """Whether a branch of these nodes runs through a motion, begun in whichever period of the forcing."""
    tolerance = CLOSED * node.scales[-1]
    neighbours = [other for other in nodes if other.word == node.word and abs(other.value - node.value) <= tolerance]
    for other in neighbours:
        if any(np.abs(z / other.scales - other.u).max() <= CLOSED for z in images(node, other)):
            return True
    for before, after in pairwise(nodes):
        same = before.word == after.word == node.word and before.problem is after.problem
        if not same or not min(before.value, after.value) - 1e-9 <= node.value <= max(before.value, after.value) + 1e-9:
            continue
        if any(between(before, after, z / before.scales) for z in images(node, before)):
            return True
    return False
