"""Recipe for the log of a machine: which columns it has, how they are filtered and differentiated.

A recipe is a TOML file without data; the log is named beside it. Every signal is a column (times a gain) or the
derivative of another signal, then perhaps filtered. What is to be found in them stands in tables that others read:
[terms] and [friction] (machines.axis), [slips] (slips.statistics). The keys of each table are a mapping beside
its reader, to what the reference of the manual says of them.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmu_models.base import shipped
from fmu_models.base.errors import nearest
from fmu_models.base.files import named_file
from fmu_models.base.toml_document import Document, read_document

SUFFIX = ".toml"
TIME = "time"
POSITION, VELOCITY, ACCELERATION, EFFORT, WEIGHT = "position", "velocity", "acceleration", "effort", "weight"
FRICTION = "friction"
KEYS = {
    "title": "what it is; needed",
    "source": "where the log comes from",
    "signals": "the signals, each a table by its name, `[signals.position]`",
    "sampling": "which samples are used",
    "terms": "the terms of the effort, for `stickslip inverse`",
    "friction": "friction laws to be compared",
    "slips": "what is known of the slider, for `stickslip slips`",
}
SIGNAL_KEYS = {
    "column": "of the log",
    "unit": "of the column; one that the log states counts instead",
    "gain": "that the column is multiplied by: a number, or the name of a single number in the log; 1 if left out",
    "gain_unit": "of the gain, such as `N/V`; 1 if left out",
    "derivative_of": "the name of another signal, in place of `column`",
    "derivative": "how many times it is differentiated, once if left out",
    "savitzky_golay": "how; by central differences if left out",
    "filter": "low-pass that the signal goes through at last; none if left out",
}
FILTER_KEYS = {
    "order": "of the Butterworth low-pass, which runs forward and backward; 4 if left out",
    "cutoff": 'needed: Hz, `"100 Hz"`, or a share of the Nyquist frequency, `"0.2 Nyquist"`',
    "padding": "samples by which the ends are reflected before; 3 per order if left out",
}
SAVITZKY_GOLAY_KEYS = {
    "order": "of the local polynomial, 3 if left out",
    "window": 'needed: that it is fitted over, s or `"20 ms"`',
}
SAMPLING_KEYS = {
    "rate": "of the clock, Hz; the stamps count if left out",
    "drop": "samples left out at the begin, where filters and derivatives have an edge; none if left out",
    "drop_end": "the same at the end, for a log that ends in motion; none if left out",
    "decimate": "one sample in so many is kept, counted back from the last, behind a Chebyshev low-pass of order 8 "
    "that runs forward and backward; every one if left out",
    "least_speed": 'slower samples are left out: m/s or rad/s, `"3 deg/s"`; none if left out',
}


@dataclass(frozen=True)
class Role:
    """What a signal of a known name must be measured in, of a body that slides or turns, and what it is."""

    units: tuple[str, ...]
    meaning: str


ROLES: Mapping[str, Role] = {
    TIME: Role(("s",), "of the samples; needed"),
    POSITION: Role(("m", "rad"), "of the body"),
    VELOCITY: Role(("m/s", "rad/s"), "of the body"),
    ACCELERATION: Role(("m/s2", "rad/s2"), "of the body"),
    EFFORT: Role(("N", "N m"), "force or torque that drives it"),
    WEIGHT: Role(("1",), "that a sample has in the fit; 1 if left out"),
    FRICTION: Role(("1",), "friction force over weight, for `stickslip slips`"),
}
# left out, these are central differences of the signal before
IMPLIED = {VELOCITY: POSITION, ACCELERATION: VELOCITY}
TASKS = ("terms", "slips")  # tables that say what is to be found


@dataclass(frozen=True)
class Speed:
    """A speed as a recipe gives it; unit: m/s or rad/s, None for a plain number, which is in that of the body."""

    value: float
    unit: str | None = None

    def fits(self, turning: bool) -> bool:
        """Whether the speed is one of a body that turns (or slides)."""
        return self.unit in (None, "rad/s" if turning else "m/s")


NO_SPEED = Speed(0.0)


@dataclass(frozen=True)
class Filter:
    """Butterworth low-pass, forward and backward. cutoff: Hz, or a share of the Nyquist frequency where ``relative``;
    padding: samples by which the ends are reflected before filtering."""

    order: int
    cutoff: float
    relative: bool
    padding: int


@dataclass(frozen=True)
class SavitzkyGolay:
    """Local polynomial of an order over a window, s."""

    order: int
    window: float


@dataclass(frozen=True)
class RecipeSignal:
    """One signal: a ``column`` in ``unit`` times ``gain`` (a number or a single number of the file, in ``gain_unit``),
    or the ``derivative``-th derivative of the signal ``of``; filtered at last."""

    name: str
    column: str | None
    unit: str | None
    gain: float | str
    gain_unit: str
    of: str | None
    derivative: int
    savitzky_golay: SavitzkyGolay | None
    filter: Filter | None


@dataclass(frozen=True)
class Sampling:
    """rate: Hz of the clock, None to take the stamps as they are; drop, drop_end: samples left out at the begin and at
    the end (edges of the filters); decimate: one sample in so many is kept; least_speed: slower samples are left
    out."""

    rate: float | None = None
    drop: int = 0
    drop_end: int = 0
    decimate: int = 1
    least_speed: Speed = NO_SPEED


@dataclass(frozen=True)
class Recipe:
    """A recipe as read. document: of the file, for those who read its other tables."""

    document: Document
    title: str
    source: str
    signals: Mapping[str, RecipeSignal]
    sampling: Sampling

    @property
    def name(self) -> str:
        """Name of the recipe's file."""
        return self.document.path.name


