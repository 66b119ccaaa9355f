"""A run against another one that looks at the FMU at other times.

A method of integration sees an FMU at the nodes of its steps alone. What lasts less than the largest gap between nodes
may be missed, in silence; a second run with other and shorter steps tells, for all that lasts longer than its own gaps.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.child_process import Limits
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.experiment import FmuExperiment, perform
from fmu_models.importer.request import StepBound
from fmu_models.simulation.results import Recording
from fmu_models.simulation.trajectory import ForeignEvent, Trajectory

# of the first run's longest step: no nodes of the two runs fall together over several steps, as with the golden section
SHIFT = 0.381966
STEPS = 1000  # over the run, to which the shift is applied where the first run's steps have no bound
GAP = 0.2226  # of a step: the largest distance of two places at which indicators are read (importer/c/search.c)
SPREAD = 1e3  # in tolerances: what the errors of the two runs may differ by


@dataclass(frozen=True)
class Difference:
    """A variable that the two runs show otherwise: when first, s, and by how much at most over the run."""

    variable: str
    time: float
    most: float


@dataclass(frozen=True)
class LoneEvent:
    """An event of one run that the other has not at that time, s."""

    kind: str
    indicator: int
    time: float
    run: str  # "first" or "second"


@dataclass(frozen=True, eq=False)
class SecondRun(Shown):
    """What a second run says of a first one.

    Attributes:
        max_step: s, longest step of the second run.
        tolerance: of both.
        steps: of the second run.
        variables: that differ by more than a thousand tolerances of their size, away from events.
        events: that one run has alone.
        failure: why the second run could not be made, or nothing.
    """

    max_step: float
    tolerance: float
    steps: int = 0
    variables: tuple[Difference, ...] = ()
    events: tuple[LoneEvent, ...] = ()
    failure: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the two runs show the same."""
        return not (self.variables or self.events or self.failure)

    @property
    def lasts(self) -> float:
        """What lasts longer than this, s, in the sign of an event indicator, is seen by the second run."""
        return GAP * self.max_step


def shifted_step(fmu: Fmu, max_step: float | None, start: float, stop: float) -> float:
    """The longest step, s, of the second run beside one from ``start`` to ``stop`` with that longest step."""
    return SHIFT * min(StepBound.of(fmu, max_step, start, stop).longest, (stop - start) / STEPS)


def perform_twice(
    fmu: Fmu,
    experiment: FmuExperiment,
    *,
    limits: Limits | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Recording, SecondRun]:
    """Make the run, and a second one that looks at the FMU at other times, with what differs between the two.
    StickslipError: as for ``perform``, or the run is not made by a method of integration of the master."""
    if experiment.is_native(fmu) or experiment.is_co_simulation(fmu):
        raise StickslipError(
            "A second run looks at an FMU between the steps of a method of integration, and this run has none. Leave "
            "it out; --error says how far a run by an FMU's own engine can be trusted."
        )
    first = perform(fmu, experiment, limits=limits, progress=progress)
    step = shifted_step(fmu, experiment.max_step, experiment.start_time, experiment.stop_time)
    tolerance = experiment.tolerance_for(fmu)
    try:
        second = perform(fmu, replace(experiment, max_step=step), limits=limits, progress=progress)
    except StickslipError as error:
        return first, SecondRun(step, tolerance, failure=str(error))
    return first, compare(first.trajectory, second.trajectory, step, tolerance)


def compare(first: Trajectory, second: Trajectory, max_step: float, tolerance: float) -> SecondRun:
    """Differences between two runs with the same output times."""
    spread = SPREAD * tolerance
    resolution = spread * max(abs(float(first.time[0])), abs(float(first.time[-1])))
    lone = (*_lone(first, second, resolution, "first"), *_lone(second, first, resolution, "second"))
    rows = min(first.time.size, second.time.size)
    time = first.time[:rows]
    # at an event one run may be before it, the other behind
    events = np.array([event.time for event in (*first.events, *second.events)])
    isolated = np.abs(time[:, None] - events[None, :]).min(axis=1, initial=np.inf) > resolution
    different = []
    for name in first.values:
        a, b = (np.asarray(run[name], dtype=float)[:rows] for run in (first, second))
        size = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
        by = np.where(isolated & np.isfinite(a) & np.isfinite(b), np.abs(a - b), 0.0)
        by[np.isfinite(a) != np.isfinite(b)] = np.inf
        beyond = np.flatnonzero(by > spread * (size if np.isfinite(size) else 1.0))
        if beyond.size:
            different.append(Difference(name, float(time[beyond[0]]), float(by.max())))
    return SecondRun(
        max_step,
        tolerance,
        second.steps,
        tuple(sorted(different, key=lambda d: d.time)),
        tuple(sorted(lone, key=lambda e: e.time)),
    )


def _lone(run: Trajectory, second: Trajectory, resolution: float, label: str) -> Iterator[LoneEvent]:
    """Events of a run without their like in the second one, each of which stands for one; label: of the run."""
    unmatched: dict[tuple[str, int], list[float]] = {}
    for event in second.events:
        if isinstance(event, ForeignEvent):
            unmatched.setdefault((event.kind, event.indicator), []).append(event.time)
    for event in run.events:
        if not isinstance(event, ForeignEvent):
            continue
        times = unmatched.get((event.kind, event.indicator), [])
        match = next((time for time in times if abs(time - event.time) <= resolution), None)
        if match is None:
            yield LoneEvent(event.kind, event.indicator, event.time, label)
        else:
            times.remove(match)
