"""What the numbers of a column say of its role: a clock, a counter that goes to and fro or runs on, a laser, a drive.

The evidence for a role is a number from 0 to 1 with a reason; 0 forbids it, whatever the name says.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import scale_of
from rig_io.logs.columns import COLUMNS
from rig_io.logs.stamps import DAY
from rig_io.repair.counters import unwrapped
from rig_io.repair.plausible import FASTEST_CLOCK, SLOWEST_CLOCK

SAMPLE = 200_000  # rows that are looked at
STEADY = 0.05  # of the mean: a drive's speed stays as near to it
DEGREES = (("degC", -30.0, 150.0), ("K", 230.0, 450.0))  # what temperatures of a rig are in, by their size
SWINGS = 3  # turns back that a movement must show


@dataclass(frozen=True)
class RoleEvidence:
    """For one role: weight (0 forbids it), the unit that the numbers look like (None: not to be told), reason."""

    weight: float
    reason: str
    unit: str | None = None


@dataclass(frozen=True, eq=False)
class Features:
    """Numbers of one column. value: (n,) those that are there; whole: all are whole; rising: share of steps that rise
    or stay; step: median rise; even: steps are alike; span: of the values; level: least distance of two values;
    turns: times that the movement turns back; steady: standard deviation over the mean."""

    value: np.ndarray
    whole: bool
    rising: float
    strict: bool
    step: float
    even: bool
    span: float
    level: float
    turns: int
    steady: float


def features(values: np.ndarray) -> Features | None:
    """Features of a column (n,); None where it holds hardly a number."""
    value = values[:SAMPLE]
    value = value[np.isfinite(value)]
    if len(value) < 10 or len(value) < 0.2 * min(len(values), SAMPLE):
        return None
    integral = bool(np.all(value == np.round(value)) and np.abs(value).max() < 2**53)
    if integral:
        value, _, _ = unwrapped(value, None)
    steps = np.diff(value)
    span = float(np.ptp(value))
    rises = steps[steps > 0]
    step = float(np.median(rises)) if len(rises) else 0.0
    different = np.diff(np.unique(value))
    level = float(different.min()) if len(different) else 0.0
    reach = max(len(value) // 2000, 1)
    smooth = value[: len(value) // reach * reach].reshape(-1, reach).mean(axis=1)
    band = 0.05 * span
    mean = abs(float(value.mean()))
    return Features(
        value,
        integral,
        float(np.mean(steps >= 0)),
        bool(np.all(steps > 0)),
        step,
        bool(len(rises) > 0.9 * len(steps) and np.quantile(np.abs(steps - np.median(steps)), 0.9) <= 0.5 * step),
        span,
        level,
        _turns(smooth, band),
        float(value.std()) / mean if mean > 0 else np.inf,
    )


def _turns(value: np.ndarray, band: float) -> int:
    """Times that a movement turns back by more than a band."""
    turns, rising, extreme = 0, bool(value[-1] > value[0]), value[0]
    for sample in value:
        if (sample < extreme - band) if rising else (sample > extreme + band):
            turns, rising, extreme = turns + 1, not rising, sample
        elif (sample > extreme) == rising:
            extreme = sample
    return turns


def evidence(content: Features | None, unit: str | None, stamp: bool) -> Mapping[str, RoleEvidence]:
    """For each role, what the numbers say for or against it. unit: as the file states it; stamp: a date or time."""
    if stamp:
        return {"time": RoleEvidence(0.97, "holds dates or times of day", "s")}
    if content is None:
        return dict.fromkeys(COLUMNS, RoleEvidence(0.0, "holds hardly a number"))
    return {
        "time": _time(content, unit),
        "encoder_count": _encoder(content),
        **dict.fromkeys(("drive0_count", "drive1_count"), _drive_count(content)),
        **dict.fromkeys(("drive0_speed", "drive1_speed"), _drive_speed(content, unit)),
        **dict.fromkeys(("encoder_edge_time", "drive0_edge_time", "drive1_edge_time"), _edge_time(content)),
        "laser": _laser(content, unit),
        "angle": _angle(content, unit),
        "tachometer": _body_speed(content, unit, "rad/s"),
        "vibrometer": _body_speed(content, unit, "m/s"),
        **dict.fromkeys(("load0", "load1"), _load(content, unit)),
        "temperature": _temperature(content, unit),
        "trigger": _trigger(content),
    }


def _has(unit: str | None, *dimension: str) -> bool | None:
    """Whether a stated unit can be converted to one of others; None where none is stated."""
    if unit is None or unit in ("", "1", "-"):
        return None
    import pint

    from fmu_models.base.unit_names import parse_unit

    try:
        return any(parse_unit(unit).check(parse_unit(kind).dimensionality) for kind in dimension)
    except (ValueError, pint.PintError):
        return None


def _time(f: Features, unit: str | None) -> RoleEvidence:
    if _has(unit, "s") is False:
        return RoleEvidence(0.0, f"is in {unit}")
    if f.rising < 0.999 or not f.step:
        return RoleEvidence(0.0, "does not rise")
    if f.whole and f.step == 1 and f.even and unit is None:
        return RoleEvidence(0.3, "counts rows or milliseconds", "ms")
    guess = unit
    if guess is None:
        if 20_000 < f.value[0] < 1_000_000 and f.step < SLOWEST_CLOCK / DAY:
            guess = "d"  # days since 1900 (Excel) or since the year 0 (MATLAB)
        elif FASTEST_CLOCK <= f.step <= 0.1:
            guess = "s"
        elif f.step < 1e3 * SLOWEST_CLOCK and f.span > 100:
            guess = "ms" if f.step <= 100 else "us"
    if f.strict and f.even:
        return RoleEvidence(0.8, "rises by even steps", guess)
    return RoleEvidence(0.6 if f.strict else 0.4, "rises throughout", guess)


def _encoder(f: Features) -> RoleEvidence:
    if not f.whole:
        return RoleEvidence(0.0, "holds fractions")
    if f.turns >= SWINGS and f.span >= 4:
        return RoleEvidence(0.75, "whole numbers that go to and fro")
    return RoleEvidence(0.1 if f.span else 0.0, "whole numbers that do not go to and fro")


def _drive_count(f: Features) -> RoleEvidence:
    if not f.whole:
        return RoleEvidence(0.0, "holds fractions")
    one_way = max(f.rising, float(np.mean(np.diff(f.value) <= 0)))
    if f.span >= 20 and one_way > 0.98 and f.turns == 0 and not (f.even and f.step == 1):
        return RoleEvidence(0.75, "whole numbers that run on in one direction")
    if not f.span:
        return RoleEvidence(0.2, "a count that stands still")
    return RoleEvidence(0.05, "whole numbers that do not run on")


def _drive_speed(f: Features, unit: str | None) -> RoleEvidence:
    fits = _has(unit, "rad/s", "rpm")
    if fits is False:
        return RoleEvidence(0.0, f"is in {unit}")
    if f.steady < STEADY and f.span > 0:
        return RoleEvidence(0.7 if fits else 0.4, "stays near one value", None)
    return RoleEvidence(0.4 if fits else 0.1, "a speed by its unit" if fits else "changes", None)


def _edge_time(f: Features) -> RoleEvidence:
    if f.rising < 0.999 or f.whole:
        return RoleEvidence(0.0, "is no time that stays and leaps")
    repeated = float(np.mean(np.diff(f.value) == 0))
    return RoleEvidence(0.6 if repeated > 0.05 else 0.3, "a time that stays between edges")


def _laser(f: Features, unit: str | None) -> RoleEvidence:
    fits = _has(unit, "V", "m")
    if fits is False:
        return RoleEvidence(0.0, f"is in {unit}")
    if f.turns < SWINGS:
        return RoleEvidence(0.15, "does not swing")
    if f.whole and unit is None:
        return RoleEvidence(0.2, "whole numbers, perhaps counts")
    guess = unit or ("V" if np.abs(f.value).max() <= 10.5 else None)
    return RoleEvidence(0.65 if fits else 0.62 if guess else 0.5, f"swings by {f.span:.3g} {unit or ''}".strip(), guess)


def _angle(f: Features, unit: str | None) -> RoleEvidence:
    fits = _has(unit, "rad")
    if fits is False or (unit is not None and fits is None):
        return RoleEvidence(0.0, f"is in {unit}")
    if f.turns < SWINGS or f.whole:
        return RoleEvidence(0.1, "does not swing")
    return RoleEvidence(0.65 if fits else 0.2, f"swings by {f.span:.3g} {unit or ''}".strip())


def _body_speed(f: Features, unit: str | None, role_unit: str) -> RoleEvidence:
    fits = _has(unit, role_unit)
    if fits is False or f.whole:
        return RoleEvidence(0.0, f"is in {unit}" if fits is False else "whole numbers, perhaps counts")
    if f.turns < SWINGS:
        return RoleEvidence(0.1, "does not swing")
    return RoleEvidence(0.6 if fits else 0.1, "a speed by its unit" if fits else "swings", unit)


def _load(f: Features, unit: str | None) -> RoleEvidence:
    fits = _has(unit, "N", "kg")
    if fits is False:
        return RoleEvidence(0.0, f"is in {unit}")
    return RoleEvidence(0.6 if fits else 0.1, "a force by its unit" if fits else "could be anything", unit)


def _temperature(f: Features, unit: str | None) -> RoleEvidence:
    middle = float(np.median(f.value))
    if unit is None or unit in ("", "1", "-"):
        guess = next((name for name, low, high in DEGREES if low < middle < high), None)
        return RoleEvidence(0.2 if guess else 0.1, f"is about {middle:.3g}", guess)
    try:
        scale_of(unit, "K", "")
    except StickslipError:
        return RoleEvidence(0.0, f"is in {unit}")
    return RoleEvidence(0.8, "a temperature by its unit", unit)


def _trigger(f: Features) -> RoleEvidence:
    two = len(np.unique(f.value[:: max(len(f.value) // 5000, 1)])) <= 2 and f.span > 0
    return RoleEvidence(0.3 if two else 0.0, "two values" if two else "more than two values")
