"""Models without tangents: FMUs of others, coupled systems, all units integrated as one, and maps, iterate by iterate.

Whole runs are differenced,

    dy/dp = (y(p + h) - y(p - h))/(2 h),    h = step max(|p|, size of p),

at a tolerance tight enough that the steps' own errors cancel: at 1e-8 the same step loses five digits. Where one of the
halves holds a jump, as of a sample that an impact passes, the other half is the derivative.

Directional derivatives are not used. An FMU gives them for its states alone, and the tangents that follow from them
(importer/c/tangent.c) would save a tenth of a calibration with two states; those of 20, 50 and 100 states take 1.7, 4
and 7 times as long as the differences, which err by 1e-8 to 2e-7.

Systems and maps are described as an FMU is, by variables with units and first values: those of a coupled system are
called "unit.variable", and what the system states stands in place of the FMUs' own values.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from fmu_models.base.cache import digest
from fmu_models.base.errors import StickslipError
from fmu_models.coupling.run import CoupledDriver
from fmu_models.coupling.system import CoupledSystem
from fmu_models.coupling.toml_system import is_system, read_system
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load, named_map
from fmu_models.importer.batch import Batch
from fmu_models.importer.driver import Driver
from fmu_models.language.maps import Map
from fmu_models.sections.iteration import Iteration
from fmu_models.simulation.trajectory import Trajectory
from identification.calibration.subject import OwnSubject, Response, Stretch, Subject, Vector, Window
from identification.calibration.unknowns import refuse_arrays

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model

TOLERANCE = 1e-10  # of runs that are differenced
STEP, STEP_OF_SOLVER = 1e-4, 1e-2  # relative, of a difference: of a method of integration, of an FMU's own
STEP_OF_MAP = 1e-6  # relative, of a difference of iterates, which rounding alone makes inexact
JUMP = 0.5  # relative: halves of a difference that differ by more have a jump, or nothing but rounding
SOLVER = "The FMU is co-simulated: model and solver are identified together."


class DifferencedSubject(Subject):
    """A model whose runs are differenced. step: relative, of a difference."""

    step = STEP

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        if self.timed:
            raise StickslipError(
                f"Times of events are compared with models of this suite only; found '{self.timed[0]}'."
            )
        self._nominals = np.array([float(fmu.variables[name].nominal or 1.0) for name in self.by])

    @abstractmethod
    def swept(self, window: Window, names: tuple[str, ...], rows: Vector) -> Vector:
        """(runs, n, k) of what is recorded, of a run for each of ``rows`` (runs, names) of parameters and start states.
        StickslipError: one of them cannot be made."""

    def shown(self, stretch: Stretch) -> Response:
        values = {**stretch.values, **stretch.start}
        return Response(self.swept(stretch.window, tuple(values), np.array([[*values.values()]]))[0])

    def respond(self, stretch: Stretch) -> Response:
        given = {**stretch.values, **stretch.start}
        names, count = tuple(given), len(self.by)
        rows = np.tile([*given.values()], (1 + 2 * count, 1))
        columns = [names.index(name) for name in self.by]
        steps = self.step * np.where(rows[0, columns], np.abs(rows[0, columns]), self._nominals)
        rows[1 + 2 * np.arange(count), columns] -= steps
        rows[2 + 2 * np.arange(count), columns] += steps
        values = self.swept(stretch.window, names, rows)
        below, above = (values[0] - values[1::2]), (values[2::2] - values[0])
        smaller = np.where(np.abs(below) < np.abs(above), below, above)
        jumps = np.abs(above - below) > JUMP * np.maximum(np.abs(above), np.abs(below))
        slopes = np.where(jumps, smaller, (above + below) / 2) / steps[:, None, None]
        return Response(values[0], np.moveaxis(slopes, 0, -1))


class ForeignSubject(DifferencedSubject):
    """Any FMU of others, by the master."""

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        rates = [name for name in map(self.rate_name, self.states) if name in fmu.variables]
        record = [name for name in dict.fromkeys((*measured, *rates)) if name not in self.states]
        self._driver = self._driven(record)
        if not self.states:
            self.step, self.note = STEP_OF_SOLVER, SOLVER
            self.by, self.recorded = self.parameters, tuple(measured)
            self._nominals = self._nominals[: len(self.by)]
        self._batches: WeakKeyDictionary[Window, Batch] = WeakKeyDictionary()

    def _driven(self, record: Sequence[str]) -> Driver:
        exchange = self.fmu.description.modelExchange is not None
        if not exchange:
            self.states = ()
        # where events accumulate a guess is followed as far as it goes, and stays there
        return Driver(self.fmu, tolerance=TOLERANCE, record=record, on_zeno="hold" if exchange else "stop")

    def trajectory(self, stretch: Stretch) -> Trajectory:
        return self._driver.run(**stretch.asked)

    def swept(self, window: Window, names: tuple[str, ...], rows: Vector) -> Vector:
        if not self.states:
            # co-simulations, one after the other
            each = (Stretch(window, dict(zip(names, row, strict=True)), {}) for row in rows.tolist())
            return np.array([Subject.shown(self, stretch).values for stretch in each])
        if window not in self._batches or self._batches[window].names != names:
            begin = {"start_time": window.start_time, "inputs": window.inputs, "output_times": window.times}
            self._batches[window] = self._driver.batch(float(window.times[-1]), names, **begin)
        values, failures = self._batches[window].runs(rows)
        if failures:
            raise StickslipError(next(iter(failures.values())))
        # rates of states come last
        return values[:, :, : len(self.recorded)]


@dataclass(frozen=True, eq=False)
class SystemFmu(Fmu):
    """A coupled system or a map, described as an FMU. system: it; rates: by state, empty of a map."""

    system: CoupledSystem | Map
    rates: Mapping[str, str]

    @classmethod
    def coupled(cls, system: CoupledSystem) -> SystemFmu:
        """A coupled system. StickslipError: its units are stepped one by one."""
        if not system.integrates:
            raise StickslipError(
                f"The units of '{system.name}' are stepped one by one. A calibration integrates all as one: each needs "
                "Model Exchange, and the solver must be 'auto' or a method of integration."
            )
        driver = CoupledDriver(system)
        composite = driver.composite
        fmu, rates = composite.fmu, dict(zip(composite.states, composite.derivatives, strict=True))
        driver.close()
        for name, unit in system.units.items():
            for variable, value in {**unit.parameters, **unit.start}.items():
                fmu.variables[f"{name}.{variable}"].start = repr(float(value))
        return cls(fmu.path, fmu.folder, fmu.description, fmu.variables, system, rates)

    @classmethod
    def of_map(cls, declared: Map) -> SystemFmu:
        """A map."""
        variables: dict[str, Any] = {}
        parameters = [
            ("parameter", parameter, parameter.value, parameter.minimum, parameter.maximum)
            for parameter in declared.parameters
        ]
        states = [("local", state, state.start, None, None) for state in declared.states]
        for causality, quantity, first, low, high in (*parameters, *states):
            variables[quantity.name] = SimpleNamespace(
                **{"name": quantity.name, "causality": causality, "variability": "discrete", "start": first},
                **{"unit": quantity.unit, "description": quantity.description, "declaredType": None},
                **{"min": low, "max": high, "nominal": None, "type": "Real", "shape": ()},
            )
        description: Any = SimpleNamespace(
            **{"modelName": declared.name, "description": declared.title, "generationTool": "", "derivatives": []},
            **{"modelExchange": None, "coSimulation": None, "outputs": [], "eventIndicators": []},
        )
        return cls(Path(declared.name), Path(), description, variables, declared, {})

    def __reduce__(self) -> tuple[Any, ...]:
        return (SystemFmu.of_map if isinstance(self.system, Map) else SystemFmu.coupled), (self.system,)

    @cached_property
    def sha256(self) -> str:
        """Hash of the rule of a map; of what a system couples, and how."""
        if isinstance(self.system, Map):
            return digest(repr(self.system))
        units = [(name, u.fmu.sha256, u.parameters, u.start, u.inputs) for name, u in self.system.units.items()]
        return digest(repr((units, self.system.connections)))

    @property
    def states(self) -> list[str]:  # type: ignore[override]  # of all units, or of the map
        return list(self.rates) or [name for name, v in self.variables.items() if v.causality == "local"]


class CoupledSubject(ForeignSubject):
    """A coupled system, by the master that integrates all units as one."""

    def __init__(
        self, fmu: SystemFmu, system: CoupledSystem, parameters: Sequence[str], measured: Sequence[str]
    ) -> None:
        self._system, self._rates = system, fmu.rates
        units = system.units.items()
        self._stated = {f"{name}.{key}": value for name, unit in units for key, value in unit.parameters.items()}
        self._inputs = {f"{name}.{key}": value for name, unit in units for key, value in unit.inputs.items()}
        self._wholes: WeakKeyDictionary[Window, Window] = WeakKeyDictionary()
        super().__init__(fmu, parameters, measured)

    def _driven(self, record: Sequence[str]) -> Driver:
        return CoupledDriver(self._system, tolerance=TOLERANCE, record=record, on_zeno="hold")

    def rate_name(self, state: str) -> str:
        return self._rates[state]

    def _whole(self, window: Window) -> Window:
        """With what the system states."""
        if window not in self._wholes:
            self._wholes[window] = replace(window, inputs={**self._inputs, **window.inputs})
        return self._wholes[window]

    def trajectory(self, stretch: Stretch) -> Trajectory:
        values = {**self._stated, **stretch.values}
        return super().trajectory(replace(stretch, window=self._whole(stretch.window), values=values))

    def swept(self, window: Window, names: tuple[str, ...], rows: Vector) -> Vector:
        stated = {name: value for name, value in self._stated.items() if name not in names}
        whole = np.hstack([rows, np.tile([*stated.values()], (len(rows), 1))])
        return super().swept(self._whole(window), (*names, *stated), whole)


class MapSubject(DifferencedSubject):
    """A map, whose times are the numbers of its iterates."""

    step, half = STEP_OF_MAP, 0

    def __init__(self, fmu: SystemFmu, declared: Map, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        self._iteration = Iteration.of(declared)

    def swept(self, window: Window, names: tuple[str, ...], rows: Vector) -> Vector:
        varied = dict(zip(names, rows.T, strict=True))
        points = np.column_stack([varied.pop(name) for name in self.states])
        numbers = np.round(window.times - window.start_time).astype(int)
        iterates = [points]
        for _ in range(int(numbers[-1])):
            iterates.append(self._iteration.step(iterates[-1], varied, derivative=False).points)
        values = np.stack([iterates[number] for number in numbers], axis=1)
        if not np.isfinite(values).all():
            raise StickslipError(f"The iterates of '{self.fmu.description.modelName}' leave every bound.")
        return values

    def trajectory(self, stretch: Stretch) -> Trajectory:
        window, values = stretch.window, self.shown(stretch).values
        units = {name: str(self.fmu.variables[name].unit) for name in self.states}
        named = dict(zip(self.recorded, values.T, strict=True))
        return Trajectory(window.times, named, units, (), int(window.times[-1] - window.start_time), 0)


def opened(model: Model | Fmu | CoupledSystem | Map, *, fmi_version: str = "3.0") -> Fmu:
    """What a calibration is of, from what names it. StickslipError: there is no such model, or its units are stepped
    one by one."""
    if isinstance(model, str) and is_system(model):
        model = read_system(model, fmi_version=fmi_version)
    if isinstance(model, str) and (declared := named_map(model)) is not None:
        model = declared
    if isinstance(model, CoupledSystem):
        return SystemFmu.coupled(model)
    if isinstance(model, Map):
        return SystemFmu.of_map(model)
    if isinstance(model, Fmu):
        return model
    return (
        load(model)
        if isinstance(model, str) and model.lower().endswith(".fmu")
        else load(model, fmi_version=fmi_version)
    )


def subject_of(fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> Subject:
    """The FMU with what is asked of it. StickslipError: it or a state is an array, or times of events are asked of an
    FMU of others."""
    refuse_arrays(fmu, [*parameters, *measured])
    if isinstance(fmu, SystemFmu):
        if isinstance(fmu.system, Map):
            return MapSubject(fmu, fmu.system, parameters, measured)
        return CoupledSubject(fmu, fmu.system, parameters, measured)
    return (OwnSubject if fmu.ours else ForeignSubject)(fmu, parameters, measured)
