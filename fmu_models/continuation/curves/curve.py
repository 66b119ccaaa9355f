"""A special point as a curve in two parameters, as it was found; ``curves/trace.py`` says how."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.formula import Formula
from fmu_models.base.shown import Pictured, Shown
from fmu_models.continuation.ended import Ended
from fmu_models.continuation.problem.node import Lost, Node, pinned
from fmu_models.continuation.problem.problem import Vector

if TYPE_CHECKING:
    import pandas

ROUNDING = 1e-12  # of the end of a range, in the scale of its parameter


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

    RECORD: ClassVar = ("kind", "parameters", "period", "state", "multipliers")

    kind: str
    parameters: Mapping[str, float]
    period: float
    state: Mapping[str, float]
    multipliers: Complex


@dataclass(frozen=True, eq=False, kw_only=True)
class Curve(Ended):
    """Of a special point.

    Attributes:
        kind: of the special point.
        second, seconds: name of the second parameter, and its values (m,).
        periods: (m,) s.
        multipliers: (m, n) largest first; without the event, where the word changes.
        meetings: points of codimension 2, in order.
        called: what the multipliers are: of equilibria they are eigenvalues, 1/s.
    """

    COLUMNS: ClassVar = ("{second}=seconds", "{over}=values", "{states}=points", "period=periods")
    RECORD: ClassVar = (
        *("kind", "over", "second", "points=pairs", "states=columns", "periods", "multipliers", "meetings"),
        "ends=named_ends",
    )

    kind: str
    second: str
    seconds: Vector
    periods: Vector
    multipliers: Complex
    meetings: tuple[CurvePoint, ...]
    nodes: tuple[Node, ...] = field(default=(), repr=False)
    condition: Any = field(default=None, repr=False)
    called: str = "multipliers"

    @property
    def pairs(self) -> Vector:
        """(m, 2) values of the second parameter and of the first."""
        return np.stack([self.seconds, self.values], axis=1)

    @property
    def columns(self) -> dict[str, Vector]:
        """(m,) of every state."""
        return {name: self.points[:, i] for i, name in enumerate(self.states)}

    def at(self, second: float) -> tuple[CurvePoint, ...]:
        """The points of the curve at a value of the second parameter."""
        index = self.nodes[0].problem.second_index
        points = []
        end = min((self.nodes[k].z[index] for k in (0, -1)), key=lambda value: abs(value - second))
        # an end of the curve is at that of its range but for rounding
        target = end if abs(end - second) <= ROUNDING * self.nodes[0].scales[index] else second
        for before, after in pairwise(self.nodes):
            low, high = before.z[index], after.z[index]
            if not min(low, high) <= target <= max(low, high) or (target == high and after is not self.nodes[-1]):
                continue
            share = (target - low) / (high - low) if high != low else 0.0
            closest = before if share < 0.5 or before.problem is not after.problem else after
            distance = (second - closest.z[index]) / closest.scales[index]
            guess = closest.u + distance * closest.tangent / closest.tangent[index]
            step = float(np.linalg.norm(guess - closest.u))
            try:
                node = self.condition.solved(closest, guess, pinned(index, second), step)
            except Lost:
                continue
            points.append(told(self.kind, node, self.condition.place(node, index)))
        return tuple(points)

    def _heading(self) -> str:
        return f"Curve of {self.kind} of {self.model} over {self.second}, {self.over}: {len(self.values)} points"

    def _contents(self) -> Mapping[str, Any]:
        kinds = [meeting.kind for meeting in self.meetings]
        return {self.second: self.seconds, self.over: self.values, "meetings": kinds, "ends": [e for e, _ in self.ends]}


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """What is shown over a parameter as a formula of it: the second parameter of a curve, or what a branch is drawn by.

    Attributes:
        formula: of that parameter and of others.
        parameters: their values.
    """

    formula: Formula
    parameters: Mapping[str, float]

    def at(self, over: str, values: Vector) -> Vector:
        """(m,) of what is shown at values (m,) of the parameter."""
        return np.broadcast_to(self.formula({**self.parameters, over: values}), np.shape(values))

    def error(self, curve: Curve) -> float:
        """The largest difference to it along a curve; nan where it has no value."""
        return float(np.abs(self.at(curve.over, curve.values) - curve.seconds).max())


@dataclass(frozen=True, eq=False)
class Curves(Pictured):
    """Those of several special points, in the same two parameters.

    Attributes:
        curves: of one at least.
        closed_form: of one kind of them, drawn beside them; None if none is known.
        failures: what could not be followed, and why.
    """

    curves: tuple[Curve, ...]
    closed_form: ClosedForm | None = None
    failures: tuple[str, ...] = ()

    @property
    def frame(self) -> "pandas.DataFrame":
        """One row per point; ``curve`` is the number of its curve."""
        import pandas

        frames = [curve.frame.assign(curve=i, kind=curve.kind) for i, curve in enumerate(self.curves)]
        return pandas.concat(frames, ignore_index=True)

    def _heading(self) -> str:
        first = self.curves[0]
        return f"{len(self.curves)} curves of {first.model} over {first.second}, {first.over}"

    def _contents(self) -> Mapping[str, Any]:
        return {f"curve {i}": f"{curve.kind}, {len(curve.values)} points" for i, curve in enumerate(self.curves)}


def told(kind: str, node: Node, z: Vector) -> CurvePoint:
    problem = node.problem
    x = problem.shifted(z, node.seen, 0.0)
    state = dict(zip(problem.states, x[: len(problem.states)].tolist(), strict=True))
    return CurvePoint(kind, problem.values(z), node.seen.length, state, node.multipliers)


def closed_form_of(node: Node, formula: Formula, parameters: Mapping[str, float]) -> ClosedForm:
    """A formula for what is shown of motions like one, with values of the parameters in it that are not given as that
    has them. StickslipError: a name that is no parameter, or the parameter that it is to be of."""
    problem, values = node.problem, dict(parameters)
    for name in formula.names:
        if name == problem.second:
            raise StickslipError(f"'{formula.text}' is to say '{name}' by '{problem.over}', and not by itself.")
        if name == problem.over or name in values:
            continue
        refuse_unknown(name, problem.system.parameters, f"'{problem.name}' has no parameter '{name}'.")
        values[name] = problem.present(name)
    return ClosedForm(formula, values)
