"""Stable motions that the sweeps of a diagram leave although their branch goes on.

    on      all points of a sweep at a value, taken to phase 0 of the forcing, lie near a branch
    lost    a sweep is on a branch at one value, the branch is stable up to the next, and there the sweep is elsewhere

A branch that ends, folds or loses its stability between two values is left rightly. A motion whose basin is narrower
than what one value does to it counts as lost: the values are too far apart there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from fmu_models.base.arrays import Integers
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.continuation.branch import Branch
from fmu_models.continuation.overlay import Motion, branches_through, segments_near
from fmu_models.continuation.problem.problem import Vector
from fmu_models.importer.simulate import simulate_any
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.oscillator import FmuSection
from fmu_models.sections.strobe import Strobe, strobe_of
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.run import simulate

Section = FmuSection | Iteration


class Swept(Protocol):
    """What is asked of a diagram; see ``diagram.Diagram``."""

    @property
    def over(self) -> str: ...
    @property
    def values(self) -> Vector: ...
    @property
    def directions(self) -> tuple[str, ...]: ...
    @property
    def ways(self) -> tuple[str, ...]: ...
    @property
    def points(self) -> Vector: ...
    @property
    def periods(self) -> Integers: ...
    @property
    def shown(self) -> Vector: ...


@dataclass(frozen=True)
class LostMotion(Shown):
    """Where a sweep left a stable branch.

    Attributes:
        direction: of the sweep.
        before, value: of the parameter: the last that has the motion, and the first that does not.
        state: that a picture shows, of the motion at ``before``.
    """

    direction: str
    before: float
    value: float
    state: float


def lost_motions(
    system: SectionSystem, diagram: Swept, longest: int = 1, known: Sequence[Branch] = ()
) -> tuple[LostMotion, ...]:
    """Where the sweeps of a diagram left a stable branch, in their order.

    Args:
        system: that of the diagram; something forces it, or it is a map.
        longest: period of a motion whose branch is followed, in periods of the forcing or steps of a map.
        known: branches through its motions, if they have been followed.

    Raises:
        StickslipError: nothing forces the system, or no branch goes through the diagram.
    """
    if not isinstance(system, Section):
        raise StickslipError(f"{type(system).__name__} has no branches: name a map, or an oscillator at a section.")
    strobe = _strobe(system)
    points = {
        (d, i): [_at_phase_0(system, diagram.over, value, x) for x in diagram.points[d, i] if np.isfinite(x).all()]
        for d in range(len(diagram.directions))
        for i, value in enumerate(diagram.values.tolist())
    }
    between = (float(diagram.values[0]), float(diagram.values[-1]))
    motions = _motions(system, diagram, points)
    branches = known or branches_through(strobe, diagram.over, motions, between, longest, None).branches
    lost: list[LostMotion] = []
    for d, (direction, way) in enumerate(zip(diagram.directions, diagram.ways, strict=True)):
        order = list(range(len(diagram.values)))[:: 1 if way == "up" else -1]
        for i, k in pairwise(order):
            value, onward = float(diagram.values[i]), float(diagram.values[k])
            before, after = points[d, i], points[d, k]
            if any(_leaves(branch, value, before, onward, after) for branch in branches):
                lost.append(LostMotion(direction, value, onward, float(diagram.shown[d, i, 0])))
    return tuple(lost)


def _strobe(system: Section) -> Strobe | Iteration:
    """What branches are followed at."""
    if isinstance(system, Strobe | Iteration):
        return system
    if not system.forced:
        raise StickslipError(
            f"Branches are compared with sweeps of what is forced, or of maps; nothing forces '{system.name}' here."
        )
    return strobe_of(system, forcing=system.forcing, period=system.period)


def _motions(system: Section, diagram: Swept, points: dict[tuple[int, int], list[Vector]]) -> Iterator[Motion]:
    """The periodic motions of the diagram, at phase 0."""
    for d, i in np.argwhere(diagram.periods > 0).tolist():
        value, periods = float(diagram.values[i]), int(diagram.periods[d, i])
        if not isinstance(system, Strobe | Iteration):
            at = system.at(**{diagram.over: value})
            times = at.step(diagram.points[d, i, :periods], derivative=False).times
            periods = round(float(times.sum()) / float(at.periods({}, 1)[0]))
        yield value, periods, points[d, i][0]


def _at_phase_0(system: Section, over: str, value: float, point: Vector) -> Vector:
    """The point of a strobe that a motion comes to from a point of its section."""
    if isinstance(system, Strobe | Iteration):
        return point
    at = system.at(**{over: value})
    end = float(at.periods({}, 1)[0])
    span: dict[str, Any] = {"start_time": float(point[-1]) * end, "output_times": [end], "tolerance": at.tolerance}
    moved = (simulate if at.fmu.ours else simulate_any)(at.fmu, end, **at.as_run(point), **span)
    return np.array([float(moved[name][-1]) for name in at.states[:-1]])


def _leaves(branch: Branch, value: float, before: list[Vector], onward: float, after: list[Vector]) -> bool:
    """Whether a motion on a branch at a value is not on it at the next one, though the branch goes on."""
    for segment in segments_near(branch, value, before):
        ahead = _stable_ahead(branch, segment, value, onward)
        if ahead is not None:
            return ahead not in segments_near(branch, onward, after)
    return False


def _stable_ahead(branch: Branch, segment: int, value: float, onward: float) -> int | None:
    """The segment between two points of a branch that holds the next value, if all from here to there is stable."""
    sense = np.sign(onward - value)
    if not (branch.stable[segment] and branch.stable[segment + 1]):
        return None
    step = 1 if (branch.values[segment + 1] - branch.values[segment]) * sense > 0 else -1
    k = segment + (step > 0)
    while (onward - branch.values[k]) * sense > 0:
        k += step
        if not 0 <= k < len(branch.values) or not branch.stable[k]:
            return None
        if (branch.values[k] - branch.values[k - step]) * sense <= 0:
            return None
    return min(k, k - step)
