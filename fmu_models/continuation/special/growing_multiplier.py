"""Why a branch comes no further where its largest multiplier grows: what is near is told by what changes with it.

    rigid grazing    multiplier ~ 1/v of the impact that weakens (Nordmark's square root)
    homoclinic       log(multiplier) ~ period: a cycle that stays ever longer near a saddle, whose rate is their slope
    else             motions part fast all along: a stiff system

A run that begins beside the motion is wrong by the multiplier times as much after one period.
"""

from collections.abc import Sequence
from math import log, log10

import numpy as np

from fmu_models.continuation.problem.node import Node
from fmu_models.language.contact_kinds import STICK

NEUTRAL = 1e-6  # so near to 1 is a multiplier along motions that stand beside one another
HUGE = 1e3  # multiplier from which on something is said of it
BACK, GROWN = 40, 1.5  # motions back to which it is compared, at most, and by how much it has grown since, at least
ALIKE, LONGER = 0.3, 0.01  # how well a power law holds, in logarithms; how much longer a period has become that grows


def why_huge(nodes: Sequence[Node]) -> str:
    """A sentence on the largest multiplier of the last motion, begun by a semicolon; "" where it is not huge."""
    last = nodes[-1]
    size = 0.0 if last.problem.still else _largest(last)
    if not (np.isfinite(size) and size >= HUGE):
        return ""
    recent = [node for node in nodes[-BACK:] if node.word == last.word]
    sentence = f"; the largest multiplier is {size:.2g}, and {log10(size):.0f} digits of a run are lost in one period: "
    if size > GROWN * _largest(recent[0]):
        cause = _grazing(recent[0], last) or _homoclinic(recent[0], last)
        if cause:
            return sentence + cause
    folding = last.seen.length / log(size)
    return f"{sentence}motions beside it part e times in {folding:.3g} s, as those of stiff systems do"


def sticking_along(node: Node) -> str:
    """The contact whose stick lets motions stand beside one another: a multiplier is 1. "" if none does."""
    own = node.problem.own(node.multipliers)
    neutral = not node.problem.still and own.size and np.abs(own - 1.0).min() < NEUTRAL
    stuck_contacts = (miss.contact for miss in node.seen.misses if miss.before == STICK)
    return next(stuck_contacts, "") if neutral else ""


def _largest(node: Node) -> float:
    return float(np.abs(node.problem.own(node.multipliers)).max(initial=0.0))


def _grazing(first: Node, last: Node) -> str:
    grown = log(_largest(last) / _largest(first))
    for event in last.seen.events:
        before = first.seen.match(event)
        weaker = 0.0 if before is None or not 0.0 < event.value < before.value else log(before.value / event.value)
        if abs(weaker - grown) <= ALIKE * grown:
            return f"it grows as an event of '{event.contact}' weakens, to {event.value:.2g}: a grazing is near"
    return ""


def _homoclinic(first: Node, last: Node) -> str:
    longer = last.seen.length - first.seen.length
    if not last.problem.autonomous or longer < LONGER * first.seen.length:
        return ""
    rate = log(_largest(last) / _largest(first)) / longer
    return (
        f"it grows with the period, which is {last.seen.length:.6g} s, as beside a saddle whose rates add up to about "
        f"{rate:.2g} 1/s: a homoclinic motion is near"
    )
