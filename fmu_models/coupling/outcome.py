"""What a co-simulation came to: at its end, where it broke off, or in a process of its own that may die."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from fmu_models.coupling.bonds import PowerBonds
from fmu_models.coupling.dense import DenseOutput
from fmu_models.coupling.histories import Vector
from fmu_models.coupling.points import CommunicationPoints
from fmu_models.importer.motion_error import OWN_STATE, MotionError
from fmu_models.simulation.trajectory import Trajectory

News = tuple[dict[str, str], list[float], list[Vector]]  # units of measure by name; times and rows since the last ones
Tell = Callable[[str | News], None]

CHATTERING, CHATTER_SPAN = 300, 1e-8  # events in a row that are so near, in the run, that it would never end


class Halts:
    """Times of the last events, merged ones too, of a run that lasts ``span`` s."""

    def __init__(self, span: float) -> None:
        self.span, self._times = span, deque([-np.inf] * CHATTERING, CHATTERING)

    def add(self, time: float, unit: str) -> None:
        """An event of a unit. MotionError: events follow one another without end."""
        self._times.append(time)
        if (width := time - self._times[0]) <= CHATTER_SPAN * self.span:
            raise MotionError(
                f"the last {CHATTERING} events, of unit '{unit}', lie within {width:.2g} s at t = {time:.9g} s "
                f"(chattering): it goes to and fro, and the run would not end. {OWN_STATE}",
                "chattering",
                time,
                concerned=[unit],
            )


class Outcome:
    """What a master records and counts; measured_in: units of measure of what is recorded, by name; reached: the
    highest degree; missed: accepted steps that missed the tolerance."""

    points: CommunicationPoints
    bonds: PowerBonds
    output: DenseOutput
    measured_in: dict[str, str]
    step: float | None
    repeats: bool
    steps: int
    retries: int
    missed: int
    reached: int

    def trajectory(self) -> Trajectory:
        """The points recorded so far, and in words how they were reached."""
        output, points = self.output, self.points
        calls = max(unit.calls for unit in points.units)
        note = f"co-simulation of {len(points.units)} units, "
        fixed = "fixed step" if self.step else "no step repeated"
        note += "steps repeated where they miss" if self.repeats else fixed
        note += f", degree up to {self.reached}: {self.retries} retries, at most {calls} calls of a unit"
        if self.missed:
            note += f"; {self.missed} steps missed the tolerance"
        for unit in points.units:
            note += f"; {unit.words}" + (f", {unit.instance.remark}" if unit.instance.remark else "")
        ended = [unit.name for unit in points.units if unit.ended]
        if ended:
            note += f"; unit '{ended[0]}' ended the run at t = {points.time:.9g} s"
        note += self.bonds.words
        values, events = columns(self.measured_in, output.rows), tuple(points.events)
        return Trajectory(np.array(output.time), values, self.measured_in, events, self.steps, self.retries, note)

    def news(self) -> News:
        """What was recorded since the last time, but for the last point, which an event may replace."""
        output = self.output
        new = slice(output.told, max(output.told, len(output.time) - 1))
        output.told = new.stop
        return self.measured_in, output.time[new], output.rows[new]


def columns(names: Iterable[str], rows: Sequence[Vector]) -> dict[str, Vector]:
    """Values (n,) by name, of n rows."""
    table = np.array(rows).T
    return {name: np.ascontiguousarray(table[i]) if rows else np.zeros(0) for i, name in enumerate(names)}
