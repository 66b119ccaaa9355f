"""Branches through motions that a sweep has found, to be laid over its diagram."""

from collections.abc import Iterable, Sequence

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.branch import Branch
from fmu_models.continuation.branches import Branches, branch, measuring, spread
from fmu_models.continuation.problem.problem import Vector
from fmu_models.sections.amounts import shown_of
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem

POINTS = 500  # of a branch, in each direction: more do not show
Motion = tuple[float, int, Vector]  # value of the parameter, period in steps of the section, and a point (n,)
NEAR = 0.02  # of what the states span on a branch: a motion no further from it, between its points, is on it


def branches_through(
    system: SectionSystem,
    over: str,
    motions: Iterable[Motion],
    between: tuple[float, float],
    longest: int,
    of: str | None,
) -> Branches:
    """Those of the motions, and all that leave them and one another.

    Args:
        system: a strobe or a map.
        longest: period of a motion that is followed, in steps of the section.

    Raises:
        StickslipError: there is no motion of such a period, or none can be followed.
    """
    state, followed = of or system.states[0], list[Branch]()
    interrupted, why = follow_motions(system, over, motions, between, longest, followed)
    if not followed:
        reason = f": {why}" if why else f": none of period {longest} or less was found"
        raise StickslipError(f"There is no branch to lay over the diagram of {system.name} over '{over}'{reason}.")
    return Branches(state, measuring(followed, shown_of(state, system)), interrupted)


def follow_motions(
    system: SectionSystem,
    over: str,
    motions: Iterable[Motion],
    between: tuple[float, float],
    longest: int,
    followed: list[Branch],
) -> tuple[bool, str]:
    """Append to branches those of the motions that lie on none of them, and all that leave these.

    Returns:
        whether the keyboard interrupted it; why a motion could not be followed.
    """
    why = ""
    interrupted = False
    every = system.every if isinstance(system, Strobe) else 1
    for value, period, point in motions:
        same = (member for member in followed if member.every == period * every)
        if interrupted or period > longest or any(segments_near(member, value, [point]) for member in same):
            continue
        section = system.at(**{over: value})
        if isinstance(section, Strobe):
            section = section.folded(period)
        elif period > 1:  # cycles of a map are met where they leave those of one point
            continue
        try:
            new_branch = branch(section, over, between, start=point.tolist(), points=POINTS)
        except StickslipError as error:
            why = str(error)
            continue
        if any(member.passes(new_branch) for member in followed if member.every == new_branch.every):
            continue  # its points lie too far apart to tell that the motion is on it
        followed.append(new_branch)
        interrupted = spread(followed, longest * every, POINTS)
    return interrupted, why


def segments_near(candidate: Branch, value: float, points: Sequence[Vector]) -> list[int]:
    """Between which neighbours of a branch, by the number of the first, all points at a value lie near it."""
    n = len(candidate.states)
    size = np.ptp(candidate.images, axis=(0, 1)) + np.abs(candidate.images).max(axis=(0, 1)) * 1e-3 + 1e-300
    low, high = candidate.values[:-1], candidate.values[1:]
    segments: list[int] = []
    for i in np.flatnonzero((low - value) * (high - value) <= 0.0).tolist():
        share = (value - low[i]) / (high[i] - low[i]) if high[i] != low[i] else 0.0
        between = (1.0 - share) * candidate.images[:, i] + share * candidate.images[:, i + 1]
        if points and all((np.abs(between - p[:n]) <= NEAR * size).all(axis=1).any() for p in points):
            segments.append(i)
    return segments
