"""A special point of a branch as a curve in two parameters.

    residual(x, [T], p, q) = 0    the motion is periodic
    condition = 0                 it is that of a fold, a flip, ... (condition.py)

by pseudo-arclength, both ways from the point. Where another multiplier passes +1, -1 or the circle, the curve has a
point of codimension 2, which is located by Brent's method and named.

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), sections 8.1, 9.1, 10.4.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.curves.codimension import REAL, Function, functions, holds
from fmu_models.continuation.curves.condition import Condition, Determinant, Miss, Rank
from fmu_models.continuation.curves.curve import Curve, told
from fmu_models.continuation.curves.meeting import met
from fmu_models.continuation.problem.node import Lost, Node, look, pinned
from fmu_models.continuation.problem.problem import Passing, Vector
from fmu_models.continuation.special.kinds import KINDS, kind_of
from fmu_models.continuation.step.follow import LONGEST, SHORTEST, STRAIGHT, is_far
from fmu_models.continuation.step.way import Found, Way, Ways, joined, ways

FIRST = 0.02  # step, in u


def curve_of(
    kind: str,
    node: Node,
    miss: Passing | None,
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
    if second == node.problem.over:
        raise StickslipError(f"The branch is followed over '{second}' already; name another parameter.")
    if not kind_of(kind).passes and miss is None:
        raise StickslipError(f"A {kind} of an FMU of others has no curve: folds, flips and other smooth points have.")
    problem = node.problem.opened(second)
    value, index = problem.present(second), problem.second_index
    low, high = sorted(float(bound) for bound in between or (value / 2, 2 * value))
    if not (low <= value <= high and low < high and np.isfinite([low, high]).all()):
        raise StickslipError(
            f"The branch has {second} = {value:g}: give a range that holds it, found {low:g} to {high:g}."
        )
    scales, z = (np.insert(node_z, problem.width, v) for node_z, v in ((node.scales, high - low), (node.z, value)))
    seen = problem.see(z)
    condition = _condition(kind, node, miss)
    point = Node(problem, scales, z, seen, np.zeros_like(z))
    box = {index: (low, high), -1: (min(within), max(within))}
    try:
        point = condition.solved(point, point.u, pinned(index, value), 0.0)
        point = condition.directed(point, None)
    except Lost as error:
        raise StickslipError(f"The curve of the {kind} could not be begun: {error}.") from None
    return _made(kind, condition, ways(point, lambda start: _Trace(kind, condition, start, box, points).follow()))


def _condition(kind: str, node: Node, miss: Passing | None) -> Condition:
    if miss is not None:
        return Miss(miss, node.word)
    return Rank(node.word) if KINDS[kind].crosses else Determinant(KINDS[kind].passes, node.word)


class _Trace:
    """One direction of a curve."""

    def __init__(
        self, kind: str, condition: Condition, node: Node, box: Mapping[int, tuple[float, float]], points: int
    ) -> None:
        self.kind, self.condition, self.begin, self.box, self.points = kind, condition, node, box, points
        self.functions = functions(kind, condition)
        self.way = Way([node], end=("points", f"{points} were followed; ask for more"))

    def follow(self) -> Way:
        try:
            self._follow()
        except KeyboardInterrupt:
            self.way.end = ("interrupted", "what was found until then is kept")
        return self.way

    def _follow(self) -> None:
        node, step = self.begin, FIRST
        while len(self.way.nodes) < self.points:
            outward = self._outward(node)
            if outward is not None:
                name, value = node.problem.parameters[outward == -1], node.z[outward]
                self.way.end = ("range", f"{name} = {value:g} is the end of its range")
                return
            try:
                after = self._step(node, step)
            except Lost as error:
                if self._touches(node, step):
                    return
                step /= 2
                if step < SHORTEST:
                    values = node.problem.values(node.z).items()
                    at = ", ".join(f"{name} = {value:.9g}" for name, value in values)
                    self.way.end = ("unresolved", f"the curve goes no further at {at}: {error}")
                    return
                continue
            if self._is_parent(after):
                return
            for kind, meeting in self._meetings(node, after):
                self.way.meet(Found(kind, meeting))
                if kind in REAL and kind_of(self.kind).passes == "circle":
                    self.way.nodes.append(meeting)
                    self.way.end = (kind, "the pair of multipliers becomes real")
                    return
            self.way.nodes.append(after)
            if self._ended(node, after):
                return
            step = min(LONGEST, step * (1.5 if after.iterations <= 4 else 0.8))
            node = self.way.nodes[-1] = self._placed(after)

    def _step(self, node: Node, step: float) -> Node:
        """The next point of the curve, or the end of a range."""
        increment = step * node.tangent
        end = self._end(node, increment)
        if end is not None:
            after = self._solved_at(end, node, increment)
        else:
            after = self.condition.solved(node, node.u + increment, node.arclength(step), step)
            # a bent curve leaves the range where its tangent does not
            end = self._end(node, after.u - node.u)
            after = after if end is None else self._solved_at(end, node, after.u - node.u)
        after = self.condition.directed(after, node.tangent)
        if after.tangent @ node.tangent < STRAIGHT:
            raise Lost("it turns too fast")
        return after

    def _end(self, node: Node, increment: Vector) -> tuple[float, int, float] | None:
        """The share of a way in u after which it first leaves a range, and the place of that and its bound."""
        ends = []
        for index, (low, high) in self.box.items():
            value = (node.u[index] + increment[index]) * node.scales[index]
            if not low <= value <= high:
                bound = min(max(value, low), high)
                ends.append(((bound / node.scales[index] - node.u[index]) / increment[index], index, bound))
        return min(ends, default=None)

    def _solved_at(self, end: tuple[float, int, float], node: Node, increment: Vector) -> Node:
        """The point of the curve at that bound."""
        share, index, bound = end
        step = share * float(np.linalg.norm(increment))
        return self.condition.solved(node, node.u + share * increment, pinned(index, bound), step)

    def _is_parent(self, node: Node) -> bool:
        """Whether the motion has become that of half its period; the curve ends there."""
        if not node.repeats() or self.begin.repeats():
            return False
        self.way.end = ("parent", "the motion is that of half its period: it has come to a curve of its parent")
        return True

    def _touches(self, node: Node, step: float) -> bool:
        """Whether another event comes or goes within a step; the curve ends there."""
        meetings = met(self.kind, self.condition, node, step)
        if meetings is None:
            return False
        name, contact, last = meetings
        if self._is_parent(last):
            return True
        self.way.meet(Found(name, last))
        self.way.nodes.append(last)
        self.way.end = (name, f"an event of '{contact}' comes or goes")
        return True

    def at(self, node: Node, step: float) -> Node:
        """The point of the curve so far from a node along its tangent."""
        pin = node.arclength(step)
        solution = self.condition.solved(node, node.u + step * node.tangent, pin, step)
        return self.condition.directed(solution, node.tangent)

    def _outward(self, node: Node) -> int | None:
        """The place of a parameter that is at the end of its range and leaves it."""
        for index, (low, high) in self.box.items():
            at_end = min(abs(node.z[index] - low), abs(node.z[index] - high)) <= 1e-12 * (high - low)
            if at_end and node.tangent[index] * (node.z[index] - (low + high) / 2) > 0.0:
                return index
        return None

    def _ended(self, node: Node, after: Node) -> bool:
        if is_far(after, self.begin):
            self.way.end = ("infinity", "the states grow without end")
            return True
        if self._closed(node, after):
            self.way.end = ("closed", "the curve is back at its begin")
            return True
        return False

    def _closed(self, node: Node, after: Node) -> bool:
        if len(self.way.nodes) < 6 or after.problem is not self.begin.problem:
            return False
        homeward, chord = self.begin.u - node.u, after.u - node.u
        share = float(homeward @ chord / (chord @ chord))
        return bool(0.0 < share <= 1.0 and np.linalg.norm(homeward - share * chord) < 0.1 * np.linalg.norm(chord))

    def _placed(self, node: Node) -> Node:
        """At another phase, where an event is near the strobe."""
        moved = node.problem.rephased(node.z, node.seen, node.scales)
        if moved is None:
            return node
        problem, z = moved
        seen, index = look(problem, z), problem.second_index
        if seen is None:
            return node
        try:
            placed = Node(problem, problem.scales_like(node.scales), z, seen, np.zeros_like(z))
            placed = self.condition.solved(placed, placed.u, pinned(index, float(z[index])), 0.0)
            placed = self.condition.directed(placed, None)
        except Lost:
            return node
        return placed if placed.tangent[[index, -1]] @ node.tangent[[index, -1]] >= 0.0 else placed.turned()

    def _meetings(self, before: Node, after: Node) -> list[tuple[str, Node]]:
        """Points of codimension 2 between neighbours."""
        meetings = []
        length = float(before.tangent @ (after.u - before.u))
        for name, function in self.functions.items():
            ends = function(before, before), function(after, before)
            if not ends[0] * ends[1] < 0.0:
                continue

            def test(distance: float, function: Function = function) -> float:
                return function(self.at(before, distance) if distance else before, before)

            try:
                distance = float(np.asarray(brentq(test, 0.0, length, xtol=1e-13)))
                node = self.at(before, distance)
                if holds(name, function(node, before), ends, node, before):
                    meetings.append((distance, name, node))
            except (Lost, ValueError):
                continue
        return [(name, node) for _, name, node in sorted(meetings, key=lambda meeting: meeting[0])]


def _made(kind: str, condition: Condition, directions: Ways) -> Curve:
    nodes, meetings, ends = joined(*directions)
    problem = nodes[0].problem
    points = [told(kind, node, condition.place(node)) for node in nodes]
    values, seconds = (np.array([p.parameters[name] for p in points]) for name in (problem.over, problem.second))
    periods, multipliers = (np.array([getattr(p, name) for p in points]) for name in ("period", "multipliers"))
    special = tuple(told(point.kind, point.node, condition.place(point.node)) for _, point, _ in meetings)
    family: dict[str, Any] = {"model": problem.name, "states": problem.states, "units": problem.units}
    family |= {name: getattr(problem, name) for name in ("over", "second")}
    columns: dict[str, Any] = {"values": values, "seconds": seconds, "periods": periods, "multipliers": multipliers}
    columns["points"] = np.array([list(point.state.values()) for point in points])
    settings: dict[str, Any] = {"meetings": special, "ends": ends, "nodes": tuple(nodes), "condition": condition}
    return Curve(kind=kind, **family, **columns, **settings)
