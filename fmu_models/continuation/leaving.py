"""Motions beside a special, on the branches that leave a branch there."""

from contextlib import suppress

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node
from fmu_models.continuation.problem.problem import Vector
from fmu_models.continuation.special.discontinuous import Touch
from fmu_models.continuation.special.kinds import BRANCH_POINT, FLIP, PITCHFORK
from fmu_models.continuation.special.several import other_words
from fmu_models.continuation.special.special import Special, beside, other_direction

# how far from a special a branch begins that is switched to, in u; nearer where its word ends before
BESIDE = (1e-3, 3e-3, 1e-2, 1e-4, 1e-5, 1e-6, 1e-7)


def leaving(special: Special) -> list[Node]:
    """Motions beside a special on branches that leave there; their tangents lead away."""
    node: Node = special.node
    if special.kind == FLIP:
        return _doubled(node)[:1]
    if special.kind in (PITCHFORK, BRANCH_POINT):
        return beside_branch_point(node)
    if special.collision is not None:
        return list(special.collision.leaving())
    return _at_touch(special, special.touch) if special.touch else []


def _at_touch(special: Special, touch: Touch) -> list[Node]:
    """Motions with some of the events that come at a touch: of the same period where several come at once, of twice and
    three times it where a multiplier passes -1 or the circle between both sides, or is infinite on one."""
    if touch.node.repeats():  # they leave its parent, and are found there
        return []
    rigid = not np.isnan(special.slope)
    nodes = [node for node in other_words(touch) if node.word not in special.words]
    for times, crossing in ((2, "-1"), (3, "circle")):
        if rigid or crossing in special.crossings:
            nodes += other_words(touch, times)
    return nodes


def beside_branch_point(node: Node) -> list[Node]:
    """Motions on both sides of the branch that crosses at a branch point."""
    return _on_both_sides(node, other_direction(node))


def _doubled(node: Node) -> list[Node]:
    """Motions of twice the period on both sides of a flip."""
    at, n = node.folded(2), len(node.problem.states)
    if at is None:
        return []
    values, vectors = np.linalg.eig(node.seen.monodromy)
    along = np.zeros_like(at.z)
    along[:n] = np.real(vectors[:, np.abs(values + 1.0).argmin()])
    along /= at.scales
    return _on_both_sides(at, along / np.linalg.norm(along))


def _on_both_sides(node: Node, direction: Vector) -> list[Node]:
    nodes: list[Node] = []
    for away in (direction, -direction):
        for distance in BESIDE:
            with suppress(Lost):
                nodes.append(beside(node, away, distance))
                break
    return nodes
