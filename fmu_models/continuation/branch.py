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
                 "set"         a contact sticks wherever it is: motions beside one another are as good
                 "homoclinic"  the period is without end: the cycle comes to a saddle
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
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.continuation.ended import SolutionBranch, seen_on
from fmu_models.continuation.kept import Keeper
from fmu_models.continuation.leaving import leaving
from fmu_models.continuation.problem.equilibrium import EquilibriumProblem
from fmu_models.continuation.problem.imported import ImportedProblem
from fmu_models.continuation.problem.map import MapProblem
from fmu_models.continuation.problem.node import Lost, Node, parameter
from fmu_models.continuation.problem.problem import Problem, Vector
from fmu_models.continuation.special.special import Special, special_of
from fmu_models.continuation.step.equilibrium import EquilibriumFollower
from fmu_models.continuation.step.follow import Follower
from fmu_models.continuation.step.imported import ImportedFollower
from fmu_models.continuation.step.map import MapFollower
from fmu_models.continuation.step.same_motion import passes
from fmu_models.continuation.step.way import Ways, joined, ways
from fmu_models.sections.amounts import Amount, Measured

ASIDE = 1e-5  # along the unit tangent: neighbours of which a difference is taken
MULTIPLIER, PERIOD = "multiplier", "period"  # what a picture shows in place of a state


