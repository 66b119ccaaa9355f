"""Runs of an oscillator with derivatives by all its states and some parameters, memory kept from run to run.

A tangent that comes from one state alone has terms so unlike in size where it reaches far ones that its series bears
short steps only. With many states the directions are orthonormal mixtures of all of them, and derivatives are turned
back: a quarter of the steps in a chain of 25 masses.
"""

import weakref
from collections.abc import Iterable, Sequence
from functools import cache

import numpy as np

from fmu_models.base.arrays import Vector
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import engine_of

LARGE = 20  # states, from which on they are differentiated by in mixtures, and as seldom as can be


@cache
def mixtures(n: int) -> Vector:
    """(n, n) orthonormal directions: cosines of the numbers of the states."""
    i = np.arange(n) + 0.5
    return np.sqrt(2.0 / n) * np.cos(np.pi / n * np.outer(i, i))


class Runs:
    """Of one instance.

    Args:
        strobe: the oscillator, with values of parameters that are not at their default.
        parameters: to differentiate by.
    """

    def __init__(self, strobe: Strobe, parameters: Sequence[str]) -> None:
        fmu = strobe.fmu
        engine, variables, names = engine_of(fmu), fmu.variables, (*fmu.states, *parameters)
        self._references = np.array([variables[name].valueReference for name in names], np.uint32)
        self._states, self._tolerance = self._references[: len(fmu.states)], strobe.tolerance
        self._engine, self._instance = engine, engine.take()
        self._differentiator = whole_run.Differentiator(engine, self._instance, self._references, len(fmu.states))
        weakref.finalize(self._differentiator, engine.give, self._instance)
        self._constants = {variables[name].valueReference: value for name, value in strobe.values.items()}

    @property
    def large(self) -> bool:
        """Whether a run with derivatives costs far more than one without."""
        return len(self._states) >= LARGE

    def _initial(self, x: Vector, values: Iterable[float]) -> dict[int, float]:
        """Start values by reference."""
        return {**self._constants, **dict(zip(self._references.tolist(), [*x.tolist(), *values], strict=True))}

    def differentiated(
        self, x: Vector, values: Iterable[float], times: Sequence[float]
    ) -> tuple[whole_run.Result, Vector, Vector, bool, whole_run.Passage]:
        """The run from states x (n,) at the first of the times (s), with these values of the parameters: what
        ``whole_run.Differentiator.run`` gives, and what it passes. StickslipError: it cannot be made, or has no
        derivative."""
        request = whole_run.Request(np.array(times, dtype=float), self._states)
        mixed = mixtures(len(x)) if self.large else None
        arguments = self._initial(x, values), times[0], self._tolerance, mixed
        result, by, by_times, one_sided = self._differentiator.run(request, *arguments)
        passage = self._differentiator.passage
        assert passage is not None
        if mixed is not None:
            for derivatives in (by, by_times, passage.speed_derivatives, passage.miss_derivatives):
                derivatives[..., : len(x)] = derivatives[..., : len(x)] @ mixed
        return result, by, by_times, one_sided, passage

    def end(self, x: Vector, values: Iterable[float], times: Sequence[float]) -> Vector:
        """(n,) states at the last of the times, without derivatives. StickslipError: there is no run."""
        begin = self._initial(x, values), times[0], self._tolerance
        later = np.array(times[1:], dtype=float)
        return whole_run.run(self._engine, self._instance, begin, later, self._states).values[-1]
