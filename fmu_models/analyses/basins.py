"""Basins of attraction on a grid of starts.

    find   a few starts, in fixed order, run until they repeat themselves: stable periodic motions, solved to rounding
    map    all starts run until they come to where a known attractor surely attracts, or repeat themselves; what repeats
           itself without being known is solved and becomes an attractor too
    rest   where two halves of a long run that never repeats itself fill the same cells, they are those of an attractor,
           by its exponents chaos, a torus, or not decided (``aperiodic``); a start belongs to the one whose cells hold
           its last points, and clouds that overlap are one. What is left is undecided

Every start is run by itself, so that the result does not depend on who makes which run; unstable motions are no
attractors.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.analyses.aperiodic import Verdict, judged
from fmu_models.analyses.attractors import claimed, index_of, targets_of
from fmu_models.analyses.declaration import STATES, Analysis, Option
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured, Shown
from fmu_models.families import jobs as families
from fmu_models.families.execution import IN_MEMORY, Execution, Runner
from fmu_models.families.jobs import Jobs
from fmu_models.families.store import PROVENANCE, told
from fmu_models.sections.periodic import PeriodicMotion
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.rows import RunRows

Vector = NDArray[np.float64]

UNDECIDED, INFINITE, FAILED = -1, -2, -3
COARSE = 64  # starts that look for attractors first
SETTLED = 1e-10
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
        verdict: what it is: chaos, a torus, a cycle seen at times of no meaning to it, or not decided.
    """

    points: Vector
    size: Vector
    cells: frozenset[tuple[int, ...]]
    verdict: Verdict

    RECORD: ClassVar = ("period", "points=sample", "kind", "exponent")

    @property
    def kind(self) -> str:
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

    @property
    def sample(self) -> Vector:
        """(1, n) a point on it."""
        return self.points[:1]

    def share(self, points: Vector) -> float:
        """Of points (k, n), those that lie in its cells."""
        cells = np.floor(points / self.size).astype(int).tolist()
        return sum(tuple(cell) in self.cells for cell in cells) / len(cells)

    def overlaps(self, cloud: Cloud) -> bool:
        """Whether the two are one attractor."""
        return max(self.share(cloud.points), cloud.share(self.points)) > SHARED


Attractor = PeriodicMotion | Cloud


@dataclass(frozen=True, eq=False)
class Basins(Pictured):
    """Which start comes to which attractor.

    Attributes:
        model, states: its name, and those of the numbers of a point.
        axes: values of the start along each direction of the grid.
        labels: one per start, in the shape of the grid: an index into ``attractors``; -1 undecided, -2 to infinity, -3
            could not be run.
        attractors: stable periodic motions, the shortest first, then those without a period.
        steps: of the section until a start was decided.
        failures: why a start could not be run, by its place in the grid.
        how: of ``SectionSystem``.
        provenance: what it was made of; see ``Execution``.
    """

    COLUMNS: ClassVar = ("{axes}=axes", "attractor=labels", "steps")
    RECORD: ClassVar = (
        *("model", "axes", "labels", "attractors", "shares", "undecided", "boundary", "entropy"),
        *("failures=refused", "how"),
    )

    model: str
    states: tuple[str, ...]
    axes: Mapping[str, Vector]
    labels: NDArray[np.int64]
    attractors: tuple[Attractor, ...]
    steps: NDArray[np.int64]
    failures: Mapping[tuple[int, ...], str]
    how: str = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def undecided(self) -> int:
        """Starts whose attractor is not known."""
        return int((self.labels == UNDECIDED).sum())

    @property
    def shares(self) -> Vector:
        """(attractors,) of the starts."""
        return np.array([(self.labels == i).mean() for i in range(len(self.attractors))])

    @property
    def boundary(self) -> float:
        """Share of the starts beside which another one comes to another attractor."""
        beside = np.zeros(self.labels.shape, bool)
        for axis in range(self.labels.ndim):
            differs = np.diff(self.labels, axis=axis) != 0
            edge = [(0, 0)] * self.labels.ndim
            for side in ((0, 1), (1, 0)):
                edge[axis] = side
                beside |= np.pad(differs, edge)
        return float(beside.mean())

    def entropy(self, box: int = 5) -> float:
        """Basin entropy: mean over boxes of so many starts a side of -sum p ln p (Daza and others, 2016)."""
        tops = [range(0, size - box + 1, box) for size in self.labels.shape]
        entropies = []
        for corner in itertools.product(*tops):
            labels = self.labels[tuple(slice(c, c + box) for c in corner)]
            p = np.unique(labels, return_counts=True)[1] / labels.size
            entropies.append(float(-(p * np.log(p)).sum()))
        return float(np.mean(entropies)) if entropies else math.nan

    @property
    def refused(self) -> list[str]:
        """``failures`` in words."""
        return [f"{index}: {why}" for index, why in self.failures.items()]

    def to_xarray(self) -> Any:
        """The grid with its axes."""
        import xarray

        names = list(self.axes)
        data = {"attractor": (names, self.labels), "steps": (names, self.steps)}
        return xarray.Dataset(data, dict(self.axes), {"model": self.model, PROVENANCE: told(self.provenance)})

    def _heading(self) -> str:
        shape = " x ".join(f"{len(values)} {name}" for name, values in self.axes.items())
        return f"Basins of {self.model}: {shape}, {len(self.attractors)} attractors"

    def _contents(self) -> Mapping[str, Any]:
        return {"shares": self.shares, "undecided": self.undecided, "boundary": self.boundary, "how": self.how or None}


