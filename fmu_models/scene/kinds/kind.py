"""What every kind of computation takes and gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.reduce import declared
from fmu_models.scene.scene import Compute, Scene
from fmu_models.sections.crossing import Crossing, Impacts
from fmu_models.sections.return_map import ReturnMap
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.sections import Section
from fmu_models.simulation.trajectory import Trajectory

if TYPE_CHECKING:
    from fmu_models.language.maps import Map
    from fmu_models.sections.iteration import Iteration


@dataclass(frozen=True, eq=False)
class Row:
    """One thing computed.

    Attributes:
        at: value of the swept quantity, None if nothing is swept.
        values: results by name, in the units of the model.
        panel: value of the quantity of the panels, None if there are none.
        trajectory, family: the run, or the family of runs, if there was one.
    """

    at: float | None
    values: Mapping[str, float]
    trajectory: Trajectory | None = None
    family: Pictured | None = None
    panel: float | None = None


@dataclass(frozen=True)
class Kind:
    """A computation by name.

    Attributes:
        compute: from a scene, its FMU and the arguments of ``simulate``, changed where the scene varies something, to a
            row; to one per value of what is varied if the kind ``sweeps`` by itself.
        periodic: whether the scene must say a period or what forces it.
        anywhere: whether another section than a strobe will do.
        unforced: whether none will do of a model that nothing forces.
        of_maps: whether a map has such motions.
        sweeps: see ``compute``.
        axes: what it is over: two PARAMETERS, one STATE or STATES; empty if it has no axes.
        settings: keys of [compute] that no other kind reads, and their defaults.
    """

    compute: Callable[[Scene, Fmu, dict[str, Any]], Row | tuple[Row, ...]]
    periodic: bool = False
    anywhere: bool = False
    unforced: bool = False
    of_maps: bool = False
    sweeps: bool = False
    axes: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)


def period(scene: Scene, parameters: Mapping[str, float], fmu: Fmu | None = None) -> float:
    """Period of a strobe or orbit, s; ``parameters`` in place of the scene's. fmu: says it where the scene does not."""
    computation = scene.compute
    if fmu is not None and not (computation.forcing or computation.period):
        return computation.periods * float(Strobe(fmu, parameters=parameters).periods({}, 1)[0])
    if computation.forcing is None:
        return computation.periods * float(computation.period or math.nan)
    value = {**scene.parameters, **parameters}[computation.forcing]
    if value <= 0.0:
        raise StickslipError(
            f"The forcing has no period: {computation.forcing} = {value:g}. Choose a positive frequency."
        )
    return computation.periods * (2.0 * math.pi if computation.angular else 1.0) / value


def constants_of(scene: Scene, run: Mapping[str, Any]) -> dict[str, float]:
    """Parameters and drives of the arguments of ``simulate``. StickslipError: a drive that moves."""
    moving = [name for name, value in run["inputs"].items() if not isinstance(value, int | float)]
    if moving:
        raise StickslipError(f"'{moving[0]}' of scene '{scene.name}' moves; a family of motions takes constant drives.")
    return {**run["parameters"], **run["inputs"]}


def section_of(
    scene: Scene, fmu: Fmu, parameters: Mapping[str, float], inputs: Mapping[str, Any]
) -> Strobe | Crossing | Impacts | ReturnMap | Iteration:
    """The section that a scene names; where its frequency is free, the period follows that. Of a map every step.
    StickslipError: a drive that moves, or as the section does."""
    constants = constants_of(scene, {"parameters": parameters, "inputs": inputs})
    computation = scene.compute
    if scene.of_map:
        from fmu_models.sections.iteration import Iteration

        return Iteration.of(cast("Map", declared(scene)), {**scene.fixed, **constants})
    forcing = None if computation.forcing in scene.fixed else computation.forcing
    length = (
        None
        if forcing or not (computation.forcing or computation.period)
        else period(scene, parameters) / computation.periods
    )
    return section_at(fmu, computation, scene.start, forcing=forcing, period=length, parameters=constants)


def section_at(
    fmu: Fmu, computation: Compute, start: Mapping[str, float], **common: Any
) -> Strobe | Crossing | Impacts | ReturnMap:
    """The section that a computation names; start: of a return map's other states; common: of ``FmuSection``."""
    if computation.impacts is not None:
        return Impacts(fmu, computation.impacts, **common)
    if computation.level:
        ((state, value),) = computation.level.items()
        if computation.returns:
            section = Section(state, value, -1 if computation.down else 1)
            options: dict[str, Any] = {"cap": computation.cap, "start": start, "accept": computation.accept}
            return ReturnMap(fmu, computation.returns, section=section, **options, parameters=common["parameters"])
        return Crossing(fmu, state, value, -1 if computation.down else 1, **common)
    return Strobe(fmu, every=computation.periods, autonomous=computation.autonomous, **common)


def periods_of(run: Mapping[str, Any], length: float) -> int:
    """How many periods of a strobe, s, fit into the run. StickslipError: fewer than two."""
    count = int(run["stop_time"] / length * (1.0 + 1e-12))
    if count < 2:
        raise StickslipError(f"The run of {run['stop_time']:g} s is shorter than two periods of {length:g} s.")
    return count


def strobe_of(scene: Scene, fmu: Fmu, run: Mapping[str, Any]) -> tuple[SectionSystem, int]:
    """The strobe of a scene, or its map, and how many of its steps fit into the run. StickslipError: a drive that
    moves, or a run shorter than two periods."""
    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    length = float(system.repeats(system.periods({}, 1))[0]) if isinstance(system, Strobe) else 1.0
    return system, periods_of(run, length)
