"""What may be calibrated beside FMUs: coupled systems, all units integrated as one, and maps, iterate by iterate.

Both are described as an FMU is, by variables with units and first values: those of a coupled system are called
"unit.variable", and what the system states stands in place of the FMUs' own values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.cache import digest
from fmu_models.base.errors import StickslipError
from fmu_models.coupling.run import CoupledDriver
from fmu_models.coupling.system import CoupledSystem
from fmu_models.coupling.toml_system import is_system, read_system
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load, named_map
from fmu_models.importer.driver import Driver
from fmu_models.language.maps import Map
from fmu_models.sections.iteration import Iteration
from fmu_models.simulation.trajectory import Trajectory
from identification.calibration.differenced import TOLERANCE, DifferencedSubject, ForeignSubject
from identification.calibration.subject import OwnSubject, Stretch, Subject, Vector

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model

STEP = 1e-6  # relative, of a difference of iterates, which rounding alone makes inexact


@dataclass(frozen=True, eq=False)
class SystemFmu(Fmu):
    """A coupled system or a map, described as an FMU. system: it; rates: by state, empty of a map."""

    system: CoupledSystem | Map
    rates: Mapping[str, str]

    @classmethod
    def coupled(cls, system: CoupledSystem) -> SystemFmu:
        """A coupled system.

        Raises:
            StickslipError: its units are stepped one by one.
        """
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
        parameters = [("parameter", one, one.value, one.minimum, one.maximum) for one in declared.parameters]
        states = [("local", one, one.start, None, None) for one in declared.states]
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
        super().__init__(fmu, parameters, measured)

    def _driven(self, record: Sequence[str]) -> Driver:
        return CoupledDriver(self._system, tolerance=TOLERANCE, record=record, on_zeno="hold")

    def rate_name(self, state: str) -> str:
        return self._rates[state]

    def _whole(self, stretch: Stretch) -> Stretch:
        """With what the system states."""
        inputs = {**self._inputs, **stretch.inputs}
        return replace(stretch, values={**self._stated, **stretch.values}, inputs=inputs)

    def trajectory(self, stretch: Stretch) -> Trajectory:
        return super().trajectory(self._whole(stretch))

    def swept(self, stretch: Stretch, rows: Mapping[str, Vector]) -> Vector:
        runs = len(next(iter(rows.values())))
        stated = {name: np.full(runs, value) for name, value in self._stated.items()}
        return super().swept(self._whole(stretch), {**stated, **rows})


class MapSubject(DifferencedSubject):
    """A map, whose times are the numbers of its iterates."""

    step, half = STEP, 0

    def __init__(self, fmu: SystemFmu, declared: Map, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        self._iteration = Iteration.of(declared)

    def swept(self, stretch: Stretch, rows: Mapping[str, Vector]) -> Vector:
        points = np.column_stack([rows[name] for name in self.states])
        varied = {name: values for name, values in rows.items() if name not in self.states}
        numbers = np.round(stretch.times - stretch.start_time).astype(int)
        iterates = [points]
        for _ in range(int(numbers[-1])):
            iterates.append(self._iteration.step(iterates[-1], varied, derivative=False).points)
        values = np.stack([iterates[number] for number in numbers], axis=1)
        if not np.isfinite(values).all():
            raise StickslipError(f"The iterates of '{self.fmu.description.modelName}' leave every bound.")
        return values

    def trajectory(self, stretch: Stretch) -> Trajectory:
        rows = {name: np.array([value]) for name, value in {**stretch.values, **stretch.start}.items()}
        values = self.swept(stretch, rows)[0]
        units = {name: str(self.fmu.variables[name].unit) for name in self.states}
        named = dict(zip(self.recorded, values.T, strict=True))
        return Trajectory(stretch.times, named, units, (), int(stretch.times[-1] - stretch.start_time), 0)


def opened(model: Model | Fmu | CoupledSystem | Map, *, fmi_version: str = "3.0") -> Fmu:
    """What a calibration is of, from what names it.

    Raises:
        StickslipError: there is no such model, or its units are stepped one by one.
    """
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
    """The FMU with what is asked of it."""
    if isinstance(fmu, SystemFmu):
        if isinstance(fmu.system, Map):
            return MapSubject(fmu, fmu.system, parameters, measured)
        return CoupledSubject(fmu, fmu.system, parameters, measured)
    return (OwnSubject if fmu.ours else ForeignSubject)(fmu, parameters, measured)
