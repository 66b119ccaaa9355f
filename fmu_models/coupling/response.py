"""How the outputs of a unit answer its inputs and states, by directional derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, c_int32, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fmu_models.coupling.histories import Matrix, Vector
from fmu_models.importer.instance import STATUS, Instance


@dataclass(frozen=True)
class Response:
    """A unit near a point: x' = a x + b u, y = c x + d u; (n, n), (n, n_inputs), (n_outputs, n) and (n_outputs,
    n_inputs)."""

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix


def response(unit: Instance, inputs: Sequence[str], outputs: Sequence[str]) -> Response | None:
    """At the present point; None where the unit offers no directional derivatives, or refuses them."""
    derivatives = [u.variable for u in unit.fmu.description.derivatives if u.variable]
    pairs = [(str(v.name), str(v.derivative.name)) for v in derivatives if v.derivative and not v.shape]
    n = len(pairs)
    if not unit.calls.directional or n < len(derivatives):
        return None
    rates, states = (_references(unit, [pair[i] for pair in pairs]) for i in (0, 1))
    unknowns = np.concatenate([rates, _references(unit, outputs)])
    matrix = np.zeros((unknowns.size, n + len(inputs)))
    for column, reference in enumerate(np.concatenate([states, _references(unit, inputs)])):
        values = _directional(unit, unknowns, int(reference))
        if values is None:
            return None
        matrix[:, column] = values
    return Response(matrix[:n, :n], matrix[:n, n:], matrix[n:, :n], matrix[n:, n:])


def _references(unit: Instance, names: Sequence[str]) -> NDArray[np.uint32]:
    return np.array([unit.fmu.variables[name].valueReference for name in names], dtype=np.uint32)


def _directional(unit: Instance, unknowns: NDArray[np.uint32], known: int) -> Vector | None:
    function = unit.function("GetDirectionalDerivative")
    seed, values = np.ones(1), np.zeros(unknowns.size)
    one, n = ([c_size_t(1)], [c_size_t(values.size)]) if unit.fmu.fmi == 3 else ([], [])
    knowns = [byref(c_uint32(known)), c_size_t(1), c_void_p(seed.ctypes.data), *one]
    arguments = [c_void_p(unknowns.ctypes.data), c_size_t(unknowns.size), *knowns, c_void_p(values.ctypes.data), *n]
    function.restype = c_int32
    status = function(c_void_p(unit.calls.instance), *arguments)
    return values if status < STATUS.DISCARD and np.isfinite(values).all() else None
