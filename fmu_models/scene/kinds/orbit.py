"""The periodic motion near the start, stable or not, and its multipliers.

Results: `<state>` at its start, `<state>_min`, `<state>_max`, `period`, `stable`, `multiplier1` (modulus),
`multiplier1_real`, and so on; of a map, where `periods` says how many points, those of its least point.
"""

from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, period, section_of
from fmu_models.scene.scene import Scene
from fmu_models.sections.amounts import Measured
from fmu_models.sections.orbits import find_orbit
from fmu_models.simulation.run import simulate


def _orbit(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    if scene.of_map:
        return _of_map(scene, fmu, run)
    computation = scene.compute
    length = period(scene, run["parameters"], fmu)
    guess = {name: float(run["start"].get(name, fmu.start_of(name))) for name in fmu.states}
    fixed: dict[str, Any] = {name: run[name] for name in ("parameters", "inputs")}
    orbit = find_orbit(fmu, length, guess, autonomous=computation.autonomous, **fixed)
    values = {"period": orbit.period, **orbit.start, "stable": float(orbit.stable), "residual": orbit.residual}
    times = np.linspace(0.0, orbit.period, computation.samples)
    run = {**fixed, "start": dict(orbit.start)}
    trajectory = simulate(fmu, orbit.period, output_times=times, sides=True, **run).drawn
    sides = Measured(fmu).extremes((0.0, orbit.period), run)
    for name, (low, high) in sides.items():
        values |= {f"{name}_min": low, f"{name}_max": high}
    return Row(None, values | _multipliers(orbit.multipliers), trajectory)


def _of_map(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    """The periodic points of a map, by Newton's method on all of them from what the map makes of the start."""
    from fmu_models.sections.iteration import Iteration, iterate
    from fmu_models.sections.periodic import cycles_at, find_cycles

    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    assert isinstance(system, Iteration)  # of a map
    points = iterate(system, system.start(run["start"]), scene.compute.periods - 1)
    cycles, _ = cycles_at(system, find_cycles(system, points[None]))
    if not cycles.points.size:
        raise StickslipError(
            f"'{scene.name}': Newton's method finds no motion of {scene.compute.periods} points from its start. Start "
            "nearer."
        )
    (motion,) = cycles.motions()
    least = min(motion.points.tolist())
    values = {"period": float(motion.period), "stable": float(motion.stability.stable), "residual": motion.residual}
    values |= dict(zip(system.states, least, strict=True))
    for i, name in enumerate(system.states):
        values |= {f"{name}_min": float(motion.points[:, i].min()), f"{name}_max": float(motion.points[:, i].max())}
    return Row(None, values | _multipliers(motion.stability.eigenvalues))


def _multipliers(multipliers: np.ndarray) -> dict[str, float]:
    values: dict[str, float] = {}
    for i, multiplier in enumerate(multipliers.tolist(), 1):
        values |= {f"multiplier{i}": abs(multiplier), f"multiplier{i}_real": complex(multiplier).real}
    return values


KIND = Kind(_orbit, periodic=True, of_maps=True)