def grid_of(system: SectionSystem, axes: Mapping[str, ArrayLike], start: Any) -> tuple[dict[str, Vector], Vector]:
    """The values along each axis, and all starts (m, n) in the order of rows.

    Raises:
        StickslipError: no axis, an unknown state, values that are no list of finite numbers or out of their range.
    """
    if not axes:
        raise StickslipError(f"Name the states of {system.name} that the grid is over, as x=[...]: {system.states}.")
    values = {name: np.atleast_1d(np.asarray(numbers, dtype=float)) for name, numbers in axes.items()}
    for name, coordinates in values.items():
        if coordinates.ndim != 1 or not coordinates.size or not np.isfinite(coordinates).all():
            raise StickslipError(
                f"The values of '{name}' must be a list of finite numbers, found shape {coordinates.shape}."
            )
    base = system.start({name: float(value[0]) for name, value in values.items()} | dict(start or {}))
    for name, coordinates in values.items():
        for extreme in (coordinates.min(), coordinates.max()):
            system.start({name: float(extreme)})
    grid = np.meshgrid(*values.values(), indexing="ij")
    starts = np.tile(base, (grid[0].size, 1))
    for name, coordinates in zip(values, grid, strict=True):
        starts[:, list(system.states).index(name)] = coordinates.ravel()
    return values, starts


def basins(
    system: SectionSystem,
    *,
    start: Mapping[str, float] | None = None,
    most: Annotated[int, Option("Steps after which a motion is taken to stay as it is.", minimum=1)] = 3000,
    longest: int = 64,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
    **axes: ArrayLike,
) -> Basins:
    """Map which attractor each start of a grid comes to.

    Args:
        system: a map, or an oscillator at a section.
        start: what the axes do not say.
        most: steps after which a motion that has not repeated itself is taken to stay as it is.
        longest: period that is looked for.
        execution: Who makes the runs, and where they are kept.
        progress: called with the fraction done.
        axes: values of a state by its name; the first is the rows.

    Raises:
        StickslipError: unknown states, or values out of their range; as ``Runner``.
    """
    values, starts = grid_of(system, axes, start)
    plan = {"analysis": "basins", "start": starts[0], "most": most, "longest": longest, "axes": values}
    with Runner(system, plan, execution, progress) as runner:
        result = _mapped(runner, system, values, starts, most, longest)
        runner.finish(result)
    return result


