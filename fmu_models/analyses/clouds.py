"""Attractors without a period: the cells that a long run fills, and what it is by its exponents.

Chaos must last: some points of the set are followed LASTS times as long as found it. Where one leaves, the set is no
attractor but a transient, and its lifetime is told by more of them: that of an exponential law, of t(i) steps until one
has left, or t without that, by k that left,

    tau = sum(t(i) - min t) / (k - 1)  +-  tau / sqrt(k - 1)

and where one left unseen, into another set, of n starts over t steps, tau = t / -ln(1 - k/n).

Source: Yorke, Yorke, Metastable chaos, Journal of Statistical Physics 21 (1979).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from fmu_models.analyses.aperiodic import CHAOS, NOT_DECIDED, AperiodicVerdict, judged
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
LASTS = 10  # times as long as a set was found chaos must last
SOME, MANY = 3, 32  # points that are followed so long, and that tell a lifetime
BESIDE = 1e-4  # of a cell
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


@dataclass(frozen=True, eq=False)
class ChaoticTransient(Shown):
    """A chaotic set that motions leave.

    Attributes:
        cloud: its points.
        lifetime, error: mean of the time that motions stay, in steps of the section, and its standard error.
    """

    cloud: Cloud
    lifetime: float
    error: float

    RECORD: ClassVar = ("word", "lifetime", "error")

    @property
    def word(self) -> str:
        """What it is, for how long."""
        return f"transient chaos that lasts {self.lifetime:.3g} +- {self.error:.1g} steps"


class Clouds:
    """The sets without a period that are found on the way, and the runs that lie on them.

    Args:
        runner, system: of the runs.
        attractors: all that are known; those that are found are added.
        most, search: steps of a transient, and ``longest`` and ``settled`` of ``Jobs``.
        verdicts: tell what they are by their exponents.
        lasting: follow chaos until it has lasted.

    Attributes:
        transients: chaos that did not last.
    """

    def __init__(
        self, runner: Runner, system: SectionSystem, attractors: list[Any], most: int, search: Mapping[str, Any],
        *, verdicts: bool, lasting: bool,
    ) -> None:  # fmt: skip
        self.runner, self.system, self.attractors, self.search = runner, system, attractors, search
        self.length, self.verdicts, self.lasting = LASTS * (most + CLOUD), verdicts, lasting
        self.transients: list[ChaoticTransient] = []

    def assign(self, rows: RunRows, labels: Integers) -> Integers:
        """Give runs that never repeat themselves their labels; numbers of those that lie on what does not last."""
        left = []
        for i in np.flatnonzero((labels == UNDECIDED) & (rows.outcomes == families.FINISHED)).tolist():
            points = rows.points[i, : rows.filled[i]]
            labels[i] = self._label_of(points)
            if labels[i] == UNDECIDED and self._is_transient(points):
                left.append(i)
            elif labels[i] == UNDECIDED:
                cloud = _cloud(self.runner, self.system, points[-1])
                if cloud is not None and cloud.share(points) >= HELD:
                    labels[i] = self._placed(cloud)
                    left += [i] * int(labels[i] == UNDECIDED)
        return np.array(left, np.int64)

    def onward(self, ends: Vector) -> Jobs:
        """The runs of what does not last, from where they were left."""
        return Jobs(ends, transient=self.length, rows=2 * self.search["longest"], **self.search)

    def _label_of(self, points: Vector) -> int:
        numbered = ((k, a) for k, a in enumerate(self.attractors) if isinstance(a, Cloud))
        return next((k for k, cloud in numbered if cloud.share(points) >= HELD), UNDECIDED)

    def _is_transient(self, points: Vector) -> bool:
        return any(transient.cloud.share(points) >= HELD for transient in self.transients)

    def _placed(self, cloud: Cloud) -> int:
        """The label of a set, which is added where it is new; ``UNDECIDED`` of one that does not last."""
        for k, attractor in enumerate(self.attractors):
            if isinstance(attractor, Cloud) and cloud.overlaps(attractor):
                return k
        if any(cloud.overlaps(transient.cloud) for transient in self.transients):
            return UNDECIDED
        if self.verdicts:
            cloud = replace(cloud, verdict=judged(self.runner, self.system, cloud.points[-1]))
        if self.lasting and cloud.word == CHAOS and (transient := self._transient(cloud)) is not None:
            self.transients.append(transient)
            return UNDECIDED
        self.attractors.append(cloud)
        return len(self.attractors) - 1

    def _transient(self, cloud: Cloud) -> ChaoticTransient | None:
        """The set as one that does not last; None if it does."""
        for count in (SOME, MANY):
            starts = cloud.points[np.linspace(0, len(cloud.points) - 1, count).astype(int)]
            # beside them: all points of one motion leave where that does
            scatter = BESIDE * np.where(self.system.free, cloud.size, 0.0)
            starts = starts + scatter * np.random.default_rng(0).uniform(-1.0, 1.0, starts.shape)
            rows = self.runner.make(self.onward(starts), quiet=True)
            seen = np.isin(rows.outcomes, (families.SETTLED, families.ESCAPED))
            finished = np.flatnonzero(rows.outcomes == families.FINISHED)
            unseen = [i for i in finished if cloud.share(rows.points[i, : rows.filled[i]]) < HELD]
            if not seen.any() and not unseen:
                return None
        k = int(seen.sum()) + len(unseen)
        if unseen or k < 2:
            stays = -np.log(1.0 - min(k, MANY - 0.5) / MANY)
            return ChaoticTransient(
                cloud, self.length / stays, self.length / stays**2 * np.sqrt(np.expm1(stays) / MANY)
            )
        times = np.where(seen, rows.steps, self.length)
        lifetime = float((times - times.min()).sum()) / (k - 1)
        return ChaoticTransient(cloud, lifetime, lifetime / np.sqrt(k - 1))


def _cloud(runner: Runner, system: SectionSystem, start: Vector) -> Cloud | None:
    """The set that a long run fills twice; None where its halves differ."""
    rows = runner.make(Jobs(start[None], rows=CLOUD), quiet=True)
    if rows.filled[0] < CLOUD:
        return None
    points = rows.points[0]
    width = np.ptp(points, axis=0)
    size = np.where(width > 0, width, 1.0) / CELLS
    size[system.drifting] = np.inf
    steps = list(itertools.product((-1, 0, 1), repeat=points.shape[1]))
    places = [list(map(tuple, np.floor(half / size).astype(int).tolist())) for half in np.array_split(points, 2)]
    first_cells, second_cells = (
        {tuple(a + b for a, b in zip(cell, step, strict=True)) for cell in set(half) for step in steps}
        for half in places
    )
    halves = zip(places, (second_cells, first_cells), strict=True)
    if min(sum(cell in cells for cell in half) / len(half) for half, cells in halves) < FILLED:
        return None
    return Cloud(points, size, frozenset(first_cells | second_cells), AperiodicVerdict(NOT_DECIDED, np.nan, np.inf))
