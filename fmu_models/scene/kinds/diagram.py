"""Where motions stay at the section over ``over``, swept up or down; a row per value.

Results: `period_up`, `<state>_min_up`, `<state>_max_up`, and `_down`. With `against_branches`, the longest period of
branches that the sweeps are held against, the first row has `lost_up` and `lost_down`: how often a sweep left a stable
branch that goes on.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_models.analyses.continuation.lost_motions import lost_motions
from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, defaults, section_of
from fmu_models.scene.scene import Scene


def _diagram(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> tuple[Row, ...]:
    how: Any = scene.compute
    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    given = {key: value for key, value in how.settings.items() if key != "against_branches"}
    found = orbit_diagram(system, how.over, how.values, start=run["start"], **given)
    longest = int(how.settings.get("against_branches", 0))
    lost = [one.direction for one in lost_motions(system, found, longest)] if longest else []
    rows = []
    for i, value in enumerate(found.values.tolist()):
        values: dict[str, float] = {}
        for d, way in enumerate(found.directions):
            points = found.shown[d, i]
            if longest and i == 0:
                values[f"lost_{way}"] = float(lost.count(way))
            values[f"period_{way}"] = float(found.periods[d, i])
            if np.isfinite(points).any():
                extremes = {"min": np.nanmin(points), "max": np.nanmax(points)}
                values |= {f"{found.of}_{what}_{way}": float(one) for what, one in extremes.items()}
        rows.append(Row(value, values, family=found))
    return tuple(rows)


KIND = Kind(
    _diagram,
    periodic=True,
    anywhere=True,
    sweeps=True,
    settings={**defaults(orbit_diagram, "direction", "transient", "points", "of", "branches"), "against_branches": 0},
)
