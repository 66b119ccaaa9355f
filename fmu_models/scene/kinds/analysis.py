"""The kind of a scene that an analysis is, derived from its declaration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fmu_models.analyses.declaration import VALUES, Analysis
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, section_of, strobe_of
from fmu_models.scene.scene import Scene


def kind_of(analysis: Analysis) -> Kind:
    """A computation by the analysis; one that is ``of_run`` takes its settings from the length of the run."""

    def compute(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row | tuple[Row, ...]:
        how = scene.compute
        settings: dict[str, Any] = dict(how.settings)
        if analysis.of_run is None:
            system: Any = section_of(scene, fmu, run["parameters"], run["inputs"])
        else:
            system, count = strobe_of(scene, fmu, run)
            settings |= analysis.of_run(count)
        axes = {str(how.over): how.values} if analysis.axes == VALUES else how.axes
        result = analysis.run(system, axes, start=run["start"], **settings)
        numbers = analysis.numbers(result)
        if isinstance(numbers, Mapping):
            return Row(None, numbers, family=result)
        return tuple(Row(at, values, family=result) for at, values in numbers)

    return Kind(
        compute,
        periodic=True,
        anywhere=analysis.of_run is None,
        sweeps=analysis.axes == VALUES,
        axes="" if analysis.axes == VALUES else analysis.axes,
        settings={} if analysis.of_run else {name: one.default for name, one in analysis.options.items()},
    )
