"""Logs over segments: each begins at a start state of its own, which the one before has to reach.

    r = (clip(gain x(t - delay; s_i, theta) + offset) - y)/noise        samples t of segment i
    c = weight (x(t_i+1; s_i, theta) - s_i+1)/scale                     between neighbours

One segment for each log is the free run. A delay shifts the times at which the run is read, which is exact across
events; where sensor and model are both at a limit, the sample says nothing. A segment that cannot be run counts as
constant residuals without slope: a bad guess, of which the search steps back, and no end of it.

Source of multiple shooting: Bock (1981), in Modelling of Chemical Reaction Systems, Springer Ser. Chem. Phys. 18, 102.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.calibration.compared import Comparison
from identification.calibration.readings import Readings
from identification.calibration.segments import Segmented
from identification.calibration.subject import Response, Stretch
from identification.inference.problem import Evaluation, FitProblem


@dataclass(frozen=True, eq=False)
class SegmentProblem(Segmented, FitProblem):
    """latest: readings, and what these are of."""

    latest: list[tuple[tuple[object, ...], Readings]] = field(default_factory=list, repr=False)

    def start(self) -> np.ndarray:
        return self.first

    def residual(self, x: np.ndarray) -> np.ndarray:
        """By runs without slopes, which cost a small part of those with them."""
        return self._evaluated(x, slopes=False).residual

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Residuals and slopes; those of continuity come last, of a log of their own."""
        return self._evaluated(x, slopes=True)

    def _evaluated(self, x: np.ndarray, *, slopes: bool) -> Evaluation:
        values = [self.parameters(log, x) for log in range(len(self.logs))]
        readings, runs = self.readings(x), []
        for number, (segment, window) in enumerate(zip(self.segments, readings.windows, strict=True)):
            runs.append(self.response(Stretch(window, values[segment.log], self._start(number, x)), slopes=slopes))
        return self.compared(x, readings, runs, slopes=slopes)

    def readings(self, x: np.ndarray) -> Readings:
        """What is read of the runs. Unless a delay is sought it stays the same, also in problems that differ from this
        one in values alone."""
        if any(constant == "delay" for _, constant in self.sensed):
            return Readings.of(self, x)
        of = self.subject, self.logs, self.segments, self.starts, self.places, self.sensors, self.sensed
        if not self.latest or any(mine is not its for mine, its in zip(of, self.latest[0][0], strict=True)):
            self.latest[:] = [(of, Readings.of(self, x))]
        return self.latest[0][1]

    def response(self, stretch: Stretch, *, slopes: bool = False) -> Response | None:
        """A run; None of one that cannot be made or is not finite."""
        try:
            run = self.subject.respond(stretch) if slopes else self.subject.shown(stretch)
        except StickslipError:
            return None
        return run if np.isfinite(run.values).all() and np.isfinite(run.slopes).all() else None

    def compared(
        self, x: np.ndarray, readings: Readings, runs: Sequence[Response | None], *, slopes: bool = False
    ) -> Evaluation:
        """The runs of all segments beside the logs."""
        here = Comparison(self, x, readings, runs, slopes)
        return Evaluation(here.residual, here.gradient, readings.log, readings.log, np.full(len(readings.log), np.nan))

    def tangents(self, x: np.ndarray) -> list[np.ndarray]:
        """(states, states) derivative of each segment's end by its start, in units of ``scale``. StickslipError: a
        segment cannot be run."""
        found, first = [], len(self.subject.parameters)
        for number, segment in enumerate(self.segments):
            run = self.subject.respond(self.stretch(number, x, np.array([segment.end])))
            slopes = run.slopes[-1, : len(self.scale), first:]
            found.append(slopes * self.scale[None, :] / self.scale[:, None])
        return found

    def resampled(self, clusters: np.ndarray) -> FitProblem:
        """Of whole logs only, which a bootstrap of neighbours cannot cut."""
        raise StickslipError("Segments that have to meet cannot be drawn anew: take the sandwich or a profile.")
