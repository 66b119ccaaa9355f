"""What happens at the events of a run: states go on continuously; an impact keeps places and obeys its restitution.

A contact is entered, hit or changes its side where its depth, slip speed or switching function is zero. An impact of
one contact without friction, with nothing else at its wall, must turn the speed u- of its gap into -e u-.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fmu_models.language.contact_kinds import AWAY
from fmu_models.simulation.trajectory import Event, Trajectory
from fmu_models.validation.stress.equations import ROUNDINGS, StressEquations, StressFindings

MOST = 48
TICKS = 8


def leeway(trajectory: Trajectory, time: float) -> float:
    """How far from an event to look, s: beside it, whatever rounding says."""
    return float(TICKS * np.spacing(max(abs(time), abs(trajectory.time[0]))))


def chosen(trajectory: Trajectory) -> list[list[Event]]:
    """Events in groups of one instant, evenly chosen of all after the start that have no neighbour too close."""
    groups: dict[float, list[Event]] = {}
    for event in trajectory.events:
        if event.time > trajectory.time[0]:
            groups.setdefault(event.time, []).append(event)
    instants = np.array([trajectory.time[0], *sorted(groups), trajectory.time[-1]])
    margins = [4 * leeway(trajectory, time) for time in instants[1:-1]]
    free = (np.diff(instants)[:-1] > margins) & (np.diff(instants)[1:] > margins)
    every = [groups[time] for time in instants[1:-1][free]]
    picks = np.unique(np.linspace(0, len(every) - 1, min(MOST, len(every))).astype(int)) if every else []
    return [every[i] for i in picks]


def around(trajectory: Trajectory, groups: list[list[Event]]) -> NDArray[np.float64]:
    """Times just before and just after each instant, ascending."""
    times = np.array([group[0].time for group in groups])
    off = np.array([leeway(trajectory, time) for time in times])
    return np.unique(np.concatenate([times - off, times + off]))


def jumps(
    equations: StressEquations, trajectory: Trajectory, groups: list[list[Event]], parameters: Mapping[str, float]
) -> StressFindings:
    """The largest contradiction at the events of ``groups``, which ``trajectory`` has samples around; relative."""
    system = equations.system
    kinds = {c.name: c for c in system.contacts}
    worst = StressFindings(0.0, "")
    sizes = {s.name: float(np.abs(trajectory[s.name]).max()) for s in system.states}
    span = float(trajectory.time[-1] - trajectory.time[0])
    columns = dict(trajectory.values) | {"time": trajectory.time}
    with np.errstate(all="ignore"):
        values = equations.environment(columns, parameters)
        # a velocity that is zero but for rounding has that of the terms of its rate
        gross = equations.rates(columns, parameters)[1].max(axis=1, initial=0.0) * span
        rounding = dict(zip(equations.driven, (ROUNDINGS * gross).tolist(), strict=True))
        for group in groups:
            jumping = {state for event in group for state in kinds[event.contact].reset}
            if any(kinds[event.contact].reset and kinds[event.contact].kind.surface for event in group):
                continue
            off = leeway(trajectory, group[0].time)
            before, after = np.searchsorted(trajectory.time, [group[0].time - off, group[0].time + off]).tolist()
            impact = any(event.is_impact for event in group)
            tick = 4.0 * off
            continuous = [*system.coordinates] if impact else [*system.states]
            for state in (name for name in continuous if name not in jumping):
                rate = np.abs(trajectory[f"der({state.name})"][[before, after]]).max()
                jump = abs(float(trajectory[state.name][after] - trajectory[state.name][before])) - rate * tick
                error = (jump - rounding.get(state.name, 0.0)) / (sizes[state.name] or 1.0)
                if error > worst.error:
                    worst = StressFindings(error, f"jump of {state.name} at {group[0].time:.9g} s")
            for event in group:
                error = _off_boundary(equations, event, values, trajectory, (before, after), moved=impact)
                if error > worst.error:
                    worst = StressFindings(error, f"{event.contact} changes off its boundary at {group[0].time:.9g} s")
            if impact and len(group) == 1 and kinds[group[0].contact].partner is None:
                error = _restitution(equations, trajectory, group[0], values, before, after, tick)
                if error > worst.error:
                    worst = StressFindings(error, f"restitution of {group[0].contact} at {group[0].time:.9g} s")
    return worst


def _off_boundary(
    equations: StressEquations,
    event: Event,
    values: list,
    trajectory: Trajectory,
    rows: tuple[int, int],
    *,
    moved: bool,
) -> float:
    """How far from zero depth, slip speed or switching function is where a contact changes for its sake; relative."""
    index, contact = next((i, c) for i, c in enumerate(equations.system.contacts) if c.name == event.contact)
    if contact.kind.impulsive:
        coordinate = "depth" if event.is_impact else ""
    elif (event.before == AWAY) != (event.after == AWAY) and contact.release is None:
        coordinate = "depth" if contact.depth is not None else ""
    elif contact.kind.dry and abs(event.before) == 1 and AWAY not in (event.before, event.after):
        coordinate = "" if moved else "slip"
    else:
        coordinate = ""
    if not coordinate:
        return 0.0
    value, size = (np.broadcast_to(a, trajectory.time.shape) for a in equations.place(index, values, coordinate))
    a, b = float(value[rows[0]]), float(value[rows[1]])
    largest = float(np.nanmax(size))
    return 0.0 if a * b <= 0 or largest == 0 else (min(abs(a), abs(b)) - abs(a - b)) / largest


def _restitution(
    equations: StressEquations, trajectory: Trajectory, event: Event, values: list, before: int, after: int, tick: float
) -> float:
    """Deviation of the speed after one impact from -e u-, relative to the speeds that make up u."""
    contacts = equations.system.contacts
    index = next(i for i, c in enumerate(contacts) if c.name == event.contact)
    others = [c for c in contacts if c.kind.impulsive and c.name != event.contact]
    if event.after != AWAY or any(trajectory[f"{c.name}_state"][before] != AWAY for c in others):
        return 0.0
    speed, size = equations.place(index, values, "slip")
    speed, size = (np.broadcast_to(a, trajectory.time.shape) for a in (speed, size))
    e = float(np.broadcast_to(equations.laws(index, values)[2], trajectory.time.shape)[before])
    rates = [np.abs(trajectory[f"der({name})"][[before, after]]).max() for name in equations.driven]
    allowed = tick * sum(rates)
    wrong = abs(float(speed[after] + e * speed[before])) - allowed
    return wrong / (float(max(size[before], size[after])) or 1.0)
