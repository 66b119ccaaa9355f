"""Parameter values at which an eigenvalue of a periodic motion at a strobe, or of a map, reaches +1 or -1.

    det(DP^n - 1) = 0   saddle-node: two motions meet and are gone beyond (or exchange their stability)
    det(DP^n + 1) = 0   flip: a motion of twice the period branches off

They are smooth special points of the branch of a motion. A motion that has branched off in a flip is not followed back
through it: the flip belongs to the shorter motion.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.continuation.begin import begin_of, problem_of
from fmu_models.continuation.branch import followed_from
from fmu_models.continuation.special.kinds import BRANCH_POINT, FLIP, FOLD
from fmu_models.sections.periodic import PeriodicMotion, motion_at
from fmu_models.sections.system import SectionSystem

KINDS = {FOLD: "saddle-node", BRANCH_POINT: "saddle-node", FLIP: "flip"}
SAME = 1e-4  # share of the box up to which the motions at one value are one: a double zero has the root of rounding
POINTS = 2000  # of a branch, at most


class Bifurcation(NamedTuple):
    """A value of a parameter, "saddle-node" or "flip", and the motion there, with an eigenvalue at +1 or -1."""

    value: float
    kind: str
    motion: PeriodicMotion

    @property
    def miss(self) -> float:
        """How far the nearest eigenvalue is from where it should be."""
        return float(np.abs(self.motion.stability.eigenvalues - (-1.0 if self.kind == "flip" else 1.0)).min())


def find_bifurcations(
    system: SectionSystem, parameter: str, ends: tuple[float, float], cycles: Iterable[Vector]
) -> list[Bifurcation]:
    """What branches of a map or a strobe meet between two values of a parameter, by value; they begin at the first of
    these with cycles (period, n). StickslipError: an unknown parameter, or values that the system cannot have."""
    system.check(parameter, np.array(ends, dtype=float))
    if ends[0] == ends[1]:
        raise StickslipError(f"Nothing changes: {parameter} goes from {ends[0]:g} to {ends[1]:g}.")
    system = system.at(**{parameter: float(ends[0])})
    bifurcations: list[Bifurcation] = []
    met = (bifurcation for points in cycles for bifurcation in _met(system, parameter, ends, points))
    for bifurcation in sorted(met, key=lambda bifurcation: bifurcation.miss):
        if not any(_equal(system, bifurcation, nearer) for nearer in bifurcations):
            bifurcations.append(bifurcation)
    return sorted(bifurcations, key=lambda bifurcation: bifurcation.value)


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
            yield Bifurcation(special.value, KINDS[special.kind], motion)


def _equal(system: SectionSystem, first: Bifurcation, second: Bifurcation) -> bool:
    """Whether two motions came upon the same."""
    if first.kind != second.kind or abs(first.value - second.value) > 1e-9 * max(1.0, abs(first.value)):
        return False
    within = SAME * system.sizes()
    turned = (np.roll(second.motion.points, k, axis=0) for k in range(second.motion.period))
    return any((np.abs(system.difference(first.motion.points - points)) <= within).all() for points in turned)
