"""The drive of a disc: a geared motor that turns almost evenly.

speed(t) = nominal (1 + once sin(phi + a) + eighth sin(8 phi + b) + n(t)),   phi' = speed

n(t): Gaussian with exponential correlation (first-order autoregression on the knots), cut at two standard deviations,
so that the whole stays within 0.8 % with the default amplitudes. Its accelerations are white, as no motor's are, and
make contacts let go early; ``smoothing`` rounds it. All amplitudes are assumptions: the paper says only
that speed varied by less than 1 %.

A program of holds stops the drive and starts it again, as tests of ageing do: RUN s of turning, a hold, RUN s, ...
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

KNOT = 1e-3  # s
RUN, RAMP = 4.0, 4.0  # s, of turning before and after each hold, and of slowing down and starting: so gently
# that what the body's inertia takes of the force in stick, which is known badly, stays small
CREEP = 1e-6  # of the speed, that is left in a hold
PASSES = 4  # of the fixed point phi -> speed -> phi; each gains the factor 8*eighth + once


@dataclass(frozen=True)
class Ripple:
    """Unevenness, relative to the nominal speed: two amplitudes locked to the angle of the drive, and rms noise.

    correlation_time: s, of the noise; smoothing: s, standard deviation of the Gaussian window that rounds it.
    """

    once: float = 0.004
    eighth: float = 0.001
    noise: float = 0.0015
    correlation_time: float = 0.1
    smoothing: float = 0.0

    def speed(
        self, nominal: float, duration: float, specimen: np.random.Generator, noise: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Knots (n,) in s from 0 to ``duration``, speeds (n,) in rad/s, linear between knots, and the angle (rad) at
        the first.

        specimen draws the phases of the two harmonics, noise the rest.
        """
        from scipy.ndimage import gaussian_filter1d

        time = KNOT * np.arange(int(np.ceil(duration / KNOT - 1e-9)) + 1)
        coloured = np.clip(self._coloured(len(time), noise), -2.0 * self.noise, 2.0 * self.noise)
        if self.smoothing > 0:
            coloured = gaussian_filter1d(coloured, self.smoothing / KNOT)
        first, second = 2.0 * np.pi * specimen.random(2)
        start = 2.0 * np.pi * noise.random()  # the angle at which the log happens to begin
        speed = np.full(len(time), nominal)
        for _ in range(PASSES):
            angle = start + np.concatenate([[0.0], np.cumsum(0.5 * KNOT * (speed[1:] + speed[:-1]))])
            ripple = self.once * np.sin(angle + first) + self.eighth * np.sin(8.0 * angle + second)
            speed = nominal * (1.0 + ripple + coloured)
        return time, speed, start

    def _coloured(self, samples: int, noise: np.random.Generator) -> np.ndarray:
        """First-order autoregression on the knots (samples,), begun in its stationary state."""
        memory = float(np.exp(-KNOT / self.correlation_time))
        fresh = self.noise * noise.standard_normal(samples)
        level, values = float(fresh[0]), [float(fresh[0])]
        for kick in (fresh[1:] * np.sqrt(1.0 - memory**2)).tolist():
            level = memory * level + kick
            values.append(level)
        return np.array(values)


def held_duration(holds: Sequence[float]) -> float:
    """Length in s of a program of holds (s each)."""
    return sum(holds) + (len(holds) + 1) * RUN + 2 * len(holds) * RAMP


def with_holds(
    time: np.ndarray, speed: np.ndarray, holds: Sequence[float], first_hold: float
) -> tuple[np.ndarray, np.ndarray]:
    """Knots in s and speeds in rad/s of a drive that stops for ``holds`` (s each) from ``first_hold`` s on; what its
    unevenness owes to its angle stays with that."""
    knots = np.arange(0.0, time[-1] + 0.5 * KNOT, KNOT)
    share, start = np.ones(len(knots)), first_hold
    for hold in holds:
        start += RUN
        slowing = np.clip((knots - start) / RAMP, 0.0, 1.0) - np.clip((knots - start - RAMP - hold) / RAMP, 0.0, 1.0)
        share -= 0.5 - 0.5 * np.cos(np.pi * slowing)
        start += hold + 2 * RAMP
    # beside a drive at no speed at all any rounding of the body's is slip
    share = np.maximum(share, CREEP)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * KNOT * (share[1:] + share[:-1]))])
    return knots, share * np.interp(turned, time, speed)
