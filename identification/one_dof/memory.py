"""How long a series remembers: what coloured residuals leave of the number of samples.

    rho_l = autocorrelation at lag l,   memory = first lag with rho <= 0,   tau = 1 + 2 sum_{l < memory} rho_l

n samples are worth n/tau independent ones. Source: Priestley, Spectral Analysis and Time Series (1981), section 5.3;
the sum ends at the first zero crossing since the sum over all lags vanishes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

REACH = 2  # memories: lags of Newey and West's estimate, whose triangular weights count half at the middle


@dataclass(frozen=True)
class Memory:
    """lags: first lag without positive correlation; first: correlation of neighbours; samples: how many independent
    ones the ``length`` samples are worth."""

    lags: int
    first: float
    samples: float
    length: int

    @property
    def newey_west_lags(self) -> int:
        """Lags that a covariance for these residuals must take in."""
        return REACH * self.lags

    @property
    def white(self) -> bool:
        """Whether neighbours are uncorrelated, within what chance gives in 1 of 20 series."""
        return abs(self.first) < 1.96 / np.sqrt(self.length)


def memory(series: np.ndarray) -> Memory:
    """Memory of a series (n,) around its mean."""
    n = len(series)
    centred = series - series.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[:n]
    if n < 2 or correlation[0] <= 0:
        return Memory(1, 0.0, float(n), n)
    correlation = correlation / correlation[0]
    below = np.flatnonzero(correlation[1:] <= 0)
    lags = int(below[0]) + 1 if below.size else n - 1
    tau = 1 + 2 * float(np.sum(correlation[1:lags]))
    return Memory(lags, float(correlation[1]), n / tau, n)
