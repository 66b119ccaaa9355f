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
                 "jump"        the motion touches something, and what then happens does not go on from it
                 "chatter"     impacts are added without end
                 "equilibrium" a cycle has shrunk to nothing
                 "points"      as many as were asked for
                 "infinity"    the states grow beyond all bounds
                 "interrupted" by the keyboard
                 "unresolved"  says why

    begin   correct the start by Newton's method; move the strobe into a free arc
    follow  forward and, unless that closed, backward (follow.py)
    switch  at a flip: twice the period, along the eigenvector of -1; at a branch point: along the other null vector;
            where the word changes: the motion of twice the period that has the event in one of its halves alone

Sources: Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), for the set-valued multipliers;
Kuznetsov, Elements of Applied Bifurcation Theory (2004), chapter 10, for pseudo-arclength, test functions, switching.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.analyses.continuation.discontinuous import other_word_once
from fmu_models.analyses.continuation.follow import Follower, Way, passes
from fmu_models.analyses.continuation.node import Lost, Node, look, parameter, solved, tangent_of
from fmu_models.analyses.continuation.problem import FlowProblem, Problem, Vector, Word, problem_of
from fmu_models.analyses.continuation.special import Special, beside, other_direction, special_of, state_at
from fmu_models.analyses.cycles import last_cycle
from fmu_models.analyses.section_system import SectionSystem
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.shown import Pictured
from fmu_models.codegen.contact_states import TOUCHING
from fmu_models.simulation.run import simulate

# how far from a special a branch begins that is switched to, in u
BESIDE = (1e-3, 3e-3, 1e-2)
# periods of a run that settles to its motion
SETTLE = 400


