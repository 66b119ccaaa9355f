"""What is met on a branch: bifurcations, smooth and discontinuous, and the ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any, ClassVar

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.base.errors import StickslipError
from fmu_models.continuation.curves.curve import Curve
from fmu_models.continuation.curves.trace import curve_of
from fmu_models.continuation.normal_forms.set_valued import hull_crossings
from fmu_models.continuation.problem.node import Lost, Node, _scaled, arclength, solved
from fmu_models.continuation.problem.problem import TIE, Problem, Vector, Word
from fmu_models.continuation.special import kinds
from fmu_models.continuation.special.border_collision import Collision
from fmu_models.continuation.special.discontinuous import Touch, event_kind
from fmu_models.continuation.special.lost_event import with_event
from fmu_models.continuation.special.point import SpecialPoint
from fmu_models.continuation.step.way import Found
from fmu_models.language.contact_kinds import STICK

# along the branch that crosses another one, in u: how far apart motions are compared to tell how the parameter changes
ASIDE = (1e-3, 1e-4)
MIRRORED = 1e-6  # in u: how nearly a motion is its own mirror image


@dataclass(frozen=True, eq=False, kw_only=True)
class Special(SpecialPoint):
    """A motion at which something happens.

    Attributes:
        kind: "fold", "flip", "Neimark-Sacker", "pitchfork", "branch point"; "flip of the parent", where a motion of
            twice the period ends; "Hopf", where a cycle does; "grazing, compliant", "grazing, rigid",
            "grazing-sliding corner", "sliding exchange", "touch", where the word changes; "detachment", where a contact
            begins to leave its wall at once after an impact without rebound, or to stay at it; "crossing-sliding",
            where a contact begins to stick as its slip turns round, or several do; "tie", where two events
            come at one instant; "jump", where no motion goes on; "grazing", where an indicator of an FMU of others
            begins to reach zero; "border collision", where a point of a cycle of a map comes to a border of the rule.
        period: s; points of the motion of a map.
        state: by name, at phase 0 of the forcing.
        words: of events before and after, along the branch; equal at smooth points.
        multipliers: (n,) of the motion without the event that comes or goes; at smooth points of the motion.
        multipliers_with_event: (n,) limit from the side with that event; None at smooth points and ties, and after a
            rigid touch, where the trace grows as the inverse of the speed.
        crossings: shares q at which a multiplier of (1 - q) M- + q M+ passes "+1", "-1" or, in a pair, the "circle".
        value_with_event: of the parameter, from the side of the event; nan if that is not how it was found.
        slope: d value / d speed of the impact on the side of a rigid touch; nan at others.
    """

    RECORD: ClassVar = (
        *("kind", "criticality", "normal_form", "value", "value_with_event", "period", "state", "words"),
        *("multipliers", "multipliers_with_event", "crossings", "contact", "slope", "cycles", "breaks_symmetry"),
        "border_form",
    )

    period: float
    words: tuple[Word, Word]
    multipliers: Complex
    multipliers_with_event: Complex | None = None
    value_with_event: float = np.nan
    slope: float = np.nan
    touch: Touch | None = field(default=None, repr=False)
    collision: Collision | None = field(default=None, repr=False)
    follows: Callable[[Special, int], tuple[Any, ...]] = field(default=lambda special, points: (), repr=False)

    @property
    def criticality(self) -> str:
        """As of ``SpecialPoint``; of a border collision "persistence", "nonsmooth fold" or "jump"."""
        return self.collision.form if self.collision else super().criticality

    @property
    def border_form(self) -> str:
        """The normal form of a border collision: "piecewise linear", "square root", or "power 0.33" of another root; ""
        where the rule jumps, and of other kinds."""
        q = self.collision.exponent if self.collision else np.nan
        names = {1.0: "piecewise linear", 0.5: "square root"}
        return "" if np.isnan(q) else names.get(round(2.0 * q, 2) / 2.0, f"power {q:.2g}")

    @cached_property
    def breaks_symmetry(self) -> bool:
        """Whether it is a pitchfork of a motion that is its own mirror image half a period later: each state there is
        the same or the opposite, about some middle. What leaves is not."""
        if self.kind != kinds.PITCHFORK or self.node.problem.still:
            return False
        node, n, eighth = self.node, len(self.node.problem.states), self.node.seen.length / 8
        later = (node.problem.later(node.z, node.seen, k * eighth)[1] for k in range(8))
        points = np.array([z[:n] / node.scales[:n] for z in later])
        opposite = np.ptp(points[:4] + points[4:], axis=0) < MIRRORED
        same = np.abs(points[:4] - points[4:]).max(axis=0) < MIRRORED
        return bool((opposite | same).all() and not same.all())

    @property
    def cycles(self) -> dict[str, dict[str, str]]:
        """Of a border collision: words of the cycles "below" and "above" it, up to eight turns, and whether each is
        "stable" or "unstable"; L and R where the border's function is below and above zero."""
        found = self.collision.cycles if self.collision else ()
        sides = {"below": False, "above": True}
        return {
            side: {cycle.word: "stable" if cycle.stable else "unstable" for cycle in found if cycle.above == above}
            for side, above in sides.items()
            if found
        }

    def switch(self, points: int = 2000) -> tuple[Any, ...]:
        """The branches that leave here, each a ``Branch``, over the range of the one that it was met on. points: of
        each, at most. StickslipError: none leaves at a point of this kind, or none was found."""
        branches = self.follows(self, points)
        if not branches:
            raise StickslipError(
                f"No branch was found that leaves at the {self.place}: one leaves at flips, pitchforks, branch points, "
                "and where the word changes and a multiplier passes -1."
            )
        return branches

    def curve(self, second: str, between: tuple[float, float] | None = None, points: int = 500) -> Curve:
        """The point as a curve in two parameters, the first within the range of the branch.

        Args:
            second: name of the other parameter or input.
            between: its least and largest value, its present one between them; half to twice that if left out.
            points: in each direction, at most.

        Raises:
            StickslipError: a kind that has no curve, no such parameter, a range that does not hold its present value.
        """
        meeting = self.touch or self.collision
        miss = meeting.miss if meeting else None
        return curve_of(self.kind, self.node, miss, second, between, self.between, points)

    def at(self, turns: float) -> Vector:
        """(n,) the state at a phase of the forcing, in turns; s where nothing forces the motion."""
        return self.node.state_at(turns)

    def _contents(self) -> dict[str, object]:
        spectra = {"multipliers": self.multipliers, "with event": self.multipliers_with_event}
        form = {"normal form": self.border_form} if self.border_form else {}
        return self._told({"period": self.period, "criticality": self.criticality or None} | form | spectra)


