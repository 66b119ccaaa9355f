"""How far a run can be trusted: the same run again, four times otherwise, and the largest difference.

    tolerance/10, tolerance/100    higher orders and other steps: what truncation and the rounding in each step leave
    data up, data down             every start value, parameter and constant input moved by 2^-52 of itself to either
                                   side: what one rounding becomes on the way, in the constants too

At the default tolerance, 1e-14, truncation is near rounding, so a run at a tolerance a hundred times coarser, scaled,
would say nothing of the error and the engine has none; and a single finer run shares what rounding the data does. The
largest of the four differences is no bound: on runs whose result is known it was from 0.9 to 16 times the error. Equal
values stay equal when they are moved, and zeros zero: discs of one speed, contacts that have no gap.

A motion that is chaotic, or grazes, may part from its companions: then the estimate says when, and from there on only
statistics of the run mean anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Trajectory

_ROUNDING = 2.0**-52
APART = 1e-3  # of the size of a state: two runs that differ by more are different motions
COMPANIONS = ("tolerance/10", "tolerance/100", "data up", "data down")


@dataclass(frozen=True)
class ErrorEstimate(Shown):
    """Largest differences between a run and its companions.

    Attributes:
        states: per state over all output times before ``apart``, in its unit; times at events are left out, since
            velocities may jump there.
        end: per state at the last output time, even if an event is there.
        relative: the largest of ``states`` in fractions of the largest magnitude of each.
        event_time: s, by which an event before ``apart`` moved.
        apart: s, from where on a companion is another motion: its states differ by more than a thousandth of their
            size, or its events are others; None if there is no such time.
        by: the companion that differs most.
        refused: companions that could not finish, with what stopped them.
        seconds: wall time of the run itself and of all companions, s.
    """

    states: Mapping[str, float]
    end: Mapping[str, float]
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
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    inputs: Mapping[str, float | Signal] | None = None,
    tolerance: float = 1e-14,
    progress: Callable[[float], None] | None = None,
    **run: Any,
) -> tuple[Trajectory, ErrorEstimate]:
    """A run and an estimate of its error; arguments are those of ``simulate``.

    Raises:
        StickslipError: as for ``simulate``.
    """
    stages = len(COMPANIONS) + 1

    def stage(i: int) -> Callable[[float], None]:
        return lambda fraction: progress((i + fraction) / stages) if progress else None

    given = {"parameters": dict(parameters or {}), "start": dict(start or {}), "inputs": dict(inputs or {})}
    trajectory = simulate(fmu, stop_time, tolerance=tolerance, progress=stage(0), **given, **run)
    found, refused = {}, {}
    for i, name in enumerate(COMPANIONS, 1):
        factor = {"tolerance/10": 0.1, "tolerance/100": 0.01}.get(name, 1.0)
        moved = given if factor < 1.0 else _moved(fmu, given, +1 if name == "data up" else -1)
        try:
            found[name] = simulate(fmu, stop_time, tolerance=tolerance * factor, progress=stage(i), **moved, **run)
        except StickslipError as error:
            refused[name] = str(error)
    return trajectory, _estimate(fmu, trajectory, found, refused)


def _moved(fmu: Fmu, given: Mapping[str, dict[str, Any]], side: int) -> dict[str, dict[str, Any]]:
    """Every value, given or default, moved by one rounding within its bounds; signals stay."""
    memories = {name: value for name, value in given["start"].items() if name in fmu.memories}
    defaults = {"parameters": fmu.parameters, "start": fmu.states, "inputs": fmu.inputs}
    moved: dict[str, dict[str, Any]] = {}
    for kind, names in defaults.items():
        values = {name: given[kind].get(name, float(fmu.variables[name].start or 0.0)) for name in names}
        moved[kind] = {n: v if isinstance(v, Signal) else _nudged(fmu, n, float(v), side) for n, v in values.items()}
    moved["start"] |= memories
    return moved


def _nudged(fmu: Fmu, name: str, value: float, side: int) -> float:
    # the direction is taken from the digits: different values go different ways, equal ones the same
    mantissa = int(math.ldexp(math.frexp(abs(value))[0], 53))
    direction = side * (-1) ** (mantissa % 1009 % 2)
    variable = fmu.variables[name]
    moved = value * (1.0 + direction * _ROUNDING)
    low = -math.inf if variable.min is None else float(variable.min)
    high = math.inf if variable.max is None else float(variable.max)
    return min(max(moved, low), high)


def _estimate(
    fmu: Fmu, trajectory: Trajectory, found: Mapping[str, Trajectory], refused: Mapping[str, str]
) -> ErrorEstimate:
    if not found:
        raise StickslipError(
            "The error cannot be estimated: the same run fails at every finer tolerance and with data moved by one "
            f"rounding ({next(iter(refused.values()))})."
        )
    sizes = {state: float(np.abs(trajectory[state]).max()) for state in fmu.states}
    shared = {name: _shared_events(trajectory, other) for name, other in found.items()}
    gaps = {name: _differences(trajectory, other, fmu.states, *shared[name]) for name, other in found.items()}
    apart = min(until for _, until in shared.values())
    for difference in gaps.values():
        for state, values in difference.items():
            large = np.flatnonzero(values > APART * sizes[state])
            apart = min(apart, float(trajectory.time[large[0]])) if large.size else apart
    before = trajectory.time < apart
    states, end = dict.fromkeys(fmu.states, 0.0), dict.fromkeys(fmu.states, 0.0)
    relative, by = 0.0, next(iter(found))
    for name, difference in gaps.items():
        for state, values in difference.items():
            largest = float(values[before].max(initial=0.0))
            states[state] = max(states[state], largest)
            end[state] = max(end[state], float(abs(found[name][state][-1] - trajectory[state][-1])))
            if largest > relative * sizes[state] > 0.0 or (relative == 0.0 and largest > 0.0):
                relative, by = largest / sizes[state], name
    moved = max((float(m[t < apart].max(initial=0.0)) for (t, m), _ in shared.values()), default=0.0)
    seconds = (trajectory.seconds, sum(other.seconds for other in found.values()))
    return ErrorEstimate(states, end, relative, moved, apart if apart < math.inf else None, by, refused, seconds)


_Events = tuple[NDArray[np.float64], NDArray[np.float64]]  # times (m,) of shared events and by how much they moved (m,)


def _shared_events(one: Trajectory, other: Trajectory) -> tuple[_Events, float]:
    """The events that two runs share from the start, and the time of the first that they do not."""
    times, moved, until = [], [], math.inf
    for a, b in zip(one.events, other.events, strict=False):
        if (a.contact, a.before, a.after) != (b.contact, b.before, b.after):
            until = min(a.time, b.time)
            break
        times.append(a.time)
        moved.append(abs(a.time - b.time))
    else:
        longer = max(one.events, other.events, key=len)
        until = longer[len(times)].time if len(longer) > len(times) else math.inf
    # an event at the very end of the run may come after it in the other one
    last = max(moved, default=0.0)
    if one.time[-1] - until <= 10.0 * last:
        times.append(until)
        moved.append(last)
        until = math.inf
    return (np.array(times), np.array(moved)), until


def _differences(
    one: Trajectory, other: Trajectory, states: Sequence[str], events: _Events, until: float
) -> dict[str, NDArray[np.float64]]:
    """Per state (n,), zero near events, where velocities may have jumped in one run and not yet in the other."""
    times, moved = events
    near = one.time >= until
    if times.size:
        right = np.searchsorted(times, one.time).clip(0, times.size - 1)
        for event in (right, (right - 1).clip(0)):
            reach = np.maximum(10.0 * moved[event], 4.0 * _ROUNDING * np.abs(one.time))
            near |= np.abs(one.time - times[event]) <= reach
    return {state: np.where(near, 0.0, np.abs(other[state] - one[state])) for state in states}
