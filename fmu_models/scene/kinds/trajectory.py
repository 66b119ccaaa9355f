"""The run itself: states and outputs at its end, and their extremes.

Results: `<state>` and `<output>` at the end, `<name>_min`, `<name>_max`, `events`; when the first ones are, `event_1`
and so on, and `last_event`.
"""

from typing import Any

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row
from fmu_models.scene.scene import Scene
from fmu_models.simulation.run import simulate

FIRST = 12  # events whose times are told


def run_row(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    """The run of a scene, at ``samples`` times."""
    times = np.linspace(0.0, run["stop_time"], scene.compute.samples)
    trajectory = simulate(fmu, output_times=times, sides=True, **run).drawn
    values = {name: float(trajectory[name][-1]) for name in (*fmu.states, *fmu.outputs)}
    for name in (*fmu.states, *fmu.outputs):
        values |= {f"{name}_min": float(trajectory[name].min()), f"{name}_max": float(trajectory[name].max())}
    values["events"] = float(len(trajectory.events))
    if trajectory.events:
        values["last_event"] = trajectory.events[-1].time
    values |= {f"event_{k}": event.time for k, event in enumerate(trajectory.events[:FIRST], 1)}
    return Row(None, values, trajectory)


KIND = Kind(run_row)
