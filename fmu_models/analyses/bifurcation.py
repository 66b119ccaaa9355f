"""Parameter values at which an eigenvalue of a periodic motion at a section reaches +1 or -1.

    det(DP^n - 1) = 0   saddle-node: two motions meet and are gone beyond (or exchange their stability)
    det(DP^n + 1) = 0   flip: a motion of twice the period branches off

A motion is followed along the parameter. Where a determinant changes its sign, the value is found on the branch; where
the branch ends, it is found together with the points, from the equations of the motion and of the determinant. A motion
that has branched off in a flip is not followed back through it: the flip belongs to the shorter motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, root

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.periodic import PeriodicMotion, Vector, find_cycles, find_periodic, motion_at
from fmu_models.sections.system import SectionSystem

# a point that moves by more than this share of the box in one step of the parameter may be of another branch
NEAR = 0.03
# shortest step of the parameter, as a share of the first one
SHORTEST = 1e-6


@dataclass(frozen=True, eq=False)
class Bifurcation(Shown):
    """A value of a parameter, and the motion there.

    Attributes:
        parameter: its name.
        value: in its unit.
        kind: "saddle-node" or "flip".
        motion: with an eigenvalue at +1 or -1.
    """

    parameter: str
    value: float
    kind: str
    motion: PeriodicMotion


def find_bifurcations(
    system: SectionSystem,
    parameter: str,
    begin: float,
    end: float,
    *,
    period: int = 1,
    guess: Sequence[Sequence[float]] | Vector | None = None,
    steps: int = 100,
) -> tuple[Bifurcation, ...]:
    """What the motions of one period that exist at ``begin`` meet on the way to ``end``, by parameter value.

    Args:
        system: a map (``Iteration``) or any other.
        parameter: name of the one that changes.
        begin, end: its values, in its unit; ``end`` may be the smaller one.
        period: number of points of the motions.
        guess: (period, n) points near the motion to follow; those of a map are sought in its box if it is left out.
        steps: number of steps from ``begin`` to ``end``, at least.

    Raises:
        StickslipError: an unknown parameter, values that the system cannot have, or no motion at ``begin``.
    """
    system.check(parameter, np.array([begin, end], dtype=float))
    if begin == end or period < 1:
        raise StickslipError(f"Nothing changes: {parameter} goes from {begin:g} to {end:g}, with period {period}.")
    branch = _Branch(system.at(**{parameter: begin}), parameter)
    for points in (motions := _motions_at_begin(branch.system, period, guess)):
        if points.shape[1] != len(system.states):
            raise StickslipError(f"A point of {system.name} has {len(system.states)} numbers: {system.states}.")
    if not motions:
        raise StickslipError(
            f"{system.name} has no motion of period {period} at {parameter} = {begin:g} that could be followed. Begin "
            "where it exists, from a guess near it; 'find_periodic' and 'stickslip map' show what a map has."
        )
    bifurcations: list[Bifurcation] = []
    for points in motions:
        for value, kind, cycle in branch.follow(points, begin, end, steps):
            candidate = Bifurcation(parameter, value, kind, motion_at(branch.at(value), cycle))
            if not any(_equal(branch, candidate, earlier) for earlier in bifurcations):
                bifurcations.append(candidate)
    return tuple(sorted(bifurcations, key=lambda bifurcation: bifurcation.value))


def _motions_at_begin(system: SectionSystem, period: int, guess: Any) -> list[Vector]:
    if guess is not None:
        return list(find_cycles(system, np.asarray(guess, dtype=float).reshape(1, period, -1)))
    if isinstance(system, Iteration):
        return [motion.points for motion in find_periodic(system, period)]
    raise StickslipError(f"Say near which points a motion of {system.name} is to be followed: guess=[[...]].")


def _equal(branch: _Branch, first: Bifurcation, second: Bifurcation) -> bool:
    """Both motions of a saddle-node come upon it, each to the root of rounding that a double zero allows."""
    if first.kind != second.kind or abs(first.value - second.value) > 1e-9 * max(1.0, abs(first.value)):
        return False
    shifts = range(first.motion.period)
    return any(branch.near(first.motion.points, np.roll(second.motion.points, k, axis=0), 1e-4) for k in shifts)


@dataclass(frozen=True, eq=False)
class _Branch:
    """The motions of a system along one of its parameters."""

    system: SectionSystem
    parameter: str

    def at(self, value: float) -> SectionSystem:
        """The system at a value of the parameter."""
        return self.system.at(**{self.parameter: float(value)})

    def near(self, points: Vector, others: Vector, share: float) -> bool:
        """Whether no point differs by more than a share of the box."""
        size = self.system.sizes()
        return bool((np.abs(self.system.difference(points - others)) <= share * size).all())

    def corrected(self, value: float, guess: Vector) -> Vector | None:
        """The motion at a value near a guess; None if there is none, or one of a shorter period."""
        cycles = find_cycles(self.at(value), guess[None])
        if not len(cycles) or not self.near(cycles[0], guess, NEAR):
            return None
        return None if self.repeats(cycles[0], 1e-6) else cycles[0]

    def repeats(self, points: Vector, share: float) -> bool:
        """Whether the points are those of a shorter motion, up to a share of the box."""
        divisors = [n for n in range(1, len(points)) if len(points) % n == 0]
        return any(self.near(points, np.roll(points, n, axis=0), share) for n in divisors)

    def test(self, kind: str, value: float, points: Vector) -> float:
        """det(DP^n - 1) for a saddle-node, det(DP^n + 1) for a flip."""
        derivative = np.eye(points.shape[1])
        for jacobian in self.at(value).step(points).derivatives:
            derivative = jacobian @ derivative
        sign = 1.0 if kind == "flip" else -1.0
        return float(np.linalg.det(derivative + sign * np.eye(points.shape[1])))

    def follow(self, points: Vector, first: float, end: float, steps: int) -> Iterator[tuple[float, str, Vector]]:
        """Values, kinds and points of what a motion meets on the way."""
        value, step = first, (end - first) / steps
        rate = np.zeros_like(points)  # of the points along the parameter: where two branches cross, it tells them apart
        while abs(end - value) > 1e-12 * abs(end - first):
            reach = value + np.sign(step) * min(abs(step), abs(end - value))
            after = self.corrected(reach, points + (reach - value) * rate)
            if after is None:
                step /= 2
                if abs(step) < SHORTEST * abs(end - first) / steps:
                    yield from self._fold(value, points)
                    return
                continue
            for kind in ("saddle-node", "flip"):
                before, behind = self.test(kind, value, points), self.test(kind, reach, after)
                if before * behind < 0.0 or behind == 0.0:
                    yield from self._crossing(kind, (value, points), (reach, after))
            rate = self.system.difference(after - points) / (reach - value)
            value, points = reach, after
            step = np.sign(step) * min(1.5 * abs(step), abs(end - first) / steps)

    def _crossing(
        self, kind: str, before: tuple[float, Vector], behind: tuple[float, Vector]
    ) -> Iterator[tuple[float, str, Vector]]:
        (low, first), (high, last) = before, behind
        turn = self.system.difference(last - first)

        def points(value: float) -> tuple[Vector, bool]:
            guess = first + (value - low) / (high - low) * turn
            cycles = find_cycles(self.at(value), guess[None])
            return (cycles[0], True) if len(cycles) else (guess, False)

        crossing = brentq(lambda value: self.test(kind, value, points(value)[0]), low, high, xtol=1e-15)
        value = float(np.asarray(crossing))
        cycle, solved = points(value)
        # where two branches cross Newton's method may fail or change over, and the sign with it
        largest = max(abs(self.test(kind, low, first)), abs(self.test(kind, high, last)))
        if solved and abs(self.test(kind, value, cycle)) <= 1e-6 * largest:
            yield value, kind, cycle

    def _fold(self, value: float, points: Vector) -> Iterator[tuple[float, str, Vector]]:
        """The end of a branch at a saddle-node; nothing if it ends at a jump of the map or in a shorter motion."""
        shape = points.shape

        def equations(unknown: Vector) -> Vector:
            cycle, at = unknown[:-1].reshape(shape), float(unknown[-1])
            system = self.at(at)
            miss = system.difference(system.step(cycle).points - np.roll(cycle, -1, axis=0))
            return np.append(miss.ravel(), self.test("saddle-node", at, cycle))

        with np.errstate(all="ignore"):
            solution = root(equations, np.append(points.ravel(), value), method="hybr", options={"xtol": 1e-15})
        cycle, at = solution.x[:-1].reshape(shape), float(solution.x[-1])
        solved = np.abs(equations(solution.x)).max() <= 1e-10
        close = self.near(cycle, points, NEAR) and abs(at - value) <= 1e-2 * max(1.0, abs(value))
        if solved and close and not self.repeats(cycle, 1e-3):
            yield at, "saddle-node", self.system.wrapped(cycle)
