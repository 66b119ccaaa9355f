"""The rates of somebody else's FMU at a point, and their derivatives.

What holds there is told by the signs of its event indicators and by its discrete variables: each counts as a contact,
a sign as 1 (above zero) or -1. Derivatives by the states are made in that mode, by the FMU's directional derivatives or
by differences of its rates; those by parameters are differences of rates that keep to it, on one side where a surface
is near.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.imported import indicator
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.flow import Flow, FlowDriver
from fmu_models.importer.request import is_number
from fmu_models.simulation.field import FieldRates, Vector

APART = 1e-3  # of the size of a number: distance between the points of a difference of fourth order
# places of the points, and their weights: central, and on one side
CENTRAL = np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
ONE_SIDED = np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0
MODES = 10  # of a mode that no sign tells, beside those of signs and of what sticks


class ImportedField:
    """The rates of an FMU of others, with one instance of it; as ``Field`` for those of this suite.

    Args:
        fmu: for Model Exchange, with states that can be set.
        constants: parameters and inputs that are not at their default.

    Raises:
        StickslipError: as ``FlowDriver``.
    """

    def __init__(self, fmu: Fmu, constants: Mapping[str, float]) -> None:
        self.fmu, self.constants = fmu, dict(constants)
        discrete = [
            name
            for name, variable in fmu.variables.items()
            if variable.variability == "discrete" and is_number(fmu, name)
        ]
        self._driver = FlowDriver(fmu, record=discrete)
        count = int(fmu.description.numberOfEventIndicators or 0)
        self.contacts = (*(indicator(i) for i in range(count)), *discrete)

    @property
    def directional(self) -> bool:
        """Whether the FMU offers directional derivatives."""
        return self._driver.directional

    @cached_property
    def _name(self) -> str:
        return str(self.fmu.description.modelName)

    def at(
        self, states: Sequence[float] | Vector, parameters: Mapping[str, float] | None = None, time: float = 0.0
    ) -> FieldRates:
        """The rates at states (n,), with other values of parameters or inputs. StickslipError: the FMU refuses the
        point, or moves it."""
        return self._seen(self._flow(states, parameters, time))

    def _flow(
        self,
        states: Sequence[float] | Vector,
        parameters: Mapping[str, float] | None,
        time: float,
        slopes: bool = False,
    ) -> Flow:
        x = np.asarray(states, dtype=float)
        if not np.isfinite(x).all():
            raise StickslipError(f"'{self._name}' has no rates at {states}: a number is not finite.")
        values = {**self.constants, **(parameters or {}), **dict(zip(self.fmu.states, x.tolist(), strict=True))}
        flow = self._driver.follow(values, time, time, derivative=True, slopes=slopes)
        if (flow.start != x).any():
            raise StickslipError(f"'{self._name}' moves its states at the start, from {x.tolist()}.")
        return flow

    def _seen(self, flow: Flow) -> FieldRates:
        signs = [1 if value > 0.0 else -1 for value in flow.indicators]
        modes = [MODES + round(number) for number in flow.recorded.tolist()]
        return FieldRates(flow.start, flow.start_rates, (*signs, *modes), np.abs(flow.indicators))

    def slopes(
        self,
        states: Sequence[float] | Vector,
        by: Sequence[str],
        values: Mapping[str, float] | None = None,
        time: float = 0.0,
    ) -> Vector:
        """(n, n + len(by)) derivatives of the rates by the states and by parameters or inputs, the mode held.
        StickslipError: the FMU refuses the point, or surfaces are too near on both sides of a parameter."""
        flow = self._flow(states, values, time, slopes=True)
        constants, mode = {**self.constants, **(values or {})}, self._seen(flow).contacts
        columns = []
        for name in by:
            value = float(constants.get(name, self.fmu.start_of(name)))
            width = APART * (abs(value) or 1.0)
            for sense, (places, weights) in ((1.0, CENTRAL), (1.0, ONE_SIDED), (-1.0, ONE_SIDED)):
                beside = [{**(values or {}), name: value + sense * offset * width} for offset in places]
                samples = [self.at(states, sample_values, time) for sample_values in beside]
                if all(sample.contacts == mode for sample in samples):
                    columns.append(sense * (weights @ np.array([sample.rates for sample in samples])) / width)
                    break
            else:
                raise StickslipError(f"'{self._name}' has no derivative by {name}: surfaces are near on both sides.")
        return np.column_stack([flow.slopes, *columns])

    def how(self, states: Vector, values: Mapping[str, float]) -> str:
        """Where derivatives come from, and how near those by the states are at a point."""
        derivative, x = self.slopes(states, (), values), np.asarray(states, dtype=float)
        spacing = APART * np.maximum(np.abs(x), 1.0)
        places, weights = CENTRAL
        others = [
            weights @ np.array([self.at(x + offset * width * unit, values).rates for offset in places]) / width
            for width, unit in zip(spacing, np.eye(len(x)), strict=True)
        ]
        within = max(float(np.abs(derivative - np.array(others).T).max()), 1e-15)
        by = "its directional derivatives" if self.directional else "differences of its rates"
        return (
            f"rates of the FMU, derivatives by {by} and, by the parameter, by differences; those by the states are "
            f"within {within:.1g} 1/s of other differences at the start"
        )
