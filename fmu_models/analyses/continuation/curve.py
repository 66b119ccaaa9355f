"""A special point of a branch as a curve in two parameters.

    residual(x, [T], p, q) = 0    the motion is periodic
    condition = 0                 it is that of a fold, a flip, ... (condition.py)

by pseudo-arclength, both ways from the point. Where another multiplier passes +1, -1 or the circle, the curve has a
point of codimension 2, which is located by Brent's method and named.

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), sections 8.1, 9.1, 10.4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from fmu_models.analyses.continuation.condition import Condition, Determinant, Miss, pinned
from fmu_models.analyses.continuation.node import Border, Lost, Node, _scaled, arclength, look
from fmu_models.analyses.continuation.problem import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured, Shown

# steps, in u: the first, the longest, the shortest
FIRST, LONGEST, SHORTEST = 0.02, 0.1, 1e-6
# states beyond so many times their scale, or their begin, are on their way to infinity
LARGE = 50.0
# least cosine between tangents of neighbours
STRAIGHT = 0.95
# kinds of branches' specials, and the determinant that vanishes all along their curves
SMOOTH = {"fold": "fold", "flip": "flip", "Neimark-Sacker": "Neimark-Sacker", "Hopf": "Neimark-Sacker"}
# what it is that another multiplier passes
MEETINGS = {
    ("fold", "+1"): "1:1 resonance",
    ("fold", "-1"): "fold-flip",
    ("fold", "circle"): "fold-Neimark-Sacker",
    ("flip", "+1"): "fold-flip",
    ("flip", "-1"): "1:2 resonance",
    ("flip", "circle"): "flip-Neimark-Sacker",
    ("Neimark-Sacker", "+1"): "fold-Neimark-Sacker",
    ("Neimark-Sacker", "-1"): "flip-Neimark-Sacker",
    ("Neimark-Sacker", "circle"): "double Neimark-Sacker",
    ("Neimark-Sacker", "1:3"): "1:3 resonance",
    ("Neimark-Sacker", "1:4"): "1:4 resonance",
}
PASSES = {"+1": "fold", "-1": "flip", "circle": "Neimark-Sacker"}


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
            found.append(_told(self.kind, node, self.condition.place(node, place)))
        return tuple(found)

    def _heading(self) -> str:
        return f"Curve of {self.kind} of {self.model} over {self.second}, {self.over}: {len(self.values)} points"

    def _contents(self) -> Mapping[str, Any]:
        met = [one.kind for one in self.meetings]
        return {self.second: self.seconds, self.over: self.values, "meetings": met, "ends": [e for e, _ in self.ends]}


def curve_of(
    kind: str,
    node: Node,
    miss: Any,
    second: str,
    between: tuple[float, float],
    within: tuple[float, float],
    points: int,
) -> Curve:
    """The curve of a special point.

    Args:
        node, miss: the motion there, and the near miss where the word changes, else None.
        second, between: the other parameter and its range.
        within: range of the first.
        points: in each direction, at most.

    Raises:
        StickslipError: a kind that has no curve, no such parameter, a range that does not hold the present value.
    """
    if miss is None and kind not in SMOOTH:
        raise StickslipError(
            f"A {kind} is not followed over a second parameter: folds, flips, Neimark-Sacker and Hopf points are, and "
            "all where the word changes. A pitchfork goes with a symmetry, or another parameter takes it apart."
        )
    if second == node.problem.over:
        raise StickslipError(f"The branch is followed over '{second}' already; name another parameter.")
    problem = node.problem.opened(second)
    value, n = problem.present(second), len(problem.states)
    low, high = sorted(float(one) for one in between)
    if not (low <= value <= high and low < high and np.isfinite([low, high]).all()):
        raise StickslipError(
            f"The branch has {second} = {value:g}: give a range that holds it, found {between[0]:g} to {between[1]:g}."
        )
    scales, z = np.insert(node.scales, n, high - low), np.insert(node.z, n, value)
    seen = problem.see(z)
    condition: Condition = Determinant(SMOOTH[kind], node.word) if miss is None else Miss(miss, node.word)
    begin = replace_node(node, problem, scales, z, seen)
    box = {n: (low, high), len(z) - 1: (min(within), max(within))}
    try:
        begin = condition.solved(begin, begin.u, pinned(n, value), 0.0)
        begin = _directed(condition, begin, None)
    except Lost as error:
        raise StickslipError(f"The curve of the {kind} could not be begun: {error}.") from None
    forward = _Way(condition, begin, box, points).follow()
    backward = None if forward.end[0] in ("closed", "interrupted") else _Way(condition, begin.turned(), box, points)
    return _made(kind, condition, forward, backward.follow() if backward else None)


def replace_node(node: Node, problem: Any, scales: Vector, z: Vector, seen: Any) -> Node:
    """A node of the same motion over two parameters."""
    return Node(problem, scales, z, seen, np.zeros_like(z))


def _directed(condition: Condition, node: Node, towards: Vector | None) -> Node:
    """With the tangent of the curve."""
    rows = np.vstack([_scaled(node.seen, node.scales), condition.gradient(node) * node.scales])
    rows /= np.abs(rows).max(axis=1, keepdims=True)
    tangent = np.linalg.svd(rows)[2][-1]
    sense = tangent[len(node.problem.states)] if towards is None else tangent @ towards
    return replace(node, tangent=tangent if sense >= 0.0 else -tangent)


class _Way:
    """One direction of a curve."""

    def __init__(self, condition: Condition, begin: Node, box: Mapping[int, tuple[float, float]], points: int) -> None:
        self.condition, self.begin, self.box, self.points = condition, begin, box, points
        self.nodes: list[Node] = [begin]
        self.met: list[tuple[int, str, Node]] = []
        self.end = ("points", f"{points} were followed; ask for more")

    def follow(self) -> _Way:
        try:
            self._follow()
        except KeyboardInterrupt:
            self.end = ("interrupted", "what was found until then is kept")
        return self

    def _follow(self) -> None:
        node, step = self.begin, FIRST
        while len(self.nodes) < self.points:
            place = self._outward(node)
            if place is not None:
                name, value = node.problem.parameters[place != len(node.problem.states)], node.z[place]
                self.end = ("range", f"{name} = {value:g} is the end of its range")
                return
            try:
                after = self._step(node, step)
            except Lost as error:
                step /= 2
                if step < SHORTEST:
                    at = ", ".join(f"{k} = {v:.9g}" for k, v in node.problem.values(node.z).items())
                    self.end = ("unresolved", f"the curve goes no further at {at}: {error}")
                    return
                continue
            self.met += [(len(self.nodes), kind, one) for kind, one in self._meetings(node, after)]
            self.nodes.append(after)
            if self._ended(node, after):
                return
            step = min(LONGEST, step * (1.5 if after.iterations <= 4 else 0.8))
            node = self.nodes[-1] = self._placed(after)

    def _step(self, node: Node, step: float) -> Node:
        """The next point of the curve, or the end of a range."""
        guess = node.u + step * node.tangent
        pin: Border = arclength(node.u, node.tangent, node.scales, step)
        for place, (low, high) in self.box.items():
            value = guess[place] * node.scales[place]
            if not low <= value <= high:
                bound = min(max(value, low), high)
                step = (bound / node.scales[place] - node.u[place]) / node.tangent[place]
                guess, pin = node.u + step * node.tangent, pinned(place, bound)
        after = _directed(self.condition, self.condition.solved(node, guess, pin, step), node.tangent)
        if after.tangent @ node.tangent < STRAIGHT:
            raise Lost("it turns too fast")
        return after

    def at(self, node: Node, step: float) -> Node:
        """The point of the curve so far from a node along its tangent."""
        pin = arclength(node.u, node.tangent, node.scales, step)
        return _directed(
            self.condition, self.condition.solved(node, node.u + step * node.tangent, pin, step), node.tangent
        )

    def _outward(self, node: Node) -> int | None:
        """The place of a parameter that is at the end of its range and leaves it."""
        for place, (low, high) in self.box.items():
            at_end = min(abs(node.z[place] - low), abs(node.z[place] - high)) <= 1e-12 * (high - low)
            if at_end and node.tangent[place] * (node.z[place] - (low + high) / 2) > 0.0:
                return place
        return None

    def _ended(self, node: Node, after: Node) -> bool:
        n = len(node.problem.states)
        if np.abs(after.u[:n]).max() > LARGE * max(1.0, float(np.abs(self.begin.u[:n]).max())):
            self.end = ("infinity", "the states grow without end")
            return True
        if self._closed(node, after):
            self.end = ("closed", "the curve is back at its begin")
            return True
        return False

    def _closed(self, node: Node, after: Node) -> bool:
        if len(self.nodes) < 6 or after.problem is not self.begin.problem:
            return False
        back, chord = self.begin.u - node.u, after.u - node.u
        share = float(back @ chord / (chord @ chord))
        return bool(0.0 < share <= 1.0 and np.linalg.norm(back - share * chord) < 0.1 * np.linalg.norm(chord))

    def _placed(self, node: Node) -> Node:
        """At another phase, where an event is near the strobe."""
        moved = node.problem.rephased(node.z, node.seen)
        if moved is None:
            return node
        problem, z = moved
        seen, n = look(problem, z), len(node.problem.states)
        if seen is None:
            return node
        try:
            placed = replace_node(node, problem, node.scales, z, seen)
            placed = self.condition.solved(placed, placed.u, pinned(n, float(z[n])), 0.0)
            placed = _directed(self.condition, placed, None)
        except Lost:
            return node
        return placed if placed.tangent[[n, -1]] @ node.tangent[[n, -1]] >= 0.0 else placed.turned()

    def _meetings(self, before: Node, after: Node) -> list[tuple[str, Node]]:
        """Points of codimension 2 between neighbours."""
        found = []
        whole = float(before.tangent @ (after.u - before.u))
        first, last = self._passing(before), self._passing(after)
        for name in sorted(first.keys() & last.keys()):
            if first[name] * last[name] >= 0.0:
                continue

            def test(place: float, name: str = name) -> float:
                return self._passing(self.at(before, place) if place else before)[name]

            try:
                place = float(np.asarray(brentq(test, 0.0, whole, xtol=1e-13)))
                found.append((name, self.at(before, place)))
            except (Lost, ValueError, KeyError):
                continue
        return found

    def _passing(self, node: Node) -> dict[str, float]:
        """Functions that change their signs where another multiplier passes +1, -1, the circle, by what it is then."""
        own: Any = node.problem.own(node.multipliers)
        kind = self.condition.kind if isinstance(self.condition, Determinant) else ""
        more: dict[str, float] = {}
        if kind == "Neimark-Sacker":
            pairs = [(abs(own[i] * own[j] - 1.0), i, j) for i in range(len(own)) for j in range(i)]
            _, i, j = min(pairs)
            cosine = float((own[i] + own[j]).real) / 2.0
            more = {"1:3": cosine + 0.5, "1:4": cosine}
            own = np.delete(own, [i, j])
        elif kind:
            own = np.delete(own, np.abs(own - (1.0 if kind == "fold" else -1.0)).argmin())
        pairs = [own[i] * own[j] for i in range(len(own)) for j in range(i)]
        found = {"+1": float(np.prod(own - 1.0).real), "-1": float(np.prod(own + 1.0).real), **more}
        if pairs and (np.abs(own.imag) > 1e-9).any():
            found["circle"] = float(np.prod(np.array(pairs) - 1.0).real)
        return {MEETINGS[kind, name] if kind else PASSES[name]: value for name, value in found.items()}


def _told(kind: str, node: Node, z: Vector) -> CurvePoint:
    problem = node.problem
    x = z if problem.autonomous else problem.shifted(z, node.seen, 0.0)
    state = dict(zip(problem.states, x[: len(problem.states)].tolist(), strict=True))
    return CurvePoint(kind, problem.values(z), node.seen.length, state, node.multipliers)


def _made(kind: str, condition: Condition, forward: _Way, backward: _Way | None) -> Curve:
    nodes, met, ends = list(forward.nodes), list(forward.met), [forward.end, forward.end]
    if backward is not None:
        ends[0] = backward.end
        nodes = [node.turned() for node in reversed(backward.nodes[1:])] + nodes
        met = list(reversed(backward.met)) + met
    problem = nodes[0].problem
    told = [_told(kind, node, condition.place(node)) for node in nodes]
    name: Callable[[str], str] = (lambda one: one) if isinstance(condition, Determinant) else f"{kind} and {{}}".format
    return Curve(
        kind,
        problem.name,
        problem.over,
        problem.second,
        problem.states,
        np.array([one.parameters[problem.over] for one in told]),
        np.array([one.parameters[problem.second] for one in told]),
        np.array([list(one.state.values()) for one in told]),
        np.array([one.period for one in told]),
        np.array([one.multipliers for one in told]),
        tuple(_told(name(one), node, condition.place(node)) for _, one, node in met),
        (ends[0], ends[1]),
        tuple(nodes),
        condition,
    )
