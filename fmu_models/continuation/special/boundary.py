"""Where a branch of equilibria meets a switching surface, and how it goes on beyond.

    locate  the indicator of an event, positive along the branch, is brought to zero from its own side; the rest of the
            way is linear
    beyond  the contact states on the other side are those of a point across the surface; the branch there is the null
            vector of [f_x f_p] in these, from the same point on, in the sense in which the surface is left

Where the rates are continuous the branch either goes on or turns: then two equilibria meet at the surface. Where they
jump there is no equilibrium beyond. The Jacobians on both sides are limits, and the eigenvalues between them a set.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.base.errors import StickslipError
from fmu_models.continuation.normal_forms.set_valued import eigenvalue_crossings, hull
from fmu_models.continuation.problem.equilibrium import EquilibriumProblem, equilibrium_problem
from fmu_models.continuation.problem.node import Lost, Node, arclength, look, solved, tangent_of
from fmu_models.continuation.problem.problem import Seen, Vector
from fmu_models.language.contact_kinds import STICK

APART = 1e-6  # how far apart points are, in u, whose differences are slopes of indicators
NEAR, TRIES = 1e-7, 60  # how near to the surface the branch is followed: what is left is linear to rounding
BEYOND = (1e-6, 1e-5, 1e-4, 1e-3)  # how far beyond the surface its other side is looked at, in u


@dataclass(frozen=True, eq=False)
class Boundary:
    """A point of a branch of equilibria on a switching surface.

    Attributes:
        before: the last equilibrium on the side that the branch comes from; its tangent leads to the surface.
        z: of the point itself.
        contact: whose surface it is, "" if several are.
        states: of the contact, before and beyond.
        jacobian: (n, n) limit on the side before.
        after: the first equilibrium beyond, its tangent leading on; None where there is none.
        jacobian_after: (n, n) limit there.
    """

    before: Node
    z: Vector
    contact: str
    states: tuple[int, int]
    jacobian: Vector
    after: Node | None = None
    jacobian_after: Vector | None = None

    @property
    def u(self) -> Vector:
        """Unknowns of the point in their scales."""
        return self.z / self.before.scales

    @property
    def turns(self) -> bool:
        """Whether the parameter goes back beyond: two equilibria meet at the surface."""
        return self.after is not None and bool(self.before.tangent[-1] * self.after.tangent[-1] < 0.0)

    @cached_property
    def _sides(self) -> tuple[Vector, Vector] | None:
        """J- and J+: where the state of the contact is the smaller and the larger number."""
        if self.jacobian_after is None:
            return None
        pair = self.jacobian, self.jacobian_after
        return pair if self.states[0] < self.states[1] else (pair[1], pair[0])

    @cached_property
    def crossings(self) -> Mapping[str, list[float]]:
        """Shares q of J+ at which the set-valued eigenvalues bifurcate, see normal_forms/set_valued.py."""
        return {} if self._sides is None else eigenvalue_crossings(*self._sides)

    def between(self, q: float) -> Vector:
        """(n, n) the matrix (1 - q) J- + q J+."""
        minus, plus = self._pair()
        return (1.0 - q) * minus + q * plus

    def path(self, q: Vector) -> Complex:
        """(m, n) eigenvalues of (1 - q) J- + q J+ at shares (m,). StickslipError: there is no equilibrium beyond, and
        so no such path."""
        return hull(*self._pair(), q)

    def _pair(self) -> tuple[Vector, Vector]:
        if self._sides is None:
            raise StickslipError("There is no equilibrium on the other side of the surface, and so no path between.")
        return self._sides


def ahead(node: Node, step: float, within: float) -> Boundary | None:
    """The switching surface that the branch meets first, if it is near: within so many steps."""
    problem = equilibrium_problem(node)
    present = problem.indicators(node.z)
    further = problem.indicators((node.u + APART * node.tangent) * node.scales)
    rates = (further - present) / APART
    falls = [(-present[i] / rates[i], i) for i in np.flatnonzero(rates < 0.0)]
    for distance, i in sorted(falls):
        if distance < within * step:
            try:
                return _located(node, int(i), distance)
            except Lost:
                continue
    return None


def _located(node: Node, i: int, distance: float) -> Boundary:
    """The surface where an indicator falls to zero, about so far along the tangent. Lost: the branch does not come
    there."""
    boundary = _completed(*_place(node, i, distance), i)
    if boundary.after is None or boundary.states[0] != STICK:
        return boundary
    # the margin of what sticks is shifted by as much as an importer may miss it; where slip begins is not
    _, u, _ = _place(boundary.after.turned(), i, BEYOND[0])
    return replace(boundary, z=u * node.scales)


def _place(node: Node, i: int, distance: float) -> tuple[Node, Vector, Vector]:
    """Where an indicator falls to zero, about so far along the tangent: the last equilibrium before, u of the point,
    and the limit of the Jacobian. Lost: the branch does not come there."""
    problem = equilibrium_problem(node)
    places, nodes, root = [0.0], [node], distance
    values = [float(problem.indicators(node.z)[i])]
    share = 0.9
    for _ in range(TRIES):
        remaining = root - places[-1]
        if remaining <= NEAR:
            break
        position = places[-1] + max(share * remaining, remaining - 0.5 * NEAR if remaining < 1e3 * NEAR else 0.0)
        try:
            guess = nodes[-1].u + (position - places[-1]) * nodes[-1].tangent
            solution = node.corrected(guess, node.arclength(position), word=node.word)
        except Lost:
            share /= 2.0
            if share < 1e-3:
                raise
            continue
        places.append(position)
        nodes.append(solution)
        values.append(float(problem.indicators(solution.z)[i]))
        if not values[-1] < values[-2]:
            raise Lost("the indicator does not fall to zero")
        root = places[-1] - values[-1] * (places[-1] - places[-2]) / (values[-1] - values[-2])
        share = min(0.999, 2.0 * share) if share < 0.9 else 0.999
    else:
        raise Lost("the branch does not come to the surface")
    last = nodes[-1]
    remaining = root - places[-1]
    u = last.u + remaining / float(node.tangent @ last.tangent) * last.tangent
    j = last.seen.monodromy
    if len(nodes) > 1:
        j = j + (j - nodes[-2].seen.monodromy) * remaining / (places[-1] - places[-2])
    return last, u, j


def _completed(last: Node, u: Vector, j: Vector, i: int) -> Boundary:
    """With what is beyond."""
    problem, scales = equilibrium_problem(last), last.scales
    slope = _slope(problem, last, i)
    across = slope / np.linalg.norm(slope)
    opposite = None
    for guess, seen in _beyond(problem, last, u, across):
        changed = [(a[0], a[1], b[1]) for a, b in zip(last.word, seen.word, strict=True) if a != b]
        contact, states = changed[0][0] if len(changed) == 1 else "", changed[0][1:]
        tangent = tangent_of(seen, scales)
        tangent = -tangent if tangent @ slope > 0.0 else tangent
        # what sticks stays on the surface, whichever way it goes
        for towards in (tangent, -tangent) if STICK in states[1:] else (tangent,):
            nodes = _along(problem, scales, guess, towards, seen)
            if nodes:
                after = 2.0 * nodes[0].seen.monodromy - nodes[1].seen.monodromy
                return Boundary(last, u * scales, contact, states, j, nodes[0], after)
        opposite = opposite or (contact, states)
    if opposite is None:
        raise Lost("the contact states do not change beyond")
    return Boundary(last, u * scales, *opposite, j)


def _beyond(problem: EquilibriumProblem, last: Node, u: Vector, across: Vector) -> Iterator[tuple[Vector, Seen]]:
    """Where a branch may go on: points with other contact states, across the surface and on it."""
    for distance in BEYOND:
        seen = look(problem, (u - distance * across) * last.scales)
        if seen is not None and seen.word != last.word:
            yield u, seen
            break
    # states that stick are exactly at rest
    on = np.where(np.abs(u) < NEAR, 0.0, u)
    seen = look(problem, on * last.scales)
    if seen is not None and any(state == STICK for _, state, _ in seen.word) and seen.word != last.word:
        yield on, seen


def _along(problem: EquilibriumProblem, scales: Vector, u: Vector, tangent: Vector, seen: Seen) -> list[Node]:
    """Two equilibria beyond, with the contact states that were seen there; none if there are none."""
    nodes: list[Node] = []
    for distance in (BEYOND[0], 2.0 * BEYOND[0]):
        try:
            border = arclength(u, tangent, scales, distance)
            guess = u + distance * tangent
            nodes.append(solved(problem, scales, guess, border, towards=tangent, word=seen.word, reach=BEYOND[-1]))
        except Lost:
            return []
    return nodes


def _slope(problem: EquilibriumProblem, node: Node, i: int) -> Vector:
    """(n + 1,) derivative of an indicator by u, from the side that it is positive on, along what does not stick."""
    present = problem.indicators(node.z)[i]
    slope = np.zeros(len(node.u))
    width = 0.1 * NEAR
    for k, unit in enumerate((problem.along_surfaces(node.z) * node.scales / node.scales[:, None]).T):
        step = width * unit
        values = [(sign, look(problem, (node.u + sign * step) * node.scales)) for sign in (1.0, -1.0)]
        inside = [sign for sign, seen in values if seen is not None and seen.word == node.word]
        falls = [problem.indicators((node.u + sign * step) * node.scales)[i] - present for sign in inside]
        slope[k] = np.mean([fall / (sign * width) for fall, sign in zip(falls, inside, strict=True)] or [0.0])
    if not slope.any():
        raise Lost("the indicator has no slope")
    return slope
