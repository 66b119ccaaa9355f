"""What the motion from the start becomes over two parameters, and how many cells are of each class.

Results: `cells_<class>`, `runs`, `failed`.
"""

from __future__ import annotations

from typing import Any

from fmu_models.analyses.chart import chart
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import PARAMETERS, Kind, Row, defaults, section_of
from fmu_models.scene.scene import Scene


def _chart(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    how: Any = scene.compute
    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    found = chart(system, start=run["start"], **how.settings, **how.axes)
    values = {f"cells_{name}": float((found.labels == i).sum()) for i, name in enumerate(found.classes)}
    return Row(None, {**values, "runs": float(found.runs), "failed": float(len(found.failures))}, family=found)


KIND = Kind(
    _chart,
    periodic=True,
    anywhere=True,
    axes=PARAMETERS,
    settings=defaults(chart, "what", "transient", "points", "refine"),
)
