"""Changes of the word that lie ahead of a motion of a branch: which comes next, and a motion beyond it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node
from fmu_models.continuation.problem.problem import TIE, Passing
from fmu_models.continuation.special.detachment import from_vanishing
from fmu_models.continuation.special.discontinuous import Touch, exchanged, from_miss, other_word
from fmu_models.continuation.special.lost_event import from_event
from fmu_models.continuation.special.several import at_once, with_all
from fmu_models.language.contact_kinds import AWAY, RELEASED, STICK

AHEAD = 6.0  # how many steps ahead an event may be lost or come


@dataclass(frozen=True, eq=False)
class Ahead:
    """A change of the word that lies ahead: of what the present motion has, a "miss", an "event", the "begin" of a
    state or a "tie" of two events, with its ``Touch``; of an equilibrium a "surface", with its ``Boundary``."""

    kind: str
    touch: Any


# how the point is located where one vanishes
LOCATED = {"miss": from_miss, "event": from_event, "begin": from_vanishing, "tie": from_vanishing}


def next_change(node: Node, step: float, between: Sequence[float], reasons: dict[str, str]) -> Ahead | None:
    """The next change of the word, if it is seen to come within some steps and in the range of the parameter; why not
    goes to ``reasons``."""
    # where a wall begins to hold, or to be left, other events of it come as near as that
    order = sorted(_coming(node, step), key=lambda coming: (coming[1] != "begin" or coming[2].slot, coming[0]))
    for _, kind, passing in order:
        name = f"{kind} of {passing.contact} at {passing.time:.6g} s"
        if name in reasons:
            continue
        try:
            touch = LOCATED[kind](node, passing)
            ahead = node.tangent @ (touch.u - node.u) >= -1e-9
            if not ahead or not between[0] <= touch.z[-1] <= between[1]:
                raise Lost("the point lies elsewhere")
            return Ahead(kind, touch)
        except Lost as error:
            reasons[name] = str(error)
    return None


def _coming(node: Node, step: float) -> list[tuple[float, str, Passing]]:
    """What would be lost or come along the tangent, and in which distance."""
    coming: list[tuple[float, str, Passing]] = []
    for miss in node.seen.misses:
        rate = node.along(miss.gradient)
        if rate < 0.0 and -miss.value / rate < AHEAD * step:
            kind = "begin" if miss.begins else "tie" if miss.slot == TIE else "miss"
            coming.append((-miss.value / rate, kind, miss))
    begun = [miss.time for _, kind, miss in coming if kind == "begin" and miss.slot == 0]
    for event in node.seen.events:
        begins = event.before in (AWAY, STICK) or event.after in (STICK, RELEASED) or event.before * event.after == -1
        if begins and event.time not in begun and np.isfinite(event.gradient).all():
            rate = node.along(event.gradient)
            if rate < 0.0 and -event.value / rate < 2.0 * AHEAD * step:
                coming.append((-event.value / (2.0 * rate), "event", event))
    return coming


def beyond(kind: str, touch: Touch) -> tuple[Node, Touch]:
    """A motion of other events beyond a point, and the point: that of an exchange, if that is what it is. Of several
    events that come at once it has all."""
    if touch.miss.turned or kind in ("begin", "tie"):
        return exchanged(touch), touch
    if len(at_once(touch)) > 1:
        nodes = with_all(touch)
        if nodes is not None:
            return nodes, touch
        if touch.node.problem.is_rigid(touch.miss.contact):
            raise Lost("several events come at once, and no motion with all of them goes on from it")
    try:
        return other_word(touch), touch
    except Lost:
        if touch.miss.slot != 1:
            raise
    # at rest against one contact the slip at another one is least at all times, and at none
    after = exchanged(touch)
    return after, replace(touch, miss=replace(touch.miss, turned=True))
