"""The prefilter of instruments: a low-pass that makes white what noise of positions leaves in the residuals.

    power of residuals    S(f) = S0 (1 + (f/fc)^4)       efforts' noise is white, that of accelerations rises by f^2
    prefilter             |W(f)|^2 = 1/(1 + (f/fc)^4)    Butterworth of order 2, forward alone
    estimate              (Z'W'W Y) theta = Z'W'W tau    over both sides of the equation: it shifts no value

Above the corner fc a row says more of the noise than of the machine. fc is found joint by joint, by Whittle's
likelihood of the residuals with equal weight on each octave: the corner counts, not the many frequencies above it.

Sources: Brunot, Janot, Young, Carrillo (2018), Control Eng. Practice 74, 155 (prefilter of instruments); Whittle
(1953), Ark. Mat. 2, 423.
"""

from dataclasses import dataclass

import numpy as np

BAND = 0.7  # of the cutoff of the rows: below, that low-pass itself takes less than a tenth of the power
PERIODS = 5.0  # of a corner in a series: one is lost
TRIED = 41  # corners
ORDER = 2


@dataclass(frozen=True)
class Band:
    """Of rows at steps of ``step`` (s): below ``motion`` (Hz) lies what moves, above ``cutoff`` (Hz) a low-pass has
    left nothing."""

    step: float
    motion: float
    cutoff: float


@dataclass(frozen=True, eq=False)
class Prefilter:
    """corners: (joints,) Hz, infinite where residuals do not rise; step: s between rows; series, joint: (rows,)."""

    corners: np.ndarray
    step: float
    series: np.ndarray
    joint: np.ndarray

    @property
    def settled(self) -> np.ndarray:
        """Which rows are a period of the corner and more behind the start of their series (rows,)."""
        settled = np.ones(len(self.series), dtype=bool)
        for corner, rows in self._each():
            settled[rows[: int(1 / (corner * self.step))]] = False
        return settled

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """W of values (rows, ...), each series from rest."""
        from scipy.signal import butter, sosfilt

        filtered = values.copy()
        for corner, rows in self._each():
            filtered[rows] = sosfilt(butter(ORDER, 2 * corner * self.step, output="sos"), values[rows], axis=0)
        return filtered

    def transposed(self, values: np.ndarray) -> np.ndarray:
        """W' of values (rows, ...): each series from its end."""
        return Prefilter(self.corners, self.step, self.series[::-1], self.joint[::-1])(values[::-1])[::-1]

    def _each(self) -> list[tuple[float, np.ndarray]]:
        """Corner and rows of each series that is filtered."""
        rows = [np.flatnonzero(self.series == label) for label in np.unique(self.series)]
        each = [(float(self.corners[self.joint[mine[0]]]), mine) for mine in rows]
        return [(corner, mine) for corner, mine in each if np.isfinite(corner)]


def prefilter(residual: np.ndarray, series: np.ndarray, joint: np.ndarray, band: Band) -> Prefilter:
    """The prefilter of residuals (rows,). No corner is below what moves, or so low that little of a series is left."""
    _, counts = np.unique(series, return_counts=True)
    least = max(band.motion, PERIODS / (band.step * float(np.mean(counts))))
    corners = [
        _corner([residual[series == label] for label in np.unique(series[joint == number])], least, band)
        for number in range(int(joint.max()) + 1)
    ]
    return Prefilter(np.array(corners), band.step, series, joint)


def _corner(residuals: list[np.ndarray], least: float, band: Band) -> float:
    """The corner of the series of one joint, Hz; infinite where their power does not rise within the band."""
    if least >= BAND * band.cutoff:
        return np.inf
    from scipy.signal import periodogram

    spectra = [periodogram(residual, 1 / band.step, window="hann") for residual in residuals]
    frequency, power = (np.concatenate([pair[column] for pair in spectra]) for column in (0, 1))
    inside = (frequency > 0) & (frequency <= BAND * band.cutoff)
    frequency, power = frequency[inside], power[inside]
    octave = (1 / frequency) / np.sum(1 / frequency)
    tried = np.geomspace(least, band.cutoff, TRIED)
    shape = 1 + (frequency / tried[:, None]) ** (2 * ORDER)
    best = float(tried[np.argmin(np.log((power / shape) @ octave) + np.log(shape) @ octave)])
    return best if best < BAND * band.cutoff else np.inf
