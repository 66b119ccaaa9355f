"""What is recorded of a co-simulation: at its points, or between them at times that do not shorten its steps.

    states            Hermite's polynomial through the last three points, with the rates at them
    other reals       the polynomial through the last points, of one degree more than the inputs were expected with
    all else          as at the point before

None reaches over an event: behind it the points begin anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fmu_models.coupling.histories import POINTS, Vector, between

HERMITE = 3  # points
NEAR = 0.05  # of the step to be filled


class DenseOutput:
    """Values of variables over time.

    Args:
        read: gives values (n,), behind them the rates of those with slopes, and what else is asked of ``last``.
        n: variables.
        slopes: places of the variables whose rates are read too.
        held: (n,) those that change at events only.
        times: (m,) s, when to record; None: at the points.
    """

    def __init__(
        self, read: Callable[[], Vector], n: int, slopes: Sequence[int], held: NDArray[np.bool_], times: Vector | None
    ) -> None:
        self.read, self._n, self._times, self._next = read, n, times, 0
        self._slopes = np.array(slopes, dtype=int)
        self._rates = slice(n, n + self._slopes.size)
        others = ~held
        others[self._slopes] = False
        self._others = np.flatnonzero(others)
        self.told = 0  # how many of the rows somebody knows
        self._points: list[float] = []
        self._values: list[Vector] = []
        self.time: list[float] = []
        self.rows: list[Vector] = []

    @property
    def last(self) -> Vector:
        """What was read at the last point."""
        return self._values[-1]

    def inside(self, start: float, end: float) -> bool:
        """Whether a time to record lies between."""
        times = self._times
        return times is not None and self._next < times.size and start < times[self._next] < end

    def error(self, time: float, row: Vector) -> float:
        """What is filled in up to a new point ``row`` is off by about so much, as a share of 1 + |x|; else 0.

        The polynomial through the points before is off by E at the new one: a cubic between two points by less than
        E / 60, Hermite's of three points by about E / 250. Of one point alone the slopes at both ends tell.
        """
        if not self._points or not self._slopes.size or not self.inside(self._points[-1], time):
            return 0.0
        kept = self._apart()[-HERMITE:]
        nodes, values = [self._points[i] for i in kept], np.array([self._values[i] for i in kept])
        if len(kept) == 1:
            h = time - nodes[0]
            expected = values[0, self._slopes] + 0.5 * h * (values[0, self._rates] + row[self._rates])
        else:
            expected = between(time, nodes, values[:, self._slopes], values[:, self._rates])
        off = np.abs(row[self._slopes] - expected) / (1.0 + np.abs(expected))
        return float(off.max()) * (0.03, 0.016, 0.004)[len(kept) - 1]

    def point(self, time: float, degree: int, values: Vector) -> None:
        """The units stand at a point, with what was read there; degree: of the inputs expected for it."""
        self._points.append(time)
        self._values.append(values)
        del self._points[:-POINTS], self._values[:-POINTS]
        if self._times is None:
            self.time.append(time)
            self.rows.append(values[: self._n])
            return
        last = int(np.searchsorted(self._times, time, side="left"))
        if last > self._next:
            self._between(self._times[self._next : last], degree + 2)
            self._next = last
        while self._next < self._times.size and self._times[self._next] == time:
            self.time.append(time)
            self.rows.append(values[: self._n])
            self._next += 1

    def finish(self, time: float) -> None:
        """The run ends at ``time``, before the times that are left."""
        if self._times is not None:
            self._times = self._times[: self._next]

    def event(self, time: float) -> None:
        """An event at this point: the values before it, as far as the points tell, and the start of new ones."""
        if self._times is not None and self._points:
            last = int(np.searchsorted(self._times, time, side="left"))
            if last > self._next:
                self._between(self._times[self._next : last], len(self._points))
                self._next = last
        elif self.time and self.time[-1] == time:
            self.time.pop()
            self.rows.pop()
        self._points.clear()
        self._values.clear()

    def _apart(self) -> list[int]:
        """Places of the points that are not so near to one another that rounding shows between the last two."""
        points, last = self._points, len(self._points) - 1
        kept = [last, last - 1] if last else [last]
        least = NEAR * (points[last] - points[last - 1])
        for i in range(last - 2, -1, -1):
            if points[kept[-1]] - points[i] > least:
                kept.append(i)
        return kept[::-1]

    def _between(self, times: Vector, points: int) -> None:
        kept = self._apart()
        nodes, values = [self._points[i] for i in kept], np.array([self._values[i] for i in kept])
        row = values[-2 if len(kept) > 1 and times[-1] < nodes[-1] else -1, : self._n]
        few, near = -max(min(points, POINTS), 2), -HERMITE
        others, places = values[few:, self._others], values[near:, self._slopes]
        rates = values[near:, self._rates]
        for time in times.tolist():
            row = row.copy()
            row[self._others] = between(time, nodes[few:], others)
            row[self._slopes] = between(time, nodes[near:], places, rates)
            self.time.append(time)
            self.rows.append(row)
