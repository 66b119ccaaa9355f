"""Where an event is lost along a branch, from the side that has it, and the limit of its multipliers there."""

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node, extrapolated, look, solved
from fmu_models.continuation.problem.problem import TIE, Passing, Vector
from fmu_models.continuation.special.discontinuous import LEAST_MISS, Touch, from_miss, growing, shrinking, value_border

# speeds of an event, in parts of what it is a unit of u away: down to where it is followed, and where the multipliers
# with it are extrapolated from
FIRST_SPEED, LIMIT_SPEED = 1e-5, 2e-5
LAST = 4  # motions through which a polynomial goes to the next one
SETTLED = 1e-6  # by how much the limit of the motions, in u, may still change with the last one of them


def from_event(start: Node, event: Passing) -> Touch:
    """The point where an event of a motion is lost. Lost: the way there leaves the word of the motion, or no motion
    without the event is near."""
    nodes = list(shrinking(start, event, LAST, FIRST_SPEED * event.far_speed(start.scales)))
    if len(nodes) < 4:
        raise Lost("the event is not lost along the branch")
    last_event, last = nodes[-1]
    limit, before = (
        extrapolated([shrinking_event.value for shrinking_event, _ in window], np.array([node.u for _, node in window]))
        for window in (nodes[-5:], nodes[-6:-1])
    )
    if np.abs(limit - before).max() > SETTLED:
        raise Lost("the event is not lost along the branch")
    for share in (1.0, 2.0, 4.0, 16.0):
        u = limit + _out_of_reach(last_event, last, limit, share)
        seen = look(last.problem, u * last.scales)
        if seen is not None and len(seen.word) < len(last.seen.word):
            break
    else:
        raise Lost("no run without the event is near")
    pending = [candidate for candidate in seen.misses if not candidate.begins and candidate.slot != TIE]
    miss = min(event.begun_in(pending), key=lambda candidate: abs(candidate.time - last_event.time), default=None)
    if miss is None:
        raise Lost("the event leaves no near miss behind")
    node = solved(last.problem, last.scales, u, value_border(miss, miss.value), reach=0.05)
    match = node.seen.match(miss)
    if match is None or len(node.word) >= len(last.word):
        raise Lost("no motion without the event is near")
    if node.along(match.gradient) > 0.0:
        node = node.turned()
    touch = from_miss(node, match)
    side = tuple(growing(node, passing) for passing, node in reversed(nodes))
    if np.abs(touch.u - limit).max() > 1e-4:
        raise Lost("the two sides do not meet")
    return Touch(touch.node, touch.z, touch.miss, side, float(limit[-1] * last.scales[-1]))


def _out_of_reach(event: Passing, node: Node, limit: Vector, share: float) -> Vector:
    """Change of u, of the states alone, by which the limit of a motion loses an event, so many times its speed.

    What the motion misses by less and less, as the event grows weaker, stays a miss: a motion that is its own mirror
    twin touches on both sides at once, and out of reach of one side may be within that of the other.
    """
    states, scales = len(node.problem.states), node.scales
    rows, goals = [event.gradient * scales], [-share * event.value]
    for miss in node.seen.misses:
        row, least = miss.gradient * scales, miss.size(scales)
        if not miss.begins and miss.slot != TIE and abs(miss.value + row @ (limit - node.u)) <= SETTLED * least:
            rows.append(row)
            goals.append(share * LEAST_MISS * least)
    change = np.zeros_like(limit)
    change[:states] = np.linalg.lstsq(np.array(rows)[:, :states], np.array(goals))[0]
    return change


def with_event(touch: Touch, first: Node, event: Passing) -> tuple[Vector, float] | None:
    """The monodromy matrix with an event that vanishes, and the parameter; None if it grows without bound. first,
    event: a motion with the event, at a small speed of it."""
    speed = LIMIT_SPEED * event.far_speed(first.scales)
    nodes: list[tuple[float, Node]] = [(event.value, first)]
    node, current = first, event
    for target in (speed, 2 * speed, 3 * speed, 4 * speed):
        while abs(current.value - target) > 1e-6 * target:
            goal = min(target, current.value * 4.0)
            speeds, us = [0.0, *(v for v, _ in nodes[-3:])], [touch.u, *(neighbour.u for _, neighbour in nodes[-3:])]
            guess = extrapolated(np.array(speeds) - goal, np.array(us))
            node = node.corrected(guess, value_border(current, goal), word=first.word)
            current = node.matched(current)
            nodes.append((current.value, node))
            if goal == target:
                break
    last = nodes[-4:]
    traces = [abs(np.trace(neighbour.seen.monodromy)) for _, neighbour in last]
    if traces[0] > 1.8 * traces[1] - 1e-9 and traces[0] > 10.0:
        return None
    limit = extrapolated([v for v, _ in last], np.array([neighbour.seen.monodromy for _, neighbour in last]))
    value = extrapolated([v for v, _ in last], np.array([neighbour.z[-1:] for _, neighbour in last]))
    return limit, float(value[0])
