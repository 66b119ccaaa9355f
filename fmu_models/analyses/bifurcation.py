"""Parameter values at which an eigenvalue of a periodic motion at a strobe, or of a map, reaches +1 or -1.

    det(DP^n - 1) = 0   saddle-node: two motions meet and are gone beyond (or exchange their stability)
    det(DP^n + 1) = 0   flip: a motion of twice the period branches off

They are smooth special points of the branch of a motion. A motion that has branched off in a flip is not followed back
through it: the flip belongs to the shorter motion.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.continuation.begin import begin_of, problem_of
from fmu_models.continuation.branch import followed_from
from fmu_models.continuation.special.kinds import BRANCH_POINT, FLIP, FOLD
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.periodic import PeriodicMotion, Vector, find_cycles, find_periodic, motion_at
from fmu_models.sections.system import SectionSystem

KINDS = {FOLD: "saddle-node", BRANCH_POINT: "saddle-node", FLIP: "flip"}
SAME = 1e-4  # share of the box up to which the motions at one value are one: a double zero has the root of rounding
POINTS = 2000  # of a branch, at most


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

    @property
    def miss(self) -> float:
        """How far the nearest eigenvalue is from where it should be."""
        return float(np.abs(self.motion.stability.eigenvalues - (-1.0 if self.kind == "flip" else 1.0)).min())


def find_bifurcations(
    system: SectionSystem,
    parameter: str,
    begin: float,
    end: float,
    *,
    period: int = 1,
    guess: Sequence[Sequence[float]] | Vector | None = None,
) -> tuple[Bifurcation, ...]:
    """What the branches of the motions of one period that exist at ``begin`` meet up to ``end``, by parameter value.

    Args:
        system: a map (``Iteration``) or a strobe.
        parameter: name of the one that changes.
        begin, end: its values, in its unit; ``end`` may be the smaller one.
        period: number of points of the motions.
        guess: (period, n) points near the motion to follow; those of a map are sought in its box if it is left out.

    Raises:
        StickslipError: an unknown parameter, values that the system cannot have, no motion at ``begin``, or another
            section than a strobe.
    """
    system.check(parameter, np.array([begin, end], dtype=float))
    if begin == end or period < 1:
        raise StickslipError(f"Nothing changes: {parameter} goes from {begin:g} to {end:g}, with period {period}.")
    system = system.at(**{parameter: float(begin)})
    for points in (motions := _motions_at_begin(system, period, guess)):
        if points.shape[1] != len(system.states):
            raise StickslipError(f"A point of {system.name} has {len(system.states)} numbers: {system.states}.")
    if not motions:
        raise StickslipError(
            f"{system.name} has no motion of period {period} at {parameter} = {begin:g} that could be followed. Begin "
            "where it exists, from a guess near it; 'find_periodic' and 'stickslip map' show what a map has."
        )
    bifurcations: list[Bifurcation] = []
    met = (bifurcation for points in motions for bifurcation in _met(system, parameter, (begin, end), points))
    for bifurcation in sorted(met, key=lambda bifurcation: bifurcation.miss):
        if not any(_equal(system, bifurcation, nearer) for nearer in bifurcations):
            bifurcations.append(bifurcation)
    return tuple(sorted(bifurcations, key=lambda bifurcation: bifurcation.value))


def _motions_at_begin(system: SectionSystem, period: int, guess: ArrayLike | None) -> list[Vector]:
    if guess is not None:
        return list(find_cycles(system, np.asarray(guess, dtype=float).reshape(1, period, -1)))
    if isinstance(system, Iteration):
        return [motion.points for motion in find_periodic(system, period)]
    raise StickslipError(f"Say near which points a motion of {system.name} is to be followed: guess=[[...]].")


def _met(system: SectionSystem, parameter: str, ends: tuple[float, float], points: Vector) -> Iterator[Bifurcation]:
    """What the motion through points (period, n) at the first end meets on its branch."""
    between = min(ends), max(ends)
    node = begin_of(
        system, problem_of(system, parameter).folded(len(points)), between, points[0].tolist(), settle=False
    )
    towards = node if (ends[1] - ends[0]) * node.tangent[-1] > 0.0 else node.turned()
    for special in followed_from(towards, between, POINTS).special:
        if special.kind in KINDS:
            turns = np.arange(len(points)) * special.node.problem.turns / len(points)
            states = [dict(zip(special.state, special.at(turn).tolist(), strict=True)) for turn in turns]
            motion = motion_at(system.at(**{parameter: special.value}), np.array([*map(system.start, states)]))
            yield Bifurcation(parameter, special.value, KINDS[special.kind], motion)


def _equal(system: SectionSystem, first: Bifurcation, second: Bifurcation) -> bool:
    """Whether two motions came upon the same."""
    if first.kind != second.kind or abs(first.value - second.value) > 1e-9 * max(1.0, abs(first.value)):
        return False
    within = SAME * system.sizes()
    turned = (np.roll(second.motion.points, k, axis=0) for k in range(second.motion.period))
    return any((np.abs(system.difference(first.motion.points - points)) <= within).all() for points in turned)