def read_recipe(path: str | os.PathLike[str]) -> Recipe:
    """Read a recipe: a TOML file, or the name of one that comes along.

    Raises:
        StickslipError: no such file, or what is wrong in it, with its line.
    """
    document = read_document(named_file(path, recipes(), "recipe"))
    document.check_keys(KEYS)
    names = document.table("signals")
    signals = {name: _signal(document, name, names) for name in names}
    for name, of in IMPLIED.items():
        if name not in signals and of in signals:
            signals[name] = RecipeSignal(name, None, None, 1.0, "1", of, 1, None, None)
    if TIME not in signals:
        raise document.fault("there is no signal 'time'. Add [signals.time] with its column and unit.", "signals")
    for name in signals:
        _refuse_circle(document, signals, name)
    if not any(task in document.data for task in TASKS):
        raise document.fault("it has neither [terms] for inverse dynamics nor [slips] for slip statistics. Add one.")
    title, source = document.text("title"), document.text("source", default="")
    return Recipe(document, title, source, signals, _sampling(document))


def recipes() -> list[Path]:
    """The recipes that come along."""
    return shipped.files("recipes", SUFFIX)


def _signal(document: Document, name: str, names: Mapping[str, Any]) -> RecipeSignal:
    keys = ("signals", name)
    document.check_keys(SIGNAL_KEYS, *keys)
    table = document.table(*keys)
    if ("column" in table) == ("derivative_of" in table):
        raise document.fault(f"signal '{name}' needs either 'column' (with 'unit') or 'derivative_of'.", *keys)
    of = document.text("derivative_of", *keys) if "derivative_of" in table else None
    signals = (*names, *(implied for implied, source in IMPLIED.items() if source in names))
    if of is not None and of not in signals:
        raise document.fault(f"there is no signal '{of}'.{nearest(of, signals)}", *keys, "derivative_of")
    for key in ("derivative", "savitzky_golay") if of is None else ("unit", "gain", "gain_unit"):
        if key in table:
            kind = "a column" if of is None else "a derivative"
            raise document.fault(f"'{key}' says nothing of {kind}. Leave it out of signal '{name}'.", *keys, key)
    gain = table.get("gain", 1.0)
    if isinstance(gain, bool) or not isinstance(gain, int | float | str):
        raise document.fault(
            f"'gain' must be a number, or the name of a single number in the log, found {gain!r}.", *keys, "gain"
        )
    return RecipeSignal(
        name,
        document.text("column", *keys) if of is None else None,
        document.text("unit", *keys) if of is None else None,
        gain if isinstance(gain, str) else float(gain),
        document.text("gain_unit", *keys, default="1"),
        of,
        document.count("derivative", 1, 1, *keys),
        _savitzky_golay(document, *keys, "savitzky_golay") if "savitzky_golay" in table else None,
        _filter(document, *keys, "filter") if "filter" in table else None,
    )


def _filter(document: Document, *keys: str) -> Filter:
    document.check_keys(FILTER_KEYS, *keys)
    table = document.table(*keys)
    if "cutoff" not in table:
        raise document.fault('a filter needs "cutoff", such as "100 Hz" or "0.2 Nyquist".', *keys)
    order = document.count("order", 4, 1, *keys)
    raw = table["cutoff"]
    relative = isinstance(raw, str) and raw.strip().lower().endswith("nyquist")
    if relative:
        raw = raw.strip()[: -len("nyquist")].strip()
    cutoff = document.value(raw, "1" if relative else "Hz", *keys, "cutoff")
    if cutoff <= 0 or (relative and cutoff >= 1):
        raise document.fault(
            "'cutoff' must lie above 0 and below the Nyquist frequency (half the sampling rate).", *keys, "cutoff"
        )
    return Filter(order, cutoff, relative, document.count("padding", 3 * order, 0, *keys))


def _savitzky_golay(document: Document, *keys: str) -> SavitzkyGolay:
    document.check_keys(SAVITZKY_GOLAY_KEYS, *keys)
    table = document.table(*keys)
    if "window" not in table:
        raise document.fault('savitzky_golay needs "window", such as "20 ms".', *keys)
    window = document.value(table["window"], "s", *keys, "window")
    if window <= 0:
        raise document.fault("'window' must be a time above 0.", *keys, "window")
    return SavitzkyGolay(document.count("order", 3, 1, *keys), window)


def _refuse_circle(document: Document, signals: Mapping[str, RecipeSignal], name: str) -> None:
    seen = [name]
    while (of := signals[seen[-1]].of) is not None:
        if of in seen:
            raise document.fault(
                f"the signals {' -> '.join([*seen, of])} are derivatives of one another. One of them must be a column.",
                "signals",
                name,
            )
        seen.append(of)


def _sampling(document: Document) -> Sampling:
    document.check_keys(SAMPLING_KEYS, "sampling")
    table = document.table("sampling")
    rate = document.value(table["rate"], "Hz", "sampling", "rate") if "rate" in table else None
    if rate is not None and rate <= 0:
        raise document.fault("'rate' must be above 0 Hz.", "sampling", "rate")
    return Sampling(
        rate,
        document.count("drop", 0, 0, "sampling"),
        document.count("drop_end", 0, 0, "sampling"),
        document.count("decimate", 1, 1, "sampling"),
        speed(document, table.get("least_speed", 0.0), "sampling", "least_speed"),
    )


def speed(document: Document, raw: object, *keys: str) -> Speed:
    """A speed. The recipe alone does not say whether the body slides or turns: the text's own unit is kept."""
    if not isinstance(raw, str):
        return Speed(document.value(raw, "m/s", *keys))
    unit = "rad/s" if any(word in raw for word in ("rad", "deg", "rpm", "turn")) else "m/s"
    return Speed(document.value(raw, unit, *keys), unit)
