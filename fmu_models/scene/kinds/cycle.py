"""The motion that the run ends in: its period, extremes, and shares of stick.

Results: `period`, `events`, `<state>_min`, `<state>_max`, `<contact>_stick` (share of the period);
at rest `events` = 0.
"""

from typing import Any

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row
from fmu_models.scene.kinds.trajectory import run_row
from fmu_models.scene.scene import Scene
from fmu_models.sections.cycles import last_cycle
from fmu_models.simulation.run import simulate


def _cycle(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    stop_time = run.pop("stop_time")
    cycle = last_cycle(fmu, stop_time, **run)
    if cycle is None:
        row = run_row(scene, fmu, {"stop_time": stop_time, **run})
        return Row(None, {"events": 0.0, **{name: row.values[name] for name in fmu.states}}, row.trajectory)
    values = {"period": cycle.period, "events": float(len(cycle.events))}
    for name in fmu.states:
        values |= {f"{name}_min": cycle.minimum[name], f"{name}_max": cycle.maximum[name]}
    values |= {f"{name}_stick": share for name, share in cycle.stick.items()}
    last = np.linspace(cycle.start, cycle.start + cycle.period, scene.compute.samples)
    return Row(None, values, simulate(fmu, float(last[-1]), output_times=last, sides=True, **run).drawn)


KIND = Kind(_cycle)
