"""Where the motion from the start meets the section.

Results: `<state>_min`, `<state>_max`, `<state>_mean`, `time_mean`.
"""

from __future__ import annotations

from typing import Any

from fmu_models.analyses.poincare import poincare_section
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, defaults, section_of
from fmu_models.scene.scene import Scene


def _section(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    settings: Any = scene.compute.settings
    found = poincare_section(section_of(scene, fmu, run["parameters"], run["inputs"]), run["start"], **settings)
    values: dict[str, float] = {}
    for name, column in zip(found.states, found.points.T, strict=True):
        extremes = {"min": column.min(), "max": column.max(), "mean": column.mean()}
        values |= {f"{name}_{what}": float(one) for what, one in extremes.items()}
    return Row(None, {**values, "time_mean": float(found.times.mean())}, family=found)


KIND = Kind(_section, periodic=True, anywhere=True, settings=defaults(poincare_section, "points", "transient"))
