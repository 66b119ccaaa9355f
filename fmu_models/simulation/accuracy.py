"""How far a run can be trusted: its defect, the same run again four times otherwise, and the largest difference.

    defect                   states against the integral of their rates, and every deciding function against the
                             contact's state, by evaluation at single points (simulation/defect.py): shares nothing
                             with the series
    other steps              steps that end at all pieces of the defect, hence within whatever is narrow
    tolerance/10             higher orders: what truncation leaves; where steps are sums, by the series that these
                             stand for
    data up, data down       every start value, parameter and constant input moved by 2^-52 of itself to either
                             side: what one rounding becomes on the way, in the constants too

At the default tolerance, 1e-14, truncation is near rounding, so a run at a tolerance a hundred times coarser, scaled,
would say nothing of the error and the engine has none; and a single finer run shares what rounding the data does. The
largest difference is no bound: on runs whose result is known it was from 0.9 to 16 times the error. Equal values stay
equal when they are moved, and zeros zero: discs of one speed, contacts that have no gap.

A run that its defect contradicts is wrong: then the difference to the run with other steps is its error, over all of
it. Steps are added until that run's own defect is rounding; where it never is, nothing is known of the motion, and the
error said is its size.

A motion that is chaotic, or grazes, may part from its companions: then the estimate says when, and from there on only
statistics of the run mean anything.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.defect import Defect, defect_of
from fmu_models.simulation.inputs import signals_of
from fmu_models.simulation.run import Repeated, bounds_of, simulate
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Trajectory

_ROUNDING = 2.0**-52
APART = 1e-3  # of the size of a state: two runs that differ by more are different motions
COMPANIONS = ("other steps", "tolerance/10", "data up", "data down")
_WRONG = 1e-9  # of the size of a state: a larger defect is no rounding, nor
_REST = 1e-6  # of its nominal value: a state that stays below this part of it is at rest
_ROUNDS = 4  # in which steps are added to a run until its defect is rounding


@dataclass(frozen=True)
class ErrorEstimate(Shown):
    """The defect of a run, and the largest differences between it and its companions.

    Attributes:
        states: per state over all output times before ``apart``, in its unit; times at events are left out, since
            velocities may jump there, unless the run is wrong.
        end: per state at the last output time, even if an event is there.
        defect: per state, the largest sum of its defects from the start on.
        wrong: s, from where on the run does not follow its model; None if it does.
        contradiction: the deciding function that is negative there, in a word; empty if none is.
        relative: the largest of ``states`` in fractions of the largest magnitude of each, of one at rest in fractions
            of a millionth of its nominal value.
        event_time: s, by which an event before ``apart`` moved.
        apart: s, from where on a companion is another motion: its states differ by more than a thousandth of their
            size, or its events are others; None if there is no such time.
        by: the companion that differs most.
        refused: companions that could not finish, with what stopped them.
        seconds: wall time of the run itself and of all companions, s.
    """

    companions: ClassVar = COMPANIONS

    states: Mapping[str, float]
    end: Mapping[str, float]
    defect: Mapping[str, float]
    wrong: float | None
    contradiction: str
    relative: float
    event_time: float
    apart: float | None
    by: str
    refused: Mapping[str, str]
    seconds: tuple[float, float]


def simulate_with_error(
    fmu: Fmu,
    stop_time: float,
    *,
    start_time: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    output_times: ArrayLike | None = None,
    tolerance: float = 1e-14,
    sides: bool = False,
    progress: Callable[[float], None] | None = None,
) -> tuple[Trajectory, ErrorEstimate]:
    """A run and an estimate of its error; arguments and errors are those of ``simulate``."""
    stages = len(COMPANIONS) + 1

    def stage(i: int) -> Callable[[float], None]:
        return lambda fraction: progress((i + fraction) / stages) if progress else None

    settings: dict[str, Any] = {
        "parameters": dict(parameters or {}),
        "start": dict(start or {}),
        "inputs": signals_of(fmu, inputs or {}, start_time, stop_time),
    }
    span: dict[str, Any] = {"start_time": start_time, "output_times": output_times}
    trajectory = simulate(fmu, stop_time, tolerance=tolerance, sides=sides, progress=stage(0), **settings, **span)
    started = time.perf_counter()
    check = _checked(Repeated(fmu, stop_time, start_time, tolerance, **settings), trajectory, output_times, stage(1))
    runs, refused = ({}, check.refused) if check.other is None else ({COMPANIONS[0]: check.other}, {})
    for i, name in enumerate(COMPANIONS[1:], 2):
        finer = name.startswith("tolerance")
        moved = settings if finer else _moved(fmu, settings, +1 if name == "data up" else -1)
        companion = Repeated(fmu, stop_time, start_time, tolerance * (0.1 if finer else 1.0), **moved)
        try:
            runs[name] = companion.trajectory(output_times, check.ends, stage(i))
        except StickslipError as error:
            refused[name] = str(error)
    seconds = trajectory.seconds, time.perf_counter() - started
    return trajectory, _estimate(fmu, trajectory, runs, refused, check, seconds)


@dataclass(frozen=True)
class _DefectCheck:
    """The defect of a run, the run with other steps, where these end, and whether its own defect is rounding."""

    defect: Defect
    name: str  # of the deciding function that contradicts
    sizes: Vector  # (s,) of the states
    other: Trajectory | None
    ends: Vector
    right: bool
    refused: dict[str, str] = field(default_factory=dict)

    @property
    def wrong(self) -> float | None:
        """The time from which the run does not follow its model; None if it follows throughout."""
        return _wrong_from(self.defect, self.sizes)


def _wrong_from(defect: Defect, sizes: Vector) -> float | None:
    times = [defect.contradiction[0]] if defect.contradiction else []
    large = np.flatnonzero((np.abs(defect.sums) > _WRONG * sizes).any(axis=1))
    return min([*times, *defect.time[large[:1]].tolist()], default=None)


def _checked(
    repeated: Repeated, run: Trajectory, output_times: ArrayLike | None, progress: Callable[[float], None]
) -> _DefectCheck:
    states = repeated.fmu.states
    sizes = np.array([max(np.abs(run[state]).max(), _resting(repeated.fmu, state)) for state in states])

    def defect(trajectory: Trajectory, ends: Vector | None) -> Defect:
        breaks = np.concatenate([repeated.kinks, [event.time for event in trajectory.events]])
        return defect_of(lambda times: repeated.record(times, ends), breaks, len(states))

    own_defect = defect(run, None)
    name = repeated.deciding_name(own_defect.contradiction[1]) if own_defect.contradiction else ""
    second, ends, latest = None, own_defect.edges, own_defect
    try:
        for _ in range(_ROUNDS):
            second = repeated.trajectory(output_times, ends, progress)
            if own_defect is latest and _wrong_from(own_defect, sizes) is None:
                break
            latest = defect(second, ends)
            if _wrong_from(latest, sizes) is None:
                break
            if latest.resolved:
                ends = np.union1d(ends, latest.edges)
    except StickslipError as error:
        return _DefectCheck(own_defect, name, sizes, None, ends, False, {COMPANIONS[0]: str(error)})
    return _DefectCheck(own_defect, name, sizes, second, ends, _wrong_from(latest, sizes) is None and latest.resolved)


def _resting(fmu: Fmu, state: str) -> float:
    """A magnitude of a state that is none: of what is held, rounding of all that acts on it is left."""
    nominal = fmu.variables[state].nominal
    return _REST * (1.0 if nominal is None else abs(float(nominal)))


def _moved(fmu: Fmu, settings: Mapping[str, dict[str, Any]], side: int) -> dict[str, Any]:
    """Every value, given or default, moved by one rounding within its bounds; signals stay."""
    memories = {name: value for name, value in settings["start"].items() if name in fmu.memories}
    defaults = {"parameters": fmu.parameters, "start": fmu.states, "inputs": fmu.inputs}
    moved: dict[str, Any] = {}
    for kind, names in defaults.items():
        values = {name: settings[kind].get(name, fmu.start_of(name)) for name in names}
        moved[kind] = {n: v if isinstance(v, Signal) else _nudged(fmu, n, float(v), side) for n, v in values.items()}
    moved["start"] |= memories
    return moved


def _nudged(fmu: Fmu, name: str, value: float, side: int) -> float:
    # the direction is taken from the digits: different values go different ways, equal ones the same
    mantissa = int(math.ldexp(math.frexp(abs(value))[0], 53))
    direction = side * (-1) ** (mantissa % 1009 % 2)
    low, high = bounds_of(fmu.variables[name])
    return min(max(value * (1.0 + direction * _ROUNDING), low), high)


def _estimate(
    fmu: Fmu,
    trajectory: Trajectory,
    runs: Mapping[str, Trajectory],
    refused: Mapping[str, str],
    check: _DefectCheck,
    seconds: tuple[float, float],
) -> ErrorEstimate:
    wrong = check.wrong
    if not runs and wrong is None:
        raise StickslipError(
            "The error cannot be estimated: the same run fails with other steps, at a finer tolerance and with data "
            f"moved by one rounding ({next(iter(refused.values()))})."
        )
    sizes = dict(zip(fmu.states, check.sizes.tolist(), strict=True))
    shared = {name: _shared_events(trajectory, companion) for name, companion in runs.items()}
    gaps = {name: _differences(trajectory, companion, fmu.states, *shared[name]) for name, companion in runs.items()}
    if wrong is not None:
        # the difference to the right run is the error, wherever it is; there is none to say without that run
        gaps = {COMPANIONS[0]: _whole_differences(trajectory, check, fmu.states)}
        parting = math.inf
    else:
        parting = min(until for _, until in shared.values())
        for difference in gaps.values():
            for state, values in difference.items():
                large = np.flatnonzero(values > APART * sizes[state])
                parting = min(parting, float(trajectory.time[large[0]])) if large.size else parting
    before = trajectory.time < parting
    defect = dict(zip(fmu.states, np.abs(check.defect.sums).max(axis=0, initial=0.0).tolist(), strict=True))
    # what is left of a defect at later times only a run that is right can say
    states = dict.fromkeys(fmu.states, 0.0) if check.right else dict(defect)
    end, by = dict(states), next(iter(runs)) if check.right else "defect"
    relative = max((value / sizes[state] for state, value in states.items() if sizes[state]), default=0.0)
    for name, difference in gaps.items():
        for state, values in difference.items():
            largest = float(values[before].max(initial=0.0))
            states[state] = max(states[state], largest)
            last = values[-1] if wrong is not None else abs(runs[name][state][-1] - trajectory[state][-1])
            end[state] = max(end[state], float(last))
            if largest > relative * sizes[state] > 0.0 or (relative == 0.0 and largest > 0.0):
                relative, by = largest / sizes[state], name
    moved = max((float(m[t < parting].max(initial=0.0)) for (t, m), _ in shared.values()), default=0.0)
    parting_time = None if parting == math.inf else parting
    return ErrorEstimate(states, end, defect, wrong, check.name, relative, moved, parting_time, by, refused, seconds)


def _whole_differences(run: Trajectory, check: _DefectCheck, states: Sequence[str]) -> dict[str, Vector]:
    """Per state (n,) to the run with other steps, the size of the state from where on nothing is known."""
    unknown = np.zeros(run.time.size, dtype=bool) if check.right else run.time >= (check.wrong or -math.inf)
    differences = {}
    for state, size in zip(states, check.sizes.tolist(), strict=True):
        difference = np.zeros(run.time.size) if check.other is None else np.abs(check.other[state] - run[state])
        differences[state] = np.where(unknown, np.maximum(difference, size), difference)
    return differences


_Events = tuple[Vector, Vector]  # times (m,) of shared events and by how much they moved (m,)


def _shared_events(first: Trajectory, second: Trajectory) -> tuple[_Events, float]:
    """The events that two runs share from the start, and the time of the first that they do not."""
    times, moved, until = [], [], math.inf
    for a, b in zip(first.events, second.events, strict=False):
        if (a.contact, a.before, a.after) != (b.contact, b.before, b.after):
            until = min(a.time, b.time)
            break
        times.append(a.time)
        moved.append(abs(a.time - b.time))
    else:
        longer = max(first.events, second.events, key=len)
        until = longer[len(times)].time if len(longer) > len(times) else math.inf
    # an event at the very end of the run may come after it in the other one
    last = max(moved, default=0.0)
    if first.time[-1] - until <= 10.0 * last:
        times.append(until)
        moved.append(last)
        until = math.inf
    return (np.array(times), np.array(moved)), until


def _differences(
    first: Trajectory, second: Trajectory, states: Sequence[str], events: _Events, until: float
) -> dict[str, Vector]:
    """Per state (n,), zero near events, where velocities may have jumped in one run and not yet in the other."""
    times, moved = events
    late = first.time >= until
    if times.size:
        right = np.searchsorted(times, first.time).clip(0, times.size - 1)
        for event in (right, (right - 1).clip(0)):
            reach = np.maximum(10.0 * moved[event], 4.0 * _ROUNDING * np.abs(first.time))
            late |= np.abs(first.time - times[event]) <= reach
    return {state: np.where(late, 0.0, np.abs(second[state] - first[state])) for state in states}
