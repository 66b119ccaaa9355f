"""A special point of a branch as a curve in two parameters.

    residual(x, [T], p, q) = 0    the motion is periodic
    condition = 0                 it is that of a fold, a flip, ... (condition.py)

by pseudo-arclength, both ways from the point. Where another multiplier passes +1, -1 or the circle, the curve has a
point of codimension 2, which is located by Brent's method and named.

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), sections 8.1, 9.1, 10.4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fmu_models.analyses.continuation.condition import Condition, Determinant, Miss, pinned
from fmu_models.analyses.continuation.curve import Curve, told
from fmu_models.analyses.continuation.discontinuous import size_of
from fmu_models.analyses.continuation.node import Border, Lost, Node, _scaled, arclength, look
from fmu_models.analyses.continuation.problem import Vector
from fmu_models.base.errors import StickslipError

# kinds of branches' specials, and the determinant that vanishes all along their curves
SMOOTH = {"fold": "fold", "flip": "flip", "Neimark-Sacker": "Neimark-Sacker", "Hopf": "Neimark-Sacker"}
# steps, in u: the first, the longest, the shortest
FIRST, LONGEST, SHORTEST = 0.02, 0.1, 1e-6
# states beyond so many times their scale, or their begin, are on their way to infinity
LARGE = 50.0
# of its change by a unit of u: the least value of a miss, or the speed of an event, that is about to vanish
NEAR = 1e-5
# least cosine between tangents of neighbours
STRAIGHT = 0.95
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
    ("Neimark-Sacker", "1:1"): "1:1 resonance",
    ("Neimark-Sacker", "1:2"): "1:2 resonance",
    ("Neimark-Sacker", "1:3"): "1:3 resonance",
    ("Neimark-Sacker", "1:4"): "1:4 resonance",
}
# where the pair of a Neimark-Sacker point becomes real: beyond, its determinant vanishes at saddles
REAL = ("1:1 resonance", "1:2 resonance")
PASSES = {"+1": "fold", "-1": "flip", "circle": "Neimark-Sacker"}


def curve_of(
    kind: str,
    node: Node,
    miss: Any,
    second: str,
    between: tuple[float, float] | None,
    within: tuple[float, float],
    points: int,
) -> Curve:
    """The curve of a special point.

    Args:
        node, miss: the motion there, and the near miss where the word changes, else None.
        second, between: the other parameter and its range; half to twice its value if left out.
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
    low, high = sorted(float(one) for one in between or (value / 2, 2 * value))
    if not (low <= value <= high and low < high and np.isfinite([low, high]).all()):
        raise StickslipError(
            f"The branch has {second} = {value:g}: give a range that holds it, found {low:g} to {high:g}."
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


def _stuck(node: Node, error: Lost) -> tuple[str, str]:
    """Why a curve goes no further."""
    at = ", ".join(f"{name} = {value:.9g}" for name, value in node.problem.values(node.z).items())
    near = [
        one for one in (*node.seen.misses, *node.seen.events) if 0.0 <= one.value < NEAR * size_of(one, node.scales)
    ]
    if near:
        return "event", f"an event of '{near[0].contact}' comes or goes at {at}"
    return "unresolved", f"the curve goes no further at {at}: {error}"


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
                    self.end = _stuck(node, error)
                    return
                continue
            for kind, one in self._meetings(node, after):
                self.met.append((len(self.nodes), kind, one))
                if kind in REAL and self.condition.kind == "Neimark-Sacker":
                    self.nodes.append(one)
                    self.end = (kind, "the pair of multipliers becomes real")
                    return
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
        kind = self.condition.kind
        more: dict[str, float] = {}
        if kind == "Neimark-Sacker":
            pairs = [(abs(own[i] * own[j] - 1.0), i, j) for i in range(len(own)) for j in range(i)]
            _, i, j = min(pairs)
            cosine = float((own[i] + own[j]).real) / 2.0
            more = {"1:1": cosine - 1.0, "1:2": cosine + 1.0, "1:3": cosine + 0.5, "1:4": cosine}
            own = np.delete(own, [i, j])
        elif kind:
            own = np.delete(own, np.abs(own - (1.0 if kind == "fold" else -1.0)).argmin())
        pairs = [own[i] * own[j] for i in range(len(own)) for j in range(i)]
        found = {"+1": float(np.prod(own - 1.0).real), "-1": float(np.prod(own + 1.0).real), **more}
        if pairs and (np.abs(own.imag) > 1e-9).any():
            found["circle"] = float(np.prod(np.array(pairs) - 1.0).real)
        return {MEETINGS[kind, name] if kind else PASSES[name]: value for name, value in found.items()}


def _made(kind: str, condition: Condition, forward: _Way, backward: _Way | None) -> Curve:
    nodes, met, ends = list(forward.nodes), list(forward.met), [forward.end, forward.end]
    if backward is not None:
        ends[0] = backward.end
        nodes = [node.turned() for node in reversed(backward.nodes[1:])] + nodes
        met = list(reversed(backward.met)) + met
    problem = nodes[0].problem
    all_told = [told(kind, node, condition.place(node)) for node in nodes]
    name: Callable[[str], str] = (lambda one: one) if isinstance(condition, Determinant) else f"{kind} and {{}}".format
    return Curve(
        kind,
        problem.name,
        problem.over,
        problem.second,
        problem.states,
        np.array([one.parameters[problem.over] for one in all_told]),
        np.array([one.parameters[problem.second] for one in all_told]),
        np.array([list(one.state.values()) for one in all_told]),
        np.array([one.period for one in all_told]),
        np.array([one.multipliers for one in all_told]),
        tuple(told(name(one), node, condition.place(node)) for _, one, node in met),
        (ends[0], ends[1]),
        tuple(nodes),
        condition,
    )
