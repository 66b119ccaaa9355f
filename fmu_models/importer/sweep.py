"""Runs of a sweep by the master: what is asked, and what comes of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import request


@dataclass(frozen=True, eq=False)
class Sweep(Shown):
    """Runs of a sweep: per variable (runs, times), and why runs ended early, by the number of the run."""

    time: NDArray[np.float64]
    values: Mapping[str, NDArray[np.float64]]
    failures: Mapping[int, str]

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        refuse_unknown(name, self.values, f"The sweep has no variable '{name}'.")
        return self.values[name]


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
