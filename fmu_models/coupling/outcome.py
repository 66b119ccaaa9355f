"""What a co-simulation came to: at its end, where it broke off, or in a process of its own that may die."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.coupling.histories import Vector
from fmu_models.simulation.trajectory import Trajectory

if TYPE_CHECKING:
    from fmu_models.coupling.cosimulation import Master

News = tuple[dict[str, str], list[float], list[Vector]]  # units of measure by name; times and rows since the last ones
Tell = Callable[[str | News], None]


def trajectory(master: Master) -> Trajectory:
    """The points recorded so far, and in words how they were reached."""
    output, points = master.output, master.points
    calls = max(unit.calls for unit in master.units)
    note = f"co-simulation of {len(master.units)} units, "
    fixed = "fixed step" if master.step else "no step repeated"
    note += "steps repeated where they miss" if master.repeats else fixed
    note += f", degree up to {master.reached}: {master.retries} retries, at most {calls} calls of a unit"
    if master.missed:
        note += f"; {master.missed} steps missed the tolerance"
    for unit in master.units:
        note += f"; {unit.words}" + (f", {unit.instance.remark}" if unit.instance.remark else "")
    ended = [unit.name for unit in master.units if unit.ended]
    if ended:
        note += f"; unit '{ended[0]}' ended the run at t = {points.time:.9g} s"
    values, events = columns(master.measured_in, output.rows), tuple(points.events)
    return Trajectory(np.array(output.time), values, master.measured_in, events, master.steps, master.retries, note)


def columns(names: Iterable[str], rows: Sequence[Vector]) -> dict[str, Vector]:
    """Values (n,) by name, of n rows."""
    table = np.array(rows).T
    return {name: np.ascontiguousarray(table[i]) if rows else np.zeros(0) for i, name in enumerate(names)}


def news(master: Master) -> News:
    """What was recorded since the last time, but for the last point, which an event may replace."""
    output = master.output
    new = slice(master.output.told, max(master.output.told, len(output.time) - 1))
    output.told = new.stop
    return master.measured_in, output.time[new], output.rows[new]