@dataclass(frozen=True, eq=False, kw_only=True)
class Branch(SolutionBranch):
    """Of m motions, n states.

    Attributes:
        periods: (m,) s.
        multipliers: (m, n) largest first.
        every: periods of the forcing in one of the motion, or turns of a cycle that nothing forces.
        amount: the quantity of a period that was asked for.
        amounts: (m, 2) it, and its derivative by the parameter along the branch, infinite at a fold.
        special_amounts: (len(special),) it where something is special.
    """

    COLUMNS: ClassVar = (
        *("{over}=values", "{states}=points", "period=periods", "stable", "multiplier{}=multipliers", "word=texts"),
        "{measured}=amounts",
    )
    RECORD: ClassVar = ("every", "ends=named_ends", "points=count", "special", "amounts=named_amounts")

    periods: Vector
    multipliers: Complex
    special: tuple[Special, ...]
    every: int = 1
    nodes: tuple[Node, ...] = field(default=(), repr=False)
    between: tuple[float, float] = (-np.inf, np.inf)
    amount: Amount | None = None
    amounts: Vector = field(default_factory=lambda: np.zeros((0, 2)))
    special_amounts: Vector = field(default_factory=lambda: np.zeros(0))

    @property
    def named_amounts(self) -> dict[str, Vector]:
        """``amounts`` by name, over the parameter."""
        if self.amount is None:
            return {}
        named = dict(zip(self.measured, self.amounts.T, strict=True))
        return {self.over: self.values, **named, "special": self.special_amounts}

    def measuring(self, amount: Amount) -> Branch:
        """The same with a quantity of each of its motions. StickslipError: a motion cannot be continued."""
        system = self.nodes[0].problem.system
        units = system.units(*self.units)
        units[amount.label] = amount.unit(system.unit_of)
        found = measured([special.node for special in self.special], amount)
        # the motion that was found lies beside the special one by what separates their parameters
        beside = [special.value - special.node.value for special in self.special]
        shifted = found[:, 0] + np.where(np.isfinite(found[:, 1]), found[:, 1], 0.0) * beside
        amounts = measured(self.nodes, amount)
        return replace(self, amount=amount, amounts=amounts, special_amounts=shifted, units=units)

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of ``amounts``."""
        return (str(self.amount), f"d {self.amount}/d {self.over}") if self.amount else ()

    def amounts_at(self, value: float) -> Vector:
        """(k, 2) what was asked for, and its derivative, of the motions at a value of the parameter."""
        return measured(self.at(value), self.amount) if self.amount else np.zeros((0, 2))

    def at(self, value: float) -> tuple[Node, ...]:
        """Its motions at a value of the parameter, in the order of the branch."""
        nodes = []
        for i in self.segments_at(value):
            closest = min(self.nodes[i : i + 2], key=lambda node: abs(node.value - value))
            guess = closest.u + closest.tangent * ((value - closest.value) / closest.scales[-1] / closest.tangent[-1])
            with suppress(Lost):
                nodes.append(closest.corrected(guess, parameter(value)))
        return tuple(nodes)

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.values)

    @property
    def texts(self) -> list[str]:
        """The word of each point, in a line: contact, state before and after."""
        return [" ".join(f"{contact}:{before}>{after}" for contact, before, after in word) for word in self.words]

    @property
    def of(self) -> str:
        """What a picture shows: the first state; where nothing forces the motion the period, which has no phase."""
        return PERIOD if self.nodes and self.nodes[0].problem.autonomous else self.states[0]

    @cached_property
    def images(self) -> Vector:
        """(every, m, n) points at phases 0, 1, ... of the forcing."""
        if self.every == 1 or not self.nodes:
            return self.points[None]
        others = [[node.state_at(float(turn)) for node in self.nodes] for turn in range(1, self.every)]
        return np.stack([self.points, *np.array(others)])

    def passes(self, branch: Branch) -> bool:
        """Whether this branch runs through the middle of another one."""
        return passes(self.nodes, branch.nodes[len(branch.nodes) // 2])

    def _heading(self) -> str:
        return f"Branch of {self.model} over {self.over}: {len(self.values)} motions, {len(self.special)} special"


def measured(nodes: Sequence[Node], amount: Amount) -> Vector:
    """(len(nodes), 2) a quantity of motions, and its derivative by the parameter along their branch.

    Of work of impacts, which has none of its own, it is the difference of neighbours on the tangent.
    """
    if not nodes:
        return np.zeros((0, 2))
    problem: Any = nodes[0].problem
    measurement = Measured(problem.strobe.fmu, amount, (*problem.states, *problem.parameters), problem.strobe.tolerance)
    rows = []
    for node in nodes:
        here: Any = node.problem
        change = node.tangent * node.scales
        with np.errstate(divide="ignore", invalid="ignore"):  # at a fold there is none
            along = here.direction(node.z, change / change[-1])
            row = measurement.of(here.span(node.z), here.as_run(node.z), along)
            if measurement.by_works:
                sides = [node.z + share * change for share in (-ASIDE, ASIDE)]
                ends = [measurement.of(here.span(z), here.as_run(z))[0] for z in sides]
                row[1] = (ends[1] - ends[0]) / (sides[1][-1] - sides[0][-1])
        rows.append(row)
    return np.array(rows)


def made(problem: Problem, directions: Ways, between: tuple[float, float], seconds: float) -> Branch:
    """The branch of one way, or of two from the same begin."""
    nodes, findings, ends = joined(*directions)
    return Branch(
        **seen_on(nodes),
        periods=np.array([node.seen.length for node in nodes]),
        multipliers=np.array([node.multipliers for node in nodes]),
        stable=np.array([node.stable for node in nodes]),
        special=tuple(special_of(finding, between, _switched) for _, finding, _ in findings),
        places=tuple(count for count, *_ in findings),
        ends=ends,
        every=problem.rounds,
        seconds=seconds,
        nodes=tuple(nodes),
        between=between,
    )


def _switched(special: Special, points: int) -> tuple[Branch, ...]:
    return tuple(followed_from(node, special.between, points) for node in leaving(special))


def follower_of(start: Node, *arguments: Any) -> Follower:
    """What follows solutions of its kind from a start on."""
    kinds = {ImportedProblem: ImportedFollower, MapProblem: MapFollower, EquilibriumProblem: EquilibriumFollower}
    follower = kinds.get(type(start.problem), Follower)
    return follower(start, *arguments)


def both_ways(
    start: Node, between: tuple[float, float], points: int, progress: Callable[[float], Any], keeper: Keeper
) -> Ways:
    """From a start over a range of the parameter, of which ``progress`` is called with the share that is behind."""
    low, high = between

    def tell(node: Node) -> None:
        progress((node.value - low) / (high - low))

    return ways(start, lambda node: follower_of(node, between, points, tell, keeper.pieces()).follow())


def followed_from(node: Node, between: tuple[float, float], points: int, keeper: Keeper | None = None) -> Branch:
    """The branch that begins beside another one."""
    clock = time.process_time()
    pieces = keeper.pieces() if keeper else None
    path = follower_of(node, between, points, lambda node: None, pieces).follow()
    return made(node.problem, (path, None), between, time.process_time() - clock)
