"""Which entries of the Jacobian an FMU declares not to be zero."""

import numpy as np
from numpy.typing import NDArray

from fmu_models.fmu.fmu import Fmu


def declared(fmu: Fmu) -> tuple[NDArray[np.int64], NDArray[np.int32]] | None:
    """The rates that depend on each state: where those of a state begin (n_states + 1,), and their numbers, ascending.

    None where the description leaves it open for some rate, or for elements of arrays.
    """
    numbers: dict[tuple[str, int], int] = {}
    depends = []
    for unknown in fmu.description.derivatives:
        state = unknown.variable and unknown.variable.derivative
        if state is None or state.shape or unknown.dependencies is None:
            return None
        numbers[str(state.type), state.valueReference] = len(numbers)
        depends.append([(str(known.type), known.valueReference) for known in unknown.dependencies])
    entries = {(numbers[known], row) for row, knowns in enumerate(depends) for known in knowns if known in numbers}
    columns, rows = np.array(sorted(entries), dtype=np.int64).reshape(-1, 2).T
    return np.searchsorted(columns, np.arange(len(depends) + 1)), rows.astype(np.int32)
