"""Sets of equilibria: where a contact sticks, the equilibria beside one are as good, and fill an interval.

    f(x, p) = 0    of what sticks is one equation too few: f_x has a null vector e, along which all are at rest
    m(x, p) > 0    while it sticks; where the margin m is zero the interval ends

From an equilibrium inside it is walked along e, both ways, until an indicator falls to zero; what is left there is
linear to rounding. Over the parameter it is begun from the middle of the one before, until its length is zero.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields

import numpy as np

from fmu_models.continuation.problem.equilibrium import ZERO, EquilibriumProblem, equilibrium_problem
from fmu_models.continuation.problem.node import Lost, Node, look, parameter, scaled, solved
from fmu_models.continuation.problem.problem import Seen, Vector, Word
from fmu_models.language.contact_kinds import STICK

FIRST, NEAR, FAR = 1e-3, 1e-7, 1e6  # of a walk, in u: the first step, how near to its end it comes, how far it goes
# of the range of the parameter: the longest step, the shortest, and how near to where the length is zero it comes
LONGEST, SHORTEST, CLOSE = 0.02, 1e-9, 1e-7


@dataclass(frozen=True, eq=False)
class StickingSet:
    """An interval of equilibria at one value of the parameter.

    Attributes:
        middle: the equilibrium half-way.
        ends: (2, n + 1) z of both ends, in the sense of ``along``.
        along: (n,) unit vector of u.
    """

    middle: Node
    ends: Vector
    along: Vector

    @property
    def length(self) -> float:
        """In u."""
        return float(np.linalg.norm((self.ends[1] - self.ends[0]) / self.middle.scales))


@dataclass(frozen=True, eq=False)
class _Place(EquilibriumProblem):
    """An equilibrium at a place along the set: that takes the row of the equation that says nothing. What sticks keeps
    a speed of zero, to the last bit, since no rows are mixed.

    Args:
        row: of the equation.
        along, at: (n + 1,) from z to the place, and what it is.
    """

    row: int = 0
    along: Vector = field(default_factory=lambda: np.zeros(0))
    at: float = 0.0

    def see(self, z: Vector) -> Seen:
        seen = super().see(z)
        seen.residual[self.row], seen.jacobian[self.row] = self.along @ z - self.at, self.along
        return seen


def set_at(problem: EquilibriumProblem, scales: Vector, z: Vector, along: Vector | None = None) -> StickingSet | None:
    """The interval of equilibria about z; None where nothing sticks, or the equilibria fill no interval. Lost: there is
    no equilibrium, or the interval has no end. along: its sense."""
    seen = look(problem, z)
    if seen is None or not any(state == STICK for _, state, _ in seen.word):
        return None
    node = Node(problem, scales, z, seen, np.zeros_like(z))
    e = _null_vector(node, along)
    if e is None:
        return None
    inside = _beside(node, e, 0.0, node.word, reach=np.inf)
    e = _null_vector(inside, e)
    if e is None:
        return None
    ends = np.array([_end(inside, sense * e) for sense in (-1.0, 1.0)])
    middle = _beside(inside, e, float(e @ ((ends.mean(axis=0) - inside.u)[:-1])), inside.word)
    return StickingSet(middle, ends * scales, e)


def _null_vector(node: Node, along: Vector | None) -> Vector | None:
    """(n,) the direction of u without a rate, the parameter held; None if there is none, or more than one."""
    _, sizes, rows = np.linalg.svd(scaled(node)[:, :-1])
    flat = sizes < ZERO * max(sizes[0], 1e-300)
    if flat.sum() != 1:
        return None
    e = np.where(np.abs(rows[-1]) < ZERO, 0.0, rows[-1])
    sense = e[np.abs(e).argmax()] if along is None else e @ along
    return e if sense > 0.0 else -e


def _beside(node: Node, e: Vector, distance: float, word: Word, reach: float = 0.3) -> Node:
    """The equilibrium so far along the null vector, at the same value of the parameter."""
    guess, problem = node.u.copy(), equilibrium_problem(node)
    guess[:-1] += distance * e
    rows, _, _ = np.linalg.svd(scaled(node)[:, :-1])
    placed = _Place(
        **{attribute.name: getattr(problem, attribute.name) for attribute in fields(problem)},
        row=int(np.abs(rows[:, -1]).argmax()),
        along=np.append(e / node.scales[:-1], 0.0),
        at=float(e @ guess[:-1]),
    )
    solution = solved(placed, node.scales, guess, parameter(node.value), word=word, reach=reach)
    return Node(problem, node.scales, solution.z, problem.see(solution.z), solution.tangent)


def _end(node: Node, e: Vector) -> Vector:
    """u of the end of the interval along a vector, followed from inside. Lost: there is none."""
    problem = equilibrium_problem(node)
    distance, step, current, values = 0.0, FIRST, node, problem.indicators(node.z)
    while distance < FAR:
        try:
            after = _beside(current, e, step, node.word, reach=0.3 + step)
        except Lost:
            step /= 2.0
            if step < NEAR * NEAR:
                raise
            continue
        new = problem.indicators(after.z)
        falls = (values - new) / step
        remaining = float(np.min(new[falls > 0.0] / falls[falls > 0.0], initial=np.inf))
        if remaining <= NEAR:
            return after.u + remaining / step * (after.u - current.u)
        distance, current, values = distance + step, after, new
        step = min(max(0.9 * remaining, remaining - 0.5 * NEAR if remaining < 1e3 * NEAR else 0.0), 10.0 * step)
    raise Lost("the set of equilibria has no end")


def followed(
    first: StickingSet, between: tuple[float, float], sense: float, points: int, tell: Callable[[Node], None]
) -> tuple[list[StickingSet], tuple[str, str]]:
    """The sets over the parameter, that at the begin first, with a growing (1) or falling (-1) one; and why they end:
    "range", "points", "point" where the interval shrinks to one, "interrupted", "unresolved"."""
    over, scale = first.middle.problem.over, first.middle.scales[-1]
    sets, step, end = [first], LONGEST, max(sense * bound for bound in between)
    try:
        while len(sets) < points:
            last = sets[-1]
            tell(last.middle)
            remaining = end / scale - sense * last.middle.u[-1]
            if remaining <= 0.0:
                return sets, ("range", f"{over} = {last.middle.value:g} is the end of its range")
            gone = _until_gone(sets)
            if gone <= CLOSE:
                value = last.middle.value + sense * gone * scale
                return sets, ("point", f"the set of equilibria shrinks to a point at {over} = {value:.9g}")
            following = _next(sets, sense, min(step, remaining, 0.9 * gone), sense * end)
            if following is None:
                step = min(step, remaining) / 4.0
                if step < SHORTEST:
                    return sets, ("unresolved", f"no such set follows at {over} = {last.middle.value:.9g}")
                continue
            sets.append(following)
            step = min(2.0 * step, LONGEST)
    except KeyboardInterrupt:
        return sets, ("interrupted", "what was found until then is kept")
    return sets, ("points", f"{points} were followed; ask for more")


def _next(sets: list[StickingSet], sense: float, step: float, end: float) -> StickingSet | None:
    """The set a step further on, or at the end of the range; None if none is found."""
    middle = sets[-1].middle
    u = middle.u.copy()
    if len(sets) > 1:
        before = sets[-2].middle.u
        u += step / abs(u[-1] - before[-1]) * (u - before)
    z = u * middle.scales
    z[-1] = middle.z[-1] + sense * step * middle.scales[-1]
    if sense * (z[-1] - end) > -1e-12 * middle.scales[-1]:
        z[-1] = end
    try:
        following = set_at(equilibrium_problem(middle), middle.scales, z, sets[-1].along)
    except Lost:
        return None
    return following if following is not None and following.middle.word == middle.word else None


def _until_gone(sets: list[StickingSet]) -> float:
    """How much further on, in u of the parameter, the length is zero; infinite where it does not shrink."""
    if len(sets) < 2:
        return np.inf
    before, last = sets[-2:]
    rate = (before.length - last.length) / abs(last.middle.u[-1] - before.middle.u[-1])
    return last.length / rate if rate > 0.0 else np.inf
