"""Which entries of the Jacobian an FMU declares not to be zero."""

import numpy as np
from numpy.typing import NDArray

from fmu_models.fmu.fmu import Fmu


def declared(fmu: Fmu) -> tuple[NDArray[np.int64], NDArray[np.int32]] | None:
    """The rates that depend on each state: where those of a state begin (n_states + 1,), and their numbers, ascending.

    None where the description leaves it open for some rate, or for elements of arrays.
    """
    unknowns = fmu.description.derivatives
    states = [unknown.variable and unknown.variable.derivative for unknown in unknowns]
    numbers = {(s.type, s.valueReference): k for k, s in enumerate(states) if s is not None and not s.shape}
    if len(numbers) < len(unknowns) or any(unknown.dependencies is None for unknown in unknowns):
        return None
    n = len(numbers)
    columns_of = [[numbers.get((v.type, v.valueReference), n) for v in u.dependencies or ()] for u in unknowns]
    columns = np.array([column for row in columns_of for column in row], dtype=np.int64)
    entries = np.unique(columns * n + np.repeat(np.arange(n), [len(row) for row in columns_of]))
    start = np.searchsorted(entries, np.arange(n + 1) * n)
    return start, (entries[: start[n]] % max(1, n)).astype(np.int32)
