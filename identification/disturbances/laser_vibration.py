"""The laser shows sin(theta) + a_i cos(2 pi f t) + b_i sin(2 pi f t) over R, i the number of the log: what it stands on
vibrates, or mains hum. f is where the spectra of all logs together have the line that is the clearest."""

from functools import lru_cache

import numpy as np

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.laser_bend import no_laser
from identification.disturbances.term import LASER, DisturbanceTerm, Effect
from identification.measurement.disc_motion import angle_sensor
from identification.measurement.pooled import Pool

LOWEST, WINDOW = 11.0, 0.1  # natural frequencies, below which stick-slip has lines of its own; natural periods, of what
# is taken off before
PADDED = 16  # times finer than the spectrum of a log
AROUND = 100  # lines of that, whose median a line is compared with
CLEAR = 30.0  # times the power around: lines of clean logs have up to 11


@lru_cache(maxsize=1)
def _frequency(ready: Pool) -> float:
    """The line that is the clearest in every log, Hz; 0 where none is."""
    period, steps = ready.natural_period, [motion.step for motion in ready.motions]
    size, block = PADDED * max(len(motion.time) for motion in ready.motions), PADDED * AROUND
    if max(steps) - min(steps) > 1e-6 * steps[0] or any(
        angle_sensor(motion.log) != "laser" for motion in ready.motions
    ):
        return 0.0
    frequency = np.fft.rfftfreq(size, steps[0])
    first, last = int(np.searchsorted(frequency, LOWEST / period)), len(frequency) // block * block
    power, clear = np.zeros(len(frequency)), np.full(last, np.inf)
    for motion in ready.motions:
        beside = motion.angle - motion.smoothed(WINDOW * period)
        mine = np.abs(np.fft.rfft(np.hanning(len(beside)) * np.nan_to_num(beside), size)) ** 2
        level = np.repeat(np.median(mine[:last].reshape(-1, block), axis=1), block)
        # cycles have lines too, but those of another speed others
        clear, power = np.minimum(clear, mine[:last] / np.maximum(level, np.finfo(float).tiny)), power + mine
    if last <= first or np.max(clear[first:]) < CLEAR:
        return 0.0
    best = first + int(np.argmax(clear[first:]))
    left, top, right = np.log(power[best - 1 : best + 2])
    return float(frequency[best] + 0.5 * (left - right) / (left - 2 * top + right) * frequency[1])


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    turning = 2 * np.pi * _frequency(ready)
    waves = Effect(
        "vibration",
        lambda at, order, functions: (functions.cos, functions.sin)[order](turning * at.share * at.duration),
        acts=LASER,
        limits=(-0.1, 0.1),
        width=lambda order: 2e-3,
    )
    logs, names = range(len(ready.motions)), ("cos", "sin")
    return [DisturbanceTerm(f"vibration_{names[n]}_{i + 1}", waves, n, i) for i in logs for n in (0, 1)]


def _hidden(ready: Pool) -> str:
    return no_laser(ready) or ("" if _frequency(ready) else "no line stands out of the spectrum of the laser.")


DISTURBANCE = Disturbance(
    words="the laser shows a steady vibration: of its support, of the mains, or a higher one sampled too seldom",
    terms=_terms,
    hidden=_hidden,
    told_by="an encoder beside the laser",
    rank=12,
    evident=True,
    remark=lambda ready, terms, values: f"; it has {_frequency(ready):.4g} Hz",
    emulated=("vibration",),
)
