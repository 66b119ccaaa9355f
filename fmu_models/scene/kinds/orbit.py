"""The periodic motion near the start, stable or not, and its multipliers.

Results: `<state>` at its start, `period`, `stable`, `multiplier1` (modulus), `multiplier1_real`, and so on.
"""

from typing import Any

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, period
from fmu_models.scene.scene import Scene
from fmu_models.sections.orbits import find_orbit
from fmu_models.simulation.run import simulate


def _orbit(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    computation = scene.compute
    length = period(scene, run["parameters"])
    guess = {name: float(run["start"].get(name, fmu.start_of(name))) for name in fmu.states}
    fixed = {name: run[name] for name in ("parameters", "inputs")}
    orbit = find_orbit(fmu, length, guess, autonomous=computation.autonomous, **fixed)
    values = {"period": orbit.period, **orbit.start, "stable": float(orbit.stable), "residual": orbit.residual}
    for i, multiplier in enumerate(orbit.multipliers, 1):
        values |= {f"multiplier{i}": float(abs(multiplier)), f"multiplier{i}_real": float(multiplier.real)}
    times = np.linspace(0.0, orbit.period, computation.samples)
    trajectory = simulate(fmu, orbit.period, start=dict(orbit.start), output_times=times, **fixed)
    return Row(None, values, trajectory)


KIND = Kind(_orbit, periodic=True)
