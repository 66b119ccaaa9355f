"""Basins of attraction on a grid of starts; how a start is given to an attractor stands in ``labels``."""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.analyses.attractors import UNDECIDED
from fmu_models.analyses.clouds import ChaoticTransient
from fmu_models.analyses.declaration import STATES, WATCHED, Analysis
from fmu_models.analyses.labels import COARSE, FAILED, INFINITE, Attractor, Labeller, watched
from fmu_models.analyses.uncertainty import uncertainty_exponent
from fmu_models.analyses.unforced import LONGEST, MOST, Most, mirror_images
from fmu_models.base.arrays import Integers, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import Spanned
from fmu_models.base.shown import Pictured
from fmu_models.families.execution import IN_MEMORY, Execution, Runner
from fmu_models.families.store import PROVENANCE, told
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.subject import Subject
from fmu_models.sections.system import SectionSystem, listed

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class Basins(Pictured):
    """Which start comes to which attractor.

    Attributes:
        model, states: its name, and those of the numbers of a point.
        axes: values of the start along each direction of the grid.
        labels: one per start, in the shape of the grid: an index into ``attractors``; -1 undecided, -2 to infinity, -3
            could not be run.
        attractors: stable periodic motions, the shortest first, then those without a period.
        steps: of sections until a start was decided.
        failures: why a start could not be run, by its place in the grid.
        how: of ``SectionSystem``.
        provenance: what it was made of; see ``Execution``.
        transients: chaos that starts leave again, with its lifetime; they have the label of what they come to then.
        units: of the states.
        mirrored: pairs of attractors that are mirror images of one another, where nothing forces the motion.
    """

    COLUMNS: ClassVar = ("{axes}=axes", "attractor=labels", "steps")
    RECORD: ClassVar = (
        *("model", "axes", "labels", "attractors", "shares", "undecided", "boundary", "entropy"),
        *("integrity", "uncertainty", "failures=refused", "mirrored", "transients", "how"),
    )

    model: str
    states: tuple[str, ...]
    axes: Mapping[str, Vector]
    labels: Integers
    attractors: tuple[Attractor, ...]
    steps: Integers
    failures: Mapping[tuple[int, ...], str]
    how: str = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    mirrored: tuple[tuple[int, int], ...] = ()
    transients: tuple[ChaoticTransient, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

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

    @cached_property
    def integrity(self) -> Vector:
        """(attractors,) half the width of the largest ball that lies in one basin and in the grid, where each axis is 1
        long: the integrity factor of Rega and Lenci (2005), to half the diagonal of a cell."""
        from scipy.ndimage import distance_transform_edt

        cell = [1.0 / max(1, size - 1) for size in self.labels.shape]
        inside = (np.pad(self.labels == i, 1) for i in range(len(self.attractors)))
        return np.array([np.max(distance_transform_edt(basin, sampling=cell)) for basin in inside])  # type: ignore[arg-type]

    @cached_property
    def uncertainty(self) -> tuple[float, float]:
        """The uncertainty exponent of the borders with its standard error; see ``uncertainty``."""
        return uncertainty_exponent(self.labels)

    @property
    def spanned(self) -> Spanned | None:
        """The states of the start, where there are two."""
        names = tuple(self.axes)
        return Spanned(names[0], names[1], states=self.states) if len(names) == 2 else None

    def to_xarray(self) -> "xarray.Dataset":
        """The grid with its axes."""
        import xarray

        names = list(self.axes)
        data = {"attractor": (names, self.labels), "steps": (names, self.steps)}
        return xarray.Dataset(data, dict(self.axes), {"model": self.model, PROVENANCE: told(self.provenance)})

    def _heading(self) -> str:
        shape = " x ".join(f"{len(values)} {name}" for name, values in self.axes.items())
        count = len(self.attractors)
        return f"Basins of {self.model}: {shape}, {count} attractor{'s' if count != 1 else ''}"

    @property
    def words(self) -> list[str]:
        """What each attractor is, and whose mirror image."""
        words = [attractor.word for attractor in self.attractors]
        for pair in self.mirrored:
            for i, other in zip(pair, reversed(pair), strict=True):
                words[i] += f", mirror image of {other + 1}"
        return words

    def _contents(self) -> Mapping[str, Any]:
        shares = {"shares": self.shares, "undecided": self.undecided, "boundary": self.boundary}
        transients = [transient.word for transient in self.transients]
        exponent, error = self.uncertainty
        told: dict[str, Any] = {"transients": transients} if transients else {}
        if np.isfinite(exponent):
            told["uncertainty exponent"] = f"{exponent:.3f} +- {error:.3f}"
        return {"attractors": self.words, **shares, "integrity": self.integrity, **told, "how": self.how or None}


def grid_of(
    system: SectionSystem, axes: Mapping[str, ArrayLike], start: Mapping[str, float] | None
) -> tuple[dict[str, Vector], Vector]:
    """The values along each axis, and all starts (m, n) in the order of rows.

    Raises:
        StickslipError: no axis, an unknown state, values that are no list of finite numbers or out of their range.
    """
    if not axes:
        raise StickslipError(f"Name the states of {system.name} that the grid is over, as x=[...]: {system.states}.")
    values = {name: listed(name, numbers) for name, numbers in axes.items()}
    base = system.start({name: float(value[0]) for name, value in values.items()} | dict(start or {}))
    for name, coordinates in values.items():
        for extreme in (coordinates.min(), coordinates.max()):
            system.start({name: float(extreme)})
    starts = np.tile(base, (*map(len, values.values()), 1))
    for name, coordinates in zip(values, np.meshgrid(*values.values(), indexing="ij", sparse=True), strict=True):
        starts[..., list(system.states).index(name)] = coordinates
    return values, starts.reshape(-1, len(base))


def basins(
    system: Subject,
    *,
    start: Mapping[str, float] | None = None,
    most: Most = MOST,
    longest: int = LONGEST,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
    **axes: ArrayLike,
) -> Basins:
    """Map which attractor each start of a grid comes to.

    Args:
        system: a map, an oscillator at a section, or a model as it is, where nothing forces it.
        start: what the axes do not say.
        most: steps after which a motion that has not repeated itself is taken to stay as it is.
        longest: period that is looked for.
        execution: Who makes the runs, and where they are kept.
        progress: called with the fraction done.
        axes: values of a state by its name; the first is the rows.

    Raises:
        StickslipError: unknown states, or values out of their range; as ``Runner``.
    """
    system = watched(system)
    values, starts = grid_of(system, axes, start)
    plan = {"analysis": "basins", "start": starts[0], "most": most, "longest": longest, "axes": values}
    with Runner(system, plan, execution, progress) as runner:
        return runner.finish(_mapped(runner, system, values, starts, most, longest))


def _mapped(
    runner: Runner, system: SectionSystem, values: dict[str, Vector], starts: Vector, most: int, longest: int
) -> Basins:
    shape, stride = tuple(len(value) for value in values.values()), max(1, len(starts) // COARSE)
    labeller = Labeller(runner, system, most, longest)
    if len(starts) > COARSE:
        labeller.explore(starts[stride // 2 :: stride])
    told_labels, attractors = labeller.label(starts, quiet=False), labeller.attractors
    order = sorted(
        range(len(attractors)), key=lambda i: (attractors[i].period == 0, attractors[i].time, *attractors[i].points[0])
    )
    # as indices those that are no attractor's count from the end
    labels = np.array([*np.argsort(order).tolist(), FAILED, INFINITE, UNDECIDED])[told_labels.labels]
    ordered = tuple(attractors[i] for i in order)
    failures = {tuple(map(int, np.unravel_index(i, shape))): text for i, text in told_labels.messages.items()}
    mirrored = mirror_images(system, ordered) if isinstance(system, Strobe) and system.autonomous else ()
    decided = labels.reshape(shape), ordered, told_labels.steps.reshape(shape), failures
    transients = tuple(labeller.transients)
    return Basins(
        *(system.name, tuple(system.states), values, *decided, system.how, runner.provenance, mirrored, transients),
        system.units(*system.states),
    )


def _numbers(result: Basins) -> dict[str, float]:
    values = {"attractors": float(len(result.attractors)), "undecided": float(result.undecided)}
    for i, attractor in enumerate(result.attractors):
        values |= {f"period{i + 1}": float(attractor.period), f"time{i + 1}": attractor.time}
        values |= {f"starts{i + 1}": float((result.labels == i).sum())}
    for i, transient in enumerate(result.transients, 1):
        values |= {f"lifetime{i}": transient.lifetime, f"lifetime{i}_error": transient.error}
    return {**values, "failed": float(len(result.failures)), "boundary": result.boundary}


ANALYSIS = Analysis(
    function=basins,
    numbers=_numbers,
    results="`attractors`, `undecided`, `failed`, `boundary`, and per attractor `period1`, `time1`, `starts1`; "
    "of chaos that does not last `lifetime1`, `lifetime1_error` in steps",
    example="discontinuous_support --forcing omega --set omega=1.1 --over x=-8:8:101 --over v=-8:8:101",
    label="mapping",
    axes=STATES,
    without=WATCHED,
)
