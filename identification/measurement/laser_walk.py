"""A laser that walks at random, and has no encoder beside it, as sticks show it.

In a stick the body goes with its drive, and what the laser shows beside is w, a random walk that grows by q in a
second. Means over pieces of T s that are n pieces apart differ by

    D[theta - (r/R) phi] = D w/R + sum of c_i D f_i,    var_n = variance of noise + (n - 1/3) q T,

f_i what a gain, a beam that is tilted, a contact that gives way and an encoder of the drive that is eccentric show of
an angle; what all sticks of a log have in common at the same time after they began is taken off. var_3 - var_1 tells q:
ringing of a contact does not grow. A log is followed by cosines of n pi u, u the share of it that is gone, up to a half
wave of `KNOT` s; q `KNOT`/pi^2 is the variance of what these leave, `DiscMotion.wander`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.measurement.disc_motion import angle_sensor, nominal_drives
from identification.measurement.laser_drift import within
from identification.measurement.motion import SMOOTHING, DiscMotion, drive_angle
from rig_io.logs.log import stretches

KNOT = 0.3  # s, between knots of a walk
PIECE, END = 0.025, 0.02  # s, of a mean; of a stick, at both ends, that is left out
NEAR, FAR = 1, 3  # pieces between two means
STICKS = 2e-3  # m/s, slip speeds that smoothed noise has in stick
CLEAR = 1.0  # times the variance of noise: logs whose laser stays have up to .7
LEAST = 20  # differences that tell


def with_walk(motions: Sequence[DiscMotion], r: float, R: float, period: float) -> list[DiscMotion]:
    """The motions with what a walk of their laser leaves beside its cosines; as they were where sticks show none, or
    cannot. period: natural one, s."""
    alone = all(angle_sensor(m.log) == "laser" and not m.log.has("encoder_count") for m in motions)
    if not alone or any(nominal_drives(m.log) or len(m.log.contacts) > 1 for m in motions):
        return list(motions)
    sticks = [_sticks(motion, r, R, period) for motion in motions]
    noise = 2 * float(np.mean([np.mean(np.diff(m.angle, 3) ** 2) / 20 / max(PIECE / m.step, 1) for m in motions]))
    grown = _variance(sticks, FAR) - _variance(sticks, NEAR)
    if not grown > CLEAR * noise:
        return list(motions)
    wander = float(np.sqrt(grown / (FAR - NEAR) / PIECE * KNOT)) / np.pi
    return [replace(motion, wander=wander) for motion in motions]


def _sticks(motion: DiscMotion, r: float, R: float, period: float) -> list[np.ndarray]:
    """Means over pieces of each stick (n, 7): of what the laser shows beside the drive, and of f_i."""
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (motion.drive[1:] + motion.drive[:-1]) * motion.step)])
    phase = drive_angle(motion, int(motion.log.contacts[0][-1]))
    waves = [wave(n * phase) for n in (1, 2) for wave in (np.cos, np.sin)]
    columns = np.column_stack([motion.angle - r / R * turned, turned, motion.angle**2, *waves])
    slow = np.abs(motion.slip(r, R, SMOOTHING * period)[0]) < STICKS
    count, off = max(round(PIECE / motion.step), 1), round(END / motion.step)
    means = []
    for first, last in stretches(slow) + np.array([off, -off]):
        whole = max(last - first, 0) // count
        pieces = columns[first : first + whole * count].reshape(whole, count, columns.shape[1])
        means.append(pieces.mean(axis=1))
    return [one for one in means if len(one) > FAR]


def _variance(sticks: Sequence[Sequence[np.ndarray]], apart: int) -> float:
    """Of differences of means so many pieces apart, but for what sticks of a log have in common; no number where there
    are too few. sticks: of each log."""
    rows, common = [np.zeros((0, 7))], 0
    for log in sticks:
        every = [one[apart:] - one[:-apart] for one in log]
        place = np.concatenate([np.zeros(0, dtype=int), *(np.arange(len(one)) for one in every)])
        count = np.bincount(place)
        rows.append(within(np.concatenate([rows[0], *every]), place)[count[place] > 1])
        common += np.count_nonzero(count > 1)
    joined = np.concatenate(rows)
    if len(joined) < LEAST + common:
        return float("nan")
    left = joined[:, 0] - joined[:, 1:] @ np.linalg.lstsq(joined[:, 1:], joined[:, 0], rcond=None)[0]
    return float(left @ left) / (len(joined) - common - joined.shape[1] + 1)
