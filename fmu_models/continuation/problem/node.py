"""One motion of a branch, and Newton's method to it.

A motion is a root of n (n + 1) equations in one unknown more, so that one equation is free: the border. It fixes how
far along the branch to look (pseudo-arclength), the parameter, or a function of the events that is to have a value: the
speed of an impact, the least gap of a miss. Unknowns are measured by their scales: u = z / scales.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.problem import (
    EVENT,
    Passing,
    Problem,
    Seen,
    Vector,
    Word,
    cyclic,
    product_of_pairs,
)
from fmu_models.continuation.special.kinds import BRANCH_POINT, FLIP, FOLD, KINDS, NEIMARK_SACKER

# the residual of a root, in scales, and of one that rounding does not let come nearer
ROOT, ROUNDED = 1e-13, 1e-9
STEPS = 12
SECANT = 1e-7  # residual, in scales, from which Newton's method begins after Broyden's
# of the product of a pair that turns without growing, from 1: rounding, which has no sign
TURNS_ON = 1e-14
# so near to its half, in u, a motion of twice the period is one of the period: where branches meet, and elsewhere
HALF, SAME = 1e-4, 1e-8

# of z and what is seen there: its value, and its derivative by z, or several; None where it has none
Border = Callable[[Vector, Seen], tuple[float | Vector, Vector] | None]


class Lost(Exception):
    """There is no such motion, as far as Newton's method tells; at the unknowns ``nearest`` it was missed by least, if
    by any. Functions that look for a motion, or a point of a branch, say in their docstring when they raise it."""

    def __init__(self, why: str, nearest: Vector | None = None) -> None:
        super().__init__(why)
        self.nearest = nearest


@dataclass(frozen=True, eq=False)
class Node:
    """A motion on a branch.

    Attributes:
        problem: whose motion it is.
        scales: of z.
        z: unknowns.
        seen: the run from there.
        tangent: unit vector along the branch, of u.
        iterations: of Newton's method.
    """

    problem: Problem
    scales: Vector
    z: Vector
    seen: Seen
    tangent: Vector
    iterations: int = 0

    @property
    def u(self) -> Vector:
        """Unknowns in their scales."""
        return self.z / self.scales

    @property
    def value(self) -> float:
        """Of the parameter."""
        return float(self.z[-1])

    @cached_property
    def word(self) -> Word:
        """Of events, from whichever of them makes it least."""
        return cyclic(self.seen.word)

    @cached_property
    def multipliers(self) -> Complex:
        """Largest first."""
        return self.problem.spectrum(self.seen)

    @cached_property
    def stable(self) -> bool:
        """Whether all multipliers that count lie inside the unit circle."""
        return bool((np.abs(self.problem.own(self.multipliers)) < 1.0).all())

    @cached_property
    def tests(self) -> dict[str, float]:
        """Functions that change their sign at a fold, a branch point, a flip, a Neimark-Sacker point."""
        multipliers = self.problem.own(self.multipliers)
        crossing = float(np.linalg.det(np.vstack([scaled(self), self.tangent])))
        passing = {kind: passing_test(multipliers, KINDS[kind].passes) for kind in (FLIP, NEIMARK_SACKER)}
        return {FOLD: float(self.tangent[-1]), BRANCH_POINT: crossing, **passing}

    def matched(self, like: Passing) -> Passing:
        """The event or miss of another motion, as this one has it. Lost: it has none."""
        passing = self.seen.match(like)
        if passing is None:
            raise Lost("the event is gone" if like.slot == EVENT else "the near miss is gone")
        return passing

    def state_at(self, turns: float) -> Vector:
        """(n,) the state at a phase of the forcing, in turns; of a cycle so many seconds after a place on it."""
        return self.problem.shifted(self.z, self.seen, turns)[: len(self.problem.states)]

    def repeats(self, within: float = HALF) -> bool:
        """Whether a motion of an even number of periods repeats itself after half of them."""
        if self.problem.turns % 2 and not self.problem.autonomous:
            return False
        half = self.problem.part(self.z, self.seen)
        return bool(np.abs((half - self.z) / self.scales).max() < within)

    def folded(self, times: int) -> Node | None:
        """The motion taken so many times; None if it cannot be followed for so long."""
        problem = self.problem.folded(times, float(np.abs(self.multipliers).max(initial=0.0)))
        scales, z = problem.unfolded(self.scales, times), problem.unfolded(self.z, times)
        seen = look(problem, z)
        return None if seen is None else Node(problem, scales, z, seen, tangent_of(seen, scales))

    def turned(self) -> Node:
        """The same, met from the other side."""
        return Node(self.problem, self.scales, self.z, self.seen, -self.tangent, self.iterations)

    def arclength(self, distance: float) -> Border:
        """So far along the tangent."""
        return arclength(self.u, self.tangent, self.scales, distance)

    def corrected(self, guess: Vector, border: Border, *, near: bool = False, **options: Any) -> Node:
        """The motion near a guess, its tangent in the sense of this one; options as for ``solved``. near: the border
        does not depend on what is seen, and derivatives are about those here."""
        if near:
            guess = _approached(self.problem, self.scales, guess, border, self.seen)
        return solved(self.problem, self.scales, guess, border, towards=self.tangent, **options)

    def along(self, gradient: Vector) -> float:
        """Derivative along the branch, by u, of what has a gradient by z."""
        return float((gradient * self.scales) @ self.tangent)


def passing_test(multipliers: Complex, passes: str) -> float:
    """What changes its sign where a multiplier passes "+1", "-1" or, in a pair, the "circle"."""
    if passes != "circle":
        return float(np.prod(multipliers - (1.0 if passes == "+1" else -1.0)).real)
    rows, columns = np.tril_indices(len(multipliers), -1)
    factors = multipliers[rows] * multipliers[columns] - 1.0
    factors[np.abs(factors) <= TURNS_ON] = 0.0
    return float(product_of_pairs(factors).real)


def scaled(node: Node) -> Vector:
    """The Jacobian by u, its rows measured alike."""
    return _scaled(node.seen, node.scales)


def _scaled(seen: Seen, scales: Vector) -> Vector:
    rows = scales[: len(seen.residual)].copy()
    jacobian = seen.jacobian * scales
    if seen.width < len(rows):  # a step of u along the motion is what the equation of the phase forbids
        jacobian[-1] = seen.jacobian[-1] / scales
        rows[-1] = np.abs(jacobian[-1]).max() or 1.0
    return jacobian / rows[:, None]


def tangent_of(seen: Seen, scales: Vector, towards: Vector | None = None) -> Vector:
    """Unit vector of u along the branch; nearest to a given one, or with a growing parameter."""
    _, _, right_vectors = np.linalg.svd(_scaled(seen, scales))
    tangent = right_vectors[-1]
    sense = tangent[-1] if towards is None else tangent @ towards
    return tangent if sense >= 0.0 else -tangent


def look(problem: Problem, z: Vector) -> Seen | None:
    """The run from z, None where there is none."""
    try:
        seen = problem.see(z)
    except StickslipError:
        return None
    return seen if np.isfinite(seen.residual).all() and np.isfinite(seen.jacobian).all() else None


def solved(
    problem: Problem,
    scales: Vector,
    guess: Vector,
    border: Border,
    *,
    towards: Vector | None = None,
    reach: float = 0.3,
    word: Word | None = None,
    halvings: int = 4,
) -> Node:
    """The motion at a guess of u that has the border at zero, of more equations than one too, if they go together.
    Lost: no convergence, or another word.

    Args:
        towards: the sense of its tangent.
        reach: how far from the guess it may be, in u.
        word: which runs on the way must have, if it is known; a step that leads out of it is halved.
        halvings: of a step into a run that there is none of, at most.
    """
    u, step, last = guess.copy(), np.zeros_like(guess), np.inf
    least, nearest = np.inf, None
    previous: Vector | None = None
    for iteration in range(STEPS):
        evaluation = _evaluated(problem, scales, u, border, word)
        for _ in range(halvings if previous is not None else 0):
            if evaluation is not None:
                break
            step = step / 2
            assert previous is not None
            u = previous - step
            evaluation = _evaluated(problem, scales, u, border, word)
        if evaluation is None:
            raise Lost("there is no such run", nearest)
        seen, residual, matrix = evaluation
        size = float(np.abs(residual).max())
        if size < least:
            least, nearest = size, u * scales
        done = size <= ROOT or (size <= ROUNDED and size > 0.3 * last)
        if done:
            return Node(problem, scales, u * scales, seen, tangent_of(seen, scales, towards), iteration)
        if size > 100.0 * last and iteration > 2:
            break
        last = size
        try:
            square = matrix.shape[0] == matrix.shape[1]
            step = np.linalg.solve(matrix, residual) if square else np.linalg.lstsq(matrix, residual)[0]
        except np.linalg.LinAlgError:
            break
        previous, u = u, u - step
        if not np.abs(u - guess).max() <= reach:
            break
    raise Lost("Newton's method does not converge", nearest)


def _approached(problem: Problem, scales: Vector, guess: Vector, border: Border, like: Seen) -> Vector:
    """A guess of u brought near the motion by Broyden's method, from the derivatives of a neighbour: by runs without
    tangents, where these are dear. The guess itself where that does not lead there."""
    u, step, last, update = guess, np.zeros_like(guess), np.inf, 0.0
    for _ in range(STEPS):
        try:
            missed = problem.missed(u * scales)
        except StickslipError:
            return guess
        equations = None if missed is None else _equations(replace(like, residual=missed), scales, u, border)
        if equations is None:
            return guess
        residual, matrix = equations
        size = float(np.abs(residual).max())
        if size <= 10.0 * ROOT or size > 0.5 * last:
            return u if size < SECANT else guess
        if step.any():
            update = update - np.outer(residual, step) / (step @ step)
        step, last = np.linalg.solve(matrix + update, residual), size
        u = u - step
    return guess


def _evaluated(
    problem: Problem, scales: Vector, u: Vector, border: Border, word: Word | None
) -> tuple[Seen, Vector, Vector] | None:
    seen = look(problem, u * scales)
    if seen is None or (word is not None and cyclic(seen.word) != word):
        return None
    equations = _equations(seen, scales, u, border)
    return None if equations is None else (seen, *equations)


def _equations(seen: Seen, scales: Vector, u: Vector, border: Border) -> tuple[Vector, Vector] | None:
    """Residual and matrix, the border below; None where that has no value."""
    bound = border(u * scales, seen)
    if bound is None:
        return None
    jacobian = _scaled(seen, scales)
    rows = np.append(scales[: seen.width], np.ones(len(seen.residual) - seen.width))
    value, gradient = bound
    gradient = np.atleast_2d(gradient) * scales
    size = np.abs(gradient).max(axis=1)
    size[size == 0.0] = 1.0
    residual = np.append(seen.residual / rows, value / size)
    return residual, np.vstack([jacobian, gradient / size[:, None]])


def arclength(u: Vector, tangent: Vector, scales: Vector, distance: float) -> Border:
    """At a distance along a tangent from u."""

    def border(z: Vector, seen: Seen) -> tuple[float, Vector]:
        return float(tangent @ (z / scales - u)) - distance, tangent / scales

    return border


def parameter(value: float) -> Border:
    """At a value of the parameter."""
    return pinned(-1, value)


def pinned(index: int, value: float) -> Border:
    """With an unknown at a value."""

    def border(z: Vector, seen: Seen) -> tuple[float, Vector]:
        gradient = np.zeros_like(z)
        gradient[index] = 1.0
        return float(z[index]) - value, gradient

    return border


def extrapolated(at: Sequence[float] | Vector, values: Vector) -> Vector:
    """The polynomial through values (k, ...) at places (k,), at 0."""
    places = np.asarray(at, dtype=float)
    total = np.zeros_like(values[0])
    for i, abscissa in enumerate(places):
        others = np.delete(places, i)
        with np.errstate(divide="ignore", invalid="ignore"):  # none goes through two values at one place
            total = total + values[i] * np.prod(others / (others - abscissa))
    return total
