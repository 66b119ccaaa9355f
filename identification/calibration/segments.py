"""Logs in segments, each of which begins at a start state of its own; how sensors show them, and what is sought."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.calibration.log import ModelLog
from identification.calibration.subject import Stretch, Subject, Window
from identification.inference.problem import Unknown


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
class Segmented:
    """Logs in segments, and what is sought.

    subject: what is run; unknowns, first: (m,); fixed: parameters and start states that are not sought; places: of
    the subject's parameters among the unknowns, by log; sensed: of sensors' constants, by variable and constant;
    starts: (segments, states) places of the start states, -1 for one that is held; noise: by log and variable;
    scale: (states,) of their differences; weight: of joints.
    """

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

    @property
    def parted(self) -> bool:
        """Whether a log has several segments; else it is the free run."""
        return len(self.segments) > len(self.logs)

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
        segment = self.segments[number]
        window = Window(segment.begin, times, self.logs[segment.log].inputs)
        return Stretch(window, self.parameters(segment.log, x), self._start(number, x))

    def parameters(self, log: int, x: np.ndarray) -> dict[str, float]:
        """Values of the subject's parameters in a log at x, by name."""
        values = {name: float(x[place]) for name, place in self.places[log].items()}
        return values | {name: value for name, value in self.fixed.items() if name not in self.subject.states}

    def _start(self, number: int, x: np.ndarray) -> dict[str, float]:
        places = zip(self.subject.states, self.starts[number].tolist(), strict=True)
        return {name: float(x[place]) if place >= 0 else self.fixed[name] for name, place in places}

    def differentiated(self, number: int) -> np.ndarray:
        """(m,) places of what the subject is differentiated by in a segment among the unknowns, -1 of what is held."""
        log = self.segments[number].log
        return np.array(
            [*(self.places[log][name] for name in self.subject.parameters), *self.starts[number]], dtype=int
        )


def whole(logs: Sequence[ModelLog]) -> tuple[Segment, ...]:
    """One segment for each log: the free run."""
    return tuple(Segment(n, float(log.time[0]), float(log.time[-1]), True) for n, log in enumerate(logs))
