"""Which samples of logs are read where, of the runs over their segments: what stays the same from guess to guess."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.calibration.segments import Segmented
from identification.calibration.subject import Window

NEAR = 1e-7  # of a log's usual step: between two readings of a run, for its rate


@dataclass(frozen=True, eq=False)
class SeriesReading:
    """Samples of a measured variable. rows: (k,) of the residuals; measured: (k,); segment: (k,) numbers of the
    segments that hold them; at: (k,) rows of the runs; later: (k,) likewise, `NEAR` steps on, empty of a variable whose
    delay is not sought."""

    rows: np.ndarray
    measured: np.ndarray
    segment: np.ndarray
    at: np.ndarray
    later: np.ndarray


@dataclass(frozen=True, eq=False)
class Readings:
    """Runs over segments, their rows one behind the other, as residuals read them.

    windows: of the runs; last: (segments,) last row of each; series: readings by the number of the series; log: (n,)
    number of the series of each residual, those of joints come last; joints: (j,) segments that meet the next; places:
    (segments, m) of what a subject is differentiated by among the unknowns, -1 of what is held.
    """

    windows: tuple[Window, ...]
    last: np.ndarray
    series: Mapping[int, SeriesReading]
    log: np.ndarray
    joints: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, problem: Segmented, x: np.ndarray) -> Readings:
        """The readings with the delays of x."""
        names = problem.series
        kept = [problem.kept(*key) for key in names]
        counts = [int(np.count_nonzero(seen)) for seen in kept]
        shifts = np.cumsum([0, *counts])[:-1] - [int(np.argmax(seen)) for seen in kept]
        windows: list[Window] = []
        rows, parts = 0, {number: [] for number, (log, name) in enumerate(names) if name in problem.logs[log].measured}
        for segment_number, segment in enumerate(problem.segments):
            log = problem.logs[segment.log]
            read = {}
            for number in parts:
                if names[number][0] != segment.log:
                    continue
                name = names[number][1]
                time = log.time - problem.sensor(name, x).delay
                samples = np.flatnonzero(segment.holds(time) & kept[number])
                times = time[samples]
                if (name, "delay") in problem.sensed:
                    times = np.concatenate([times, times + NEAR * float(np.median(np.diff(time)))])
                read[number] = samples, np.minimum(times, segment.end)
            window = np.unique(np.concatenate([*(times for _, times in read.values()), [segment.end]]))
            for number, (samples, times) in read.items():
                at = rows + np.searchsorted(window, times)
                here = np.full(len(samples), segment_number)
                parts[number].append((samples, here, at[: len(samples)], at[len(samples) :]))
            windows.append(Window(segment.begin, window, log.inputs))
            rows += len(window)
        series = {}
        for number, pieces in parts.items():
            samples, *others = (np.concatenate(column).astype(int) for column in zip(*pieces, strict=True))
            log, name = names[number]
            series[number] = SeriesReading(samples + shifts[number], problem.logs[log].measured[name][samples], *others)
        joints = np.flatnonzero([not segment.last for segment in problem.segments])
        met = len(problem.subject.states) * len(joints)
        return cls(
            tuple(windows),
            np.cumsum([len(window.times) for window in windows]) - 1,
            series,
            np.repeat(np.arange(len(names) + 1), [*counts, met]),
            joints,
            np.array([problem.differentiated(number) for number in range(len(problem.segments))]),
        )