def special_of(
    finding: Found, between: tuple[float, float], follows: Callable[[Special, int], tuple[Any, ...]]
) -> Special:
    """The special point of a finding on a branch over a range. follows: the branches that leave a special, of so many
    points at most."""
    node, touch = finding.node, finding.touch
    problem, kind = node.problem, finding.kind
    before, after = (side.word if side else node.word for side in (finding.before, finding.after))
    values: dict[str, Any] = {"value": node.value, "words": (before, after), "contact": finding.contact}
    if finding.collision is not None:
        values |= _collided(problem, finding.collision)
    elif touch is None:
        if kind == kinds.BRANCH_POINT:
            kind = kinds.PARENT_FLIP if node.repeats() else branch_kind(node)
    else:
        values |= {"value": float(touch.z[-1]), "contact": touch.miss.contact}
        if kind == kinds.JUMP:
            values["words"] = node.word, ()
            rigid = problem.is_rigid(touch.miss.contact)
            kind = kinds.TIE if touch.miss.slot == TIE else kinds.RIGID_GRAZING if rigid else kinds.JUMP
        elif touch.miss.turned or touch.miss.slot == TIE:
            kind = kinds.EXCHANGE if touch.miss.turned else kinds.TIE
        else:
            kind, details = (_beginning if touch.miss.begins else _discontinuous)(finding, touch)
            values |= details
    return Special(
        kind=kind,
        parameter=problem.over,
        period=node.seen.length,
        state=dict(zip(problem.states, node.state_at(0.0).tolist(), strict=True)),
        node=node,
        touch=touch,
        between=between,
        follows=follows,
        **{"multipliers": node.multipliers, **values},
    )


