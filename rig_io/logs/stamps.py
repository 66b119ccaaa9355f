"""Date and time as recorders write them, as seconds: ISO, 31.12.2025, 12/31/2025, a time of day, or two of these cells.

A time of day that falls by half a day or more has passed midnight. Stamps that state a zone are counted in UTC.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError

if TYPE_CHECKING:
    from pandas import Series

DAY = 86400.0  # s
NANO = 1e-9  # s

_CLOCK = r"\d{1,2}:\d\d(:\d\d([.,]\d{1,9})?)?( ?[AP]M)?"
_DATE = r"(\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[./-]\d{1,2}[./-]\d{4})"
_ZONE = r"( ?(Z|UTC|[+-]\d\d:?\d\d))?"
_KINDS = {
    "date and time": re.compile(rf"{_DATE}[T ]\s*{_CLOCK}{_ZONE}", re.IGNORECASE),
    "date": re.compile(_DATE),
    "time of day": re.compile(_CLOCK, re.IGNORECASE),
}
ORDERS = ("day", "month")


def kinds_of(cells: Sequence[str]) -> list[str | None]:
    """Each cell's kind: "date and time", "date", "time of day", or None where it is no stamp."""
    return [next((k for k, pattern in _KINDS.items() if pattern.fullmatch(cell.strip())), None) for cell in cells]


def instants(cells: Series, kind: str, first: str) -> tuple[np.ndarray, bool]:
    """Nanoseconds (n,) int64 since 1970, or since midnight for a time of day; and whether a zone is stated.

    first: "day" or "month", which of them stands first where the year stands last. A cell that is no stamp becomes
    `MISSING`.

    Raises:
        StickslipError: some state a zone and some do not.
    """
    import pandas

    text = cells.astype("string").str.strip().str.replace(",", ".", regex=False)
    zoned = text.str.contains(r"(?:Z|UTC|[+-]\d\d:?\d\d)$", case=False, regex=True).fillna(False).to_numpy(dtype=bool)
    filled = text.notna().to_numpy() & (text != "").fillna(False).to_numpy(dtype=bool)
    any_zone = kind == "date and time" and bool(zoned.any())
    if any_zone and not zoned[filled].all():
        row = int(np.flatnonzero(filled & ~zoned)[0])
        raise StickslipError(f"a stamp without a time zone, '{cells.iloc[row]}', among stamps with one")
    if kind == "time of day":
        text = "1970-01-01 " + text
        first = "month"
    sample = next((cell for cell in text[filled]), "")
    times = pandas.to_datetime(text, format=_format(str(sample), first), errors="coerce", utc=True)
    return times.to_numpy(dtype="datetime64[ns]").astype(np.int64), any_zone


MISSING = np.iinfo(np.int64).min  # what pandas makes of no time


def _format(cell: str, first: str) -> str:
    """The format of a stamp, by one of them."""
    if re.match(r"\d{4}-", cell) and not re.search(r"[AP]M$|:\d\d ?UTC$", cell, re.IGNORECASE):
        return "ISO8601"
    mark = re.search(r"[-/.]", cell)
    between = mark[0] if mark else "."
    year_first = re.match(r"\d{4}", cell)
    fields = ("%Y", "%m", "%d") if year_first else ("%d", "%m", "%Y") if first == "day" else ("%m", "%d", "%Y")
    pattern = between.join(fields)
    if ":" not in cell:
        return pattern
    half = re.search(r" ?[AP]M$", cell, re.IGNORECASE)
    pattern += ("T" if "T" in cell[:12] else " ") + ("%I" if half else "%H") + ":%M"
    pattern += ":%S" if cell.count(":") > 1 else ""
    pattern += ".%f" if re.search(r":\d\d\.\d", cell) else ""
    if half:
        return pattern + (" %p" if half[0].startswith(" ") else "%p")
    return pattern + (
        " %Z" if cell.upper().endswith(" UTC") else "%z" if re.search(r"(Z|[+-]\d\d:?\d\d)$", cell) else ""
    )


def order_of(cells: list[str]) -> str | None:
    """Which stands first where the year stands last, "day" or "month"; None where the cells do not tell.

    With points or hyphens it is the day; with strokes a number beyond twelve decides.
    """
    for cell in cells:
        match = re.match(r"(\d{1,2})([./-])(\d{1,2})[./-]\d{4}", cell.strip())
        if not match:
            continue
        if match[2] != "/" or int(match[1]) > 12:
            return "day"
        if int(match[3]) > 12:
            return "month"
    return None


def seconds(nanoseconds: np.ndarray, kind: str, zoned: bool) -> tuple[np.ndarray, datetime | None]:
    """Seconds (n,) from the midnight before the first stamp, NaN where there is none; and what instant that is."""
    good = nanoseconds != MISSING
    if not good.any():
        return np.full(len(nanoseconds), np.nan), None
    origin = int(nanoseconds[good][0] // int(DAY / NANO) * int(DAY / NANO))
    time = np.where(good, (nanoseconds - origin) * NANO, np.nan)
    if kind == "time of day":
        return past_midnight(time), None
    return time, datetime.fromtimestamp(origin * NANO, UTC).replace(tzinfo=UTC if zoned else None)


def past_midnight(time: np.ndarray) -> np.ndarray:
    """Seconds of the day (n,) that go on after midnight."""
    finite = np.isfinite(time)
    steps = np.diff(time[finite], prepend=time[finite][:1])
    later = time.copy()
    later[finite] += DAY * (np.cumsum(steps < -DAY / 2) - np.cumsum(steps > DAY / 2))
    return later
