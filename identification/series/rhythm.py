"""The rhythm of a series: its cycle, its spectrum, its period with error, or its two frequencies.

    x(t) = a_0 + sum over k of a_k cos(2 pi k.f t) + b_k sin(2 pi k.f t) + noise,    k of one or two whole numbers

The frequencies are found by Gauss and Newton from the strongest lines, with errors from the least squares. A series is
periodic, or quasiperiodic, if what is left is noise. Of periods f is divided by 1, 2, 3 ..., and the first that does
is taken; of two frequencies the ratio, the rotation number, is that of the weaker to the stronger.
"""

from dataclasses import dataclass, replace

import numpy as np

HARMONICS = 24
LONGEST = 16  # cycles of a period
COARSE = 0.2  # cycles a sample, from which harmonics beyond half of the sampling rate count: it is a section
ORDERS = (8, 8)  # multiples of either of two frequencies
MOST, FINE = 8192, 40  # samples of a fit, and of a cycle in it
LEFT = 1.35  # times the noise: what is left of a series that is understood
FAR = 6.0  # times that, from which a fit is given up
ALWAYS = 0.004  # of the rms, which harmonics of kinks and a coarse estimate of the noise leave
FEW = 10  # cycles, for which a slower motion may hide a faster one
CARRIED = 0.2  # of the power, by a line that sets the cycle
REPEATS = 0.03  # of the rms, by which a series may miss itself after a period, for a period to be tried
TERMS = 160  # harmonics of a fit


@dataclass(frozen=True)
class Lines:
    """A fit by one or two frequencies. frequencies, errors: per sample; left: rms of what it leaves, in parts of that
    of the series; multiple: cycles of the strongest line in a period; explains: whether it leaves noise alone."""

    frequencies: tuple[float, ...]
    errors: tuple[float, ...]
    left: float
    multiple: int
    explains: bool


