"""Runs of a sweep by the master: what is asked, and what comes of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import request
from fmu_models.importer.motion_error import RUN
from fmu_models.simulation.run import bounds_of


@dataclass(frozen=True, eq=False)
class Sweep(Shown):
    """Runs of a sweep: per variable (runs, times), and why runs ended early, by the number of the run."""

    time: NDArray[np.float64]
    values: Mapping[str, NDArray[np.float64]]
    failures: Mapping[int, str]

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        refuse_unknown(name, self.values, f"The sweep has no variable '{name}'.")
        return self.values[name]


class Batch:
    """Runs over the same times with the same inputs, as `Driver.batch` prepares them.

    times: (n,) s; names: of the values that a run begins with; recorded: of those it tells, of which the first
    ``states`` are states; prepared: the request; call: makes the run of it; reason: of one that ended early.
    """

    def __init__(
        self,
        fmu: Fmu,
        names: tuple[str, ...],
        times: NDArray[np.float64],
        recorded: tuple[str, ...],
        states: int,
        prepared: Any,
        call: Callable[[Any], int],
        reason: Callable[[int, Any], str],
    ) -> None:
        self.times, self.names, self.recorded = times, names, recorded
        self._fmu, self._states = fmu, states
        self._prepared, self._call, self._reason = prepared, call, reason
        self._low, self._high = np.array([bounds_of(fmu.variables[owner(name, fmu.variables)]) for name in names]).T

    def runs(
        self, rows: NDArray[np.float64], progress: Callable[[float], None] | None = None
    ) -> tuple[NDArray[np.float64], dict[int, str]]:
        """(runs, n, k) of what is recorded in a run for each of ``rows`` (runs, names), and why runs ended early.

        Raises:
            StickslipError: a value out of range.
        """
        if not ((rows >= self._low) & (rows <= self._high)).all():
            columns_of(self._fmu, dict(zip(self.names, rows.T, strict=True)))
        rows, c, n, k = np.ascontiguousarray(rows), self._prepared.c, self._states, len(self.recorded)
        states, values = np.empty((len(rows), len(self.times), n)), np.empty((len(rows), len(self.times), k - n))
        failures: dict[int, str] = {}
        pointers = [(request.address(array), array.strides[0]) for array in (rows, states, values)]
        for i in range(len(rows)):
            c.begun = c.next_time = 0
            c.start_values, c.states, c.values = [first + i * stride for first, stride in pointers]
            while (status := self._call(self._prepared)) == RUN.MORE:
                pass
            if status != RUN.DONE:
                states[i, c.next_time :], values[i, c.next_time :] = np.nan, np.nan
                failures[i] = self._reason(status, c)
            if progress and i % 100 == 99:
                progress((i + 1) / len(rows))
        return np.concatenate([states, values], axis=2), failures


def columns_of(fmu: Fmu, values: Mapping[str, ArrayLike]) -> dict[str, NDArray[np.float64]]:
    """Numbers of a sweep by name, one per run.

    Raises:
        StickslipError: unknown name, value out of range, elements of arrays, columns of different length.
    """
    columns = {name: np.array(column, dtype=float) for name, column in values.items()}
    sizes = {column.shape for column in columns.values()}
    elements = [name for name in columns if owner(name, fmu.variables) != name]
    if elements:
        raise StickslipError(f"A sweep takes scalars; '{elements[0]}' is an element of an array. Run once per value.")
    if len(sizes) != 1 or len(next(iter(sizes))) != 1 or not next(iter(sizes))[0]:
        raise StickslipError(
            f"A sweep needs one list of numbers per name, all of one length; found shapes {sizes or 'none'}."
        )
    for row in (np.min, np.max):
        bounds = {name: float(row(column)) for name, column in columns.items()}
        parameters = {
            n: v for n, v in bounds.items() if n in fmu.variables and fmu.variables[n].causality == "parameter"
        }
        request.start_values(fmu, parameters, {n: v for n, v in bounds.items() if n not in parameters})
    return columns
