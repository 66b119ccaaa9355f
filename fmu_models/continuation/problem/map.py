"""What a branch of a declared map is followed of: its cycles."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.pieces import RulePieces, Sides, pieces_of
from fmu_models.continuation.problem.problem import Passing, Problem, Seen, Vector
from fmu_models.sections.iteration import Iteration


@dataclass(frozen=True, eq=False)
class MapProblem(Problem):
    """Of a declared map: cycles of ``period`` points. sides: of every border, at every point of the cycle, whose smooth
    piece of the rule holds wherever the point is; those that the point is on if left out."""

    map: Iteration
    over: str = ""
    period: int = 1
    second: str = ""
    sides: tuple[Sides, ...] | None = None

    @property
    def states(self) -> tuple[str, ...]:  # type: ignore[override] # a field of others
        return self.map.states

    @property
    def system(self) -> Iteration:
        return self.map

    @cached_property
    def pieces(self) -> RulePieces:
        """Of its rule."""
        return pieces_of(self.map.map, self.map.backward, self.parameters)

    def opened(self, second: str) -> Problem:
        self.map.check(second, np.array([self.map.values.get(second, 0.0)]))
        return replace(self, second=second)

    def present(self, name: str) -> float:
        return float(self.map.values[name])

    def see(self, z: Vector) -> Seen:
        """The images of a point, and the product of their derivatives."""
        n = len(self.states)
        at = self.map.at(**self.values(z))
        values = list(at.values.values())
        x, by = z[:n], np.eye(n, self.size)
        word: list[Sides] = []
        misses: list[Passing] = []
        for k in range(self.period):
            h, h_by = self.pieces.at_borders(x, values)
            sides = self.sides[k] if self.sides else tuple(np.where(h > 0.0, 1, -1).tolist())
            h_by = h_by[:, :n] @ by + np.pad(h_by[:, n:], ((0, 0), (n, 0))) if len(h) else h_by
            word.append(sides)
            misses += [
                Passing(name, 0, 0, side, side, float(k), side * float(h[i]), side * h_by[i])
                for i, (name, side) in enumerate(zip(self.pieces.names, sides, strict=True))
            ]
            image, slopes = self.pieces.of(sides, x, values)
            if not np.isfinite(image).all():  # derivatives need not be
                raise StickslipError(f"{self.map.name} has no step from there: the rule has no value there")
            with np.errstate(invalid="ignore"):
                x, by = at.wrapped(image), slopes[:, :n] @ by + np.pad(slopes[:, n:], ((0, 0), (n, 0)))
        letters = tuple(
            (name, word[k][i], word[(k + 1) % self.period][i])
            for k in range(self.period)
            for i, name in enumerate(self.pieces.names)
        )
        jacobian = by - np.eye(n, self.size)
        passings = (), tuple(misses)
        return Seen(at.difference(x - z[:n]), jacobian, by[:, :n], float(self.period), letters, lambda: passings)

    def sides_of(self, seen: Seen) -> tuple[Sides, ...]:
        """On which side of every border each point of a cycle is."""
        sides, many = [miss.before for miss in seen.misses], len(self.pieces.borders)
        return tuple(tuple(sides[k * many : (k + 1) * many]) for k in range(self.period))

    def scales(self, z: Vector, between: tuple[float, float]) -> Vector:
        """The box of the map."""
        return np.append(self.map.sizes(), abs(between[1] - between[0]))

    @property
    def turns(self) -> int:
        return self.period

    def shifted(self, z: Vector, seen: Seen, phase: float, like: Problem | None = None) -> Vector:
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

    def folded(self, times: int, growth: float = 1.0) -> Problem:
        """Cycles of so many times as many points."""
        return replace(self, period=self.period * times)
