"""Bifurcations of a smooth piece of a branch, between two of its motions.

    fold            the parameter turns: its share of the tangent changes its sign
    branch point    det [J; t] changes its sign where that does not
    flip            det(M + 1) = 0
    Neimark-Sacker  det(M (x) M - 1) = 0, the bialternate product, with a pair of complex multipliers

Their functions of the arclength are brought to zero by Brent's method, every value of them at a motion that Newton's
method has found. At a branch point that method fails; its function is interpolated from motions around.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fmu_models.continuation.problem.node import Lost, Node, extrapolated
from fmu_models.continuation.problem.problem import Vector
from fmu_models.continuation.special.kinds import BRANCH_POINT, FOLD, KINDS

# share of the distance between two motions to which a branch point is narrowed by halving; how far apart, in u and at
# most in that distance, the motions lie that its function is interpolated from
NARROW, WIDTHS, SHARES = 0.1, (4e-3, 1e-3), ((0.1, 0.1), (1.0, 1.0))
NEAREST = 4  # motions through which a polynomial goes to the next one
HOLDS = 1e-4  # how near a multiplier is to where it should be


def changes(before: Node, after: Node) -> list[str]:
    """Kinds of what lies between two neighbours."""
    kinds = [kind for kind in before.tests if before.tests[kind] * after.tests[kind] < 0.0]
    if BRANCH_POINT in kinds and FOLD in kinds:
        kinds.remove(FOLD)  # the branch that bends at a pitchfork turns there
    return kinds


def hides(past: Node, before: Node, after: Node) -> bool:
    """Whether a test that has the same sign at two neighbours may have another one between them: by how it changed
    before, or by the parabola through all three."""
    a, b = -float(np.linalg.norm(before.u - past.u)), float(np.linalg.norm(after.u - before.u))
    for kind, y in before.tests.items():
        x, z = past.tests[kind], after.tests[kind]
        if y * z <= 0.0:
            continue
        slope = (x - y) / a
        bend = ((z - y) / b - slope) / (b - a)
        turn = (a - slope / bend) / 2.0 if bend else np.inf
        least = y + slope * turn + bend * turn * (turn - a) if 0.0 < turn < b else y
        if (y + slope * b) * y < 0.0 or least * y < 0.0:
            return True
    return False


def between(before: Node, after: Node) -> Iterator[tuple[str, Node]]:
    """What lies between two neighbours on a smooth piece: kinds and motions there, along the way."""
    zeros = []
    for kind in changes(before, after):
        try:
            position, node = _located(kind, before, after)
        except (Lost, ValueError):
            continue
        if not _holds(kind, node):
            continue
        zeros.append((position, kind, node))
    for _, kind, node in sorted(zeros, key=lambda located: located[0]):
        yield kind, node


def _holds(kind: str, node: Node) -> bool:
    """Whether a multiplier is where the kind has one: a function may also change its sign by a jump."""
    multipliers, passes = node.problem.own(node.multipliers), KINDS[kind].passes
    if passes == "circle":  # not two real ones whose product is 1
        return bool((np.abs(np.abs(multipliers) - 1.0)[np.abs(multipliers.imag) > 1e-9] < HOLDS).any())
    return bool(np.abs(multipliers - float(passes)).min() < HOLDS)


def _located(kind: str, before: Node, after: Node) -> tuple[float, Node]:
    """Arclength from the first of two neighbours, and the motion there."""
    length = float(before.tangent @ (after.u - before.u))
    nodes: dict[float, Node] = {0.0: before, length: after}

    def at(distance: float) -> Node:
        nearest = sorted(nodes, key=lambda position: abs(position - distance))[:NEAREST]
        from_node = nodes[nearest[0]]
        if nearest[0] == distance:
            return from_node
        guess = from_node.u + (distance - nearest[0]) * from_node.tangent / float(before.tangent @ from_node.tangent)
        if len(nearest) == NEAREST:
            better = extrapolated(np.array(nearest) - distance, np.array([nodes[position].u for position in nearest]))
            # through motions that are too near to one another the polynomial goes astray
            if np.linalg.norm(better - guess) < abs(distance - nearest[0]):
                guess = better
        node = from_node.corrected(guess, before.arclength(distance), near=True, word=before.word)
        nodes[distance] = node
        return node

    def test(distance: float) -> float:
        return at(distance).tests[kind]

    if kind == BRANCH_POINT:
        return _interpolated(test, at, nodes, length)
    root: Any = brentq(test, 0.0, length, xtol=1e-14, full_output=True, disp=False)
    return float(root[0]), at(float(root[0]))


def _interpolated(
    test: Callable[[float], float], at: Callable[[float], Node], nodes: dict[float, Node], length: float
) -> tuple[float, Node]:
    """The root of a test that cannot be had near it: from a polynomial through motions on both sides."""
    low, high, first = 0.0, length, test(0.0)
    while high - low > NARROW * length:
        middle = (low + high) / 2 + 0.01 * (high - low)
        low, high = (middle, high) if test(middle) * first > 0.0 else (low, middle)
    for shares in SHARES:
        widths = [min(width, share * length) for width, share in zip(WIDTHS, shares, strict=True)]
        with suppress(Lost):
            return _from_around(at, (low + high) / 2, widths)
        # motions on the branch that crosses would lead others there
        for distance in set(nodes) - {0.0, length}:
            del nodes[distance]
    raise Lost("the branch point is not seen from around")


def _from_around(at: Callable[[float], Node], root: float, widths: Sequence[float]) -> tuple[float, Node]:
    """The root near a place, and the motion there."""
    for width in widths[:-1]:
        root += width * _root(*_around(at, root, width))
    shifts, nodes = _around(at, root, widths[-1])
    shift = _root(shifts, nodes)
    columns = np.array([node.z for node in nodes]).T
    z = np.array([np.polynomial.Polynomial.fit(shifts, column, 7)(shift) for column in columns])
    node = nodes[3]
    seen = node.problem.see(z)
    return root + widths[-1] * shift, Node(node.problem, node.scales, z, seen, node.tangent)


def _around(at: Callable[[float], Node], root: float, width: float) -> tuple[Vector, list[Node]]:
    """Motions on both sides of a place, and where they are, in widths."""
    shifts = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
    return shifts, [at(float(root + width * shift)) for shift in shifts]


def _root(shifts: Vector, nodes: list[Node]) -> float:
    values = [node.tests[BRANCH_POINT] for node in nodes]
    if not abs(np.sign(np.diff(values)).sum()) == len(values) - 1:
        raise Lost("some of them lie on the branch that crosses there")
    roots = np.polynomial.Polynomial.fit(shifts, values, 7).roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    if not len(real):
        raise Lost("the branch point is not seen from around")
    return float(real[np.abs(real).argmin()])
