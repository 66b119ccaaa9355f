"""Incremental encoder: edges of a ruled disc, counted with their sign, each stamped by a clock.

Edge n lies at  pitch*(n - phase) + error_n,  count n means that the shaft stands between edges n and n + 1: an edge
passed upward raises the count, the same edge passed back lowers it. The counter is set to zero with the shaft at angle
zero, so that edge n is taken to lie at pitch*(n - 1/2): right within half a pitch, the same shift for all edges.

Logged at every tick: the count, and the clock time of the last edge at or before the tick.

Speed is the pitch over each interval between edges, dated at its middle: exact to second order.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import EncoderCalibration, RigLog
from rig_io.sensors.motion import Motion


@dataclass(frozen=True)
class Encoder:
    """An encoder to be emulated.

    line_error: largest fixed misplacement of an edge, in pitches (uniformly distributed); the rest as in
    `EncoderCalibration`.
    """

    pulses_per_revolution: int = 1000
    quadrature: bool = False
    line_error: float = 0.02
    clock: float = 1e-6
    ratio: float = 1.0

    @property
    def calibration(self) -> EncoderCalibration:
        """The calibration as the user knows it."""
        return EncoderCalibration(self.pulses_per_revolution, self.quadrature, self.clock, ratio=self.ratio)

    def ruled(self, rng: np.random.Generator) -> Ruling:
        """One specimen with its own line errors and mounting."""
        edges = self.calibration.edges_per_revolution
        return Ruling(self.calibration, float(rng.random()), self.line_error * rng.uniform(-1.0, 1.0, edges))


@dataclass(frozen=True, eq=False)
class Ruling:
    """Where the edges of one specimen lie. phase in [0, 1), errors (edges_per_revolution,), both in pitches."""

    calibration: EncoderCalibration
    phase: float
    errors: np.ndarray = field(repr=False)

    def position(self, edge: np.ndarray) -> np.ndarray:
        """Angle (rad) of edges by number."""
        return self.calibration.pitch * (edge - self.phase + self.errors[edge % len(self.errors)])

    def count(self, angle: np.ndarray) -> np.ndarray:
        """Number of the last edge at or below each angle (rad)."""
        guess = np.floor(angle / self.calibration.pitch + self.phase).astype(np.int64) + 1
        for _ in range(2):  # an edge is misplaced by less than a pitch
            guess = np.where(self.position(guess) > angle, guess - 1, guess)
        return guess

    def passed(self, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,) in s, floored to the clock, and counts (m,) after each edge that a motion passes."""
        turned = motion.turned()
        count = self.count(turned.angle)
        change = np.diff(count)
        pieces = np.repeat(np.arange(len(change)), np.abs(change))
        ends = np.cumsum(np.abs(change))
        rank = np.arange(len(pieces)) - np.repeat(ends - np.abs(change), np.abs(change))
        sign = np.sign(change[pieces])
        after = count[pieces] + sign * (rank + 1)
        time = turned.times_at(pieces, self.position(np.where(sign > 0, after, after + 1)))
        return np.floor(time / self.calibration.clock) * self.calibration.clock, after

    def read(self, motion: Motion, ticks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Count and last edge time (s) at each tick (n,); before the first edge the start of the motion."""
        time, after = self.passed(motion)
        last = np.searchsorted(time, ticks, side="right")
        counts = np.concatenate([self.count(motion.angle[:1]), after])
        times = np.concatenate([motion.time[:1], time])
        return counts[last].astype(np.float64), np.round(times[last], 9)


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges found in a log: time (m,) s, angle (m,) rad, direction (m,) +1 or -1.

    run: (m,) number of the stretch between reversals hidden within a tick; no interval may join two stretches.
    """

    time: np.ndarray
    angle: np.ndarray
    direction: np.ndarray
    run: np.ndarray


def edges(log: RigLog, instrument: str = "encoder") -> Edges:
    """The edges that a log shows, the last of each tick: the most precise source of the angle, but for a common shift.

    instrument: "encoder", "drive0" or "drive1". Without a column of edge times an edge is put between its two ticks.

    Raises:
        StickslipError: the log has no such encoder or no calibration for it.
    """
    count = log.column(f"{instrument}_count")
    pitch = log.calibration.need(instrument).pitch
    change = np.diff(count)
    indices = np.flatnonzero(change)
    after = count[indices + 1]
    if log.has(f"{instrument}_edge_time"):
        stamps = log.column(f"{instrument}_edge_time")
        hidden = np.concatenate([[0], np.cumsum((change == 0) & (np.diff(stamps) > 0))])
        time, run = stamps[indices + 1], hidden[indices]
    else:
        time, run = 0.5 * (log.time[indices] + log.time[indices + 1]), np.zeros(len(indices), dtype=np.int64)
    direction = np.sign(change[indices])
    return Edges(time, pitch * (after + (direction < 0) - 0.5), direction, run)


def velocity_mid_interval(log: RigLog, instrument: str = "encoder") -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) in s and speeds (m,) in rad/s at the middle of each interval between edges passed in one direction.
    StickslipError: no such encoder in the log."""
    measured = edges(log, instrument)
    # intervals that hold no reversal
    same = (np.diff(measured.direction) == 0) & (np.diff(measured.run) == 0) & (np.diff(measured.time) > 0)
    time, angle = measured.time, measured.angle
    return 0.5 * (time[1:] + time[:-1])[same], (np.diff(angle)[same]) / np.diff(time)[same]


def drive_speed(log: RigLog, disc: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) in s and speeds (m,) in rad/s of a driving disc: its column of speed, else its encoder, mid-interval.
    StickslipError: the log holds neither."""
    name = f"drive{disc}"
    if log.has(f"{name}_speed"):
        return log.time, log.column(f"{name}_speed")
    if not log.has(f"{name}_count"):
        raise StickslipError(
            f"Log '{log.name}' does not say how disc {disc} turned: it needs '{name}_count' and '{name}_edge_time', or "
            f"'{name}_speed' [rad/s], or a nominal speed: stickslip describe FILES --set 'w:FILE=VALUE ± UNCERTAINTY "
            "rad/s'."
        )
    return velocity_mid_interval(log, name)
