"""The Lyapunov exponents of the motion that the run becomes, with their errors, per unit of time.

Results: `exponent1` per unit of time, `error1`, and so on, `<contact>_share`.
"""

from __future__ import annotations

from typing import Any

from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, strobe_of
from fmu_models.scene.scene import Scene

MOTIONS = 4  # that are followed, each for the length of the run
DROPPED = 4  # part of it that is left out first


def _lyapunov(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    system, count = strobe_of(scene, fmu, run)
    dropped = count // DROPPED
    found = lyapunov(system, run["start"], periods=MOTIONS * (count - dropped), transient=dropped, motions=MOTIONS)
    values: dict[str, float] = {}
    for i, (value, error) in enumerate(zip(found.per_time.tolist(), found.per_time_errors.tolist(), strict=True), 1):
        values |= {f"exponent{i}": value, f"error{i}": error}
    return Row(None, {**values, **{f"{name}_share": share for name, share in found.shares.items()}}, family=found)


KIND = Kind(_lyapunov, periodic=True)
