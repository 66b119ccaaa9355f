"""Attractors without a period: the cells that a long run fills, and what it is by its exponents."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from fmu_models.analyses.aperiodic import AperiodicVerdict, judged
from fmu_models.analyses.attractors import UNDECIDED
from fmu_models.base.arrays import Integers, Vector
from fmu_models.base.shown import Shown
from fmu_models.families import jobs as families
from fmu_models.families.execution import Runner
from fmu_models.families.jobs import Jobs
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.rows import RunRows

CLOUD = 4096  # points of an attractor that has no period
CELLS = 40  # cells across it
FILLED = 0.8  # share of the points of one half that must lie in the cells of the other
HELD = 0.9  # share of the last points of a run that must lie in the cells of an attractor
SHARED = 0.6  # share of the points of one cloud that lie in the cells of another: more, and they are one


@dataclass(frozen=True, eq=False)
class Cloud(Shown):
    """An attractor that has no period.

    Attributes:
        points: (k, n) on it.
        cells: of how many sizes, and which: those that the points lie in and their neighbours.
        verdict: what it is: chaos, a torus, a cycle that meets no section after few turns, or not decided.
    """

    points: Vector
    size: Vector
    cells: frozenset[tuple[int, ...]]
    verdict: AperiodicVerdict

    RECORD: ClassVar = ("period", "points=sample", "kind=word", "exponent")

    @property
    def word(self) -> str:
        """The kind of the verdict."""
        return self.verdict.kind

    @property
    def exponent(self) -> float:
        """The largest, of its verdict."""
        return self.verdict.exponent

    @property
    def period(self) -> int:
        """0: it has none."""
        return 0

    time = 0.0

    @property
    def sample(self) -> Vector:
        """(1, n) a point on it."""
        return self.points[:1]

    def share(self, points: Vector) -> float:
        """Of points (k, n), those that lie in its cells."""
        cells = np.floor(points / self.size).astype(int).tolist()
        return sum(tuple(cell) in self.cells for cell in cells) / len(cells)

    def holds(self, points: Vector) -> bool:
        """Whether points (k, n) of an attractor are its own."""
        return self.share(points) > SHARED

    def overlaps(self, cloud: Cloud) -> bool:
        """Whether the two are one attractor."""
        return self.holds(cloud.points) or cloud.holds(self.points)


def assign_clouds(
    runner: Runner, system: SectionSystem, rows: RunRows, labels: Integers, attractors: list[Any]
) -> Integers:
    """Labels of the runs that never repeat themselves, by the cells of attractors without a period."""
    undecided = np.flatnonzero((labels == UNDECIDED) & (rows.outcomes == families.FINISHED))
    clouds = {i: attractor for i, attractor in enumerate(attractors) if isinstance(attractor, Cloud)}
    for i in undecided:
        points = rows.points[i, : rows.filled[i]]
        label = next((k for k, cloud in clouds.items() if cloud.share(points) >= HELD), UNDECIDED)
        if label == UNDECIDED:
            cloud = _cloud(runner, system, points[-1])
            if cloud is not None and cloud.share(points) >= HELD:
                label = next((k for k, earlier in clouds.items() if cloud.overlaps(earlier)), len(attractors))
                if label == len(attractors):
                    attractors.append(cloud)
                    clouds[label] = cloud
        labels[i] = label
    return labels


def _cloud(runner: Runner, system: SectionSystem, start: Vector) -> Cloud | None:
    """The set that a long run fills twice; None where its halves differ."""
    rows = runner.make(Jobs(start[None], rows=CLOUD), quiet=True)
    if rows.filled[0] < CLOUD:
        return None
    points = rows.points[0]
    width = np.ptp(points, axis=0)
    size = np.where(width > 0, width, 1.0) / CELLS
    steps = list(itertools.product((-1, 0, 1), repeat=points.shape[1]))
    places = [list(map(tuple, np.floor(half / size).astype(int).tolist())) for half in np.array_split(points, 2)]
    first_cells, second_cells = (
        {tuple(a + b for a, b in zip(cell, step, strict=True)) for cell in set(half) for step in steps}
        for half in places
    )
    halves = zip(places, (second_cells, first_cells), strict=True)
    if min(sum(cell in cells for cell in half) / len(half) for half, cells in halves) < FILLED:
        return None
    return Cloud(points, size, frozenset(first_cells | second_cells), judged(runner, system, points[-1]))
