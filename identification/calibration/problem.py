"""Logs over segments: each begins at a start state of its own, which the one before has to reach.

    r = (clip(gain x(t - delay; s_i, theta) + offset) - y)/noise        samples t of segment i
    c = weight (x(t_i+1; s_i, theta) - s_i+1)/scale                     between neighbours

One segment for each log is the free run. A delay shifts the times at which the run is read, which is exact across
events; where sensor and model are both at a limit, the sample says nothing. A segment that cannot be run counts as
constant residuals without slope: a bad guess, of which the search steps back, and no end of it.

Source of multiple shooting: Bock (1981), in Modelling of Chemical Reaction Systems, Springer Ser. Chem. Phys. 18, 102.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.calibration.log import ModelLog
from identification.calibration.subject import Response, Stretch, Subject
from identification.inference.problem import Evaluation, FitProblem, Unknown

NEAR = 1e-7  # of a log's usual step: between two readings of a run, for its rate
FAILED = 3.0  # standard deviations of a series: residuals of a segment that cannot be run


@dataclass(frozen=True)
class Sensor:
    """How a variable is measured: y = clip(gain x(t - delay) + offset); delay in s, clip in the unit of y; longest: s,
    delay that is tried where it is sought."""

    gain: float = 1.0
    offset: float = 0.0
    delay: float = 0.0
    clip: tuple[float, float] = (-np.inf, np.inf)
    longest: float | None = None


IDEAL = Sensor()
SENSED = ("gain", "offset", "delay")


@dataclass(frozen=True)
class Segment:
    """Of log number ``log``, from ``begin`` to ``end`` in s; last: the samples at its end are its own."""

    log: int
    begin: float
    end: float
    last: bool

    def holds(self, time: np.ndarray) -> np.ndarray:
        """Which of these times (n,) are in it."""
        return (time >= self.begin) & ((time <= self.end) if self.last else (time < self.end))


@dataclass(frozen=True, eq=False)
class SegmentProblem(FitProblem):
    """subject: what is run; unknowns, first: (m,); fixed: parameters and start states that are not sought; places: of
    the subject's parameters among the unknowns, by log; sensed: of sensors' constants, by variable and constant;
    starts: (segments, states) places of the start states, -1 for one that is held; noise: by log and variable;
    scale: (states,) of their differences; reach: s, least and greatest delay that is tried, by variable."""

    subject: Subject
    logs: tuple[ModelLog, ...]
    segments: tuple[Segment, ...]
    unknowns: tuple[Unknown, ...]
    first: np.ndarray
    fixed: Mapping[str, float]
    places: tuple[Mapping[str, int], ...]
    starts: np.ndarray
    noise: Mapping[tuple[int, str], float]
    scale: np.ndarray
    noise_known: bool
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    sensed: Mapping[tuple[str, str], int] = field(default_factory=dict)
    weight: float = 1.0

    def start(self) -> np.ndarray:
        """As given."""
        return self.first

    @property
    def shared(self) -> int:
        """How many unknowns, the first, are no start states."""
        return len(self.unknowns) - int(np.count_nonzero(self.starts >= 0))

    @property
    def series(self) -> list[tuple[int, str]]:
        """Log and variable of what is compared, in order of the residuals."""
        return [(number, name) for number, log in enumerate(self.logs) for name in log.observed]

    def kept(self, number: int, name: str) -> np.ndarray:
        """(n,) which samples of a log can be seen with every delay that is tried."""
        if name in self.logs[number].events:
            return np.ones(self.logs[number].events[name].size, dtype=bool)
        time, delay = self.logs[number].time, self.sensors.get(name, IDEAL).delay
        least, most = delay, delay
        if (name, "delay") in self.sensed:
            unknown = self.unknowns[self.sensed[name, "delay"]]
            least, most = unknown.minimum, unknown.maximum
        return (time - most >= time[0]) & (time - least <= time[-1])

    def sensor(self, name: str, x: np.ndarray) -> Sensor:
        """The sensor of a variable at x."""
        constants = {key: float(x[place]) for (variable, key), place in self.sensed.items() if variable == name}
        return replace(self.sensors.get(name, IDEAL), **constants)

    def stretch(self, number: int, x: np.ndarray, times: np.ndarray) -> Stretch:
        """The run of segment ``number`` at x, read at ``times``."""
        segment, states = self.segments[number], self.subject.states
        log = self.logs[segment.log]
        values = {name: float(x[place]) for name, place in self.places[segment.log].items()}
        values |= {name: value for name, value in self.fixed.items() if name not in states}
        places = zip(states, self.starts[number], strict=True)
        start = {name: float(x[place]) if place >= 0 else self.fixed[name] for name, place in places}
        return Stretch(segment.begin, times, values, start, log.inputs)

    def residual(self, x: np.ndarray) -> np.ndarray:
        """By runs without slopes, which cost a small part of those with them."""
        return self._evaluated(x, slopes=False).residual

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Residuals and slopes; those of continuity come last, of a log of their own."""
        return self._evaluated(x, slopes=True)

    def _evaluated(self, x: np.ndarray, *, slopes: bool) -> Evaluation:
        series, states, width = self.series, len(self.subject.states), len(x) if slopes else 0
        kept = {key: self.kept(*key) for key in series}
        ends = np.cumsum([0, *(int(kept[key].sum()) for key in series)])
        joints = np.flatnonzero([not segment.last for segment in self.segments])
        count = int(ends[-1]) + states * len(joints)
        residual, gradient = np.zeros(count), np.zeros((count, width))
        row = dict(zip(joints.tolist(), ends[-1] + states * np.arange(len(joints)), strict=True))
        for number, segment in enumerate(self.segments):
            sensors = {name: self.sensor(name, x) for name in self.logs[segment.log].measured}
            readings = self._readings(segment, sensors, kept)
            times = np.unique(np.concatenate([*(time for _, time in readings.values()), [segment.end]]))
            run = self._response(number, x, times, slopes)
            for name, (rows, time) in readings.items():
                place = int(ends[series.index((segment.log, name))])
                at, seen = np.searchsorted(times, time), rows - int(np.argmax(kept[segment.log, name])) + place
                residual[seen], gradient[seen] = self._compared(number, name, sensors[name], rows, run, at, width)
            for name, measured in self.logs[segment.log].events.items():
                place = int(ends[series.index((segment.log, name))])
                rows = np.flatnonzero(segment.holds(measured))
                residual[rows + place], gradient[rows + place] = self._timed(number, name, measured[rows], run, width)
            if number in row:
                where = slice(row[number], row[number] + states)
                residual[where], gradient[where] = self._joined(number, x, run, width)
        log = np.concatenate([np.repeat(np.arange(len(series)), np.diff(ends)), np.full(count - ends[-1], len(series))])
        return Evaluation(residual, gradient, log, log, np.full(count, np.nan))

    def _readings(
        self, segment: Segment, sensors: Mapping[str, Sensor], kept: Mapping[tuple[int, str], np.ndarray]
    ) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Numbers of the samples of a segment, and the times s at which its run is read, by variable; of one whose
        delay is sought twice, for the rate."""
        found = {}
        for name, sensor in sensors.items():
            time = self.logs[segment.log].time - sensor.delay
            rows = np.flatnonzero(segment.holds(time) & kept[segment.log, name])
            read = time[rows]
            if (name, "delay") in self.sensed:
                read = np.concatenate([read, read + NEAR * float(np.median(np.diff(time)))])
            found[name] = rows, np.minimum(read, segment.end)
        return found

    def _response(self, number: int, x: np.ndarray, times: np.ndarray, slopes: bool) -> Response | None:
        stretch = self.stretch(number, x, times)
        try:
            run = self.subject.respond(stretch) if slopes else self.subject.shown(stretch)
        except StickslipError:
            return None
        return run if np.isfinite(run.values).all() and np.isfinite(run.slopes).all() else None

    def _compared(
        self, number: int, name: str, sensor: Sensor, rows: np.ndarray, run: Response | None, at: np.ndarray, width: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (k,) of samples (k,) of one variable over one segment, and their slopes (k, width)."""
        log = self.segments[number].log
        noise, measured = self.noise[log, name], self.logs[log].measured[name]
        gradient = np.zeros((len(rows), width))
        if run is None:
            return np.full(len(rows), FAILED * float(np.std(measured)) / noise), gradient
        column, at, later = self.subject.recorded.index(name), at[: len(rows)], at[len(rows) :]
        value = run.values[at, column]
        modelled = sensor.gain * value + sensor.offset
        low, high = sensor.clip
        residual = (np.clip(modelled, low, high) - measured[rows]) / noise
        if not width:
            return residual, gradient
        weight = np.where((modelled > low) & (modelled < high), 1 / noise, 0.0)[:, None]
        places, used = self.columns(number)
        gradient[:, places] = weight * sensor.gain * run.slopes[at, column][:, used]
        step = NEAR * float(np.median(np.diff(self.logs[log].time)))
        by = {"gain": value, "offset": np.ones(len(rows))}
        if len(later):
            by["delay"] = -sensor.gain * (run.values[later, column] - value) / step
        for key, slope in by.items():
            if (name, key) in self.sensed:
                gradient[:, self.sensed[name, key]] = weight[:, 0] * slope
        return residual, gradient

    def _timed(
        self, number: int, name: str, measured: np.ndarray, run: Response | None, width: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same of the event times (k,) of one contact over one segment, paired in their order."""
        log, noise = self.segments[number].log, self.noise[self.segments[number].log, name]
        apart = float(np.median(np.diff(self.logs[log].events[name])))
        residual, gradient = np.full(len(measured), FAILED * apart / noise), np.zeros((len(measured), width))
        if run is None:
            return residual, gradient
        times, slopes = run.hits[name]
        count = min(len(times), len(measured))
        residual[:count] = np.clip((times[:count] - measured[:count]) / apart, -FAILED, FAILED) * apart / noise
        if width:
            places, used = self.columns(number)
            told = np.isfinite(slopes[:count]).all(axis=1)
            near = np.flatnonzero(told & (np.abs(times[:count] - measured[:count]) < FAILED * apart))
            gradient[np.ix_(near, places)] = slopes[near][:, used] / noise
        return residual, gradient

    def columns(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Places of the unknowns that a segment is differentiated by, and which columns of its slopes these are."""
        log = self.segments[number].log
        parameters = [self.places[log][name] for name in self.subject.parameters]
        places = np.array([*parameters, *self.starts[number].tolist()], dtype=int)
        used = np.flatnonzero(places >= 0)
        return places[used], used

    def _joined(self, number: int, x: np.ndarray, run: Response | None, width: int) -> tuple[np.ndarray, np.ndarray]:
        """How far a segment ends from where the next begins (states,), and its slopes (states, width)."""
        following, states = self.starts[number + 1], len(self.subject.states)
        weight, gradient = self.weight / self.scale, np.zeros((states, width))
        if run is None:
            return np.full(states, self.weight), gradient
        if width:
            places, used = self.columns(number)
            gradient[:, places] = weight[:, None] * run.slopes[-1, :states][:, used]
            gradient[np.arange(states), following] = -weight
        return weight * (run.values[-1, :states] - x[following]), gradient

    def tangents(self, x: np.ndarray) -> list[np.ndarray]:
        """(states, states) derivative of each segment's end by its start, in units of ``scale``.

        Raises:
            StickslipError: a segment cannot be run.
        """
        found, first = [], len(self.subject.parameters)
        for number, segment in enumerate(self.segments):
            run = self.subject.respond(self.stretch(number, x, np.array([segment.end])))
            slopes = run.slopes[-1, : len(self.scale), first:]
            found.append(slopes * self.scale[None, :] / self.scale[:, None])
        return found

    def resampled(self, clusters: np.ndarray) -> FitProblem:
        """Of whole logs only, which a bootstrap of neighbours cannot cut."""
        raise StickslipError("Segments that have to meet cannot be drawn anew: take the sandwich or a profile.")


def whole(logs: Sequence[ModelLog]) -> tuple[Segment, ...]:
    """One segment for each log: the free run."""
    return tuple(Segment(n, float(log.time[0]), float(log.time[-1]), True) for n, log in enumerate(logs))
