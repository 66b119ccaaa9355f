"""From the columns of a log to the signals of a recipe: gains, filters, derivatives, decimation.

Filters run forward and backward, so that they delay nothing. They never run over a gap of the clock: the log is cut
there. Decimation filters by a Chebyshev low-pass of order 8 (0.05 dB, edge at 0.8 of the new Nyquist frequency) and
keeps every n-th sample, counted back from the last. Every regressor goes through the same filter as the effort.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.unit_names import conversion
from identification.measurement.motion import savitzky_golay
from identification.measurement.recipe import FRICTION, ROLES, TIME, WEIGHT, Filter, Recipe, RecipeSignal, Speed
from rig_io.logs.table import Table
from rig_io.repair.clock import mended

GRAVITY = 9.81  # m/s2
GAP = 10.0  # median sample intervals: a longer one is a gap
CHEBYSHEV_ORDER, CHEBYSHEV_RIPPLE = 8, 0.05  # dB
RATE_SUSPECT = 0.01  # relative difference of the stated rate and the stamps: the recipe is of another log
LEAST = 20  # samples of a piece; fewer cannot be filtered
# units that a column may be converted to, as base unit and number of times it was differentiated
_FAMILY = {"m": ("m", "m/s", "m/s2"), "rad": ("rad", "rad/s", "rad/s2"), "N": ("N",), "N m": ("N m",), "1": ("1",)}


@dataclass(frozen=True, eq=False)
class Piece:
    """Signals between two gaps, by name, each (n,), at the full rate and with the dropped samples off."""

    values: Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Prepared:
    """The signals of one log. turning: whether the body turns (rad) rather than slides (m); step: s between samples;
    notes: sentences on what was cut."""

    source: str
    pieces: tuple[Piece, ...]
    turning: bool
    step: float
    notes: tuple[str, ...]


def check_speed(recipe: Recipe, turning: bool, name: str, speed: Speed) -> None:
    """Refuse a speed of the recipe that is not one of such a body. StickslipError: which."""
    if not speed.fits(turning):
        raise StickslipError(
            f"{recipe.name}: '{name}' is given in a unit of {speed.unit}, but the body "
            f"{'turns: rad/s' if turning else 'slides: m/s'} is expected."
        )


def prepare(recipe: Recipe, table: Table, repair: Collection[str] = ()) -> Prepared:
    """Signals of a log, as the recipe makes them. repair: see `rig_io.repair.clock`. StickslipError: a column is
    missing or holds no numbers, a unit does not fit, time does not rise, the log is too short."""
    units: dict[str, str] = {}
    columns = {name: _column(recipe, table, signal, units) for name, signal in recipe.signals.items() if signal.column}
    notes = []
    if repair:
        clock = mended(columns[TIME], replace(table, columns=columns), repair)
        columns = {**{name: values[clock.rows] for name, values in columns.items()}, TIME: clock.time}
        notes += clock.said
    time = columns[TIME]
    for name in recipe.signals:
        _check_unit(recipe, name, _unit_of(recipe, name, units))
    step = _step(recipe, table, time)
    inner = [i for i in np.flatnonzero(np.diff(time) > GAP * step) + 1]
    borders = [0, *inner, len(time)]
    pieces, lost = [], 0
    for start, end in pairwise(borders):
        dropped = recipe.sampling.drop + recipe.sampling.drop_end
        if end - start <= max(LEAST, dropped + 3 * recipe.sampling.decimate * CHEBYSHEV_ORDER):
            lost += end - start
            continue
        raw = {name: values[start:end] for name, values in columns.items()}
        pieces.append(Piece(_Chain(recipe, raw, step).values()))
    if not pieces:
        raise StickslipError(
            f"{table.source} is too short for this recipe: no stretch without a gap keeps enough of its {len(time)} "
            "samples after 'drop', 'drop_end' and 'decimate'. Record a longer log, or lower them."
        )
    if len(borders) > 2:
        notes.append(f"The clock has {len(borders) - 2} gaps; no filter runs across them ({lost} samples left out).")
    turning = _turning(recipe, units)
    check_speed(recipe, turning, "least_speed", recipe.sampling.least_speed)
    return Prepared(table.source, tuple(pieces), turning, step, tuple(notes))


def turning_of(recipe: Recipe) -> bool:
    """Whether the body of a recipe turns (rad, N m) rather than slides, by its units alone. StickslipError: a unit does
    not fit, or signals are of both kinds."""
    units = {
        name: _si(_gained(signal, str(signal.unit)), _expected(name), f"{recipe.name}: signal '{name}'")[0]
        for name, signal in recipe.signals.items()
        if signal.column
    }
    return _turning(recipe, units)


class _Chain:
    """Signals of one piece, each made once."""

    def __init__(self, recipe: Recipe, raw: Mapping[str, np.ndarray], step: float) -> None:
        self.recipe, self.raw, self.step = recipe, raw, step
        self.made: dict[str, np.ndarray] = {}

    def values(self) -> dict[str, np.ndarray]:
        inner = slice(self.recipe.sampling.drop, len(self.raw[TIME]) - self.recipe.sampling.drop_end)
        return {name: self.signal(name)[inner] for name in self.recipe.signals}

    def signal(self, name: str) -> np.ndarray:
        if name not in self.made:
            signal = self.recipe.signals[name]
            values = self.raw[name] if signal.of is None else self._derivative(signal)
            self.made[name] = values if signal.filter is None else filtered(values, signal.filter, self.step)
        return self.made[name]

    def _derivative(self, signal: RecipeSignal) -> np.ndarray:
        values = self.signal(str(signal.of))
        local = signal.savitzky_golay
        if local:
            return savitzky_golay(values, self.step, local.window, local.order, signal.derivative)
        for _ in range(signal.derivative):
            # stamps count where the recipe states no rate
            values = np.gradient(values, self.step if self.recipe.sampling.rate else self.raw[TIME])
        return values


def filtered(values: np.ndarray, low_pass: Filter, step: float) -> np.ndarray:
    """Butterworth low-pass forward and backward. values: (n,); step: s. StickslipError: the cutoff is not below the
    Nyquist frequency, or there are no more samples than the padding."""
    from scipy.signal import butter, sosfiltfilt

    share = low_pass.cutoff if low_pass.relative else 2 * low_pass.cutoff * step
    if share >= 1:
        raise StickslipError(
            f"The filter's cutoff of {low_pass.cutoff:g} Hz is not below half the sampling rate of {1 / step:g} Hz. "
            "Lower it, or state the right rate."
        )
    if len(values) <= low_pass.padding:
        raise StickslipError(
            f"A stretch of {len(values)} samples is too short for a filter with a padding of {low_pass.padding}."
        )
    return sosfiltfilt(butter(low_pass.order, share, output="sos"), values, padlen=low_pass.padding)


def decimating(values: np.ndarray, every: int) -> np.ndarray:
    """The low-pass before one sample in so many is kept. values: (n, ...)."""
    if every == 1:
        return values
    from scipy.signal import sosfiltfilt

    low_pass = _decimating_filter(every)
    # a filter of even order passes a constant with the loss of its ripple, twice
    return sosfiltfilt(low_pass, values, axis=0, padlen=3 * CHEBYSHEV_ORDER) * 10 ** (CHEBYSHEV_RIPPLE / 10)


@cache
def _decimating_filter(every: int) -> np.ndarray:
    from scipy.signal import cheby1

    return np.asarray(cheby1(CHEBYSHEV_ORDER, CHEBYSHEV_RIPPLE, 0.8 / every, output="sos"))


def decimated(count: int, every: int) -> np.ndarray:
    """Which of ``count`` samples are kept, counted back from the last."""
    return np.arange((count - 1) % every, count, every)


def _column(recipe: Recipe, table: Table, signal: RecipeSignal, units: dict[str, str]) -> np.ndarray:
    """Values (n,) of a column in an SI unit, which goes to ``units``."""
    name = str(signal.column)
    if name not in table.columns:
        reason = f" ('{name}' is {table.left_out[name]})" if name in table.left_out else ""
        raise StickslipError(
            f"{table.source} has no column '{name}', which recipe {recipe.name} reads as '{signal.name}'{reason}."
            f"{nearest(name, table.columns)}"
        )
    values = table.columns[name]
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise StickslipError(
            f"{table.source}: column '{name}' holds no number in {bad.size} samples, the first at "
            f"{table.place(int(bad[0]))}. A filter cannot run across it: cut the log there."
        )
    unit = str(signal.unit)
    stated = table.units.get(name)
    if stated:
        conversion(stated, unit, f"{table.source}: column '{name}', for signal '{signal.name}' of {recipe.name},")
        unit = stated
    where = f"{recipe.name}: signal '{signal.name}'"
    si_unit, factor = _si(_gained(signal, unit), _expected(signal.name), where)
    units[signal.name] = si_unit
    return values * (_gain(table, signal, where) * factor)


def _expected(name: str) -> tuple[str, ...] | None:
    """Units of which a signal must have one; None for a name without a meaning."""
    return ROLES[name].units if name in ROLES else None


def _gained(signal: RecipeSignal, unit: str) -> str:
    """Unit of a column in this unit after its gain."""
    return unit if signal.gain_unit == "1" else f"({unit}) * ({signal.gain_unit})"


def _gain(table: Table, signal: RecipeSignal, where: str) -> float:
    if not isinstance(signal.gain, str):
        return signal.gain
    if signal.gain not in table.scalars:
        hint = f" Its single numbers: {', '.join(table.scalars)}." if table.scalars else " It holds none."
        raise StickslipError(
            f"{where}: the gain '{signal.gain}' is not a single number in {table.source}.{hint} Write the number into "
            "the recipe."
        )
    return table.scalars[signal.gain]


def _si(unit: str, expected: tuple[str, ...] | None, where: str) -> tuple[str, float]:
    """SI unit that a unit converts to, and the factor."""
    choices = expected or tuple(name for family in _FAMILY.values() for name in family)
    if unit in choices:
        return unit, 1.0
    fault: StickslipError | None = None
    for choice in choices:
        try:
            return choice, conversion(unit, choice, where)
        except StickslipError as error:
            fault = fault or error
    assert fault is not None
    raise fault


def _unit_of(recipe: Recipe, name: str, units: Mapping[str, str]) -> str:
    """Unit of a signal: of its column, or of what it is a derivative of, per second."""
    signal = recipe.signals[name]
    if signal.of is None:
        return units[name]
    unit = _unit_of(recipe, signal.of, units)
    for family in _FAMILY.values():
        if unit in family and family.index(unit) + signal.derivative < len(family):
            return family[family.index(unit) + signal.derivative]
    return f"{unit} per s^{signal.derivative}"


def _check_unit(recipe: Recipe, name: str, unit: str) -> None:
    if name in ROLES and unit not in ROLES[name].units:
        raise StickslipError(
            f"{recipe.name}: signal '{name}' comes out in '{unit}', expected {' or '.join(ROLES[name].units)}. Look at "
            "the units of the columns and at 'derivative_of'."
        )


def _turning(recipe: Recipe, units: Mapping[str, str]) -> bool:
    """Whether the body turns, all signals alike."""
    unit_of = {name: _unit_of(recipe, name, units) for name in recipe.signals if name not in (TIME, WEIGHT, FRICTION)}
    turning = {name: unit.startswith(("rad", "N m")) for name, unit in unit_of.items() if name in ROLES}
    if len(set(turning.values())) > 1:
        listing = ", ".join(f"{name} in {unit_of[name]}" for name in turning)
        raise StickslipError(
            f"{recipe.name}: the signals are of a body that slides and of one that turns ({listing}). Give lengths "
            "with forces, or angles with torques; a gain with its 'gain_unit' converts."
        )
    return any(turning.values())


def _step(recipe: Recipe, table: Table, time: np.ndarray) -> float:
    """Sample interval, s."""
    if len(time) < LEAST:
        raise StickslipError(f"{table.source} is too short: {len(time)} samples. Record a longer log.")
    steps = np.diff(time)
    falls = np.flatnonzero(steps <= 0)
    if falls.size:
        raise StickslipError(
            f"{table.source}: time does not rise at {table.place(int(falls[0]) + 1)} ({time[falls[0]]:.9g} s, then "
            f"{time[falls[0] + 1]:.9g} s; {falls.size} such). Sort the rows, drop doubled ones, or split the log there."
        )
    step = float(np.median(steps))
    rate = recipe.sampling.rate
    if rate is None:
        return step
    if abs(rate * step - 1) > RATE_SUSPECT:
        raise StickslipError(
            f"{table.source} is sampled at {1 / step:.4g} Hz, but recipe {recipe.name} says {rate:g} Hz. Correct "
            "'rate', or leave it out to use the stamps."
        )
    return 1 / rate
