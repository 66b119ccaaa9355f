"""Families of runs for systems that know one step only: all runs of a chunk go one step at a time, together.

The rules are those of engine/ensemble: a motion that repeats itself is recorded over one period; one that comes to a
known orbit, leaves every bound or does not arrive is followed no farther.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Flags, Integers, Varied, Vector
from fmu_models.families import jobs as outcome
from fmu_models.families.jobs import Jobs
from fmu_models.simulation.rows import RunRows, joined

FAR = 1e12  # a motion farther out than this goes to infinity
LOST_SHARE = 1e-13  # less is left of a difference only by rounding


@dataclass(frozen=True, eq=False)
class Step:
    """One step of m points.

    Attributes:
        points: (m, n) where they arrive; nan where they do not.
        derivatives: (m, n, n) of these by the points.
        times: (m,) that passed, s; 1 for a map.
        began: (m, contacts) how often contact or stick began on the way; held: how long it lasted, s.
        why: of points that do not arrive, by number.
    """

    points: Vector
    derivatives: Vector
    times: Vector
    began: NDArray[np.int32]
    held: Vector
    why: Mapping[int, str]

    @classmethod
    def without_contacts(cls, points: Vector, derivatives: Vector, times: Vector, why: Mapping[int, str]) -> Self:
        """A step of what has no contacts."""
        return cls(points, derivatives, times, np.zeros((len(points), 0), np.int32), np.zeros((len(points), 0)), why)

    def part(self, begin: int, end: int) -> Self:
        """That of the points from ``begin`` up to ``end``."""
        points, derivatives, times = (a[begin:end] for a in (self.points, self.derivatives, self.times))
        why = {i - begin: text for i, text in self.why.items() if begin <= i < end}
        return type(self)(points, derivatives, times, self.began[begin:end], self.held[begin:end], why)


class Stepping(Protocol):
    """What a family needs of a system; see ``section_system``."""

    @property
    def contacts(self) -> tuple[str, ...]: ...
    def step(self, points: Vector, varied: Varied | None = None, *, derivative: bool = True) -> Step: ...
    def difference(self, points: Vector) -> Vector: ...
    def sizes(self) -> Vector: ...
    def along(self, points: Vector, varied: Varied | None = None) -> Vector: ...


def run(system: Stepping, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
    """The rows of some jobs."""
    if jobs.chain == 1:
        return _Together(system, jobs).run(stop)
    pieces: list[RunRows] = []
    begins = range(0, len(jobs), jobs.beside)
    for i in begins:
        links = jobs.part(i, i + jobs.beside)
        if i % jobs.block and pieces:
            sound = pieces[-1].outcomes <= outcome.ABSORBED
            links = replace(links, starts=np.where(sound[:, None], pieces[-1].ends, links.starts))
        pieces.append(_Together(system, links).run(stop))
    return joined(pieces, begins)


def _orthonormal(vectors: Vector) -> tuple[Vector, Vector, Flags]:
    """Vectors (m, n, k) made orthonormal in order, by Gram and Schmidt's method, twice; their sizes (m, k) before, and
    whether nothing but rounding was left of one."""
    orthonormal = vectors.copy()
    sizes = np.empty((len(orthonormal), orthonormal.shape[2]))
    lost = np.empty(sizes.shape, bool)
    for k in range(orthonormal.shape[2]):
        column = orthonormal[:, :, k]
        length = np.sqrt((column**2).sum(axis=1))
        for before in [*range(k), *range(k)]:
            basis = orthonormal[:, :, before]
            column = column - basis * (basis * column).sum(axis=1)[:, None]
        sizes[:, k] = np.sqrt((column**2).sum(axis=1))
        lost[:, k] = sizes[:, k] <= LOST_SHARE * length
        orthonormal[:, :, k] = np.where(lost[:, k, None], 0.0, column / np.where(lost[:, k], 1.0, sizes[:, k])[:, None])
    return orthonormal, sizes, lost


class _Together:
    def __init__(self, system: Stepping, jobs: Jobs) -> None:
        m, n = jobs.starts.shape
        contacts, k = len(system.contacts), jobs.tangents
        self.system, self.jobs = system, jobs
        self.x = np.array(jobs.starts, dtype=float)
        derivatives = (n, n) if jobs.derivatives else (0, 0)
        self.rows = RunRows.empty(m, jobs.rows, n, contacts, growth=k, derivatives=derivatives)
        self.left = np.full(m, jobs.transient)
        self.wanted = np.full(m, jobs.rows)
        self.frames = np.broadcast_to(np.eye(n)[:, :k], (m, n, k)).copy()
        if jobs.flow:
            # the first along the motion, the others beside it: of n + 1 vectors one is lost
            first = system.along(self.x, jobs.varied)[:, :, None]
            tangents, _, lost = _orthonormal(np.concatenate([first, np.broadcast_to(np.eye(n), (m, n, n))], axis=2))
            self.frames = np.stack([v[:, ~gone][:, :k] for v, gone in zip(tangents, lost, strict=True)])
        # the ring of the last points, for how many steps each period has held, and known points met in a row
        self.ring = np.full((jobs.longest, m, n), np.nan)
        self.period_held = np.zeros((jobs.longest, m), int)
        self.expected, self.met = np.full(m, -1), np.zeros(m, int)
        self.seen = 0

    def run(self, stop: NDArray[np.int32]) -> RunRows:
        rows = self.rows
        while not stop[0]:
            unfinished = (self.left > 0) | (rows.filled < self.wanted)
            going = np.flatnonzero((rows.outcomes == outcome.FINISHED) & unfinished)
            if not going.size:
                break
            # those that record a row of several steps and those in their transient keep in step by the batch
            recording = self.left[going] == 0
            for group, steps in ((going[~recording], 1), (going[recording], self.jobs.batch)):
                if group.size:
                    self._row(group, steps)
            self.seen += 1
        rows.outcomes[(rows.periods > 0) & (rows.outcomes == outcome.FINISHED)] = outcome.SETTLED
        if stop[0]:
            rows.outcomes[rows.outcomes == outcome.FINISHED] = outcome.STOPPED
        return rows

    def _row(self, group: Integers, steps: int) -> None:
        jobs, rows = self.jobs, self.rows
        recording = bool((self.left[group] == 0).all())
        row = rows.filled[group]
        if recording:
            rows.times[group, row] = 0.0
            rows.growth[group, row] = 0.0
            if jobs.flow:
                rows.growth[group, row, 0] = self._speed(group)
        for _ in range(steps):
            derivative = jobs.tangents > 0 or jobs.derivatives
            stepped = self.system.step(self.x[group], self._varied(group), derivative=derivative)
            growth = self._grow(group, stepped)
            self.x[group] = stepped.points
            rows.steps[group] += 1
            if recording:
                rows.times[group, row] += stepped.times
                rows.held[group, row] += stepped.held
                rows.began[group, row] += stepped.began
                rows.growth[group, row] += growth
                if jobs.derivatives:
                    rows.derivatives[group, row] = stepped.derivatives
            self._lose(group, stepped)
        arrived = rows.outcomes[group] == outcome.FINISHED
        if recording and jobs.flow:
            # less that of the speed, which says nothing of a motion that stays where it is
            rows.growth[group[arrived], row[arrived], 0] -= self._speed(group[arrived])
        if recording:
            rows.points[group[arrived], row[arrived]] = self.x[group[arrived]]
            rows.filled[group[arrived]] += 1
        else:
            self.left[group[arrived]] -= 1
            # differences that were lost on the way to where the motion stays say nothing of it
            fresh = group[(self.left[group] == 0) & ~(self.frames[group] != 0.0).any(axis=1).all(axis=1)]
            self.frames[fresh] = np.eye(self.x.shape[1])[:, : jobs.tangents]
        self._end(group[arrived])

    def _speed(self, group: Integers) -> Vector:
        return np.log(np.sqrt((self.system.along(self.x[group], self._varied(group)) ** 2).sum(axis=1)))

    def _varied(self, group: Integers) -> Varied:
        return {name: values[group] for name, values in self.jobs.varied.items()}

    def _lose(self, group: Integers, stepped: Step) -> None:
        """Runs that do not arrive, or go to infinity."""
        for i, why in stepped.why.items():
            self.rows.outcomes[group[i]] = outcome.BROKEN if why else outcome.LOST
            self.rows.messages[int(group[i])] = why
        with np.errstate(invalid="ignore"):
            escaped = ~(np.abs(self.x[group]) < FAR).all(axis=1)
        escaped &= self.rows.outcomes[group] == outcome.FINISHED
        self.rows.outcomes[group[escaped]] = outcome.ESCAPED
        self.x[group[escaped]] = 0.0

    def _grow(self, group: Integers, stepped: Step) -> Vector:
        """(m, k) logarithms of the growth of each difference."""
        k = self.jobs.tangents
        if not k:
            return np.zeros((group.size, 0))
        with np.errstate(all="ignore"):
            grown = np.nan_to_num(stepped.derivatives @ self.frames[group])
            frames, sizes, lost = _orthonormal(grown)
            growth = np.log(sizes)
        self.frames[group] = frames
        return np.where(lost | np.isnan(growth), -np.inf, growth)

    def _end(self, group: Integers) -> None:
        """Runs that have come to a known orbit, or repeat themselves."""
        jobs, rows = self.jobs, self.rows
        if jobs.targets is not None:
            self._absorb(group)
            group = group[rows.outcomes[group] == outcome.FINISHED]
        if not jobs.longest:
            return
        fresh = group[rows.periods[group] == 0]
        sizes = self.system.sizes()
        for n in range(1, min(jobs.longest, self.seen) + 1):
            differences = self.system.difference(self.x[fresh] - self.ring[(self.seen - n) % jobs.longest, fresh])
            with np.errstate(invalid="ignore"):
                same = (np.abs(differences) <= jobs.settled * sizes).all(axis=1)
            repeats = np.where(same, self.period_held[n - 1, fresh] + 1, 0)
            self.period_held[n - 1, fresh] = repeats
            repeating = fresh[(repeats > 2 * n + 2) & (rows.periods[fresh] == 0)]
            rows.periods[repeating] = n
            self.wanted[repeating] = np.minimum(n, jobs.rows)
            self.left[repeating] = rows.filled[repeating] = 0
        self.ring[self.seen % jobs.longest, group] = self.x[group]

    def _absorb(self, group: Integers) -> None:
        targets = self.jobs.targets
        assert targets is not None
        differences = self.system.difference(self.x[group][:, None] - targets.points[None])
        inside = np.einsum("mki,kij,mkj->mk", differences, targets.forms, differences) <= 1.0
        first = np.where(inside.any(axis=1), inside.argmax(axis=1), -1)
        hoped = self.expected[group]
        confirmed = (hoped >= 0) & inside[np.arange(group.size), np.maximum(hoped, 0)]
        target = np.where(confirmed, hoped, first)
        self.met[group] = np.where(confirmed, self.met[group], 0) + (target >= 0)
        self.expected[group] = np.where(target >= 0, targets.after[np.maximum(target, 0)], -1)
        absorbed = (target >= 0) & (self.met[group] >= targets.passes[np.maximum(target, 0)])
        self.rows.orbits[group[absorbed]] = targets.orbits[target[absorbed]]
        self.rows.outcomes[group[absorbed]] = outcome.ABSORBED
