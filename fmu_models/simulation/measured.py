"""Columns of a log, as what an input or a run is measured by; the reader of logs is found by its name."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.registry import Registry
from fmu_models.base.shown import Shown, span
from fmu_models.base.unit_names import conversion
from fmu_models.simulation.signal import Signal

ROLES = ("input", "measured", "event")  # of a column for a model
IDEAL = {"gain": 1.0, "offset": 0.0, "delay": 0.0}  # constants of a sensor that shows what is


@dataclass(frozen=True)
class SensorConstant:
    """value, and its standard deviation: 0 where it is held, infinite where it is to be found."""

    value: float
    deviation: float = 0.0


@dataclass(frozen=True)
class Instrument:
    """How a column was measured, as far as anybody says. role: one of `ROLES`, "" of a column that is not to be read;
    noise: standard deviation; constants: of `IDEAL`, by name; clip: least and greatest reading. Noise, offset and clip
    in the unit of the column, delay in s."""

    role: str | None = None
    noise: float | None = None
    constants: Mapping[str, SensorConstant] = field(default_factory=dict)
    clip: tuple[float, float] | None = None

    def scaled(self, factor: float) -> Instrument:
        """In another unit, of which the column's is ``factor``."""
        constants = dict(self.constants)
        if offset := constants.get("offset"):
            constants["offset"] = SensorConstant(factor * offset.value, abs(factor) * offset.deviation)
        low, high = sorted(factor * end for end in self.clip or (0.0, 0.0))
        noise = None if self.noise is None else abs(factor) * self.noise
        return Instrument(self.role, noise, constants, (low, high) if self.clip else None)


UNSTATED = Instrument()


@dataclass(frozen=True, eq=False)
class MeasuredLog(Shown):
    """Columns of a log over time.

    Attributes:
        source: the file, for messages.
        time: (n,) s, ascending; a time that stands twice is a jump.
        columns: per column (n,) in its own unit, NaN where the log has no number.
        units: of those columns whose unit is stated.
        stepwise: columns whose values hold until the next sample; the others are straight lines between samples.
        variables: per column the variable of a model that it measures, where that has another name.
        instruments: per column how it was measured, where anything is said of that.
        locate: where a row stands in the file, for messages.
    """

    source: str
    time: Vector
    columns: Mapping[str, Vector]
    units: Mapping[str, str] = field(default_factory=dict)
    stepwise: frozenset[str] = frozenset()
    variables: Mapping[str, str] = field(default_factory=dict)
    instruments: Mapping[str, Instrument] = field(default_factory=dict)
    locate: Callable[[int], str] = "row {}".format

    def _heading(self) -> str:
        return f"{self.source}: {self.time.size} samples from {self.time[0]:g} to {self.time[-1]:g} s"

    def _contents(self) -> Mapping[str, object]:
        return {name: span(values, self.units.get(name, "")) for name, values in self.columns.items()}

    @cached_property
    def by_variable(self) -> dict[str, str]:
        """The column that measures a variable, by its name."""
        return {self.variables.get(column, column): column for column in self.columns}

    def values(self, column: str, unit: str | None, purpose: str) -> Vector:
        """A column (n,) in a unit; as it is where that or its own is not stated. StickslipError: no such column, or a
        unit that cannot be converted; says for which ``purpose``."""
        name = column if column in self.columns else self.by_variable.get(column)
        if name is None:
            raise StickslipError(
                f"{self.source} has no column '{column}', wanted for {purpose}.{nearest(column, self.columns)}"
            )
        return in_unit(self.columns[name], self.units.get(name), unit, f"{self.source}: column '{name}' for {purpose}")

    def signal(self, column: str, unit: str | None, purpose: str) -> Signal:
        """A column as an input. StickslipError: as for `values`; or samples of it are missing."""
        values = self.values(column, unit, purpose)
        missing = np.flatnonzero(~np.isfinite(values))
        if missing.size:
            raise StickslipError(
                f"{self.source}: column '{column}' holds no number on {self.locate(int(missing[0]))} "
                f"({missing.size} times), and {purpose} needs one at all times. Fill or cut these rows."
            )
        holds = self.by_variable.get(column, column) in self.stepwise
        return Signal.held(self.time, values) if holds else Signal(self.time, values)


def in_unit(values: Vector, stated_unit: str | None, unit: str | None, where: str) -> Vector:
    """Values (n,) in a unit; as they are where that or the stated one is not known. StickslipError: one cannot be
    converted to the other; begins with ``where``."""
    return values * conversion(stated_unit, unit, where) if stated_unit and unit and stated_unit != unit else values


LOGS: Registry[Callable[[Path], MeasuredLog]] = Registry(
    kind="reader of logs", package="rig_io.packages", attribute="READ_MEASURED", group="stickslip.logs"
)


def read_measured(path: str | os.PathLike[str]) -> MeasuredLog:
    """Every column of a log of any kind over its time, as its ``datapackage.json`` describes them where there is one.
    StickslipError: no such file, no column of times, or times that run back."""
    return LOGS.load("measured")(Path(path))


def column_of_log(text: str, folder: Path | None = None) -> tuple[Path, str]:
    """File and column of ``LOG:COLUMN``; a relative file is in ``folder``, or the working folder. StickslipError:
    another form."""
    places = [i for i, letter in enumerate(text) if letter == ":"]
    halves = [(text[:i], text[i + 1 :].strip()) for i in places]
    pairs = [(Path(folder or "") / path, column) for path, column in halves if path and column]
    if not pairs:
        raise StickslipError(f"A column of a log is LOG:COLUMN, such as speed.csv:w; found '{text}'.")
    # a drive of Windows and the name of a column may hold a colon too
    return next((pair for pair in pairs if pair[0].is_file()), pairs[-1])
