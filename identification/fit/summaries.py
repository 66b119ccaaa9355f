"""What the result of a fit says of its logs: segments, residuals by speed, sensors."""

from dataclasses import fields

import numpy as np

from identification.estimators.base import FrictionRows
from identification.fit.parts import LogSummary, SpeedBin
from identification.measurement.pooled import Pool

BINS = 12


def summaries(ready: Pool, rows: FrictionRows) -> tuple[LogSummary, ...]:
    summaries = []
    for number, motion in enumerate(ready.motions):
        mine = rows.log == number
        least, greatest = (
            (float(rows.least[mine].min()), float(rows.greatest[mine].max())) if mine.any() else (0.0, 0.0)
        )
        segments = len(np.unique(rows.cluster[mine]))
        speeds = tuple(float(np.mean(drive)) for drive in motion.drives)
        duration = float(motion.time[-1] - motion.time[0])
        summaries.append(LogSummary(motion.log.name, speeds, segments, least, greatest, duration))
    return tuple(summaries)


def bins(rows: FrictionRows, disc: int, contact: str) -> list[SpeedBin]:
    """Measured and fitted coefficient of one disc in ranges of slip speed of equal counts; standard errors over slip
    segments."""
    mine = rows.disc == disc
    if not mine.any():
        return []
    edges = np.quantile(rows.speed[mine], np.linspace(0, 1, BINS + 1))
    range_of = np.where(mine, np.clip(np.searchsorted(edges, rows.speed, side="right") - 1, 0, BINS - 1), -1)
    range_of = np.where(mine & (rows.speed < 0), range_of - BINS - 1, range_of)  # a range holds slips of one way
    bins = []
    for number in np.unique(range_of[mine]):
        inside = range_of == number
        off, labels = (rows.measured - rows.fitted)[inside], rows.cluster[inside]
        means = [float(np.mean(off[labels == label])) for label in np.unique(labels)]
        error = float(np.std(means, ddof=1) / np.sqrt(len(means))) if len(means) > 1 else None
        slip, measured, fitted = (float(np.mean(v[inside])) for v in (rows.speed, rows.measured, rows.fitted))
        bins.append(SpeedBin(slip, measured, error, fitted, int(np.sum(inside)), contact))
    return bins


def sensors(ready: Pool) -> dict[str, float]:
    fit, velocity = ready.sensors, ready.sensors.velocity
    values: dict[str, float] = {} if ready.temperature is None else {"temperature": ready.temperature}
    if velocity is not None:
        values |= {f"velocity_{field.name}": getattr(velocity, field.name) for field in fields(velocity)[1:]}
    if fit.lines == 0:
        return values
    deviation = np.sqrt(np.diag(fit.covariance))
    return values | {
        "laser_gain_correction": fit.gain,
        "laser_gain_correction_sd": float(deviation[0]),
        "laser_delay": fit.delay,
        "laser_delay_sd": float(deviation[1]),
        "encoder_line_error": fit.rms,
        "encoder_lines": fit.lines,
    }
