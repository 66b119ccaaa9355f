"""Which attractor each start of a grid comes to, and how many of the starts.

Results: `attractors`, `undecided`, `failed`, `boundary`, and per attractor `period1`, `starts1`.
"""

from __future__ import annotations

from typing import Any

from fmu_models.analyses.basins import basins
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import STATES, Kind, Row, defaults, section_of
from fmu_models.scene.scene import Scene


def _basins(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    how: Any = scene.compute
    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    found = basins(system, start=run["start"], **how.settings, **how.axes)
    values = {"attractors": float(len(found.attractors)), "undecided": float(found.undecided)}
    for i, one in enumerate(found.attractors):
        values |= {f"period{i + 1}": float(one.period), f"starts{i + 1}": float((found.labels == i).sum())}
    return Row(None, {**values, "failed": float(len(found.failures)), "boundary": found.boundary}, family=found)


KIND = Kind(_basins, periodic=True, anywhere=True, axes=STATES, settings=defaults(basins, "most"))
