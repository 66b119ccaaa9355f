"""A special point as a curve in two parameters, as it was found; how, says trace.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.analyses.continuation.condition import pinned
from fmu_models.analyses.continuation.node import Lost, Node
from fmu_models.analyses.continuation.problem import Vector
from fmu_models.base.shown import Pictured, Shown


@dataclass(frozen=True, eq=False)
class CurvePoint(Shown):
    """One motion on a curve.

    Attributes:
        kind: of the point of codimension 2; that of the curve at others.
        parameters: values of both, by name.
        period: s; points of the motion of a map.
        state: by name, at phase 0 of the forcing.
        multipliers: (n,) without the event, where the word changes.
    """

    kind: str
    parameters: Mapping[str, float]
    period: float
    state: Mapping[str, float]
    multipliers: NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Curve(Pictured):
    """Of m points, n states.

    Attributes:
        kind: of the special point.
        model, over, second: names of the model and of the two parameters.
        states: names.
        values, seconds: (m,) of both parameters.
        points: (m, n) states at phase 0 of the forcing.
        periods: (m,) s.
        multipliers: (m, n) largest first; without the event, where the word changes.
        meetings: points of codimension 2, in order.
        ends: kind and a sentence, of both ends.
        units: of states and parameters.
    """

    kind: str
    model: str
    over: str
    second: str
    states: tuple[str, ...]
    values: Vector
    seconds: Vector
    points: Vector
    periods: Vector
    multipliers: NDArray[np.complex128]
    meetings: tuple[CurvePoint, ...]
    ends: tuple[tuple[str, str], tuple[str, str]]
    units: Mapping[str, str] = field(default_factory=dict)
    nodes: tuple[Node, ...] = field(default=(), repr=False)
    condition: Any = field(default=None, repr=False)

    @property
    def frame(self) -> Any:
        """One row per point."""
        import pandas

        columns: dict[str, Any] = {self.second: self.seconds, self.over: self.values}
        columns |= {name: self.points[:, i] for i, name in enumerate(self.states)}
        return pandas.DataFrame(columns | {"period": self.periods})

    def at(self, second: float) -> tuple[CurvePoint, ...]:
        """The points of the curve at a value of the second parameter."""
        place = len(self.states)
        found = []
        for before, after in pairwise(self.nodes):
            low, high = before.z[place], after.z[place]
            if not min(low, high) <= second <= max(low, high) or (second == high and after is not self.nodes[-1]):
                continue
            share = (second - low) / (high - low) if high != low else 0.0
            near = before if share < 0.5 or before.problem is not after.problem else after
            guess = near.u + (second - near.z[place]) / near.scales[place] * near.tangent / near.tangent[place]
            step = float(np.linalg.norm(guess - near.u))
            try:
                node = self.condition.solved(near, guess, pinned(place, second), step)
            except Lost:
                continue
            found.append(told(self.kind, node, self.condition.place(node, place)))
        return tuple(found)

    def _heading(self) -> str:
        return f"Curve of {self.kind} of {self.model} over {self.second}, {self.over}: {len(self.values)} points"

    def _contents(self) -> Mapping[str, Any]:
        met = [one.kind for one in self.meetings]
        return {self.second: self.seconds, self.over: self.values, "meetings": met, "ends": [e for e, _ in self.ends]}


@dataclass(frozen=True, eq=False)
class Curves(Pictured):
    """Those of several special points, in the same two parameters."""

    curves: tuple[Curve, ...]

    @property
    def frame(self) -> Any:
        """One row per point; ``curve`` is the number of its curve."""
        import pandas

        frames = [one.frame.assign(curve=i, kind=one.kind) for i, one in enumerate(self.curves)]
        return pandas.concat(frames, ignore_index=True)

    def _heading(self) -> str:
        first = self.curves[0]
        return f"{len(self.curves)} curves of {first.model} over {first.second}, {first.over}"

    def _contents(self) -> Mapping[str, Any]:
        return {f"curve {i}": f"{one.kind}, {len(one.values)} points" for i, one in enumerate(self.curves)}


def told(kind: str, node: Node, z: Vector) -> CurvePoint:
    problem = node.problem
    x = z if problem.autonomous else problem.shifted(z, node.seen, 0.0)
    state = dict(zip(problem.states, x[: len(problem.states)].tolist(), strict=True))
    return CurvePoint(kind, problem.values(z), node.seen.length, state, node.multipliers)
