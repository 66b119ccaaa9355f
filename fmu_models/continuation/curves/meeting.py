"""Where a curve comes to a change of the word: a point of codimension 2, at which it ends.

from the side without the event   the condition of the curve and h = target, the target shrinking, as in
                                  special/discontinuous.py, until the rest is linear
from the side with it             the condition and v = target, the target shrinking until what is left is its
                                  square, far below the errors
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fmu_models.continuation.curves.codimension import DEPTH, displaced
from fmu_models.continuation.curves.condition import Condition, Miss
from fmu_models.continuation.problem.node import Lost, Node
from fmu_models.continuation.problem.problem import Passing
from fmu_models.continuation.special.discontinuous import LEAST_MISS, event_kind, value_border
from fmu_models.continuation.special.kinds import EXCHANGE, TOUCH

AHEAD = 3.0  # how many steps ahead an event may come or go
LEAST_SPEED = 1e-5  # of an event, in parts of what it is a unit of u away
LOST = 10.0  # by how much more than before a curve bends where its tangent is lost: two curves cross at the point


def met(kind: str, condition: Condition, node: Node, step: float) -> tuple[str, str, Node] | None:
    """The name of the point, the contact whose event comes or goes, and the motion; None if none does within a step.

    Args:
        kind: of the curve.
        node, step: a motion on the curve, and how far along it the next one could not be found.
    """
    for _, has, passing in sorted(_coming(condition, node, step), key=lambda coming: coming[0]):
        try:
            last = (_without if has == "miss" else _with)(condition, node, passing)
        except Lost:
            continue
        if np.linalg.norm(last.u - node.u) > 2.0 * AHEAD * step or node.tangent @ (last.u - node.u) < 0.0:
            continue
        return _named(kind, condition, last, passing, has), passing.contact, last
    return None


def _coming(condition: Condition, node: Node, step: float) -> Iterator[tuple[float, str, Passing]]:
    """How far ahead what may come or go."""
    own_miss = condition.of(node) if isinstance(condition, Miss) else None
    for miss in node.seen.misses:
        rate = node.along(miss.gradient)
        if miss is not own_miss and rate < 0.0 and -miss.value / rate < AHEAD * step:
            yield -miss.value / rate, "miss", miss
    for event in node.seen.events:
        rate = node.along(event.gradient) if np.isfinite(event.gradient).all() else 0.0
        if rate < 0.0 and -event.value / (2.0 * rate) < AHEAD * step:
            yield -event.value / (2.0 * rate), "event", event


def _without(condition: Condition, node: Node, miss: Passing) -> Node:
    """From the side of the miss."""
    bend = np.inf
    while True:
        miss = node.matched(miss)
        least = LEAST_MISS * miss.size(node.scales)
        if miss.value <= 1.5 * least:
            return _at_end(node, miss.value / _rate(node, miss))
        after = _shrunk(condition, node, miss, max(least, 0.03 * miss.value))
        turned = float(np.linalg.norm(after.tangent - node.tangent) / np.linalg.norm(after.u - node.u))
        if turned > LOST * bend:
            return _at_end(node, miss.value / _rate(node, miss))
        node, bend = after, turned


def _with(condition: Condition, node: Node, event: Passing) -> Node:
    """From the side of the event."""
    least = LEAST_SPEED * event.far_speed(node.scales)
    while event.value > 1.5 * least:
        node = _shrunk(condition, node, event, max(least, 0.3 * event.value))
        event = node.matched(event)
    return _at_end(node, event.value / (2.0 * _rate(node, event)))


def _rate(node: Node, passing: Passing) -> float:
    """How fast the value of a passing changes along the curve."""
    rate = node.along(passing.gradient)
    if rate == 0.0:  # as that of the curve's own condition does
        raise Lost("it does not change along the curve")
    return rate


def _at_end(node: Node, step: float) -> Node:
    """With z of the point itself, so little aside that nothing else changes."""
    return replace(node, z=(node.u - step * node.tangent) * node.scales)


def _shrunk(condition: Condition, node: Node, passing: Passing, target: float) -> Node:
    """The motion on the curve where the value of a passing is a target, or nearer to it."""
    rate = _rate(node, passing)
    for _ in range(8):
        guess = node.u + node.tangent * (target - passing.value) / rate
        try:
            step = float(np.linalg.norm(guess - node.u))
            solution = condition.solved(node, guess, value_border(passing, target), step)
            return condition.directed(solution, node.tangent)
        except Lost:
            target = (passing.value + target) / 2.0
    raise Lost("the event neither comes nor goes")


def _named(kind: str, condition: Condition, node: Node, passing: Passing, has: str) -> str:
    """What the point is."""
    event: Passing | None = passing
    if has == "miss":
        run = displaced(node, node.z, passing, 4.0 * DEPTH)
        event = None if run is None else run[0]
    name = EXCHANGE if passing.turned else TOUCH if event is None else event_kind(node.problem, event)
    if isinstance(condition, Miss):
        return f"double {kind}" if kind == name else f"{kind} and {name}"
    return f"{name} and {kind}{' with its event' if has == 'event' else ''}"
