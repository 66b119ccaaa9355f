"""Branches: periodic motions followed over a parameter, stable or not, through every bifurcation on the way.

Semantics.

    a branch     motions z(s), smooth in s within one word of events
    its points   value, state, period, multipliers, stability, word
    its specials kinds as in ``special.Special``; found once each, in the order of the branch
    its ends     "range"       the parameter leaves its range
                 "closed"      the branch is back at its begin, up to whole periods of the forcing
                 "flip"        a motion of twice the period has come to the flip of its parent
                 "parent"      the same, where the word changes
                 "start"       where it branched off another one
                 "jump"        the motion touches something, and what then happens does not go on from it; or it depends
                               on which of two events that come at once is the first
                 "chatter"     impacts are added without end, or infinitely many no longer come to rest
                 "equilibrium" a cycle has shrunk to nothing
                 "bounds"      the parameter comes to where there is no such model
                 "points"      as many as were asked for
                 "infinity"    the states grow beyond all bounds
                 "interrupted" by the keyboard
                 "unresolved"  says why

    begin   correct the start by Newton's method; move the strobe into a free arc
    follow  forward and, unless that closed, backward (step/follow.py)
    switch  at a flip: twice the period, along the eigenvector of -1; at a branch point: along the other null vector;
            where the word changes: the motion of twice the period that has the event in one of its halves alone

Sources: Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), for the set-valued multipliers;
Kuznetsov, Elements of Applied Bifurcation Theory (2004), chapter 10, for pseudo-arclength, test functions, switching.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fmu_models.continuation.ended import Ended
from fmu_models.continuation.kept import Keeper
from fmu_models.continuation.leaving import leaving
from fmu_models.continuation.problem.imported import ImportedProblem
from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.problem.problem import Problem, Vector, Word
from fmu_models.continuation.special.special import Special, special_of, state_at
from fmu_models.continuation.step.follow import Follower
from fmu_models.continuation.step.imported import ImportedFollower
from fmu_models.continuation.step.same_motion import passes
from fmu_models.continuation.step.way import Found, Way

# what a picture shows in place of a state
MULTIPLIER, PERIOD = "multiplier", "period"


@dataclass(frozen=True, eq=False)
class Branch(Ended):
    """Of m points, n states.

    Attributes:
        model, over: names of the model and of the parameter.
        states: names.
        values: (m,) of the parameter.
        points: (m, n) states at phase 0 of the forcing; where nothing forces the motion, somewhere on it.
        periods: (m,) s.
        multipliers: (m, n) largest first.
        stable: (m,).
        words: of each point.
        special: what was met, in order.
        places: (len(special),) number of points before each.
        ends: kind and a sentence, of both ends.
        every: periods of the forcing in one of the motion.
        seconds: CPU time.
        how: where motions come from, and how near they are, where that is not a matter of course.
        units: of states and of the parameter.
    """

    COLUMNS: ClassVar = (
        "{over}=values",
        "{states}=points",
        "period=periods",
        "stable",
        "multiplier{}=multipliers",
        "word=texts",
    )
    RECORD: ClassVar = ("every", "ends=named_ends", "points=count", "special")

    model: str
    over: str
    states: tuple[str, ...]
    values: Vector
    points: Vector
    periods: Vector
    multipliers: NDArray[np.complex128]
    stable: NDArray[np.bool_]
    words: tuple[Word, ...]
    special: tuple[Special, ...]
    places: tuple[int, ...]
    ends: tuple[tuple[str, str], tuple[str, str]]
    every: int = 1
    seconds: float = 0.0
    how: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    nodes: tuple[Any, ...] = field(default=(), repr=False)
    between: tuple[float, float] = (-np.inf, np.inf)

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.values)

    @property
    def texts(self) -> list[str]:
        """The word of each point, in a line."""
        return [word_text(word) for word in self.words]

    @property
    def of(self) -> str:
        """What a picture shows: the first state; where nothing forces the motion the period, which has no phase."""
        return PERIOD if self.nodes and self.nodes[0].problem.autonomous else self.states[0]

    @cached_property
    def images(self) -> Vector:
        """(every, m, n) points at phases 0, 1, ... of the forcing."""
        if self.every == 1 or not self.nodes:
            return self.points[None]
        others = [[state_at(node, float(turn)) for node in self.nodes] for turn in range(1, self.every)]
        return np.stack([self.points, *np.array(others)])

    def passes(self, branch: Branch) -> bool:
        """Whether this branch runs through the middle of another one."""
        return passes(self.nodes, branch.nodes[len(branch.nodes) // 2])

    def _heading(self) -> str:
        return f"Branch of {self.model} over {self.over}: {len(self.values)} motions, {len(self.special)} special"

    def _contents(self) -> Mapping[str, Any]:
        specials = [f"{special.kind} {special.value:.9g}" for special in self.special]
        return {self.over: self.values, "special": specials, "ends": [kind for kind, _ in self.ends]}


def word_text(word: Word) -> str:
    """Events in a line: contact, state before and after."""
    return " ".join(f"{contact}:{before}>{after}" for contact, before, after in word)


def joined(
    forward: Way, backward: Way | None
) -> tuple[list[Node], list[tuple[int, Found, bool]], tuple[tuple[str, str], tuple[str, str]]]:
    """One way, or two from the same begin, as a whole: motions, what was found (number of motions before it, whether it
    was met the other way round), both ends."""
    nodes = list(forward.nodes)
    findings = [(count, finding, False) for count, finding in forward.found]
    complete = forward.end[0] in ("closed", "interrupted")
    first = forward.end if complete else ("start", "where it leaves another branch")
    if backward is not None:
        first, k = backward.end, len(backward.nodes)
        nodes = [node.turned() for node in reversed(backward.nodes[1:])] + nodes
        turned = [
            (k - count, replace(finding, before=finding.after, after=finding.before), True)
            for count, finding in backward.found
        ]
        findings = list(reversed(turned)) + [(count + k - 1, finding, False) for count, finding, _ in findings]
    return nodes, findings, (first, forward.end)


def made(problem: Problem, forward: Way, backward: Way | None, between: tuple[float, float], seconds: float) -> Branch:
    """The branch of one way, or of two from the same begin."""
    nodes, findings, ends = joined(forward, backward)
    autonomous = problem.autonomous
    states = np.array([_shown(node, autonomous) for node in nodes])
    return Branch(
        problem.name,
        problem.over,
        problem.states,
        np.array([node.value for node in nodes]),
        states,
        np.array([node.seen.length for node in nodes]),
        np.array([node.multipliers for node in nodes]),
        np.array([node.stable for node in nodes]),
        tuple(node.word for node in nodes),
        tuple(special_of(finding, between, _switched) for _, finding, _ in findings),
        tuple(count for count, *_ in findings),
        ends,
        problem.turns,
        seconds,
        problem.how(nodes[0].z, nodes[0].seen),
        problem.units,
        tuple(nodes),
        between,
    )


def _shown(node: Node, autonomous: bool) -> Vector:
    return node.z[: len(node.problem.states)] if autonomous else state_at(node, 0.0)


def _switched(special: Special, points: int) -> tuple[Branch, ...]:
    return tuple(followed_from(node, special.between, points) for node in leaving(special))


def follower_of(node: Node) -> type[Follower]:
    """What follows motions of its kind."""
    return ImportedFollower if isinstance(node.problem, ImportedProblem) else Follower


def followed_from(node: Node, between: tuple[float, float], points: int, keeper: Keeper | None = None) -> Branch:
    """The branch that begins beside another one."""
    clock = time.process_time()
    path = follower_of(node)(node, between, points, pieces=keeper.pieces() if keeper else None).follow()
    return made(node.problem, path, None, between, time.process_time() - clock)
