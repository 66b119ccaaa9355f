"""The kind of a scene that an analysis is, derived from its declaration."""

from collections.abc import Mapping
from typing import Any

from fmu_models.analyses.declaration import EITHER, OSCILLATOR, RANGE, SECTION, Analysis
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, constants_of, section_of, strobe_of
from fmu_models.scene.scene import Scene


def kind_of(analysis: Analysis) -> Kind:
    """A computation by the analysis; one that is ``of_run`` takes its settings from the length of the run."""

    def compute(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row | tuple[Row, ...]:
        computation = scene.compute
        settings: dict[str, Any] = {**differing, **computation.settings}
        subject: Any = fmu
        # the model of a scene has what is constant in it no more
        settings |= {argument: scene.parameters for name, argument in constants.items() if name in settings}
        section = computation.forcing or computation.period or computation.level or computation.impacts or fmu.signals
        if analysis.subject == OSCILLATOR or (analysis.subject == EITHER and not (section or scene.of_map)):
            settings["parameters"] = constants_of(scene, run)
        elif analysis.of_run is None:
            subject = section_of(scene, fmu, run["parameters"], run["inputs"])
        else:
            subject, count = strobe_of(scene, fmu, run)
            settings |= analysis.of_run(count)
        axes: Mapping[str, Any] = {str(computation.over): computation.values} if analysis.sweeps else computation.axes
        if analysis.axes == RANGE:
            low, high = min(computation.values), max(computation.values)
            axes = {str(computation.over): (low, high)}
            subject, settings = _inside(subject, settings, str(computation.over), low, high)
        result = analysis.run(subject, axes, start=run["start"], **settings)
        numbers = analysis.numbers(result, *((computation.values,) if analysis.axes == RANGE else ()))
        if isinstance(numbers, Mapping):
            return Row(None, numbers, family=result)
        return tuple(Row(at, values, family=result) for at, values in numbers)

    options = {} if analysis.of_run else analysis.options
    declared_options = {
        name: declared for name, declared in options.items() if declared.option.scene and not declared.range
    }
    differing = {
        name: declared.in_scene for name, declared in declared_options.items() if declared.option.in_scene is not None
    }
    constants = {
        name: declared.option.constants for name, declared in declared_options.items() if declared.option.constants
    }
    return Kind(
        compute,
        periodic=analysis.subject == SECTION,
        anywhere=analysis.of_run is None and "level" not in analysis.without,
        unforced=not (analysis.subject == OSCILLATOR or analysis.forced),
        of_maps=analysis.subject != OSCILLATOR,
        sweeps=analysis.sweeps,
        axes="" if analysis.sweeps else analysis.axes,
        settings={name: declared.in_scene for name, declared in declared_options.items()},
    )


def _inside(subject: Any, settings: dict[str, Any], over: str, low: float, high: float) -> tuple[Any, dict[str, Any]]:
    """What is followed over a range begins in it."""
    constants = settings.get("parameters")
    present = (subject.values if constants is None else constants).get(over)
    if present is None:
        present = (subject.fmu if constants is None else subject).start_of(over)
    inside = {over: min(max(float(present), low), high)}
    if constants is None:
        return subject.at(**inside), settings
    return subject, {**settings, "parameters": {**constants, **inside}}
