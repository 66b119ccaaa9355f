"""Charts: what a motion becomes, over two parameters.

    period      steps of the section after which it repeats itself; 0 if it does not
    impacts     n-p-q: the period, and how often each contact begins in it
    stick       the contacts that are held at the end: stick, or touch
    exponent    sign of the largest Lyapunov exponent, by its error (``aperiodic``)
    attractor   which of the motions found it is, by its period and its events

With ``refine`` the chart is made on a coarse grid first, and its distances are halved until all cells are there. A new
cell is taken to be of the class of the one before it; it is run where one beside it is of another class, and so on
until every cell beside another class has been run. What is narrower than the coarse grid is found only where it leaves
a trace on it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.analyses.aperiodic import largest_exponents, sign_of
from fmu_models.analyses.attractors import claimed
from fmu_models.analyses.declaration import CROSSED, PARAMETERS, Analysis, Option
from fmu_models.base.arrays import Flags, Integers, Varied, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import Spanned
from fmu_models.base.shown import Pictured
from fmu_models.families import jobs as families
from fmu_models.families.execution import IN_MEMORY, Execution, Runner
from fmu_models.families.jobs import Jobs
from fmu_models.families.store import PROVENANCE, told
from fmu_models.sections.system import SectionSystem, listed
from fmu_models.simulation.rows import RunRows

if TYPE_CHECKING:
    import xarray

WHAT = ("period", "impacts", "stick", "exponent", "attractor")
UNKNOWN = -1
SETTLED = 1e-11
ALIKE = 1e-7  # two points nearer than that are one where Newton's method finds no stable motion


@dataclass(frozen=True, eq=False)
class Chart(Pictured):
    """A class per cell.

    Attributes:
        model, what: name of the model, and what the classes are of.
        axes: values of the two parameters, by name; the first is the rows.
        classes: what the numbers of ``labels`` mean, in order.
        labels: (rows, columns) an index into ``classes``; -1 where the run failed.
        values: (rows, columns) numbers behind them: the period, or the exponent; nan where there is none.
        made: (rows, columns) whether the cell was run; the others lie between equal ones.
        failures: why, by row and column.
        runs: how many were made.
        how: of ``SectionSystem``.
        provenance: what it was made of; see ``Execution``.
        units: of the parameters.
    """

    COLUMNS: ClassVar = ("{axes}=axes", "{what}=names", "value=values")
    RECORD: ClassVar = ("model", "what", "axes", "classes", "labels", "runs", "failures=refused", "how")

    model: str
    what: str
    axes: Mapping[str, Vector]
    classes: tuple[str, ...]
    labels: Integers
    values: Vector
    made: Flags
    failures: Mapping[tuple[int, int], str]
    how: str = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def runs(self) -> int:
        """See the class."""
        return int(self.made.sum())

    @property
    def refused(self) -> list[str]:
        """``failures`` in words."""
        return [f"{index}: {why}" for index, why in self.failures.items()]

    @property
    def names(self) -> NDArray[Any]:
        """The class of each cell; "" where it has none."""
        return np.array([*self.classes, ""], dtype=object)[self.labels]

    @property
    def spanned(self) -> Spanned:
        """The two parameters."""
        return Spanned(*self.axes, parameters=tuple(self.axes))

    def to_xarray(self) -> "xarray.Dataset":
        """The grid with its axes."""
        import xarray

        names = list(self.axes)
        data = {"label": (names, self.labels), "value": (names, self.values), "made": (names, self.made)}
        attributes = {"model": self.model, "classes": list(self.classes), PROVENANCE: told(self.provenance)}
        return xarray.Dataset(data, dict(self.axes), attributes)

    def _heading(self) -> str:
        return f"Chart of {self.model}: {self.what} over {' and '.join(self.axes)}, {self.runs} runs"

    def _contents(self) -> Mapping[str, Any]:
        counts = {name: int((self.labels == i).sum()) for i, name in enumerate(self.classes)}
        return {**self.axes, "cells": counts, "failed": len(self.failures), "how": self.how or None}


def chart(
    system: SectionSystem,
    *,
    what: Annotated[str, Option("period, impacts, stick, exponent or attractor.")] = "period",
    start: Mapping[str, float] | Sequence[float] | None = None,
    transient: Annotated[int, Option("Steps before a motion is classified, at most.", minimum=0)] = 3000,
    points: Annotated[int, Option("Steps over which it is looked at then.", minimum=1)] = 48,
    longest: int = 24,
    refine: Annotated[int, Option("Cells a side of a coarse grid to begin with: 1, 2, 4, ...", minimum=1)] = 1,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
    **axes: ArrayLike,
) -> Chart:
    """Chart what a motion becomes over two parameters.

    Args:
        system: a map, or an oscillator at a section.
        what: one of WHAT.
        start: of every run.
        transient: steps before a motion is classified; fewer where it repeats itself before.
        points: steps over which it is then looked at.
        longest: period that is looked for.
        refine: cells from one of the coarse grid to the next, a power of two; 1: all cells are run.
        execution: Who makes the runs, and where they are kept.
        progress: called with the fraction done, of each round of refinement.
        axes: values (m,) and (n,) of two parameters.

    Raises:
        StickslipError: not two parameters, unknown names, values out of their range, no such class; as ``Runner``.
    """
    if what not in WHAT:
        raise StickslipError(f"A chart shows one of {', '.join(WHAT)}, found '{what}'.")
    values = {name: listed(name, numbers) for name, numbers in axes.items()}
    if len(values) != 2:
        raise StickslipError(f"A chart is over two parameters, found {list(axes)}.")
    if refine < 1 or refine & (refine - 1):
        raise StickslipError(f"The coarse grid is a power of two cells apart, found {refine}.")
    for name, coordinates in values.items():
        system.check(name, coordinates)
    cells = _Cells(what, system.start(start), transient, points, longest)
    plan = {"analysis": "chart", **vars(cells), "refine": refine, "axes": values}
    with Runner(system, plan, execution, progress) as runner:
        return runner.finish(_charted(runner, system, cells, refine, values))


@dataclass(frozen=True, eq=False)
class _Cells:
    """The runs of cells, and what is asked of them."""

    what: str
    start: Vector
    transient: int
    points: int
    longest: int

    def jobs(self, varied: Varied, count: int) -> Jobs:
        rows = max(self.points, 2 * self.longest) if self.what != "exponent" else 1
        longest = 0 if self.what in ("stick", "exponent") else self.longest
        starts = np.tile(self.start, (count, 1))
        return Jobs(starts, varied, self.transient, rows, longest=longest, settled=SETTLED)


def _charted(runner: Runner, system: SectionSystem, setup: _Cells, refine: int, values: Mapping[str, Vector]) -> Chart:
    shape = tuple(coordinates.size for coordinates in values.values())
    computed: dict[tuple[int, int], tuple[str, float]] = {}
    failures: dict[tuple[int, int], str] = {}

    def run(cells: list[tuple[int, int]]) -> None:
        varied = {name: value[[cell[k] for cell in cells]] for k, (name, value) in enumerate(values.items())}

        def take(first: int, chunk: RunRows) -> None:
            end = first + len(chunk.filled)
            subset = {name: numbers[first:end] for name, numbers in varied.items()}
            exponents = setup.what == "exponent"
            results = _signs(runner, system, chunk, subset) if exponents else _classes(system, chunk, subset, setup)
            for i, cell in enumerate(cells[first:end]):
                computed[cell] = results[i]
                if chunk.outcomes[i] > families.ABSORBED:
                    failures[cell] = families.reason(chunk, i)

        runner.each(setup.jobs(varied, len(cells)), take)

    labels = _filled(shape, refine, computed, run)
    classes = tuple(sorted({label for label in labels.ravel() if label}, key=_in_order))
    number = {label: i for i, label in enumerate(classes)}
    numbers = np.full(shape, np.nan)
    chunk = np.zeros(shape, bool)
    for cell, (_, value) in computed.items():
        numbers[cell], chunk[cell] = value, True
    indices = np.array([number.get(label, UNKNOWN) for label in labels.ravel()], np.int64).reshape(shape)
    cells = classes, indices, numbers, chunk, failures
    origin = system.how, runner.provenance, system.units(*values)
    return Chart(system.name, setup.what, values, *cells, *origin)


def _in_order(label: str) -> tuple[Any, ...]:
    return tuple((0, int(word), "") if word.isdigit() else (1, 0, word) for word in label.split("-"))


def _filled(
    shape: tuple[int, ...],
    refine: int,
    computed: Mapping[tuple[int, int], tuple[str, float]],
    run: Callable[[list[tuple[int, int]]], None],
) -> NDArray[np.object_]:
    """A label per cell, from runs of as few of them as tell where the classes meet."""
    labels, reached = np.full(shape, "", dtype=object), np.zeros(shape, bool)
    ticks = [np.unique(np.append(np.arange(0, size, refine), size - 1)) for size in shape]
    fresh = np.ones([tick.size for tick in ticks], bool)
    while True:
        grid = np.ix_(*ticks)
        while fresh.any():
            cells = [(int(ticks[0][i]), int(ticks[1][j])) for i, j in np.argwhere(fresh)]
            run(cells)
            for cell in cells:
                labels[cell], reached[cell] = computed[cell][0], True
            fresh = _beside_another(labels[grid]) & ~reached[grid]
        if labels[grid].shape == shape:
            return labels
        finer = [np.union1d(tick, (tick[1:] + tick[:-1]) // 2) for tick in ticks]
        before = [tick[np.searchsorted(tick, new, side="right") - 1] for tick, new in zip(ticks, finer, strict=True)]
        ticks, coarse = finer, labels[np.ix_(*before)]
        labels[np.ix_(*ticks)] = coarse
        fresh = _beside_another(coarse) & ~reached[np.ix_(*ticks)]


def _beside_another(labels: NDArray[np.object_]) -> Flags:
    """Which cells have one of another class beside them, along either axis."""
    edges = np.zeros(labels.shape, bool)
    for grid, mark in ((labels, edges), (labels.T, edges.T)):
        differs = grid[1:] != grid[:-1]
        mark[1:] |= differs
        mark[:-1] |= differs
    return edges


def _signs(runner: Runner, system: SectionSystem, rows: RunRows, varied: Varied) -> list[tuple[str, float]]:
    """Sign and value of the exponent of each run; no sign where it failed."""
    signs = [("", np.nan)] * len(rows.filled)
    sound = np.flatnonzero((rows.outcomes <= families.ABSORBED) & (rows.filled > 0))
    subset = {name: values[sound] for name, values in varied.items()}
    values, errors, _ = largest_exponents(runner, system, rows.ends[sound], subset)
    for i, value, error in zip(sound.tolist(), values.tolist(), errors.tolist(), strict=True):
        signs[i] = (sign_of(value, error), value)
    return signs


def _classes(system: SectionSystem, rows: RunRows, varied: Varied, cells: _Cells) -> list[tuple[str, float]]:
    """Label and number of each run; no label where it failed."""
    quantity, longest = cells.what, cells.longest
    sound = rows.outcomes <= families.ABSORBED
    if quantity == "stick":
        sticking = rows.held.sum(axis=1) > 0.0
        names = [", ".join(np.array(system.contacts, object)[row]) or "none" for row in sticking]
        counts = sticking.sum(axis=1).tolist()
        return [(n if good else "", float(count)) for n, count, good in zip(names, counts, sound, strict=True)]
    claims, began = claimed(system, rows, varied, longest=longest), np.zeros((len(sound), len(system.contacts)), int)
    for cycles, numbers in claims.parts:
        began[numbers] = cycles.began
    classes: list[tuple[str, float]] = []
    told = zip(sound.tolist(), claims.periods.tolist(), began.tolist(), strict=True)
    for i, (good, period, counts) in enumerate(told):
        if not good:
            classes.append(("", np.nan))
            continue
        if not period:
            period, counts = _alike(system, rows, i, longest)
        word = "-".join(map(str, (period, *counts))) if period else "0"
        classes.append((str(period) if quantity == "period" else word, float(period)))
    return classes


def _alike(system: SectionSystem, rows: RunRows, i: int, longest: int) -> tuple[int, list[int]]:
    """Period and events of a run whose last points repeat themselves, though no stable motion was solved for."""
    points, within = rows.points[i, : rows.filled[i]], ALIKE * system.sizes()
    near = np.abs(system.difference(points[-1:] - points[-2::-1][:longest])) <= within
    for n in (np.flatnonzero(near.all(axis=1)) + 1).tolist():
        if (np.abs(system.difference(points[n:] - points[:-n])) <= within).all():
            return n, rows.began[i, rows.filled[i] - n : rows.filled[i]].sum(axis=0).tolist()
    return 0, []


def _numbers(result: Chart) -> dict[str, float]:
    values = {f"cells_{name}": float((result.labels == i).sum()) for i, name in enumerate(result.classes)}
    return {**values, "runs": float(result.runs), "failed": float(len(result.failures))}


ANALYSIS = Analysis(
    function=chart,
    numbers=_numbers,
    results="`cells_<class>`, `runs`, `failed`",
    example="disc_rig --period 1 --autonomous --what stick --over w0=0.2:1.8:41 --over w1=-0.6:1:41",
    label="charting",
    axes=PARAMETERS,
    without=CROSSED,
)
