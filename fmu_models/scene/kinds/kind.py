"""What every kind of computation takes and gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.scene import Scene
from fmu_models.simulation.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Row:
    """One thing computed: results by name, in the units of the model, and the run if there was one.

    at: value of the swept quantity, None if nothing is swept.
    """

    at: float | None
    values: Mapping[str, float]
    trajectory: Trajectory | None = None


@dataclass(frozen=True)
class Kind:
    """A computation by name. compute: from a scene, its FMU and the arguments of ``simulate``, changed where the scene
    varies something, to a row; periodic: whether the scene must say a period or what forces it."""

    compute: Callable[[Scene, Fmu, dict[str, Any]], Row]
    periodic: bool = False


def period(scene: Scene, parameters: Mapping[str, float]) -> float:
    """Period of a strobe or orbit, s; ``parameters`` in place of the scene's."""
    how = scene.compute
    if how.forcing is None:
        return how.periods * float(how.period or math.nan)
    value = {**scene.parameters, **parameters}[how.forcing]
    if value <= 0.0:
        raise StickslipError(f"The forcing has no period: {how.forcing} = {value:g}. Choose a positive frequency.")
    return how.periods * (2.0 * math.pi if how.angular else 1.0) / value
