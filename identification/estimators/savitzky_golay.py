"""Inverse dynamics on slip segments: friction from the measured motion, Savitzky-Golay derivatives.

    F = (J th'' + c th' + k th)/R,    v = r w - R th',    F sgn(v)/N = mu(|v|)

Angle, speed and acceleration come from one local polynomial (order 5, window 0.22 natural periods) inside each slip
segment: no window reaches across a switch, where the acceleration jumps. Values near the ends of a segment, where the
polynomial is one-sided, are noisier by a known factor and weighted accordingly. Source: disc_rig paper, section 3.3,
eqs. (27), (28).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.disturbances.term import Whereabouts
from identification.estimators.base import Estimate, Estimator, Options
from identification.estimators.regression import Regression, regress, whereabouts
from identification.estimators.windows import coloured
from identification.laws import FittableLaw
from identification.laws.joint_law import JointLaw
from identification.measurement.motion import local_polynomial, odd_count, savitzky_golay
from identification.measurement.pooled import Pool, RigValues
from identification.measurement.slip_segments import SlipSegment, long_enough

ORDER = 5
WINDOW = 0.22  # natural periods
EVERY = 5  # samples: neighbours within a window say the same thing again

STRUCTURE = (
    "rigid contact: the disc sticks or slides, no micro-slip",
    "friction depends on slip speed alone",
    "J, k, c, N, R, r known",
)


@dataclass(frozen=True, eq=False)
class FrictionSamples:
    """Friction measured in slip. slip: (n,) m/s, >= 0; coefficient: (n,) 1, F sgn(v)/N; cluster: (n,) number of the
    slip segment; log: (n,) number of the log; weight: (n,) 1/standard deviation that sensor noise gives, relative;
    where: (n,) drive and body stood; sign: (n,) of the slip, where known.
    """

    slip: np.ndarray
    coefficient: np.ndarray
    cluster: np.ndarray
    log: np.ndarray
    weight: np.ndarray
    where: Whereabouts | None = None
    sign: np.ndarray | None = None


def estimate(ready: Pool, law: FittableLaw, options: Options) -> Estimate:
    """Friction law from pooled logs. StickslipError: no slip segment holds a window, or friction has the wrong sign."""
    if isinstance(law, JointLaw):
        raise StickslipError(
            "Two driving discs give no friction coefficient at a single sample, only the sum of their forces: fit them "
            "by another estimator, weak-form first."
        )
    return Estimate(ESTIMATOR, law, *regress(ready, law, _equations, WINDOW, options))


def friction_samples(ready: Pool) -> FrictionSamples:
    """Friction coefficient against slip speed at every sample of the pooled slip segments."""
    window = WINDOW * ready.natural_period
    segments = long_enough(ready.segments, window)
    return _samples(segments, [ready.log_number(s) for s in segments], ready.values, window)


def _samples(segments: Sequence[SlipSegment], logs: Sequence[int], rig: RigValues, window: float) -> FrictionSamples:
    columns: list[tuple[np.ndarray, ...]] = []
    for number, (segment, log) in enumerate(zip(segments, logs, strict=True)):
        step, angle = segment.motion.step, segment.angle
        position, speed, acceleration = (savitzky_golay(angle, step, window, ORDER, d) for d in range(3))
        slip = rig.r * segment.drive - rig.R * speed
        force = (rig.J * acceleration + rig.c * speed + rig.k * position) / rig.R
        weight = 1 / _noise_gain(len(angle), odd_count(window, step), step, rig, segment.motion.memory / step)
        labels = (np.full(len(angle), number), np.full(len(angle), log))
        columns.append((segment.sign * slip, segment.sign * force / rig.N, *labels, weight))
    slip, coefficient, cluster, log, weight = (np.concatenate(column) for column in zip(*columns, strict=True))
    where = Whereabouts.joined(whereabouts(segments, logs, rig.N))
    sign = np.array([float(segment.sign) for segment in segments])[cluster]
    return FrictionSamples(slip, coefficient, cluster, log, weight / np.mean(weight), where, sign)


def _noise_gain(length: int, count: int, step: float, rig: RigValues, memory: float = 0.0) -> np.ndarray:
    """Standard deviation (length,) of J th'' + c th' + k th at each sample of a segment, for unit noise of the
    angle. memory: of that noise, samples; 0 where it is white."""
    half, gain = count // 2, _window_gain(count, step, rig, memory)
    return np.concatenate([gain[:half], np.full(length - 2 * half, gain[half]), gain[half + 1 :]])


@lru_cache(maxsize=16)
def _window_gain(count: int, step: float, rig: RigValues, memory: float) -> np.ndarray:
    """The same (count,) of one window."""
    (fitted, value), (_, first), (_, second) = (local_polynomial(count, ORDER, derivative) for derivative in range(3))
    weights = (rig.J * second / step**2 + rig.c * first / step + rig.k * value) @ fitted
    if memory:
        return np.sqrt(np.sum(weights @ coloured(count, memory) * weights, axis=1))
    return np.sqrt(np.sum(weights**2, axis=1))


def _equations(segments: Sequence[SlipSegment], logs: Sequence[int], rig: RigValues, period: float) -> Regression:
    samples = _samples(segments, logs, rig, WINDOW * period)
    slip, coefficient = samples.slip[::EVERY], samples.coefficient[::EVERY]
    cluster, weight = samples.cluster[::EVERY], samples.weight[::EVERY]
    blocks = tuple(np.split(weight, np.flatnonzero(np.diff(cluster)) + 1))
    assert samples.where is not None and samples.sign is not None
    rows = np.arange(0, len(samples.slip), EVERY)
    where = samples.where.map(lambda values: values[rows][:, None])
    count = odd_count(WINDOW * period, segments[0].motion.step)
    noise = _noise_gain(count, count, segments[0].motion.step, rig)[count // 2] / (rig.R * rig.N)
    return Regression(
        slip[:, None],
        np.ones(1),
        coefficient,
        cluster,
        samples.log[::EVERY],
        blocks,
        where=where,
        noise=float(noise),
        sign=samples.sign[::EVERY],
        spring=rig.spring,
    )


ESTIMATOR = Estimator("savitzky-golay", STRUCTURE, estimate, inverse=True)
