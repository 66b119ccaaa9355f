"""The mean divergence of the rates along a motion: how fast the volume of nearby starts shrinks between events.

    ln |det D x(t)| = integral of (sum over i of d x_i' / d x_i) dt

where no event changes volumes itself: that of a compliant stop does not, since the speed of its gap is continuous;
friction, impacts and stops that remember the speed of their entry do. The integral goes from event to event, by Gauss's
formula in a variable whose ends are flat, so that forces that begin with a root do no harm; with twice as many nodes
until that changes nothing.
"""

from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.field import VectorField
from fmu_models.simulation.run import simulate

NODES = (2, 4, 8, 16, 32)  # between two events
_rule = cache(np.polynomial.legendre.leggauss)
AGREES = 1e-13  # relative difference of two integrals


def keeps_volumes(fmu: Fmu) -> bool:
    """Whether no event of the model changes volumes: all contacts are stops, and none remembers anything."""
    kinds = [fmu.variables[f"{name}_state"].declaredType for name in fmu.contacts]
    return fmu.ours and not fmu.memories and all(kind is not None and kind.name == "StopState" for kind in kinds)


def volume_change(
    fmu: Fmu,
    duration: float,
    *,
    start: Mapping[str, float],
    parameters: Mapping[str, float],
    inputs: Mapping[str, float],
) -> float:
    """ln |det| of the derivative of a motion of so many s by its start, from time 0, by the divergence alone.

    Args:
        start, parameters, inputs: as for ``simulate``; inputs are constant.
    """
    settings: dict[str, Any] = {"start": start, "parameters": parameters, "inputs": inputs}
    events = [event.time for event in simulate(fmu, duration, output_times=[0.0, duration], **settings).events]
    field, integral = VectorField(fmu, {**parameters, **inputs}), np.inf
    for nodes in NODES:
        u, weights = _rule(nodes)
        u = 0.5 + 0.5 * u
        times, shares = [], []
        for start_of_piece, end in pairwise(sorted({0.0, *events, duration})):
            times.append(start_of_piece + (end - start_of_piece) * u**2 * (3.0 - 2.0 * u))
            shares.append((end - start_of_piece) * 3.0 * weights * u * (1.0 - u))
        at, share = np.concatenate(times), np.concatenate(shares)
        run = simulate(fmu, duration, output_times=at, **settings)
        rows = zip(at.tolist(), np.array([run[name] for name in fmu.states]).T, strict=True)
        coarse, integral = integral, share @ np.array([np.trace(field.slopes(r, (), time=time)) for time, r in rows])
        if abs(integral - coarse) <= AGREES * abs(integral):
            break
    return float(integral)