def _collided(problem: Problem, collision: Collision) -> dict[str, Any]:
    """What is said of a border that a point of a cycle comes to."""
    values: dict[str, Any] = {"value": float(collision.z[-1]), "collision": collision}
    values["contact"] = collision.miss.contact
    finite = [monodromy for monodromy in collision.monodromies if monodromy is not None]
    if finite:
        values["multipliers"] = problem.multipliers(finite[0])
    if len(finite) > 1:
        values["multipliers_with_event"] = problem.multipliers(finite[1])
        values["crossings"] = hull_crossings(problem, *finite)
    return values


def _beginning(finding: Found, touch: Touch) -> tuple[str, dict[str, Any]]:
    """What is said of both sides of a point where a contact begins to stay at its wall, or to leave it at once, or to
    stick where its slip turns round."""
    node = touch.node
    sides = sorted([member for member in (touch, finding.other) if member], key=lambda member: len(member.node.word))
    matrices = [side.node.seen.monodromy if side.monodromy is None else side.monodromy for side in sides]
    multipliers = [node.problem.multipliers(matrix) for matrix in matrices]
    details: dict[str, Any] = {"multipliers": multipliers[0]}
    if len(sides) > 1:
        details |= {"multipliers_with_event": multipliers[1], "value_with_event": float(sides[1].z[-1])}
        details["crossings"] = hull_crossings(node.problem, *matrices)
    if touch.miss.slot == 0:
        return kinds.DETACHMENT, details
    same = (event for event in node.seen.events if event.contact == touch.miss.contact)
    turns = any(event.before != STICK for event in same if event.time == touch.miss.time)
    return kinds.CROSSING_SLIDING if turns else kinds.EXCHANGE, details


def _discontinuous(finding: Found, touch: Touch) -> tuple[str, dict[str, Any]]:
    """The kind of a change of the word, and what is said of its other side."""
    node = touch.node
    sides = [member for member in (finding.before, finding.after) if member is not None]
    first = touch.event_side[0] if touch.event_side else max(sides, key=lambda side: len(side.word))
    details: dict[str, Any] = {"value_with_event": touch.value_from_event}
    # the event that the point has not
    weakest = min(touch.miss.begun_in(first.seen.events), key=lambda event: event.value)
    name = event_kind(node.problem, weakest)
    if name == kinds.RIGID_GRAZING:
        # d parameter / d speed of the impact, from a motion of small speed
        return name, details | {"slope": (first.value - float(touch.z[-1])) / weakest.value}
    try:
        limit = with_event(touch, first, weakest)
    except Lost:
        return name, details
    if limit is not None:
        details["multipliers_with_event"] = node.problem.multipliers(limit[0])
        details["crossings"] = hull_crossings(node.problem, node.seen.monodromy, limit[0])
        if np.isnan(touch.value_from_event):
            details["value_with_event"] = limit[1]
    return name, details


def other_direction(node: Node) -> Vector:
    """Unit vector of u along the branch that crosses at a branch point."""
    _, _, right_vectors = np.linalg.svd(_scaled(node.seen, node.scales))
    plane = right_vectors[-2:]
    along = plane @ node.tangent
    across = plane.T @ np.array([-along[1], along[0]])
    return across / np.linalg.norm(across)


def beside(node: Node, direction: Vector, distance: float) -> Node:
    """The motion on the branch that leaves in a direction, so far along it. Lost: there is none."""
    border = arclength(node.u, direction, node.scales, distance)
    towards = direction * np.sign(distance)
    return solved(node.problem, node.scales, node.u + direction * distance, border, towards=towards, word=node.word)


def branch_kind(node: Node) -> str:
    """A pitchfork, where one of the two branches has its extreme value of the parameter; else a branch point."""
    for direction, step in product((other_direction(node), node.tangent), ASIDE):
        try:
            sides = [beside(node, direction, distance).u[-1] - node.u[-1] for distance in (step, -step)]
        except Lost:
            continue
        if max(abs(side) for side in sides) < 0.1 * step and sides[0] * sides[1] > 0.0:
            return kinds.PITCHFORK
    return kinds.BRANCH_POINT
