"""The section of the strobe's map over the state of ``axes``, all others the same after a period as before, and its
fixed points."""

from typing import Any

from fmu_models.analyses.declaration import STATES
from fmu_models.analyses.reduced_map import reduced_map
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, section_of
from fmu_models.scene.scene import Scene


def _reduced_map(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    axes = scene.compute.axes
    if len(axes) != 1:
        raise StickslipError(f"A reduced map is over one state, found axes over {', '.join(axes)}.")
    ((of, values),) = axes.items()
    result = reduced_map(section_of(scene, fmu, run["parameters"], run["inputs"]), of, values, start=run["start"])
    top = result.images.argmax()
    numbers = {
        "fixed_points": float(len(result.fixed)),
        "peak": float(result.images[top]),
        "peak_at": result.values[top],
    }
    for i, (point, slope) in enumerate(zip(result.fixed, result.fixed_slopes, strict=True), 1):
        numbers |= {f"{name}_{i}": float(coordinate) for name, coordinate in zip(result.states, point, strict=True)}
        numbers[f"slope_{i}"] = float(slope)
    return Row(None, numbers, family=result)


KIND = Kind(_reduced_map, periodic=True, axes=STATES)
