"""A measured series: one column of a log at even steps of time, ready for the analyses of this room."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from identification.hysteresis.read import columns_by_role, numbers_by_role
from rig_io.logs.table import Table
from rig_io.readers import read_table

TIME = {"time": r"t(ime)?|zeit"}
FEWEST = 200  # samples, below which nothing of this room says anything
UNEVEN = 0.02  # of the step, by which steps may differ before a series is resampled
GAP = 5.0  # steps that are missing at once, which interpolation would invent


@dataclass(frozen=True, eq=False)
class Series:
    """values: (n,) at steps of ``step`` ("s" where the log has times, else samples); notes: what was done to it."""

    name: str
    values: np.ndarray
    step: float
    unit: str = "s"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.values.ndim != 1 or len(self.values) < FEWEST:
            raise StickslipError(
                f"{self.name}: a series is an array (n,) of at least {FEWEST} values, found {self.values.shape}."
            )
        if not np.all(np.isfinite(self.values)):
            raise StickslipError(f"{self.name}: some values are no finite numbers. Leave them out, or cut the series.")
        if not self.step > 0:
            raise StickslipError(f"{self.name}: the step between samples is {self.step:g}; it must be positive.")
        if np.ptp(self.values) <= 1e-12 * np.max(np.abs(self.values)):
            raise StickslipError(f"{self.name} never changes. Name another column.")

    def part(self, first: int, last: int | None = None) -> "Series":
        """Some of its samples."""
        return Series(self.name, self.values[first:last], self.step, self.unit)


def read_series(
    path: str | Path,
    columns: Sequence[str] = (),
    *,
    time: str | None = None,
    rate: float | None = None,
    reader: str | None = None,
) -> list[Series]:
    """Series from a log of any kind. columns: a series each, by default all but the time; time: the column of the times
    (s, or what the file states), where its name does not tell; rate: samples a second of a log without times.
    StickslipError: a file or column that cannot be read, gaps, or too few samples."""
    table = read_table(path, reader)
    for column in columns:
        refuse_unknown(column, table.columns, f"{table.source} has no column '{column}'.")
    others = [name for name in table.columns if name not in columns] if columns else list(table.columns)
    by_role = columns_by_role(table, {"time": time} if time else {}, TIME if not rate else {}, (), {})
    clock = by_role.get("time")
    clock = clock if clock in others else None
    chosen = list(columns) or [name for name in table.columns if name != clock]
    return [_series(table, name, clock, rate) for name in chosen]


def _series(table: Table, column: str, clock: str | None, rate: float | None) -> Series:
    """One column, resampled where its times ask for it."""
    name, notes = f"{Path(table.source.strip(chr(39))).name}: {column}", []
    if clock is None:
        values = np.asarray(table.columns[column], dtype=float)
        if not rate:
            notes.append("No column of times: a sample counts as one step (say --rate, or --time COLUMN).")
        return Series(name, values[np.isfinite(values)], 1 / rate if rate else 1.0, "s" if rate else "1", tuple(notes))
    scaled, _ = numbers_by_role(table, {"time": clock, "value": column}, {"value": "1"}, {"time": "s", "value": "1"})
    times, values = scaled["time"], scaled["value"]
    if len(times) < FEWEST:
        raise StickslipError(f"{name}: {len(times)} rows hold numbers; a series needs {FEWEST}.")
    steps = np.diff(times)
    step = float(np.median(steps))
    if (worst := float(steps.max())) > GAP * step:
        at = times[int(np.argmax(steps))]
        raise StickslipError(
            f"{name}: after {at:.6g} s {worst / step - 1:.0f} samples are missing, which interpolation would invent. "
            "Cut the log there and analyse its parts."
        )
    if np.max(np.abs(steps - step)) > UNEVEN * step:
        even = np.arange(times[0], times[-1], step)
        values = np.interp(even, times, values)
        notes.append(f"Its steps differ ({steps.min():.4g} to {worst:.4g} s): resampled to {step:.4g} s.")
    return Series(name, values, step, "s", tuple(notes))
