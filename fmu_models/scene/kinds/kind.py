"""What every kind of computation takes and gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fmu_models.analyses.fmu_sections import Strobe
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


def strobe_of(scene: Scene, fmu: Fmu, run: Mapping[str, Any]) -> tuple[Strobe, int]:
    """The strobe of a scene, and how many of its steps fit into the run.

    Raises:
        StickslipError: a drive that moves, or a run shorter than two periods.
    """
    moving = [name for name, value in run["inputs"].items() if not isinstance(value, int | float)]
    if moving:
        raise StickslipError(f"'{moving[0]}' moves: a section once per period takes constant drives.")
    length = period(scene, run["parameters"])
    count = int(run["stop_time"] / length * (1.0 + 1e-12))
    if count < 2:
        raise StickslipError(f"The run of {run['stop_time']:g} s is shorter than two periods of {length:g} s.")
    every = scene.compute.periods
    values = {**run["parameters"], **run["inputs"]}
    autonomous = scene.compute.autonomous
    return Strobe(fmu, period=length / every, every=every, autonomous=autonomous, parameters=values), count
