"""The rates of a model at a point, in the contact states that hold there, and their exact derivatives.

    x' = f(x, p),    df/dx, df/dp

No step is made: the engine is started at the point, which chooses the contact states (and brings a point that sticks or
lies on a wall onto it), and is asked for its rates there.
"""

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import engine_of, indicators_of

TOLERANCE = 1e-14  # of the engine, which makes no step here


@dataclass(frozen=True, eq=False)
class FieldRates:
    """What is seen at a point, of n states.

    Attributes:
        states: (n,) where it is, after what a start does to it.
        rates: (n,) per second.
        contacts: state of each contact.
        indicators: of their events, positive while they keep their states.
    """

    states: Vector
    rates: Vector
    contacts: tuple[int, ...]
    indicators: Vector


class HasRates(Protocol):
    """What has rates at a point, at a time."""

    fmu: Fmu

    def at(self, states: Vector, parameters: Mapping[str, float] | None = None, time: float = 0.0) -> FieldRates: ...


def is_forced(field: HasRates, point: Vector) -> bool:
    """Whether a periodic signal drives the model, or rates or events at a point (n,) depend on time, looked at when no
    harmonic is the same by chance. StickslipError: the engine refuses the point."""
    if field.fmu.signals:
        return True
    first, *others = (field.at(point, time=time) for time in (0.0, 0.7310585786, 2.391046))
    return any((seen.rates != first.rates).any() or (seen.indicators != first.indicators).any() for seen in others)


class VectorField:
    """The rates of an FMU of this suite, with one instance of it.

    Args:
        fmu: that was opened.
        constants: parameters and inputs that are not at their default.

    Raises:
        StickslipError: as ``engine_of``.
    """

    def __init__(self, fmu: Fmu, constants: Mapping[str, float]) -> None:
        self.fmu = fmu
        self._constants = {self._reference(name): float(value) for name, value in constants.items()}
        self._engine = engine_of(fmu)
        self._instance = self._engine.take()
        weakref.finalize(self, self._engine.give, self._instance)
        self._states = [self._reference(name) for name in fmu.states]
        self._rates = [self._reference(f"der({name})") for name in fmu.states]
        contacts = [self._reference(f"{name}_state") for name in fmu.contacts]
        self._read = np.array([*self._states, *self._rates, *contacts, *indicators_of(fmu)], dtype=np.uint32)
        self._ends = np.cumsum([len(self._states), len(self._rates), len(contacts)])
        self.contacts = tuple(fmu.contacts)

    def _reference(self, name: str) -> int:
        return int(self.fmu.variables[name].valueReference)

    def at(
        self, states: Sequence[float] | Vector, parameters: Mapping[str, float] | None = None, time: float = 0.0
    ) -> FieldRates:
        """The rates at states (n,), with other values of parameters or inputs. StickslipError: the engine refuses the
        point."""
        self._start(states, parameters, time)
        row = whole_run.run(self._engine, self._instance, None, np.array([time]), self._read).values[0]
        states, rates, contacts, indicators = np.split(row, self._ends)
        return FieldRates(states, rates, tuple(int(state) for state in contacts), indicators)

    def slopes(
        self,
        states: Sequence[float] | Vector,
        by: Sequence[str],
        parameters: Mapping[str, float] | None = None,
        time: float = 0.0,
    ) -> Vector:
        """(n, n + len(by)) derivatives of the rates by the states and by parameters or inputs, contact states held.
        StickslipError: the engine refuses the point, or a rate has no derivative there."""
        self._start(states, parameters, time)
        seeds = [*self._states, *(self._reference(name) for name in by)]
        of = np.array(self._rates, dtype=np.uint32)
        return np.column_stack([self._engine.derivative(self._instance, of, seed) for seed in seeds])

    def _start(self, states: Sequence[float] | Vector, parameters: Mapping[str, float] | None, time: float) -> None:
        values = {self._reference(name): float(value) for name, value in (parameters or {}).items()}
        start_values = dict(zip(self._states, np.asarray(states, dtype=float).tolist(), strict=True))
        if not np.isfinite([*values.values(), *start_values.values()]).all():
            raise StickslipError(
                f"'{self.fmu.description.modelName}' has no rates at {states}: a number is not finite."
            )
        self._instance.restart({**self._constants, **values, **start_values}, time, TOLERANCE)