def _mapped(
    runner: Runner, system: SectionSystem, values: dict[str, Vector], starts: Vector, most: int, longest: int
) -> Basins:
    rows, shape = 2 * longest, tuple(len(value) for value in values.values())
    jobs = Jobs(starts, transient=most, rows=rows, longest=longest, settled=SETTLED)
    sample = jobs.part(0, 0) if len(starts) <= COARSE else _every(jobs, len(starts) // COARSE)
    attractors: list[Attractor] = []
    if len(sample):
        _decide(system, runner.make(sample, quiet=True), attractors, longest)
    periodic = [attractor for attractor in attractors if isinstance(attractor, PeriodicMotion)]
    labels, steps = np.full(len(starts), UNDECIDED), np.zeros(len(starts), np.int64)
    failures: dict[tuple[int, ...], str] = {}
    open_indices, ends = [np.zeros(0, np.int64)], [starts[:0]]

    def map_some(first: int, chunk: RunRows) -> None:
        decided = _ended(chunk)
        decided[chunk.orbits >= 0] = [attractors.index(periodic[i]) for i in chunk.orbits[chunk.orbits >= 0]]
        labels[first : first + len(decided)], steps[first : first + len(decided)] = decided, chunk.steps
        open_ = np.flatnonzero((decided == UNDECIDED) & (chunk.filled > 0))
        open_indices.append(first + open_)
        ends.append(chunk.ends[open_])
        for i, text in chunk.messages.items():
            failures[tuple(map(int, np.unravel_index(first + i, shape)))] = text

    targets = targets_of(system, periodic)
    runner.each(Jobs(starts, transient=most, rows=1, longest=longest, settled=SETTLED, targets=targets), map_some)
    undecided = np.concatenate(open_indices)

    def settle_some(first: int, chunk: RunRows) -> None:
        indices = undecided[first : first + len(chunk.filled)]
        labels[indices] = _decide(system, chunk, attractors, longest)
        labels[indices] = _assign_clouds(runner, system, chunk, labels[indices], attractors)

    if undecided.size:
        runner.each(Jobs(np.concatenate(ends), rows=rows, longest=longest, settled=SETTLED), settle_some)
    order = sorted(
        range(len(attractors)),
        key=lambda i: (attractors[i].period == 0, attractors[i].period, *attractors[i].points[0]),
    )
    position = {old: new for new, old in enumerate(order)}
    labels = np.array([position.get(int(label), int(label)) for label in labels])
    ordered = tuple(attractors[i] for i in order)
    return Basins(
        system.name,
        tuple(system.states),
        values,
        labels.reshape(shape),
        ordered,
        steps.reshape(shape),
        failures,
        system.how,
        runner.provenance,
    )


def _ended(rows: RunRows) -> NDArray[np.int64]:
    """Labels of the runs that end without an attractor."""
    labels = np.full(len(rows.outcomes), UNDECIDED)
    labels[rows.outcomes == families.ESCAPED] = INFINITE
    labels[(rows.outcomes == families.BROKEN) | (rows.outcomes == families.LOST)] = FAILED
    return labels


def _every(jobs: Jobs, stride: int) -> Jobs:
    return Jobs(
        jobs.starts[stride // 2 :: stride],
        transient=jobs.transient,
        rows=jobs.rows,
        longest=jobs.longest,
        settled=jobs.settled,
    )


def _decide(system: SectionSystem, rows: RunRows, attractors: list[Attractor], longest: int) -> NDArray[np.int64]:
    """Labels of the runs that repeat themselves; motions that are not known yet are added."""
    labels = _ended(rows)
    indices = np.flatnonzero((rows.outcomes == families.SETTLED) | (rows.outcomes == families.FINISHED))
    if not indices.size:
        return labels
    for i, motion in zip(indices, claimed(system, rows.only(indices), longest=longest).motions, strict=True):
        if motion is None:
            continue
        periodic = [attractor for attractor in attractors if isinstance(attractor, PeriodicMotion)]
        index = index_of(system, motion, periodic)
        if index < 0:
            attractors.append(motion)
            labels[i] = len(attractors) - 1
        else:
            labels[i] = attractors.index(periodic[index])
    return labels


def _assign_clouds(
    runner: Runner, system: SectionSystem, rows: RunRows, labels: NDArray[np.int64], attractors: list[Attractor]
) -> NDArray[np.int64]:
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
    finer = system.beside_periods(start) if isinstance(system, Strobe) else None
    often = 1.0
    if finer is not None:  # its own period may be one of whole steps, which see a few places of it alone
        system, often = finer
        runner = Runner(system, execution=Execution(workers=runner.workers))
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
    filled = (
        sum(cell in cells for cell in half) / len(half)
        for half, cells in zip(places, (second_cells, first_cells), strict=True)
    )
    if min(filled) < FILLED:
        return None
    verdict = judged(runner, system, points[-1])
    verdict = replace(verdict, exponent=often * verdict.exponent, error=often * verdict.error)
    return Cloud(points, size, frozenset(first_cells | second_cells), verdict)


def _numbers(result: Basins) -> dict[str, float]:
    values = {"attractors": float(len(result.attractors)), "undecided": float(result.undecided)}
    for i, attractor in enumerate(result.attractors):
        values |= {f"period{i + 1}": float(attractor.period), f"starts{i + 1}": float((result.labels == i).sum())}
    return {**values, "failed": float(len(result.failures)), "boundary": result.boundary}


ANALYSIS = Analysis(
    function=basins,
    numbers=_numbers,
    results="`attractors`, `undecided`, `failed`, `boundary`, and per attractor `period1`, `starts1`",
    example="discontinuous_support --forcing omega --set omega=1.1 --over x=-8:8:101 --over v=-8:8:101",
    label="mapping",
    axes=STATES,
    without=("autonomous", "level", "down", "impacts"),
)