def spectrum(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (per sample) and power of a series (n,), through a Hann window."""
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)))) ** 2
    return np.fft.rfftfreq(len(x)), power / power.sum()


def strongest(x: np.ndarray) -> tuple[float, float]:
    """Frequency of the strongest line of a series, and its share of the power."""
    frequencies, power = spectrum(x)
    at = int(np.argmax(power[2:])) + 2
    return float(frequencies[at]), float(power[max(at - 3, 0) : at + 4].sum())


def cycle_of(x: np.ndarray, slow: bool = False) -> int:
    """Samples of a cycle: of the strongest line if it carries the motion, else four times the first fall of the
    autocorrelation to a third; 1 where a sample says nothing of the next, as of a map. Of a series that is slow as a
    whole, as where an oscillation leaves one place for another, the cycle of its differences is taken."""
    frequency, share = strongest(x)
    y = x - x.mean()
    spectral = np.abs(np.fft.rfft(y, 2 * len(y))) ** 2
    memory = np.fft.irfft(spectral)[: len(y) // 4]
    falls = int(np.argmax(memory < memory[0] / 3))
    if falls <= 1:
        return 1
    cycle = max(round(1 / frequency) if share > CARRIED else 4 * falls, 2)
    return cycle if slow or FEW * cycle < len(x) else cycle_of(np.diff(x), slow=True)


def period_of(x: np.ndarray, noise: float) -> Lines:
    """The shortest period that explains a series of unit variance, or its strongest line, which does not."""
    thinned, every = _thinned(x)
    base = _fitted(thinned, _multiples(strongest(thinned)[0], 1), np.array([strongest(thinned)[0]]), noise, 1)
    if base.explains:
        return _scaled(base, every)
    for multiple in range(2, LONGEST + 1):
        period = multiple / base.frequencies[0]
        if len(thinned) < 3 * period:
            break
        if _missed(thinned, period) < REPEATS + 2 * noise:
            frequency = 1 / period
            found = _fitted(thinned, _multiples(frequency, multiple), np.array([frequency]), noise, multiple)
            if found.explains:
                return _scaled(found, every)
    return _scaled(base, every)


def _multiples(frequency: float, multiple: int) -> np.ndarray:
    """Harmonics (k, 1) of a fit, as far as samples show them."""
    orders = np.arange(1, min(HARMONICS * multiple, TERMS) + 1)
    return orders[(orders * frequency <= 0.5) | (orders == 1)][:, None]


def _missed(x: np.ndarray, period: float) -> float:
    """Rms by which a series does not repeat itself after so many samples."""
    at = np.arange(int(len(x) - period - 1))
    return float(np.sqrt(np.mean((np.interp(at + period, np.arange(len(x)), x) - x[at]) ** 2) / 2))


def two_frequencies(x: np.ndarray, noise: float) -> Lines:
    """The two frequencies whose sums and differences explain a series of unit variance, or most of it. Of a series with
    few samples a cycle, as a section gives, one of them may be that of the samples."""
    thinned, every = _thinned(x)
    start = strongest(thinned)[0]
    first = _fitted(thinned, _multiples(start, 1), np.array([start]), noise, 1).frequencies[0]
    if first > COARSE:
        folded = _fitted(thinned, np.arange(1, HARMONICS + 1)[:, None], np.array([first]), noise, 1)
        if folded.explains:
            return replace(folded, frequencies=(*folded.frequencies, 1.0), errors=(*folded.errors, 0.0))
    residual = thinned - _design(thinned, _multiples(first, 1), np.array([first]))[1]
    second = strongest(residual)[0]
    grid = [(k, m) for k in range(ORDERS[0] + 1) for m in range(-ORDERS[1], ORDERS[1] + 1) if (k, m) > (0, 0)]
    # the strongest lines may be multiples of what generates them all
    best = None
    for pair in ((first, second), (first, abs(first - second)), (first, second / 2), (first / 2, second)):
        found = _fitted(thinned, np.array(grid), np.array(pair), noise, 1)
        best = found if best is None or found.left < best.left else best
        if best.explains:
            break
    assert best is not None
    return _scaled(best, every)


def _thinned(x: np.ndarray) -> tuple[np.ndarray, int]:
    """Few enough samples for a fit, of the whole length where the cycle allows that, else the last ones."""
    frequency = strongest(x)[0]
    every = int(np.clip(len(x) // MOST, 1, max(1 / (FINE * max(frequency, 1e-9)), 1)))
    return x[::every][-MOST:], every


def _scaled(lines: Lines, every: int) -> Lines:
    frequencies, errors = (tuple(value / every for value in many) for many in (lines.frequencies, lines.errors))
    return replace(lines, frequencies=frequencies, errors=errors)


def _design(x: np.ndarray, terms: np.ndarray, frequencies: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns of a fit, what it makes of x, and its derivatives (n, len(frequencies)) by the frequencies."""
    time = np.arange(len(x)) - len(x) / 2
    angles = 2 * np.pi * np.outer(time, terms @ frequencies)
    columns = np.column_stack([np.ones(len(x)), np.cos(angles), np.sin(angles)])
    amplitudes = _least_squares(columns, x)
    count = len(terms)
    turned = -np.sin(angles) * amplitudes[1 : count + 1] + np.cos(angles) * amplitudes[count + 1 :]
    return columns, columns @ amplitudes, 2 * np.pi * time[:, None] * (turned @ terms)


def _fitted(x: np.ndarray, terms: np.ndarray, frequencies: np.ndarray, noise: float, multiple: int) -> Lines:
    """Gauss and Newton over the frequencies; steps longer than the resolution of the series are cut."""
    resolution = 1 / len(x)
    errors = np.full(len(frequencies), resolution)
    residual = np.inf
    limit = np.hypot(LEFT * noise, ALWAYS)
    for turn in range(4):
        columns, fitted, slopes = _design(x, terms, frequencies)
        design = np.column_stack([columns, slopes])
        step = _least_squares(design, x - fitted)[-len(frequencies) :]
        free = max(len(x) - design.shape[1], 1)
        residual = float(np.sqrt(np.sum((x - fitted) ** 2) / free))
        # what the columns explain of the slopes is no knowledge of the frequencies
        bare = slopes - columns @ _least_squares(columns, slopes)
        errors = residual * np.sqrt(np.diag(np.linalg.pinv(bare.T @ bare)))
        if np.all(np.abs(step) < 1e-3 * errors) or (turn and residual > FAR * limit):
            break
        frequencies = np.abs(frequencies + np.clip(step, -resolution, resolution))
    return Lines(tuple(map(float, frequencies)), tuple(map(float, errors)), residual, multiple, bool(residual <= limit))


def _least_squares(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """By normal equations: harmonics are nearly orthogonal, and a decomposition would take ten times as long."""
    size = np.sqrt(np.sum(columns**2, axis=0)) + 1e-300
    scaled = columns / size
    gram = scaled.T @ scaled + 1e-9 * np.eye(columns.shape[1])
    return (np.linalg.solve(gram, scaled.T @ values).T / size).T
