"""Branches followed from a start, with all that leave them and one another."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import Spanned
from fmu_models.base.shown import Pictured
from fmu_models.continuation.begin import begin_of, problem_of
from fmu_models.continuation.branch import MULTIPLIER, PERIOD, Branch, both_ways, followed_from, made
from fmu_models.continuation.curves.curve import ClosedForm, Curve, Curves
from fmu_models.continuation.kept import Keeper
from fmu_models.continuation.leaving import leaving
from fmu_models.continuation.problem.problem import range_of
from fmu_models.continuation.special.kinds import FLIP
from fmu_models.continuation.special.special import Special
from fmu_models.continuation.step.same_motion import passes
from fmu_models.families.execution import IN_MEMORY, Execution, Runner
from fmu_models.sections.amounts import Amount, shown_of
from fmu_models.sections.system import SectionSystem

if TYPE_CHECKING:
    import pandas
    import xarray

SAME = 1e-9  # special points of two branches that lie no further apart are one


def branch(system: SectionSystem, over: str, between: tuple[float, float], **options: Any) -> Branch:
    """Follow the periodic motion near a start over a parameter, both ways, and none that leaves it. system, over,
    between, options: As for ``branches``. StickslipError: As ``branches``."""
    return branches(system, over, between, **{**options, "switch": False}).branches[0]


def branches(
    system: SectionSystem,
    over: str,
    between: tuple[float, float],
    *,
    start: Mapping[str, float] | Sequence[float] | None = None,
    settle: bool = False,
    points: int = 2000,
    switch: bool = True,
    longest: int = 8,
    of: str | None = None,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Branches:
    """Follow the periodic motion near a start over a parameter, both ways, and all that leave it and one another.

    Args:
        system: A strobe, whose parameters are those of the start, or a map. ``every`` of the strobe is the number of
            periods of the forcing in one of the motion; where nothing forces the motion, ``period`` is about its own.
        over: Name of a parameter or input.
        between: Its least and largest value.
        start: States at phase 0 near the motion. Defaults to those of the declaration.
        settle: Run for a while from the start first.
        points: Motions of a branch in each direction, at most.
        switch: Whether branches that leave one another are followed. Without, there is the first alone.
        longest: Period of a motion that is still followed, in periods of the forcing.
        of: What a picture shows: a state; "multiplier": the real part of the largest one that may change; "period"; a
            quantity of a period, as "max(x)", which every motion is told with then, and its derivative (see
            ``fmu_models.sections.amounts``). Defaults to what the first branch shows.
        execution: Where they are kept as they are found.
        progress: Called with the share of the range that is behind, or less.

    Raises:
        StickslipError: no such parameter or state, a range that is none or does not hold its value at the start, a
            section that is no strobe, or no motion near the start; as ``Runner``.
    """
    low, high = range_of(over, between)
    system.check(over, np.array([low, high]))
    problem = problem_of(system, over)
    amount = None if of in (None, MULTIPLIER, PERIOD) else shown_of(str(of), system, (MULTIPLIER, PERIOD))
    plan: dict[str, Any] = {"analysis": "branch", "over": over, "between": [low, high], "start": system.start(start)}
    plan |= {"settle": settle, "points": points, "switch": switch} | ({"longest": longest} if switch else {})
    with Runner(system, plan, execution) as runner:
        keeper = Keeper(runner.store, problem)
        first_piece = keeper.pieces()
        if not first_piece.known:
            first_piece.put(begin_of(system, problem, (low, high), start, settle))
        clock, start_node = time.process_time(), first_piece.known[0]
        directions = both_ways(start_node, (low, high), points, progress, keeper)
        first = made(start_node.problem, directions, (low, high), time.process_time() - clock)
        followed = [first]
        interrupted = spread(followed, longest, points, keeper) if switch else first.interrupted
        result = Branches(of or first.of, measuring(followed, amount), interrupted)
        if not result.interrupted:
            runner.finish(result)
    return result


@dataclass(frozen=True, eq=False)
class Branches(Pictured):
    """A branch and those that leave it.

    Attributes:
        of: what a picture shows, as of ``branches``.
        branches: the first, and the others in the order in which they were found.
        interrupted: by the keyboard: others may be missing.
        closed_form: of what a picture shows, drawn below it; None if none is known.
    """

    RECORD: ClassVar = ("model", "over", "branches")

    of: str
    branches: tuple[Branch, ...]
    interrupted: bool = False
    closed_form: ClosedForm | None = None

    @property
    def model(self) -> str:
        """Name of the model."""
        return self.branches[0].model

    @property
    def over(self) -> str:
        """Name of the parameter."""
        return self.branches[0].over

    @property
    def spanned(self) -> Spanned:
        """The parameter, and what is shown of the motions."""
        return Spanned(self.over, self.of, (self.over,), self.branches[0].states)

    @property
    def how(self) -> str:
        """Where motions come from; see ``Branch``."""
        return self.branches[0].how

    @property
    def frame(self) -> pandas.DataFrame:
        """One row per point; ``branch`` is the number of its branch."""
        import pandas

        frames = [member.frame.assign(branch=i) for i, member in enumerate(self.branches)]
        return pandas.concat(frames, ignore_index=True)

    @property
    def special(self) -> tuple[Special, ...]:
        """Of all branches."""
        return tuple(special for member in self.branches for special in member.special)

    def to_xarray(self) -> xarray.Dataset:
        """The points, and what is special beside them."""
        of = [i for i, member in enumerate(self.branches) for _ in member.special]
        places = [count for member in self.branches for count in member.places]
        fields = ("kind", object), ("value", None), ("contact", object)
        columns = {name: np.array([getattr(s, name) for s in self.special], dtype) for name, dtype in fields}
        columns |= {"branch": np.array(of, dtype=int), "place": np.array(places, dtype=int)}
        return super().to_xarray().assign({f"special_{name}": ("special", column) for name, column in columns.items()})

    def curves(
        self, second: str, between: tuple[float, float], points: int = 500, *, only: str | None = None
    ) -> Curves:
        """Those of all special points; see ``Special.curve``. One that two branches meet is followed once; where one
        could not be followed, the others say why. only: the kind of those that are followed. StickslipError: there is
        none that could be followed, no such parameter, a range that does not hold its present value."""
        curves: list[Curve] = []
        failures: list[str] = []
        tried: list[Special] = []
        for special in self.special:
            if only is not None and special.kind != only:
                continue
            twins = (earlier for earlier in tried if earlier.contact == special.contact)
            if any(abs(special.value - twin.value) <= SAME for twin in twins):
                continue
            tried.append(special)
            try:
                curves.append(special.curve(second, between, points))
            except StickslipError as error:
                failures.append(f"{special.kind} at {self.over} = {special.value:.9g}: {error}")
                continue
            if curves[-1].interrupted:
                break
        if failures and not curves:
            raise StickslipError(failures[0])
        if not curves:
            kinds = ", ".join(sorted({special.kind for special in self.special})) or "none"
            raise StickslipError(
                f"There is no {only or 'special point'} of {self.model} to follow over '{second}'; it has: {kinds}."
            )
        return Curves(tuple(curves), failures=tuple(failures))

    def _heading(self) -> str:
        return f"{len(self.branches)} branches of {self.model} over {self.over}"

    def _contents(self) -> Mapping[str, Any]:
        return {f"branch {i}": f"{len(member.values)} motions" for i, member in enumerate(self.branches)}


def measuring(followed: Sequence[Branch], amount: Amount | None) -> tuple[Branch, ...]:
    """Branches with a quantity of their motions, if one is asked for."""
    return tuple(followed) if amount is None else tuple(member.measuring(amount) for member in followed)


def spread(followed: list[Branch], longest: int, points: int = 2000, keeper: Keeper | None = None) -> bool:
    """Append to branches what leaves the last of them, and one another; whether the keyboard interrupted it."""
    if followed[-1].interrupted:
        return True
    try:
        for member in _switched_at(followed, longest, points, keeper):
            followed.append(member)
            if member.interrupted:
                return True
    except KeyboardInterrupt:
        return True
    return False


def _switched_at(followed: list[Branch], longest: int, points: int, keeper: Keeper | None) -> Iterator[Branch]:
    """What leaves the last of the branches that are known, and is not; the list may grow meanwhile."""
    for member in islice(followed, len(followed) - 1, None):
        for special in member.special:
            if member.every * (2 if special.kind == FLIP else 1) > longest:
                continue
            for node in leaving(special):
                turns = node.problem.rounds
                same = (earlier.nodes for earlier in followed if earlier.every == turns)
                if turns <= longest and not any(passes(nodes, node) for nodes in same):
                    yield followed_from(node, member.between, points, keeper)
