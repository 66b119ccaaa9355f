"""A measured series, and what motion it is: periodic, quasiperiodic, chaos, transient chaos, noise, or too short."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured
from identification.series.divergence import Divergence, divergences
from identification.series.embedding import Reconstruction, delayed, noise_level, reconstruct, windowed
from identification.series.invariants import (
    Dimension,
    Recurrence,
    correlation_dimension,
    level_crossings,
    recurrence,
    surrogate_test,
    zero_one_test,
)
from identification.series.read import FEWEST, Series, read_series
from identification.series.rhythm import LONGEST, Lines, cycle_of, period_of, two_frequencies
from identification.series.tangent import Tangent, tangent_exponent

CYCLES = 12  # below which nothing irregular is named
WIDE = 1.96  # standard deviations of an interval of 95 %
METHOD = 0.04  # of the exponent: by so much methods differ that are all well set up (tests/benchmarks/bench_series.py)
SURE = 0.10  # of the exponent, half the width that a series should be long enough for
TAILS = (0.75, 0.5, 0.25)  # parts of a series that are cut off in the search for its end
FORETOLD = 0.9  # error over that of surrogates, below which a motion is deterministic
REGULAR = 0.05  # 1/cycle, below which an exponent does not tell chaos from noise on a regular motion


@dataclass(frozen=True, eq=False)
class SeriesInvariants(Pictured):
    """A measured series and its invariants.

    Attributes:
        verdict: "periodic", "quasiperiodic", "chaos", "transient chaos", "noise" or "too short".
        sentence, why: the verdict with its numbers, and what it rests on.
        exponent, interval: the largest exponent, per unit of time, and its interval of 95 %; None where the motion is
            regular, or noise.
        period, period_error: of a periodic series, with its standard deviation.
        frequencies, frequency_errors: of a quasiperiodic one, per unit of time; rotation: their ratio.
        needed: cycles that the series should have; None if it is long enough.
        cycles, cycle: number of cycles in it, and the duration of one.
        end: time at which transient chaos ends.
        tangent, divergences: the exponent by local linear maps, and after Rosenstein, Kantz and Wolf, per sample.
        reconstruction, dimension, zero_one, surrogates, recurrence: see there; surrogates: share that is foretold as
            well, and error of prediction over theirs.
        returns: (n,) times at which it crosses its mean upwards, with a dead band against noise.
    """

    RECORD: ClassVar = (
        *("name=series.name", "step=series.step", "unit=series.unit", "verdict", "sentence", "why", "exponent"),
        *("interval", "period", "period_error", "frequencies", "frequency_errors", "rotation", "needed", "cycles"),
        *("cycle", "end", "noise=reconstruction.noise", "delay=reconstruction.delay"),
        *("embedding_dimension=reconstruction.dimension", "methods", "correlation_dimension=dimension", "zero_one"),
        *("surrogates", "recurrence", "notes=series.notes"),
    )

    series: Series
    verdict: str
    sentence: str
    why: str
    cycles: float
    cycle: float
    reconstruction: Reconstruction
    lines: Lines
    tangent: Tangent | None = None
    divergences: tuple[Divergence, ...] = ()
    dimension: Dimension | None = None
    zero_one: tuple[float, float] | None = None
    surrogates: tuple[float, float] | None = None
    recurrence: Recurrence | None = None
    exponent: float | None = None
    interval: tuple[float, float] | None = None
    period: float | None = None
    period_error: float | None = None
    frequencies: tuple[float, ...] = ()
    frequency_errors: tuple[float, ...] = ()
    rotation: float | None = None
    needed: int | None = None
    end: float | None = None
    returns: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def methods(self) -> dict[str, dict[str, float]]:
        """Exponents and their standard deviations by method, per unit of time."""
        estimates = [("local maps", self.tangent), *((estimate.method, estimate) for estimate in self.divergences)]
        return {
            name: {"value": estimate.value / self.series.step, "error": estimate.error / self.series.step}
            for name, estimate in estimates
            if estimate is not None
        }

    def _heading(self) -> str:
        return f"{self.series.name}: {self.sentence}"

    def _contents(self) -> dict[str, Any]:
        return {"why": self.why, "exponent": self.exponent, "interval": self.interval, "cycles": self.cycles}


def series_invariants(
    series: Series | str | Path,
    column: str | None = None,
    *,
    delay: int | None = None,
    dimension: int | None = None,
    whole: bool = True,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> SeriesInvariants:
    """What motion a measured series is, and its invariants with their errors.

    Args:
        series: a `Series` (values at even steps), or a log of any kind, of which ``column`` is taken.
        delay, dimension: of the reconstruction, in samples, where they are known; else both are found.
        whole: whether everything is computed; else what the verdict rests on alone, which takes a second or two.
        seed: of bootstraps and surrogates.
        progress: called with the fraction done.

    Raises:
        StickslipError: a log that cannot be read, a series that is too short for any answer or never changes, or a
            reconstruction longer than the series.
    """
    if not isinstance(series, Series):
        found = read_series(series, [column] if column else [])
        if len(found) > 1:
            raise StickslipError(
                f"'{series}' has several columns. Say which: column={found[0].name.split(': ')[-1]!r}."
            )
        series = found[0]
    advance = progress or (lambda _: None)
    x = (series.values - series.values.mean()) / series.values.std()
    remainder = _rest_of(x, noise_level(x))
    # what rests has no cycle, and its offset would pass for a slow one
    cycle = cycle_of(x[: remainder if remainder and remainder > FEWEST else None])
    if (dimension or 2) * (delay or 1) > len(x) // 10 or min(delay or 1, dimension or 2) < 1:
        raise StickslipError(
            f"{series.name}: a delay of {delay} in {dimension} dimensions does not fit {len(x)} samples."
        )
    state = reconstruct(x, cycle, delay, dimension)
    returns = level_crossings(x, 0.0, max(4 * state.noise, 0.1)) * series.step
    about = {"series": series, "cycles": len(x) / cycle, "cycle": cycle * series.step, "reconstruction": state}
    about |= {"returns": returns}
    advance(0.2)
    lines = regular_lines(x, state.noise)
    if lines.explains:
        found = _regular(series, lines, about)
    else:
        found = _irregular(series, x, cycle, state, lines, about, seed, given=bool(delay and dimension))
    advance(0.5)
    return _with_the_rest(found, x, cycle, seed) if whole else found


def regular_lines(x: np.ndarray, noise: float) -> Lines:
    """One frequency or two that explain a series, else those that come nearer."""
    lines = period_of(x, noise)
    if lines.explains:
        return lines
    two = two_frequencies(x, noise)
    # frequencies that the series does not tell apart are no two frequencies
    apart = len(x) * abs(two.frequencies[0] - two.frequencies[1]) > 3 and len(x) * min(two.frequencies) > 3
    return two if two.explains and apart else lines


def _regular(series: Series, lines: Lines, about: dict[str, Any]) -> SeriesInvariants:
    """Of a series that one frequency or two explain."""
    rest = f"what is left, {100 * lines.left:.2g} % of the rms, is noise ({100 * about['reconstruction'].noise:.2g} %)"
    frequencies, errors = (tuple(value / series.step for value in many) for many in (lines.frequencies, lines.errors))
    if len(frequencies) == 1:
        period, error = 1 / frequencies[0], errors[0] / frequencies[0] ** 2
        many = f", {lines.multiple} cycles" if lines.multiple > 1 else ""
        unit = "samples" if series.unit == "1" else series.unit
        sentence = f"periodic (period {period:.6g} +- {error:.2g} {unit}{many})"
        said = {"verdict": "periodic", "sentence": sentence, "why": f"One frequency explains it: {rest}."}
        return SeriesInvariants(lines=lines, period=period, period_error=error, **said, **about)
    ratio = frequencies[1] / frequencies[0]
    pair = " and ".join(f"{frequency:.6g}" for frequency in frequencies)
    sentence = f"quasiperiodic (frequencies {pair} per {series.unit}, ratio {ratio:.6g})"
    why = f"Two frequencies explain it and no period of {LONGEST} cycles does: {rest}."
    about = {**about, "frequencies": frequencies, "frequency_errors": errors, "rotation": ratio}
    return SeriesInvariants(verdict="quasiperiodic", sentence=sentence, why=why, lines=lines, **about)


def windows_of(cycle: int, state: Reconstruction, given: bool) -> Sequence[int]:
    """Lengths of windows that are tried."""
    if given:
        return [(state.dimension - 1) * state.delay + 1]
    return [2 * state.delay, 4 * state.delay, cycle] if cycle > 4 else range(2, 5)


def _irregular(
    series: Series,
    x: np.ndarray,
    cycle: int,
    state: Reconstruction,
    lines: Lines,
    about: dict[str, Any],
    seed: int,
    *,
    given: bool,
) -> SeriesInvariants:
    """Of a series that no frequencies explain."""
    cycles = about["cycles"]
    if cycles < CYCLES:
        sentence = f"too short: needs about {5 * CYCLES} cycles, and has {cycles:.0f}"
        return _too_short(5 * CYCLES, sentence, "No period repeats itself in it.", lines, about)
    end = _end_of_transient(x, cycle, state.noise)
    before = x[: end or None]
    if end is not None and len(before) < max(CYCLES * cycle, FEWEST // 2):
        lines_after = regular_lines(x[end:], state.noise)
        found = _regular(series, lines_after, about) if lines_after.explains else None
        if found is not None:
            why = f"{found.why} Before {end * series.step:.4g} {series.unit} it settles."
            return replace(found, why=why, end=end * series.step)
    sigma = state.noise
    noise = 0.0 if cycle <= 4 else sigma
    scale = before.std()
    windows = windows_of(cycle, state, given)
    tangent = tangent_exponent((before - before.mean()) / scale, cycle, windows, noise / scale)
    share, ratio = surrogate_test(before, cycle, max(windows), seed)
    half = WIDE * float(np.hypot(tangent.error, METHOD * tangent.value)) / series.step
    value = tangent.value / series.step
    interval = (value - half, value + half)
    needed = int(np.ceil(len(before) / cycle * (half / max(SURE * abs(value), REGULAR / 2 / about["cycle"])) ** 2))
    about = {**about, "tangent": tangent, "surrogates": (share, ratio), "lines": lines}
    measured = f"{value:.4g} +- {half:.2g} per {series.unit}"
    if share > 0.05 or ratio > FORETOLD:
        why = f"The error of prediction is {ratio:.2g} times that of series with its spectrum alone: nothing "
        why += "says that it is deterministic."
        return SeriesInvariants(
            verdict="noise", sentence="noise, or a linear process that noise drives", why=why, **about
        )
    why = f"It is foretold {1 / ratio:.2g} times as well as series with its spectrum alone, and differences grow by "
    why += f"{measured} (95 %)."
    if interval[0] <= 0 or value * about["cycle"] < REGULAR:
        needed = max(needed, int(2 * cycles))
        sentence = f"too short: needs about {needed} cycles, and has {cycles:.0f}"
        return _too_short(needed, sentence, f"{why} That does not tell chaos from a regular motion.", lines, about)
    about |= {"exponent": value, "interval": interval, "needed": needed if half > SURE * value else None}
    if end is None:
        return SeriesInvariants(verdict="chaos", sentence=f"chaos (exponent {measured})", why=why, **about)
    sentence = f"transient chaos (until {end * series.step:.4g} {series.unit}, exponent {measured})"
    why += " What follows is regular."
    return SeriesInvariants(verdict="transient chaos", sentence=sentence, why=why, end=end * series.step, **about)


def _too_short(needed: int, sentence: str, why: str, lines: Lines, about: dict[str, Any]) -> SeriesInvariants:
    about = {**about, "lines": lines, "needed": needed}
    return SeriesInvariants(verdict="too short", sentence=sentence, why=why, **about)


def _end_of_transient(x: np.ndarray, cycle: int, noise: float) -> int | None:
    """Sample from which a series is regular, or rests, to its end; None where it is not."""
    remainder = _rest_of(x, noise)
    if remainder is not None:
        return remainder
    for cut in TAILS:
        first = int(cut * len(x))
        tail = x[first:]
        if len(tail) < max(6 * cycle, FEWEST // 4):
            continue
        lines = period_of(tail, noise)
        if lines.explains:
            return _first_regular(x, first, lines, noise, cycle)
    return None


def _rest_of(x: np.ndarray, noise: float) -> int | None:
    """Sample from which a series rests to its end."""
    tail = x[int(TAILS[0] * len(x)) :]
    if tail.std() >= max(2 * noise, 0.02):
        return None
    moves = np.flatnonzero(np.abs(x - tail.mean()) > max(4 * noise, 0.05))
    return int(moves[-1]) + 1 if len(moves) else 0


def _first_regular(x: np.ndarray, first: int, lines: Lines, noise: float, cycle: int) -> int:
    """Sample from which a series repeats what it is from ``first`` on."""
    period = 1 / lines.frequencies[0]
    at = np.arange(len(x))
    later = at + np.ceil((first - at) / period).clip(0) * period
    later = np.where(at < first, later, at)
    repeated = np.interp(later, at, x)
    limit = 5 * np.hypot(max(noise, 1e-3), lines.left)
    away = np.abs(x - repeated)[:first]
    smooth = np.sqrt(np.convolve(away**2, np.ones(cycle) / cycle, "same"))
    moves = np.flatnonzero(smooth > limit)
    return int(moves[-1]) + 1 if len(moves) else 0


def _with_the_rest(found: SeriesInvariants, x: np.ndarray, cycle: int, seed: int) -> SeriesInvariants:
    """With the invariants that the verdict does not rest on."""
    state = found.reconstruction
    transient = x[: int(found.end / found.series.step)] if found.end and found.verdict == "transient chaos" else x
    if cycle > 4:
        points = windowed(transient, max((state.dimension - 1) * state.delay + 1, 2), max(state.dimension, 3))
    else:
        points = delayed(transient, state.delay, state.dimension)
    # few samples a cycle do not show the noise; what local maps miss by bounds it
    missed = found.tangent.foretold / 2 if found.tangent else state.noise
    noise = min(missed, state.noise) if cycle <= 4 else state.noise
    every = max(state.delay // 2, 1)
    return replace(
        found,
        divergences=divergences(points, cycle, noise, seed),
        dimension=correlation_dimension(points, 2 * cycle, noise, seed),
        zero_one=zero_one_test(transient, cycle, seed=seed),
        surrogates=found.surrogates or surrogate_test(transient, cycle, 4 * state.delay, seed),
        recurrence=recurrence(points, every, cycle),
    )
