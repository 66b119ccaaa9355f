"""What a co-simulation reads at every point: what is recorded, and what tells events."""

from __future__ import annotations

from ctypes import byref

import numpy as np

from fmu_models.coupling.composite import library
from fmu_models.coupling.dense import DenseOutput
from fmu_models.coupling.histories import Vector
from fmu_models.coupling.order import discrete
from fmu_models.coupling.points import CommunicationPoints
from fmu_models.coupling.watch import Watch
from fmu_models.coupling.wiring import split
from fmu_models.importer import request


def recording(
    points: CommunicationPoints, names: list[str], times: Vector | None, *, fixed: bool
) -> tuple[list[str], DenseOutput, Watch]:
    """Names of the variables recorded, their values over time, and the watch over events.

    Args:
        names: of the units, in the order in which they are recorded.
        times: when to record, s; None: at the points.
        fixed: all steps are of one length.
    """
    system, composite = points.system, points.composite
    fmu, fmus = composite.fmu, system.fmus
    rates = dict(zip(composite.states, composite.derivatives, strict=True))
    rates = {x: rate for x, rate in rates.items() if x in fmu.variables and rate in fmu.variables}
    states = [x for unit in names for x in composite.states if x.startswith(f"{unit}.") and x in fmu.variables]
    every = [n for unit in names for n in request.recordable(fmu) if split(fmus, n, "")[0] == unit]
    recorded = list(system.outputs) or list(dict.fromkeys([*states, *every]))
    ends = [split(fmus, name, system.name) for name in recorded]
    still = [fmus[unit].variables[name].causality in ("parameter", "calculatedParameter") for unit, name in ends]
    steady = np.array([s or discrete(fmus[u], name) for s, (u, name) in zip(still, ends, strict=True)], bool)
    # what tells an event that changes something
    stopping = [unit.name for unit in points.units if unit.stops]
    memory = [
        f"{unit}.{name}" for unit in fmus for name, v in fmus[unit].variables.items()
        if v.causality in ("output", "local") and v.variability == "discrete" and f"{unit}.{name}" in fmu.variables
    ]  # fmt: skip
    moving = [x for x in rates if split(fmus, x, "")[0] in stopping]
    sloped = [i for i, name in enumerate(recorded) if name in rates]
    sought = [*recorded, *(rates[recorded[i]] for i in sloped), *memory, *moving, *(rates[x] for x in moving)]
    selection = request.Selection.of(fmu, sought)
    column = {name: i for i, name in enumerate(selection.names)}  # several may ask for the same
    columns = np.array([column[name] for name in sought])
    calls, chosen = byref(composite.calls), byref(selection.c)
    watch = Watch([split(fmus, n, "")[0] for n in memory], len(recorded) + len(sloped), len(moving), fixed)

    def read() -> Vector:
        values = np.zeros(len(selection.names))
        points.check(library().fmi_read(calls, chosen, values.ctypes.data), "reading values")
        return values[columns]

    return recorded, DenseOutput(read, len(recorded), sloped, steady, times), watch
