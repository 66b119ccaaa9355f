"""The states once per period, and how many different ones are left at the end.

Results: `points` (different ones at the end), `period`, `<state>`.
"""

from typing import Any

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, period, periods_of
from fmu_models.scene.scene import Scene
from fmu_models.simulation.run import simulate

KEPT = 32  # periods at the end of a strobe, among which different points are counted
SAME = 1e-6  # of the size of a state, up to which two points of a strobe are one


def _strobe(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    """Once per period; as many whole periods as fit into the run."""
    length = period(scene, run["parameters"], fmu)
    count = periods_of(run, length)
    run["stop_time"] = count * length
    trajectory = simulate(fmu, **run, output_times=length * np.arange(count + 1))
    last = np.stack([trajectory[name][-min(KEPT, count) :] for name in fmu.states], axis=1)
    values = {name: float(trajectory[name][-1]) for name in fmu.states}
    return Row(None, {"period": length, "points": float(_different(last)), **values}, trajectory)


def _different(points: np.ndarray) -> int:
    """How many of the points (n, m) differ."""
    size = SAME * np.abs(points).max(axis=0)
    distinct: list[np.ndarray] = []
    for point in points:
        if not any((np.abs(point - earlier) <= size).all() for earlier in distinct):
            distinct.append(point)
    return len(distinct)


KIND = Kind(_strobe, periodic=True)
