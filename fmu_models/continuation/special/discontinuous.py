"""Where the word of a branch changes: a touch, the first stick, a tie.

On one side of such a point there is an event, whose indicator falls at a speed v > 0; on the other a near miss, whose
least value is h > 0. The point has v = h = 0.

    from the side of the miss   everything is smooth up to the point: Newton's method with the border h = target, the
                                target shrinking geometrically; from the last one, so near that the rest is linear, to 0
    from the side of the event  v = target, shrinking too; the motions are a smooth function of v, and polynomials in v
                                go to v = 0: multipliers with the event, and a guess for the side of the miss
                                (lost_event.py)
    the other side              a displacement of the start against the gradient of h makes the event happen; what the
                                event then does to the end, b, gives the motion with that event to first order:
                                    [J; grad h] dz = -(b, h)
                                and Newton's method with the border v = target the motion itself

No derivative is ever taken at the point: there the event has none.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np

from fmu_models.continuation.problem.node import Border, Lost, Node, _scaled, extrapolated, look, parameter, solved
from fmu_models.continuation.problem.problem import Passing, Problem, Seen, Vector
from fmu_models.continuation.special.kinds import COMPLIANT_GRAZING, CORNER, RIGID_GRAZING, TOUCH
from fmu_models.continuation.step.same_motion import begun_at
from fmu_models.language.contact_kinds import AWAY, STICK

LEAST_MISS = 1e-9  # the least value of a miss, in its change by a unit of u, from where the rest is linear
# displacements of a start, in u, by which an event is made to happen
DEPTHS = (1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4)
# by which the speed of an event shrinks, from motion to motion, to see whether they come to a point; curvature may
# take the event away half-way
SHRINKS = (0.5, 0.8, 0.93)
BEYOND = (1e-6, 1e-5, 1e-4, 1e-7)  # how far beyond a point, in u, the motion is looked for that goes on by other events


@dataclass(frozen=True, eq=False)
class Touch:
    """A motion that has an event or not.

    Attributes:
        node: with a miss that is so near that the rest is linear; its word has no event.
        z: of the point itself, h = 0.
        miss: the near miss of the node.
        event_side: motions with the event, of growing speed; empty if none is known.
        value_from_event: of the parameter, from the other side; nan if none.
        monodromy: (n, n) its limit there, where it is not that of the node.
        trail: motions on the way to it, where the multipliers change fast there; the last one is the node.
    """

    node: Node
    z: Vector
    miss: Passing
    event_side: tuple[Node, ...] = ()
    value_from_event: float = np.nan
    monodromy: Vector | None = None
    trail: tuple[Node, ...] = ()

    @property
    def u(self) -> Vector:
        """Unknowns of the point in their scales."""
        return self.z / self.node.scales


def value_border(like: Passing, target: float, time: float | None = None) -> Border:
    """The speed of an event, or the least value of a miss, at a value; it is followed from a time, or from its own."""
    instant = like.time if time is None else time

    def border(z: Vector, seen: Seen) -> tuple[float, Vector] | None:
        nonlocal instant
        passing = seen.match(like, instant)
        if passing is None or not np.isfinite(passing.gradient).all():
            return None
        instant = passing.time
        return passing.value - target, passing.gradient

    return border


def shrinking(start: Node, passing: Passing, through: int, least: float = 0.0) -> Iterator[tuple[Passing, Node]]:
    """Motions of a shrinking value of an event or a miss, that at the start first; the passing, and the motion.

    Args:
        through: motions through which a polynomial in the value goes to the next one.
        least: value at which it ends; it also ends where no motion of the same word follows.
    """
    node, current, shrink = start, passing, 0.5
    passed = [(passing, start)]
    yield passing, start
    while current.value > least:
        target = max(current.value * shrink, 0.99 * least)
        if len(passed) > 1:
            values = np.array([event.value for event, _ in passed[-through:]])
            guess = extrapolated(values - target, np.array([neighbour.u for _, neighbour in passed[-through:]]))
        else:
            guess = node.u + node.tangent * (target - current.value) / (node.along(current.gradient) or np.inf)
        try:
            after = node.corrected(guess, value_border(current, target), word=start.word)
        except Lost:
            if shrink > 0.9:
                return
            shrink = shrink**0.5
            continue
        match = after.seen.match(current)
        if match is None:
            return
        node, current, shrink = after, match, max(0.25, shrink * 0.8)
        passed.append((current, node))
        yield current, node


def from_miss(start: Node, miss: Passing) -> Touch:
    """The point where a miss of a motion becomes an event. Lost: the way there leaves the word of the motion."""
    node = start
    while True:
        passing = node.matched(miss)
        least = LEAST_MISS * passing.size(node.scales)
        if passing.value <= 1.5 * least:
            break
        dz, target = _towards(node, passing), max(least, 0.03 * passing.value)
        for _ in range(8):
            guess = node.u + dz * (target - passing.value)
            try:
                after = node.corrected(guess, value_border(passing, target), word=start.word)
                break
            except Lost:
                target = (passing.value + target) / 2
        else:
            raise Lost("the near miss does not become an event")
        node = after
    u = node.u - _towards(node, passing) * passing.value
    return Touch(node, u * node.scales, passing)


def begun_after(node: Node, time: float) -> Node:
    """The same motion, begun in the longest pause of the fourth of its period after a time. Lost: Newton's method does
    not find it there."""
    length = node.seen.length
    passings = (mark.time for mark in (*node.seen.events, *node.seen.misses))
    turns = ((passing - time) % length for passing in passings)
    marks = sorted({0.0, length / 4, *(turn for turn in turns if turn < length / 4)})
    gap_start, end = max(pairwise(marks), key=lambda gap: gap[1] - gap[0])
    problem, z = node.problem.later(node.z, node.seen, (time + (gap_start + end) / 2) % length)
    return begun_at(node, problem, z)


def _towards(node: Node, passing: Passing) -> Vector:
    """Change of u along the branch by the value of a passing."""
    rate = node.along(passing.gradient)
    if abs(rate) < 1e-12 * passing.size(node.scales):
        raise Lost("the miss does not change along the branch")
    return node.tangent / rate


def other_word(touch: Touch) -> Node:
    """The motion that has the event, at a small speed of it; its tangent leads away. Lost: none is near."""
    for depth, event, jump in _jumps(touch):
        step = stepped(touch.node, touch.miss, jump, depth)
        guesses = (touch.u + step - share * depth * _down(touch) for share in (0.0, 2.0, 10.0))
        for guess in (_deep(touch, touch.u + step, depth), *guesses):
            solution = with_speed(touch.node.problem, touch.node.scales, guess, event, touch)
            if solution is not None:
                return solution
    raise Lost("no motion with that event goes on from it")


def _deep(touch: Touch, u: Vector, depth: float) -> Vector:
    """u, or where it misses what it is to touch, which it may to second order, a place near it that does not."""
    node = touch.node
    for _ in range(4):
        seen = look(node.problem, u * node.scales)
        if seen is None or new_event(seen, node.seen, touch.miss) is not None:
            break
        missed = seen.match(touch.miss)
        if missed is None:
            break
        down = _down(touch)
        u = u - down * (missed.value / float(down @ (missed.gradient * node.scales)) + depth)
    return u


def _down(touch: Touch) -> Vector:
    """Unit vector of u, of the states alone, along which the miss shrinks fastest."""
    down = touch.miss.gradient * touch.node.scales
    down[touch.node.problem.width :] = 0.0
    size = float(np.linalg.norm(down))
    if size == 0.0:
        raise Lost("the miss does not depend on the state")
    return down / size


def _jumps(touch: Touch) -> Iterator[tuple[float, Passing, Vector]]:
    """Displacements of the start against the miss, the event there, and what it does to the end to first order."""
    node, scales, down = touch.node, touch.node.scales, _down(touch)
    for depth in DEPTHS:
        moved = touch.u - down * depth
        seen = look(node.problem, moved * scales)
        event = None if seen is None else new_event(seen, node.seen, touch.miss)
        if seen is None or event is None or not np.isfinite(event.gradient).all():
            continue
        yield depth, event, relative(node, seen, moved - touch.u)


def relative(node: Node, seen: Seen, displacement: Vector) -> Vector:
    """What a run beside a motion, its start displaced, misses in scaled rows beyond the linear part."""
    at_point = node.seen.residual / _row_sizes(node, node.seen)
    return seen.residual / _row_sizes(node, seen) - at_point - _scaled(node.seen, node.scales) @ displacement


def stepped(node: Node, miss: Passing, jump: Vector, depth: float) -> Vector:
    """Change of u to the motion with an event that makes such a jump, to first order."""
    down = miss.gradient * node.scales
    size = float(np.linalg.norm(down[: node.problem.width]))
    matrix = np.vstack([_scaled(node.seen, node.scales), down / size])
    try:
        solution: Any = np.linalg.solve(matrix, -np.append(jump, depth))
        return solution
    except np.linalg.LinAlgError:
        raise Lost("the miss does not change along the branch") from None


def with_speed(problem: Problem, scales: Vector, guess: Vector, event: Passing, touch: Touch) -> Node | None:
    """The motion near a guess that has the event at its speed, and goes on from the point."""
    try:
        node = solved(problem, scales, guess, value_border(event, event.value), reach=1e-2)
        match = node.seen.match(event)
        if match is None or node.word == touch.node.word or not _meets(touch, node, match):
            return None
        return growing(node, match)
    except Lost:
        return None


def exchanged(touch: Touch) -> Node:
    """The motion beyond a point where one event takes the place of another: that is of another word, or has both at one
    instant, and begins with no event that is weak. Lost: none is near."""
    node = touch.node
    straight = np.zeros_like(touch.u)
    straight[-1] = np.sign(node.tangent[-1])
    for distance, direction in product(BEYOND, (straight, node.tangent / abs(node.tangent[-1]))):
        guess = touch.u + distance * direction
        try:
            value = float(guess[-1] * node.scales[-1])
            solution = node.corrected(guess, parameter(value), reach=100 * distance)
        except Lost:
            continue
        outward = solution.tangent[-1] * node.tangent[-1] > 0.0
        solution = solution if outward else solution.turned()
        if solution.word != node.word or solution.seen.match(touch.miss) is None:
            return solution
    raise Lost("no motion of other events is near")


def _meets(touch: Touch, node: Node, event: Passing) -> bool:
    """Whether the motions with the event come to the point as its speed vanishes."""
    distance = np.abs(node.u - touch.u).max()
    for shrink in SHRINKS:
        half, value = node, event.value
        try:
            while value > 0.55 * event.value:
                value *= shrink
                guess = touch.u + shrink * (half.u - touch.u)
                half = node.corrected(guess, value_border(event, value), word=node.word)
        except Lost:
            continue
        return bool(np.abs(half.u - touch.u).max() <= 0.75 * distance + 1e-9)
    raise Lost("the event goes before it is weaker")


def _row_sizes(node: Node, seen: Seen) -> Vector:
    n = seen.width
    extra = np.abs((seen.jacobian * node.scales)[n:]).max(axis=1, initial=0.0)
    return np.append(node.scales[:n], np.where(extra > 0.0, extra, 1.0))


def new_event(seen: Seen, without: Seen, miss: Passing) -> Passing | None:
    """The event that a miss has become."""
    candidates = miss.begun_in(seen.events)
    if len(candidates) <= len(miss.begun_in(without.events)):
        return None
    return min(candidates, key=lambda candidate: abs(candidate.time - miss.time), default=None)


def growing(node: Node, event: Passing) -> Node:
    """With the tangent along which the event grows stronger."""
    match = node.seen.match(event)
    return node.turned() if match is not None and node.along(match.gradient) < 0.0 else node


def event_kind(problem: Problem, event: Passing) -> str:
    """What it is called that an event comes or goes."""
    if problem.is_rigid(event.contact):
        return RIGID_GRAZING
    if event.before == AWAY:
        return COMPLIANT_GRAZING
    return CORNER if event.after == STICK else TOUCH
