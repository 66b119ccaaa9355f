"""Many runs by the master that differ in their values alone."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from fmu_models.base.arrays import Vector
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import request
from fmu_models.importer.motion_error import RUN
from fmu_models.simulation.run import bounds_of


class Batch:
    """Runs over the same times with the same inputs, as `Driver.batch` prepares them.

    times: (n,) s; begun: what `begun` says of the values that differ, names; recorded: of those a run tells, of which
    the first ``states`` are states; prepared: the request; call: makes the run of it; reason: of one that ended early.
    """

    def __init__(
        self,
        fmu: Fmu,
        names: tuple[str, ...],
        begun: Mapping[str, float],
        times: Vector,
        recorded: tuple[str, ...],
        states: int,
        prepared: Any,
        call: Callable[[Any], int],
        reason: Callable[[int, Any], str],
    ) -> None:
        self.times, self.names, self.recorded = times, names, recorded
        self._fmu, self._states = fmu, states
        self._prepared, self._call, self._reason = prepared, call, reason
        self._low, self._high = _bounds(fmu, names)
        self._row, self._columns = np.array([*begun.values()]), [[*begun].index(name) for name in names]

    def runs(self, rows: Vector) -> tuple[Vector, dict[int, str]]:
        """(runs, n, k) of what is recorded in a run for each of ``rows`` (runs, names), and why runs ended early.
        StickslipError: a value out of range."""
        if not ((rows >= self._low) & (rows <= self._high)).all():
            for values in (rows.min(axis=0), rows.max(axis=0)):  # the one that is out of range is refused
                _checked(self._fmu, dict(zip(self.names, values.tolist(), strict=True)))
        c, n, k = self._prepared.c, self._states, len(self.recorded)
        table = np.tile(self._row, (len(rows), 1))
        table[:, self._columns] = rows
        states, values = np.empty((len(rows), len(self.times), n)), np.empty((len(rows), len(self.times), k - n))
        failures: dict[int, str] = {}
        pointers = [(request.address(array), array.strides[0]) for array in (table, states, values)]
        for i in range(len(rows)):
            c.begun = c.next_time = 0
            c.start_values, c.states, c.values = [first + i * stride for first, stride in pointers]
            while (status := self._call(self._prepared)) == RUN.MORE:
                pass
            if status != RUN.DONE:
                states[i, c.next_time :], values[i, c.next_time :] = np.nan, np.nan
                failures[i] = self._reason(status, c)
        return np.concatenate([states, values], axis=2), failures


def begun(fmu: Fmu, names: tuple[str, ...]) -> dict[str, float]:
    """Values that a run over ``names`` is given, in the order in which they are set: of each name one in its bounds,
    and those of the other elements of arrays, which FMI sets whole. StickslipError: as `request.start_values`."""
    return _checked(fmu, dict(zip(names, np.clip(0.0, *_bounds(fmu, names)).tolist(), strict=True)))


def _bounds(fmu: Fmu, names: tuple[str, ...]) -> Vector:
    """(2, names) between which values of variables that there are pass."""
    owners = [fmu.variables.get(owner(name, fmu.variables)) for name in names]
    return np.reshape([(0.0, 0.0) if variable is None else bounds_of(variable) for variable in owners], (-1, 2)).T


def _checked(fmu: Fmu, values: Mapping[str, float]) -> dict[str, float]:
    """`request.start_values` of parameters and other variables alike."""
    kinds = {name: getattr(fmu.variables.get(owner(name, fmu.variables)), "causality", "") for name in values}
    parameters = {n: v for n, v in values.items() if kinds[n] in ("parameter", "structuralParameter")}
    return request.start_values(fmu, parameters, {n: v for n, v in values.items() if n not in parameters})
