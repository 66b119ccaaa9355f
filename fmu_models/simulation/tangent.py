"""Exact derivatives of a motion with respect to start state and parameters, through all its events.

The engine carries them along with the motion (engine/tangent.c): variational equation and saltation in one, derived
from the model's own arithmetic; no finite differences.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from ctypes import c_double, c_int, c_int64, c_void_p
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fmu_models.errors import StickslipError
from fmu_models.simulation import native
from fmu_models.simulation.fmu import Fmu
from fmu_models.simulation.system import check_names, check_value, instance


@dataclass(frozen=True, eq=False)
class FlowDerivative:
    """Where a motion arrives, and how that depends on where it began.

    Attributes:
        states: names of the states, in the order of rows and columns below.
        end: (n,) states at the end.
        by_start: (n, n) d end / d start; over a period of a periodic motion its monodromy matrix.
        by_parameter: per parameter asked for (n,) d end / d parameter, start states held.
    """

    states: tuple[str, ...]
    end: NDArray[np.float64]
    by_start: NDArray[np.float64]
    by_parameter: Mapping[str, NDArray[np.float64]]


def flow_derivative(
    fmu: Fmu,
    stop_time: float,
    *,
    start_time: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    by: Sequence[str] = (),
    tolerance: float = 1e-14,
) -> FlowDerivative:
    """End states of a run and their derivatives.

    Args:
        parameters, start, inputs: as for ``simulate``; inputs are constant.
        by: parameters to differentiate by.

    Raises:
        StickslipError: as for ``simulate``; or the motion has no derivative, because it touches the bound of a contact
            without crossing it.
    """
    parameters, start, inputs = dict(parameters or {}), dict(start or {}), dict(inputs or {})
    if not (np.isfinite([start_time, stop_time]).all() and stop_time > start_time):
        raise StickslipError(
            f"The run must end after it starts, found start {start_time:g} s and stop {stop_time:g} s."
        )
    check_names(fmu, "parameter", {**parameters, **dict.fromkeys(by)}, fmu.parameters)
    check_names(fmu, "state", start, [*fmu.states, *fmu.memories])
    check_names(fmu, "input", inputs, fmu.inputs)
    initial = {**parameters, **start, **inputs}
    for name, value in initial.items():
        check_value(fmu, name, value)
    n, p = len(fmu.states), len(fmu.parameters)
    directions = n + len(by)
    along_states = np.zeros((directions, n))
    along_states[:n] = np.eye(n)
    along_parameters = np.zeros((directions, max(p, 1)))
    for row, name in enumerate(by, start=n):
        along_parameters[row, fmu.parameters.index(name)] = 1.0
    end, derivatives = np.empty(n), np.empty((directions, n))
    with instance(fmu, initial, start_time, tolerance) as (slave, failure):
        native.library_of(slave.dll, fmu.path.name)
        run = slave.dll.stickslip_tangent
        run.restype = c_int
        run.argtypes = (c_void_p, c_double, c_int64, c_void_p, c_void_p, c_void_p, c_void_p)
        arrays = (along_states, along_parameters, end, derivatives)
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in arrays]
        if run(slave.component, stop_time, directions, *pointers) != native.DONE:
            raise failure()
    by_parameter = dict(zip(by, derivatives[n:], strict=True))
    return FlowDerivative(tuple(fmu.states), end, derivatives[:n].T.copy(), by_parameter)
