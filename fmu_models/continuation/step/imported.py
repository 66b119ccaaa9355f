"""A branch of somebody else's FMU followed in one direction: over events that come and go.

Such a point is located from the side without the event, by the least value of its indicator
(special/discontinuous.py). The branch goes on in the other word from beside it, with steps that grow, and is scanned
from there back to where it was; where no such point is found, or
nothing near it, it goes on from where the step has led.
"""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node, arclength
from fmu_models.continuation.special.discontinuous import Touch, from_miss
from fmu_models.continuation.special.kinds import GRAZING
from fmu_models.continuation.step.follow import Follower
from fmu_models.continuation.step.way import Found
from fmu_models.continuation.step.word_change import Ahead

# how far beyond a point, in u, the motion is looked for that goes on with the event
BESIDE = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3)


class ImportedFollower(Follower):
    """Follows motions of an FMU of others: ahead is the motion that a step has led to."""

    def _change(self, node: Node, step: float, reasons: dict[str, str]) -> Ahead | None:
        try:
            after, length = self._corrected(node, step)
        except Lost:
            return None
        return Ahead("step", after) if after.word != node.word and self._near(node, after, length) else None

    def _across(self, node: Node, ahead: Ahead) -> tuple[Node, float] | None:
        after: Node = ahead.touch
        distance, gains = float(np.linalg.norm(after.u - node.u)), len(after.word) > len(node.word)
        touch = _touched(node if gains else after.turned(), distance)
        beside = None if touch is None else _beside(touch)
        if touch is None or beside is None:
            self._add(after)
            return after, distance
        at = replace(touch.node, z=touch.z)
        away = float(np.linalg.norm(beside.u - touch.u))
        if not gains:
            self._rescan(node, replace(touch, event_side=(beside,)))
            at = at.turned()
        before, beyond = (touch.node, beside) if gains else (beside.turned(), touch.node.turned())
        self.way.meet(Found(GRAZING, at, before=before, after=beyond, contact=touch.miss.contact))
        self._add(beyond)
        return beyond, away


def _touched(node: Node, within: float) -> Touch | None:
    """The point ahead of a motion at which an indicator of it touches zero, no farther than that."""
    falling = [(node.along(miss.gradient), miss) for miss in node.seen.misses if node.along(miss.gradient) < 0.0]
    for _, miss in sorted(falling, key=lambda candidate: -candidate[1].value / candidate[0]):
        with suppress(Lost):
            touch = from_miss(node, miss)
            if -1e-9 <= node.tangent @ (touch.u - node.u) <= within:
                return touch
    return None


def _beside(touch: Touch) -> Node | None:
    """A motion with the event, its tangent leading away from the point."""
    node = touch.node
    for distance in BESIDE:
        with suppress(Lost):
            border = arclength(touch.u, node.tangent, node.scales, distance)
            solution = node.corrected(touch.u + distance * node.tangent, border, reach=100.0 * distance)
            if solution.word != node.word:
                return solution
    return None
