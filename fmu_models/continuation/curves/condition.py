"""What holds all along a curve of special points: one equation more, for one parameter more.

    fold            det of d residual / d (x, [T]) = 0
    flip            det(M + 1) = 0
    Neimark-Sacker  det(M (x) M - 1) = 0, the bialternate product; of an equilibrium over a share of a period, Hopf too
    where branches cross   the rank of d residual / d (x, [T], p) is less by one
    where the word changes   the least value h of a near miss: 0

The gradient of a determinant or a rank is a difference of exact derivatives; that of a miss is exact.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fmu_models.continuation.problem.node import Border, Lost, Node, _scaled, look, passing_test, solved
from fmu_models.continuation.problem.problem import Passing, Problem, Seen, Vector, Word, cyclic
from fmu_models.continuation.special.discontinuous import LEAST_MISS, value_border

WIDTH = 1e-6  # in u: of the differences that give the gradient of a determinant
APART = 1e-6  # how far equations that go together are from doing so, at most
# by how much a guess is pushed from the event, in squares of the step that led to it
PUSHES = (0.0, 0.1, 1.0, 10.0, 100.0)


class Condition(ABC):
    """An equation on motions over two parameters, or several that go together."""

    @abstractmethod
    def solved(self, node: Node, guess: Vector, pin: Border, step: float) -> Node:
        """The motion near a guess of u that fulfils it, and the pin too. Lost: none is near, or of another word.

        Args:
            node: one of the curve.
            step: how far from the node, in u, the guess is.
        """

    @abstractmethod
    def gradient(self, node: Node) -> Vector:
        """(len(z),) of it, or (k, len(z)) of them, by z. Lost: events come and go around the motion."""

    def place(self, node: Node, fixed: int | None = None) -> Vector:
        """z of the point itself; one of its unknowns may be held."""
        return node.z

    def directed(self, node: Node, towards: Vector | None) -> Node:
        """With the tangent of the curve: nearest to a given one, or with a growing second parameter. Lost: there is no
        curve, where several equations do not go together."""
        rows = np.vstack([_scaled(node.seen, node.scales), self.gradient(node) * node.scales])
        sizes = np.abs(rows).max(axis=1, keepdims=True)
        rows /= np.where(sizes > 0.0, sizes, 1.0)
        tangent = np.linalg.svd(rows)[2][-1]
        if np.abs(rows @ tangent).max() > APART:
            raise Lost("the second parameter takes the crossing of two branches apart")
        sense = tangent[node.problem.second_index] if towards is None else tangent @ towards
        return replace(node, tangent=tangent if sense >= 0.0 else -tangent)


def both(first: Border, second: Border) -> Border:
    """Two equations."""

    def border(z: Vector, seen: Seen) -> tuple[Vector, Vector] | None:
        rows = first(z, seen), second(z, seen)
        if rows[0] is None or rows[1] is None:
            return None
        return np.hstack([row[0] for row in rows if row]), np.vstack([row[1] for row in rows if row])

    return border


class Vanishing(Condition):
    """Of functions of the derivatives of a run, whose own derivatives are differences. word: of events, of all motions
    on the curve."""

    word: Word

    @abstractmethod
    def function(self, node: Node) -> Callable[[Seen], Vector]:
        """Of a run near a node: (k,) numbers that vanish on the curve."""

    def _gradient(self, function: Callable[[Seen], Vector], problem: Problem, z: Vector, scales: Vector) -> Vector:
        """(k, len(z)) by central differences, one-sided ones where an event comes or goes."""
        columns = []
        for k in range(len(z)):

            def moved(widths: int, k: int = k) -> Vector | None:
                shift = np.zeros_like(z)
                shift[k] = widths * WIDTH * scales[k]
                seen = look(problem, z + shift)
                return None if seen is None or cyclic(seen.word) != self.word else function(seen)

            columns.append(_slope(moved) / (WIDTH * scales[k]))
        return np.array(columns).T

    def gradient(self, node: Node) -> Vector:
        return self._gradient(self.function(node), node.problem, node.z, node.scales)

    def solved(self, node: Node, guess: Vector, pin: Border, step: float) -> Node:
        problem, scales, function = node.problem, node.scales, self.function(node)

        def border(z: Vector, seen: Seen) -> tuple[Vector, Vector] | None:
            try:
                return function(seen), self._gradient(function, problem, z, scales)
            except Lost:
                return None

        return solved(problem, scales, guess, both(border, pin), word=self.word)


def _slope(moved: Callable[[int], Vector | None]) -> Vector:
    """The derivative of a function by widths, at 0."""
    up, down = moved(1), moved(-1)
    if up is not None and down is not None:
        return (up - down) / 2.0
    side = -1 if up is None else 1
    at, beside, beyond = moved(0), down if up is None else up, moved(2 * side)
    if at is None or beside is None or beyond is None:
        raise Lost("there is no such run")
    return side * (4.0 * beside - beyond - 3.0 * at) / 2.0


@dataclass(frozen=True, eq=False)
class Determinant(Vanishing):
    """Of a fold, a flip, a Neimark-Sacker or Hopf point: a multiplier is +1, -1 or, in a pair, on the circle."""

    passes: str
    word: Word

    def function(self, node: Node) -> Callable[[Seen], Vector]:
        return lambda seen: np.array([self._value(node.problem, seen, node.scales)])

    def _value(self, problem: Problem, seen: Seen, scales: Vector) -> float:
        if self.passes == "+1":
            rows = np.ones(problem.size, bool)
            rows[[problem.width, -1]] = False
            return float(np.linalg.det(_scaled(seen, scales)[:, rows]))
        return passing_test(problem.own(problem.spectrum(seen)), self.passes)


@dataclass(frozen=True, eq=False)
class Rank(Vanishing):
    """Of a point where branches cross: the Jacobian by all but the second parameter has a rank that is less by one.

    These are two equations for one parameter more. They go together as long as the second parameter leaves the
    symmetry, or the motion that is always there, alone; where it takes the crossing apart there is no such curve.
    """

    word: Word

    def function(self, node: Node) -> Callable[[Seen], Vector]:
        """The part of the bordered inverse that vanishes where the rank is less."""
        n, scales = node.problem.width, node.scales

        def matrix(seen: Seen) -> Vector:
            return np.delete(_scaled(seen, scales), n, axis=1)

        left_vectors, _, right = np.linalg.svd(matrix(node.seen))

        def value(seen: Seen) -> Vector:
            bordered = np.block([[matrix(seen), left_vectors[:, -1:]], [right[-2:], np.zeros((2, 1))]])
            sides = np.vstack([np.zeros((len(left_vectors), 2)), np.eye(2)])
            return np.linalg.solve(bordered, sides)[-1]

        return value


@dataclass(frozen=True, eq=False)
class Miss(Condition):
    """Of a change of the word.

    Attributes:
        like: the near miss of one of the motions.
        word: of events, of all motions on the curve: that without the event.
    """

    like: Passing
    word: Word

    def of(self, node: Node) -> Passing:
        """The near miss of a motion on the curve: that which is least."""
        same = [miss for miss in node.seen.misses if miss.key == self.like.key]
        if not same:
            raise Lost("the near miss is gone")
        return min(same, key=lambda miss: miss.value / miss.size(node.scales))

    def gradient(self, node: Node) -> Vector:
        return self.of(node).gradient

    def place(self, node: Node, fixed: int | None = None) -> Vector:
        """Where the miss is none, from a motion so near that the rest is linear."""
        return (node.u + self._across(node, -self.of(node).value, fixed)) * node.scales

    def _across(self, node: Node, change: float, fixed: int | None = None) -> Vector:
        """Change of u by which the miss changes so much, straight across the curve if nothing is held."""
        rows = np.vstack([_scaled(node.seen, node.scales), self.of(node).gradient * node.scales])
        right = np.append(np.zeros(len(rows) - 1), change)
        if fixed is not None:
            rows, right = np.vstack([rows, np.eye(len(node.z))[fixed]]), np.append(right, 0.0)
        solution: Any = np.linalg.lstsq(rows, right, rcond=None)[0]
        return solution

    def solved(self, node: Node, guess: Vector, pin: Border, step: float) -> Node:
        miss = self.of(node)
        away = miss.gradient * node.scales
        size = float(np.linalg.norm(away))
        solution = None
        for push in PUSHES:
            target = max(LEAST_MISS, push * step**2) * size
            try:
                solution = self._at(node, guess + target * away / size**2, target, pin, miss.time)
                break
            except Lost:
                continue
        if solution is None:
            raise Lost("the near miss becomes an event")
        while True:
            miss = self.of(solution)
            least = LEAST_MISS * miss.size(node.scales)
            if miss.value <= 1.5 * least:
                return solution
            target = max(least, 0.03 * miss.value)
            for _ in range(8):
                try:
                    guess = solution.u + self._across(solution, target - miss.value)
                    solution = self._at(solution, guess, target, pin, miss.time)
                    break
                except Lost:
                    target = (miss.value + target) / 2
            else:
                raise Lost("the near miss becomes another event")

    def _at(self, node: Node, guess: Vector, target: float, pin: Border, time: float) -> Node:
        turned = self.like.turned
        border = self._least(target) if turned else value_border(self.like, target, time)
        solution = solved(node.problem, node.scales, guess, both(border, pin), word=self.word)
        if not turned and solution.seen.match(self.like, time) is None:
            raise Lost("the near miss is gone")
        return solution

    def _least(self, target: float) -> Border:
        """The miss at a value, wherever in the period it is: one that an event turns is seen at whichever of them."""

        def border(z: Vector, seen: Seen) -> tuple[float, Vector] | None:
            same = (miss for miss in seen.misses if miss.key == self.like.key)
            least = min(same, key=lambda candidate: candidate.value, default=None)
            return None if least is None else (least.value - target, least.gradient)

        return border
