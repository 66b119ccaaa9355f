"""What a branch of a declared map is followed of: its cycles."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.problem import Problem, Seen, Vector
from fmu_models.sections.iteration import Iteration


@dataclass(frozen=True, eq=False)
class MapProblem(Problem):
    """Of a declared map: cycles of ``period`` points."""

    map: Iteration
    over: str = ""
    period: int = 1
    second: str = ""

    @property
    def states(self) -> tuple[str, ...]:  # type: ignore[override] # a field of others
        return self.map.states

    @property
    def system(self) -> Iteration:
        return self.map

    @cached_property
    def _by_parameters(self) -> Callable[..., list[list[Any]]]:
        declared = self.map.map
        rule = (declared.inverse if self.map.backward else declared.rule) or {}
        symbols = [next(p for p in declared.parameters if p.name == name) for name in self.parameters]
        slopes = [[sympy.diff(rule[x], symbol) for symbol in symbols] for x in declared.states]
        return sympy.lambdify([*declared.states, *declared.parameters], slopes, "numpy")

    def opened(self, second: str) -> Problem:
        self.map.check(second, np.array([self.map.values.get(second, 0.0)]))
        return replace(self, second=second)

    def present(self, name: str) -> float:
        return float(self.map.values[name])

    def see(self, z: Vector) -> Seen:
        """The images of a point, and the product of their derivatives."""
        n = len(self.states)
        at = self.map.at(**self.values(z))
        x, monodromy, by_values = z[:n], np.eye(n), np.zeros((n, len(self.parameters)))
        for _ in range(self.period):
            slopes = np.array(self._by_parameters(*x, *at.values.values()), float)
            step = at.step(x[None])
            if step.why:
                raise StickslipError(f"{self.map.name} has no step from there: {next(iter(step.why.values()))}")
            monodromy, by_values = step.derivatives[0] @ monodromy, step.derivatives[0] @ by_values + slopes
            x = step.points[0]
        residual = at.difference(x - z[:n])
        return Seen(residual, np.column_stack([monodromy - np.eye(n), by_values]), monodromy, float(self.period))

    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """The box of the map."""
        return np.append(self.map.sizes(), abs(between[1] - between[0]))

    @property
    def turns(self) -> int:
        return self.period

    def shifted(self, z: Vector, seen: Seen, phase: float) -> Vector:
        n = len(self.states)
        x = z[None, :n]
        for _ in range(round(phase) % self.period):
            x = self.map.at(**self.values(z)).step(x, derivative=False).points
        return np.append(x[0], z[n:])

    def beside(self, z: Vector, other: Vector) -> Vector:
        moved = z.copy()
        angles = np.flatnonzero(np.isfinite(self.map.turns))
        turns = self.map.turns[angles]
        moved[angles] += turns * np.rint((other - z)[angles] / turns)
        return moved

    def told(self) -> dict[str, Any]:
        return {"period": self.period}

    def like(self, identity: Mapping[str, Any]) -> Problem:
        return replace(self, period=identity["period"])

    def folded(self, times: int) -> Problem:
        """Cycles of so many times as many points."""
        return replace(self, period=self.period * times)
