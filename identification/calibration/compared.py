"""Runs over segments beside the logs: residuals of samples, of times of events and of joints, with their slopes."""

from collections.abc import Sequence

import numpy as np

from identification.calibration.readings import NEAR, Readings, SeriesReading
from identification.calibration.segments import Segmented
from identification.calibration.subject import Response

FAILED = 3.0  # standard deviations of a series: residuals of a segment that cannot be run


class Comparison:
    """residual: (n,); gradient: (n, m) by the unknowns, (n, 0) where no slopes are asked for. runs: of the segments,
    None of one that cannot be made."""

    def __init__(
        self, problem: Segmented, x: np.ndarray, readings: Readings, runs: Sequence[Response | None], slopes: bool
    ) -> None:
        self.problem, self.x, self.readings, self.runs, self.sloped = problem, x, readings, runs, slopes
        self.made = np.array([run is not None for run in runs])
        # rows of all runs, one behind the other
        shape = len(problem.subject.recorded), len(problem.subject.by)
        lengths = np.diff(readings.last, prepend=-1).tolist()
        whole = [_silent(size, *shape) if run is None else run for run, size in zip(runs, lengths, strict=True)]
        self.values = np.concatenate([run.values for run in whole])
        self.slopes = np.concatenate([run.slopes for run in whole]) if slopes else np.zeros((0, *shape))
        self.residual = np.zeros(len(readings.log))
        # what is held has a column of its own, the last, which is left out
        columns = np.zeros((len(readings.log), len(x) + 1 if slopes else 1))
        self._columns, self.gradient = columns, columns[:, :-1]
        for number, (log, name) in enumerate(problem.series):
            if number in readings.series:
                self._samples(log, name, readings.series[number])
            else:
                self._times(log, name, int(np.argmax(readings.log == number)))
        if len(readings.joints):
            self._joints()

    def _samples(self, log: int, name: str, reading: SeriesReading) -> None:
        """Of a measured variable."""
        problem, rows, made = self.problem, reading.rows, self.made[reading.segment]
        sensor, noise = problem.sensor(name, self.x), problem.noise[log, name]
        column = problem.subject.recorded.index(name)
        value = self.values[reading.at, column]
        modelled, (low, high) = sensor.gain * value + sensor.offset, sensor.clip
        self.residual[rows] = (np.clip(modelled, low, high) - reading.measured) / noise
        if not made.all():
            self.residual[rows[~made]] = FAILED * float(np.std(problem.logs[log].measured[name])) / noise
        if not self.sloped:
            return
        weight = np.where((modelled > low) & (modelled < high) & made, 1 / noise, 0.0)
        places = self.readings.places[reading.segment]
        self._columns[rows[:, None], places] = (weight * sensor.gain)[:, None] * self.slopes[reading.at, column]
        by = {"gain": value, "offset": np.ones(len(rows))}
        if len(reading.later):
            step = NEAR * float(np.median(np.diff(problem.logs[log].time)))
            by["delay"] = -sensor.gain * (self.values[reading.later, column] - value) / step
        for key, slope in by.items():
            if (name, key) in problem.sensed:
                self.gradient[rows, problem.sensed[name, key]] = weight * slope

    def _times(self, log: int, name: str, begin: int) -> None:
        """Of the event times of one contact, paired in their order within a segment; from row ``begin`` on."""
        every, noise = self.problem.logs[log].events[name], self.problem.noise[log, name]
        apart = float(np.median(np.diff(every)))
        for number, (segment, run) in enumerate(zip(self.problem.segments, self.runs, strict=True)):
            if segment.log != log:
                continue
            held = np.flatnonzero(segment.holds(every))
            self.residual[begin + held] = FAILED * apart / noise
            times, slopes = run.hits[name] if run is not None else (np.zeros(0), np.zeros((0, 0)))
            count = min(len(times), len(held))
            off, rows = (times[:count] - every[held[:count]]) / apart, begin + held[:count]
            self.residual[rows] = np.clip(off, -FAILED, FAILED) * apart / noise
            if self.sloped and count:
                near = np.flatnonzero(np.isfinite(slopes[:count]).all(axis=1) & (np.abs(off) < FAILED))
                self._columns[np.ix_(rows[near], self.readings.places[number])] = slopes[near] / noise

    def _joints(self) -> None:
        """How far segments end from where the next begin; these rows come last."""
        problem, joints = self.problem, self.readings.joints
        states, weight = len(problem.subject.states), problem.weight / problem.scale
        rows = len(self.residual) + np.arange(-states * len(joints), 0).reshape(len(joints), states)
        following, ends, made = problem.starts[joints + 1], self.readings.last[joints], self.made[joints][:, None]
        off = weight * (self.values[ends, :states] - self.x[following])
        self.residual[rows] = np.where(made, off, problem.weight)
        if self.sloped:
            slopes = weight[:, None] * self.slopes[ends, :states]
            self._columns[rows[:, :, None], self.readings.places[joints][:, None, :]] = slopes
            self.gradient[rows, following] = -weight * made


def _silent(size: int, width: int, by: int) -> Response:
    """In place of a run that cannot be made."""
    return Response(np.zeros((size, width)), np.zeros((size, width, by)))
