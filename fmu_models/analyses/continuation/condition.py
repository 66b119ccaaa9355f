"""What holds all along a curve of special points: one equation more, for one parameter more.

    fold            det of d residual / d (x, [T]) = 0
    flip            det(M + 1) = 0
    Neimark-Sacker  det(M (x) M - 1) = 0, the bialternate product; of an equilibrium over a share of a period, Hopf too
    where the word changes   the least value h of a near miss: 0

The gradient of a determinant is a difference of exact derivatives; that of a miss is exact.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.analyses.continuation.discontinuous import LEAST_MISS, miss_border, nearest, size_of
from fmu_models.analyses.continuation.node import Border, Lost, Node, _scaled, look, solved
from fmu_models.analyses.continuation.problem import Passing, Problem, Seen, Vector, Word

# in u: of the differences that give the gradient of a determinant
WIDTH = 1e-6
# by how much a guess is pushed from the event, in squares of the step that led to it
PUSHES = (0.0, 0.1, 1.0, 10.0, 100.0)


class Condition(ABC):
    """An equation on motions over two parameters.

    Attributes:
        kind: "fold", "flip", "Neimark-Sacker"; "" where the word changes.
    """

    kind: str

    @abstractmethod
    def solved(self, node: Node, guess: Vector, pin: Border, step: float) -> Node:
        """The motion near a guess of u that fulfils it, and the pin too.

        Args:
            node: one of the curve.
            step: how far from the node, in u, the guess is.

        Raises:
            Lost: none is near, or of another word.
        """

    @abstractmethod
    def gradient(self, node: Node) -> Vector:
        """(len(z),) of it, by z."""

    def place(self, node: Node, held: int | None = None) -> Vector:
        """z of the point itself; one of its unknowns may be held."""
        return node.z


def both(first: Border, second: Border) -> Border:
    """Two equations."""

    def border(z: Vector, seen: Seen) -> tuple[Vector, Vector] | None:
        found = first(z, seen), second(z, seen)
        if found[0] is None or found[1] is None:
            return None
        return np.array([one[0] for one in found if one]), np.array([one[1] for one in found if one])

    return border


def pinned(place: int, value: float) -> Border:
    """An unknown at a value."""

    def border(z: Vector, seen: Seen) -> tuple[float, Vector]:
        gradient = np.zeros_like(z)
        gradient[place] = 1.0
        return float(z[place]) - value, gradient

    return border


@dataclass(frozen=True, eq=False)
class Determinant(Condition):
    """Of a smooth bifurcation.

    Attributes:
        word: of events, of all motions on the curve.
    """

    kind: str
    word: Word

    def _value(self, problem: Problem, seen: Seen, scales: Vector) -> float:
        if self.kind == "fold":
            kept = np.ones(problem.size, bool)
            kept[[len(problem.states), -1]] = False
            return float(np.linalg.det(_scaled(seen, scales)[:, kept]))
        own: Any = problem.own(problem.multipliers(seen.monodromy))
        if self.kind == "flip":
            return float(np.prod(own + 1.0).real)
        pairs = [own[i] * own[j] for i in range(len(own)) for j in range(i)]
        return float(np.prod(np.array(pairs) - 1.0).real)

    def _gradient(self, problem: Problem, z: Vector, scales: Vector) -> Vector | None:
        gradient = np.empty_like(z)
        for k in range(len(z)):
            shift = np.zeros_like(z)
            shift[k] = WIDTH * scales[k]
            sides = [look(problem, z + shift), look(problem, z - shift)]
            if sides[0] is None or sides[1] is None:
                return None
            values = [self._value(problem, one, scales) for one in sides if one]
            gradient[k] = (values[0] - values[1]) / (2.0 * shift[k])
        return gradient

    def gradient(self, node: Node) -> Vector:
        found = self._gradient(node.problem, node.z, node.scales)
        if found is None:
            raise Lost("there is no such run")
        return found

    def solved(self, node: Node, guess: Vector, pin: Border, step: float) -> Node:
        problem, scales = node.problem, node.scales

        def border(z: Vector, seen: Seen) -> tuple[float, Vector] | None:
            gradient = self._gradient(problem, z, scales)
            return None if gradient is None else (self._value(problem, seen, scales), gradient)

        return solved(problem, scales, guess, both(border, pin), word=self.word)


@dataclass(frozen=True, eq=False)
class Miss(Condition):
    """Of a change of the word.

    Attributes:
        like: the near miss of one of the motions.
        word: of events, of all motions on the curve: that without the event.
    """

    like: Passing
    word: Word
    kind: str = ""

    def of(self, node: Node) -> Passing:
        """The near miss of a motion on the curve: that which is least."""
        same = [one for one in node.seen.misses if one.key == self.like.key]
        if not same:
            raise Lost("the near miss is gone")
        return min(same, key=lambda one: one.value / size_of(one, node.scales))

    def gradient(self, node: Node) -> Vector:
        return self.of(node).gradient

    def place(self, node: Node, held: int | None = None) -> Vector:
        """Where the miss is none, from a motion so near that the rest is linear."""
        return (node.u + self._across(node, -self.of(node).value, held)) * node.scales

    def _across(self, node: Node, change: float, held: int | None = None) -> Vector:
        """Change of u by which the miss changes so much, straight across the curve if nothing is held."""
        rows = np.vstack([_scaled(node.seen, node.scales), self.of(node).gradient * node.scales])
        right = np.append(np.zeros(len(rows) - 1), change)
        if held is not None:
            rows, right = np.vstack([rows, np.eye(len(node.z))[held]]), np.append(right, 0.0)
        found: Any = np.linalg.lstsq(rows, right, rcond=None)[0]
        return found

    def solved(self, node: Node, guess: Vector, pin: Border, step: float) -> Node:
        miss = self.of(node)
        away = miss.gradient * node.scales
        size = float(np.linalg.norm(away))
        found = None
        for push in PUSHES:
            target = max(LEAST_MISS, push * step**2) * size
            try:
                found = self._at(node, guess + target * away / size**2, target, pin, miss.time)
                break
            except Lost:
                continue
        if found is None:
            raise Lost("the near miss becomes an event")
        while True:
            miss = self.of(found)
            least = LEAST_MISS * size_of(miss, node.scales)
            if miss.value <= 1.5 * least:
                return found
            target = max(least, 0.03 * miss.value)
            for _ in range(8):
                try:
                    guess = found.u + self._across(found, target - miss.value)
                    found = self._at(found, guess, target, pin, miss.time)
                    break
                except Lost:
                    target = (miss.value + target) / 2
            else:
                raise Lost("the near miss becomes another event")

    def _at(self, node: Node, guess: Vector, target: float, pin: Border, time: float) -> Node:
        border = both(miss_border(self.like, target, [time]), pin)
        found = solved(node.problem, node.scales, guess, border, word=self.word)
        if nearest(found.seen.misses, self.like, time, found.seen.length) is None:
            raise Lost("the near miss is gone")
        return found
