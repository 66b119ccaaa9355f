"""Every kind of computation, found by itself, gives numbers with names for a forced oscillator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.compute import compute
from fmu_models.scene.kinds import KINDS
from fmu_models.scene.read import read_scene
from fmu_models.scene.reduce import built_scene
from fmu_models.scene.scene import Compute


@pytest.mark.parametrize("name", KINDS.members())
def test_a_kind_gives_numbers(name: str) -> None:
    scene = read_scene("discontinuous_support_table_1")
    how = Compute(kind=name, samples=51, period=2.0 * np.pi)
    scene = replace(scene, stop_time=20.0 * np.pi, compute=how)
    (row,) = compute(scene, Fmu.open(built_scene(scene)))
    assert row.values and all(isinstance(value, float) and np.isfinite(value) for value in row.values.values())
    assert row.trajectory is None or len(row.trajectory.time) > 1
