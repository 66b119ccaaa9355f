"""Every kind of computation, found by itself, gives numbers with names for a forced oscillator."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fmu_models.analyses.declaration import PARAMETERS, STATES
from fmu_models.base.shipped import files
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.compute import compute
from fmu_models.scene.kinds import KINDS
from fmu_models.scene.read import read_scene
from fmu_models.scene.reduce import built_scene
from fmu_models.scene.scene import Compute

AXES = {"": {}, PARAMETERS: {"omega": (0.8, 0.81), "f0": (0.3, 0.32)}, STATES: {"x": (0.0, 0.1), "v": (0.0, 0.1)}}


# of special points, borders, bodies at rest, saddles, planes, maps of a state: they have shipped scenes, judged as such
OWN = ("crossings", "curves", "edge", "equilibria", "manifolds", "plane", "reduced_map", "shares", "shock", "tipping")


def test_kinds_that_need_scenes_of_their_own_have_them() -> None:
    assert set(OWN) <= {read_scene(path).compute.kind for path in files("scenes")}


@pytest.mark.nightly_for("basins")
@pytest.mark.parametrize("name", [name for name in KINDS.members() if name not in OWN])
def test_a_kind_gives_numbers(name: str) -> None:
    scene = read_scene("discontinuous_support_periods")
    kind = KINDS.load(name)
    how: dict[str, Any] = {"period": 2.0 * np.pi / 0.8}
    if kind.axes == PARAMETERS:
        how = {"forcing": "omega"}
    if kind.sweeps:
        how = {"over": "omega", "values": (0.8, 0.81), "forcing": "omega", "angular": True}
    asked = Compute(kind=name, samples=51, axes=AXES[kind.axes], **how)
    scene = replace(scene, stop_time=1000.0 * np.pi, compute=asked)
    rows = compute(scene, Fmu.open(built_scene(scene)))
    assert [row.at for row in rows] == (list(asked.values) or [None])
    for row in rows:
        assert row.values and all(isinstance(value, float) and np.isfinite(value) for value in row.values.values())
        assert row.trajectory is None or len(row.trajectory.time) > 1