@dataclass(frozen=True, eq=False)
class Branch(Pictured):
    """Of m points, n states.

    Attributes:
        model, over: names of the model and of the parameter.
        states: names.
        values: (m,) of the parameter.
        points: (m, n) states at phase 0 of the forcing; where nothing forces the motion, where the first of them is
            largest.
        periods: (m,) s.
        multipliers: (m, n) largest first.
        stable: (m,).
        words: of each point.
        special: what was met, in order.
        places: (len(special),) number of points before each.
        ends: kind and a sentence, of both ends.
        every: periods of the forcing in one of the motion.
        seconds: CPU time.
    """

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
    nodes: tuple[Any, ...] = field(default=(), repr=False)
    between: tuple[float, float] = (-np.inf, np.inf)

    @property
    def frame(self) -> Any:
        """One row per point."""
        import pandas

        columns: dict[str, Any] = {self.over: self.values}
        columns |= {name: self.points[:, i] for i, name in enumerate(self.states)}
        columns |= {"period": self.periods, "stable": self.stable}
        for i in range(self.multipliers.shape[1]):
            columns[f"multiplier{i + 1}_real"] = self.multipliers[:, i].real
            columns[f"multiplier{i + 1}_imag"] = self.multipliers[:, i].imag
        columns["word"] = [word_text(word) for word in self.words]
        return pandas.DataFrame(columns)

    def switch(self, special: Special, points: int = 2000) -> tuple[Branch, ...]:
        """The branches that leave the branch at one of its specials.

        Raises:
            StickslipError: none leaves at a point of that kind, or none was found.
        """
        return switched(special, self.between, points)

    def passes(self, other: Branch) -> bool:
        """Whether this branch runs through the middle of another one."""
        return passes(self.nodes, other.nodes[len(other.nodes) // 2])

    def _heading(self) -> str:
        return f"Branch of {self.model} over {self.over}: {len(self.values)} motions, {len(self.special)} special"

    def _contents(self) -> Mapping[str, Any]:
        met = [f"{one.kind} {one.value:.9g}" for one in self.special]
        return {self.over: self.values, "special": met, "ends": [kind for kind, _ in self.ends]}


def word_text(word: Word) -> str:
    """Events in a line: contact, state before and after."""
    return " ".join(f"{contact}:{before}>{after}" for contact, before, after in word)


def branch(
    system: SectionSystem,
    over: str,
    between: tuple[float, float],
    *,
    start: Mapping[str, float] | Sequence[float] | None = None,
    settle: bool = False,
    points: int = 2000,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Branch:
    """Follow the periodic motion near a start over a parameter, both ways.

    Args:
        system: a strobe, whose parameters are those of the start, or a map. ``every`` of the strobe is the number of
            periods of the forcing in one of the motion; where nothing forces the motion, ``period`` is about its own.
        over: name of a parameter or input.
        between: its least and largest value.
        start: states at phase 0 near the motion; as the declaration says what is left out.
        settle: run for a while from the start first.
        points: motions in each direction, at most.
        progress: called with the share of the range that is behind, or less.

    Raises:
        StickslipError: no such parameter, a range that is none or does not hold its value at the start, a section that
            is no strobe, or no motion near the start.
    """
    low, high = sorted(float(one) for one in between)
    if not low < high or not np.isfinite([low, high]).all():
        raise StickslipError(f"A branch needs a range of '{over}', from one finite value to another, found {between}.")
    system.check(over, np.array([low, high]))
    problem = problem_of(system, over)
    begin = _begin(system, problem, (low, high), start, settle)
    clock = time.process_time()

    def tell(node: Node) -> None:
        progress((node.value - low) / (high - low))

    forward = Follower(begin, (low, high), points, tell).follow()
    backward = None
    if forward.end[0] not in ("closed", "interrupted"):
        backward = Follower(begin.turned(), (low, high), points, tell).follow()
    return made(problem, forward, backward, (low, high), time.process_time() - clock)


def _begin(system: SectionSystem, problem: Problem, between: tuple[float, float], start: Any, settle: bool) -> Node:
    """The motion at the start."""
    value = _value(system, problem.over)
    if not between[0] <= value <= between[1]:
        raise StickslipError(
            f"The start has {problem.over} = {value:g}, which is not between {between[0]:g} and {between[1]:g}. Set it "
            "to a value in that range."
        )
    point = system.start(start)
    if settle and isinstance(problem, FlowProblem) and problem.autonomous:
        z = _last_cycle(problem, point, value)
    else:
        point = _settled(system, point) if settle else point
        if isinstance(problem, FlowProblem) and point[len(problem.states) :].any():
            problem, point = _freed(problem, point, value)
        z = point[: len(problem.states)]
        if isinstance(problem, FlowProblem) and problem.autonomous:
            z = np.append(z, problem.strobe.period or 0.0)
        z = np.append(z, value)
    scales = problem.scales(z, between)
    try:
        node = solved(problem, scales, z / scales, parameter(value), reach=2.0)
    except Lost as error:
        seen = look(problem, z)
        missed = "" if seen is None else f": after one period it misses its start by {np.abs(seen.residual).max():.2g}"
        raise StickslipError(
            f"No periodic motion of {system.name} was found near that start{missed} ({error}). Start nearer, let it "
            "settle first (settle=True, --settle), or check how many periods of the forcing it takes (every)."
        ) from None
    moved = problem.rephased(node.z, node.seen)
    if moved is not None:
        with suppress(Lost):  # it stays where it was
            node = solved(moved[0], scales, moved[1] / scales, parameter(value), reach=0.1)
    return node


def _settled(system: SectionSystem, point: Vector) -> Vector:
    """Where a run from a point has come to, after many steps."""
    for _ in range(SETTLE):
        made_step = system.step(point[None], derivative=False)
        if made_step.why:
            raise StickslipError(f"The start does not settle: {next(iter(made_step.why.values()))}")
        point = made_step.points[0]
    return point


def _freed(problem: FlowProblem, point: Vector, value: float) -> tuple[FlowProblem, Vector]:
    """The problem at a phase where no stop remembers, and the state there of a motion that begins in one that does."""
    strobe = problem.strobe.at(**{problem.over: value})
    length = strobe.every * float(strobe.periods({}, 1)[0])
    events = strobe.trajectory(point, np.array([length])).events
    memories = [name.removesuffix("_memory") for name in strobe.fmu.memories]
    inside = {name for name, one in zip(memories, point[len(problem.states) :], strict=True) if one}
    longest, middle = 0.0, 0.0
    for i, event in enumerate(events):
        (inside.add if event.after == TOUCHING else inside.discard)(event.contact)
        pause = (events[i + 1].time if i + 1 < len(events) else length) - event.time
        if not inside.intersection(memories) and pause > longest:
            longest, middle = pause, event.time + pause / 2
    if longest == 0.0:
        raise StickslipError(
            f"The motion of '{strobe.name}' near that start is never free of a stop that remembers its speed of entry: "
            "start where it is."
        )
    moved = strobe.trajectory(point, np.array([middle]))
    turns = middle / length * strobe.every
    return replace(problem, phase=turns), np.array([float(moved[name][0]) for name in problem.states])


def _last_cycle(problem: FlowProblem, point: Vector, value: float) -> Vector:
    """z of the cycle that a run from a point ends in, in the middle of its longest pause between events."""
    strobe = problem.strobe.at(**{problem.over: value})
    run: dict[str, Any] = {name: one for name, one in strobe.as_run(point).items() if name != "start_time"}
    cycle = last_cycle(strobe.fmu, SETTLE * float(strobe.period or 0.0), **run)
    if cycle is None:
        raise StickslipError(
            f"'{strobe.name}' does not settle to a cycle with events in {SETTLE} times {strobe.period:g} s. Start on "
            "the cycle, or choose other values."
        )
    marks = np.array([*(one.time for one in cycle.events), cycle.events[0].time + cycle.period])
    longest = int(np.diff(marks).argmax())
    middle = float(marks[longest] + marks[longest + 1]) / 2
    moved = simulate(strobe.fmu, middle, output_times=[middle], **run)
    return np.array([*(float(moved[name][0]) for name in problem.states), cycle.period, value])


def _value(system: Any, over: str) -> float:
    known = system.values.get(over)
    return float(system.fmu.variables[over].start or 0.0) if known is None else float(known)


def made(problem: Problem, forward: Way, backward: Way | None, between: tuple[float, float], seconds: float) -> Branch:
    """The branch of one way, or of two from the same begin."""
    nodes, found = list(forward.nodes), list(forward.found)
    both = forward.end[0] in ("closed", "interrupted")
    ends = [forward.end if both else ("start", "where it leaves another branch"), forward.end]
    if backward is not None:
        ends[0] = backward.end
        k = len(backward.nodes)
        nodes = [node.turned() for node in reversed(backward.nodes[1:])] + nodes
        turned = [(k - place, replace(one, before=one.after, after=one.before)) for place, one in backward.found]
        found = list(reversed(turned)) + [(place + k - 1, one) for place, one in found]
    autonomous = problem.autonomous
    states = np.array([_shown(node, autonomous) for node in nodes])
    return Branch(
        _name(problem),
        problem.over,
        problem.states,
        np.array([node.value for node in nodes]),
        states,
        np.array([node.seen.length for node in nodes]),
        np.array([node.multipliers for node in nodes]),
        np.array([node.stable for node in nodes]),
        tuple(node.word for node in nodes),
        tuple(special_of(one) for _, one in found),
        tuple(place for place, _ in found),
        (ends[0], ends[1]),
        problem.turns,
        seconds,
        tuple(nodes),
        between,
    )


def _name(problem: Any) -> str:
    return problem.strobe.name if isinstance(problem, FlowProblem) else problem.map.name


def _shown(node: Node, autonomous: bool) -> Vector:
    return node.z[: len(node.problem.states)] if autonomous else state_at(node, 0.0)


def switched(special: Special, between: tuple[float, float], points: int = 2000) -> tuple[Branch, ...]:
    """The branches that leave at a special; see ``Branch.switch``."""
    begins = _leaving(special)
    if not begins:
        raise StickslipError(
            f"No branch was found that leaves at the {special.kind} at {special.parameter} = {special.value:.9g}: one "
            "leaves at flips, pitchforks, branch points, and where the word changes and a multiplier passes -1."
        )
    found = []
    for begin in begins:
        clock = time.process_time()
        way = Follower(begin, between, points).follow()
        found.append(made(begin.problem, way, None, between, time.process_time() - clock))
    return tuple(found)


def _leaving(special: Special) -> list[Node]:
    """Motions beside a special on branches that leave there; their tangents lead away."""
    node: Node = special.node
    if special.kind == "flip":
        return _doubled(node)[:1]
    if special.kind in ("pitchfork", "branch point"):
        direction = other_direction(node)
        return [one for one in (_aside(node, direction), _aside(node, -direction)) if one is not None]
    if special.touch is not None and "-1" in special.crossings:
        try:
            return [other_word_once(special.touch)]
        except Lost:
            return []
    return []


def _doubled(node: Node) -> list[Node]:
    """Motions of twice the period on both sides of a flip."""
    problem, n = node.problem.folded(2), len(node.problem.states)
    scales, z = node.problem.unfolded(node.scales, 2), node.problem.unfolded(node.z, 2)
    seen = look(problem, z)
    if seen is None:
        return []
    values, vectors = np.linalg.eig(node.seen.monodromy)
    along = np.zeros_like(z)
    along[:n] = np.real(vectors[:, np.abs(values + 1.0).argmin()])
    along /= scales
    along /= np.linalg.norm(along)
    at = Node(problem, scales, z, seen, tangent_of(seen, scales))
    return [one for one in (_aside(at, along), _aside(at, -along)) if one is not None]


def _aside(node: Node, direction: Vector) -> Node | None:
    for distance in BESIDE:
        try:
            return beside(node, direction, distance)
        except Lost:
            continue
    return None


@dataclass(frozen=True, eq=False)
class Branches(Pictured):
    """A branch and those that leave it.

    Attributes:
        of: the state that a picture shows.
        branches: the first, and the others in the order in which they were found.
    """

    of: str
    branches: tuple[Branch, ...]

    @property
    def model(self) -> str:
        """Name of the model."""
        return self.branches[0].model

    @property
    def over(self) -> str:
        """Name of the parameter."""
        return self.branches[0].over

    @property
    def frame(self) -> Any:
        """One row per point; ``branch`` is the number of its branch."""
        import pandas

        return pandas.concat([one.frame.assign(branch=i) for i, one in enumerate(self.branches)], ignore_index=True)

    @property
    def special(self) -> tuple[Special, ...]:
        """Of all branches."""
        return tuple(special for one in self.branches for special in one.special)

    def _heading(self) -> str:
        return f"{len(self.branches)} branches of {self.model} over {self.over}"

    def _contents(self) -> Mapping[str, Any]:
        return {f"branch {i}": f"{len(one.values)} motions" for i, one in enumerate(self.branches)}


def branches(
    first: Branch, *, longest: int = 8, points: int = 2000, of: str | None = None, switch: bool = True
) -> Branches:
    """A branch and all that leave it and one another, up to a period of so many of the forcing.

    Args:
        longest: period of a motion, in periods of the forcing.
        points: of each, at most.
        of: the state that a picture shows; the first if left out.
        switch: without, the branch alone.

    Raises:
        StickslipError: no such state.
    """
    if of is not None and of not in first.states:
        raise StickslipError(f"'{first.model}' has no state '{of}'.{nearest(of, first.states)}")
    known, done = [first], 0 if switch else 1
    while done < len(known):
        one = known[done]
        done += 1
        for special in one.special:
            doubles = special.kind == "flip" or special.touch is not None
            if one.every * (2 if doubles else 1) > longest:
                continue
            for begin in _leaving(special):
                if any(other.every == begin.problem.turns and passes(other.nodes, begin) for other in known):
                    continue
                clock = time.process_time()
                way = Follower(begin, one.between, points).follow()
                known.append(made(begin.problem, way, None, one.between, time.process_time() - clock))
    return Branches(of or first.states[0], tuple(known))
