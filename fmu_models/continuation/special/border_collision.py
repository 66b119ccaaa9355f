"""Where a cycle of a map comes to a border of its rule, and what goes on beyond.

    locate   h(x_j, p) = 0 at the point x_j that comes to the border, by Newton's method on the smooth piece of this
             side, which does not end there, or on that of the other one, where this one has no derivative (a root)
    beyond   the cycle with x_j on the other side, at a small h; none where the rule jumps
    name     "persistence"     it is there on the other side of the parameter
             "nonsmooth fold"  it comes back on the same one, and beyond there is neither
             "jump"            there is none
    cycles   of the piecewise linear normal form, y = x - x_j through one turn and m = p - p_j,

                 y -> M- y + b- m    c y + d m <= 0        y -> M+ y + b+ m    c y + d m > 0

             each word of the two letters has one cycle, which is there if its points lie where the word says
    root     where a side has no derivative: the image beside the border goes with a power of the distance, 1/2 of a
             grazing (Nordmark, Journal of Sound and Vibration 145 (1991))

Sources: di Bernardo, Budd, Champneys, Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 3; Nusse, Yorke,
Physica D 57 (1992) 39-57.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.map import MapProblem
from fmu_models.continuation.problem.node import Lost, Node, parameter, solved, tangent_of
from fmu_models.continuation.problem.pieces import Sides
from fmu_models.continuation.problem.problem import Passing, Vector
from fmu_models.continuation.special.discontinuous import growing, value_border

# how far beside the border motions are looked for, in the change of h by a unit of u; how far from it they are found
BESIDE, REACH = (1e-12, 1e-10, 1e-8, 1e-6), 0.1
JUMPS = 1e-9  # by how much, in u, the image of a cycle at a border on its other side misses it where the rule jumps
NEAR = 1e-8  # where the exponent of a border is taken, in scales
LONGEST = 8  # letters of a word
FAR = 1e-9  # how far from the border, in the parameter, points of a cycle of the normal form must be
# how far from a collision a branch begins that is switched to, in the range of the parameter
AWAY = (1e-4, 1e-5, 1e-6, 1e-7)


@dataclass(frozen=True)
class SmallCycle:
    """A cycle that is born or dies at a collision.

    Attributes:
        word: its letters, L where h <= 0, R elsewhere.
        above: whether it is there above the value of the parameter, or below.
        stable: whether it is.
        start: (n,) y of its first point per unit of the parameter.
    """

    word: str
    above: bool
    stable: bool
    start: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Collision:
    """A cycle at a border.

    Attributes:
        before: the motion beside it on the side that the branch comes from; its tangent leads to the border.
        z: of the cycle at the border.
        miss: what comes to zero there.
        after: the motion beside it on the other side, its tangent leading on; None if there is none.
    """

    before: Node
    z: Vector
    miss: Passing
    after: Node | None

    @property
    def form(self) -> str:
        """Its name, see the module."""
        if self.after is None:
            return "jump"
        return "nonsmooth fold" if self.before.tangent[-1] * self.after.tangent[-1] < 0.0 else "persistence"

    @cached_property
    def monodromies(self) -> list[Vector | None]:
        """(n, n) on the side before and on the other one; None where it is not finite or the rule jumps."""
        problem, pair = _problem(self.before), []
        own_sides = problem.sides_of(self.before.seen)
        for sides in (own_sides, _other(problem, own_sides, self.miss)) if self.after else (own_sides,):
            monodromy = replace(problem, sides=sides).see(self.z).monodromy
            pair.append(monodromy if np.isfinite(monodromy).all() else None)
        return pair

    @cached_property
    def exponent(self) -> float:
        """q of the image beside the border, which changes by the q-th power of the distance: 1 where both sides have a
        derivative (the piecewise linear normal form), 1/2 of a square root; nan where the rule jumps."""
        if self.after is None or all(monodromy is not None for monodromy in self.monodromies):
            return np.nan if self.after is None else 1.0
        problem, n, rough = _problem(self.before), len(self.before.problem.states), self.monodromies[0] is None
        own_sides = problem.sides_of(self.before.seen)
        forced = replace(problem, sides=own_sides if rough else _other(problem, own_sides, self.miss))
        way = np.append(self.miss.gradient[:n] * (1.0 if rough else -1.0), 0.0)
        way *= NEAR / float(np.abs(way / self.before.scales).max())
        places = [self.z + k * way for k in (1.0, 2.0, 4.0)]
        images = [forced.see(place).residual + place[:n] for place in places]
        return float(np.log2(np.linalg.norm(images[2] - images[1]) / np.linalg.norm(images[1] - images[0])))

    @cached_property
    def cycles(self) -> tuple[SmallCycle, ...]:
        """Those of the normal form up to eight turns; none where it has no derivative, or jumps."""
        if self.after is None or any(monodromy is None for monodromy in self.monodromies):
            return ()
        problem, n = _problem(self.before), len(self.before.problem.states)
        sides = _turned(problem.sides_of(self.before.seen), self.miss)
        i = self._border
        maps, border = {}, np.zeros(n + 1)
        for first in (sides[0], _flipped(sides[0], i)):
            seen = replace(problem, sides=(first, *sides[1:])).see(self.turned_z)
            border = first[i] * seen.misses[i].gradient
            maps[first[i]] = seen.monodromy, seen.jacobian[:, -1]
        return tuple(_small_cycles(maps, border))

    @property
    def _border(self) -> int:
        """Which of the borders it is."""
        return _problem(self.before).pieces.names.index(self.miss.contact)

    @property
    def turned_z(self) -> Vector:
        """The cycle begun at the point that is at the border."""
        return self.before.problem.shifted(self.z, self.before.seen, self.miss.time)

    def leaving(self) -> Iterator[Node]:
        """Motions of several turns beside the point, their tangents leading away: those that are stable, and of two."""
        for cycle in self.cycles:
            if len(cycle.word) == 2 or (cycle.stable and len(cycle.word) > 2):
                node = self._beside(cycle)
                if node is not None:
                    yield node

    def _beside(self, cycle: SmallCycle) -> Node | None:
        scales = self.before.scales
        problem, i = replace(_problem(self.before), period=self.before.problem.turns * len(cycle.word)), self._border
        for away in AWAY:
            m = away * scales[-1] * (1 if cycle.above else -1)
            z = self.turned_z + m * np.array([*cycle.start, 1.0])
            try:
                node = solved(problem, scales, z / scales, parameter(float(z[-1])), reach=REACH)
            except Lost:
                continue
            letters = [sides[i] for sides in problem.sides_of(node.seen)[:: self.before.problem.turns]]
            if letters == [1 if letter == "R" else -1 for letter in cycle.word]:
                return node if node.tangent[-1] * m > 0.0 else node.turned()
        return None


def collision(node: Node, miss: Passing) -> Collision:
    """Where a point of a cycle comes to a border. Lost: it does not."""
    problem, scales = _problem(node), node.scales
    own_sides = problem.sides_of(node.seen)
    other_sides, opposite = _other(problem, own_sides, miss), replace(miss, before=-miss.before, after=-miss.before)
    rate = node.along(miss.gradient)
    guess, u = node.u + (-miss.value / rate if rate else 0.0) * node.tangent, None
    for sides, like in ((own_sides, miss), (other_sides, opposite)):
        try:
            u = solved(replace(problem, sides=sides), scales, guess, value_border(like, 0.0), reach=REACH).u
            break
        except Lost:
            continue
    if u is None:
        raise Lost("it does not come to the border")
    down = miss.gradient * scales
    down = down / float(down @ down)
    before = _beside(problem, scales, u, own_sides, miss, down)
    jumps = _jumps(replace(problem, sides=other_sides), u, scales)
    after = None if jumps else _beside(problem, scales, u, other_sides, opposite, -down)
    return Collision(node if before is None else before.turned(), u * scales, miss, after)


def _jumps(problem: MapProblem, u: Vector, scales: Vector) -> bool:
    """Whether a cycle at a border is none on a side of it."""
    try:
        residual = problem.see(u * scales).residual
    except StickslipError:
        return True
    return bool(np.abs(residual / scales[: len(residual)]).max() > JUMPS)


def _beside(
    problem: MapProblem, scales: Vector, u: Vector, sides: tuple[Sides, ...], like: Passing, up: Vector
) -> Node | None:
    """The motion at a small distance from the border, on these sides of all, its tangent leading away; None if there is
    none. The distance grows by 1 along ``up``."""
    for distance in BESIDE:
        value = distance * like.size(scales)
        try:
            forced = replace(problem, sides=sides)
            z = solved(forced, scales, u + value * up, value_border(like, value), reach=REACH).z
            seen = problem.see(z)
        except (Lost, StickslipError):
            continue
        if problem.sides_of(seen) == sides and np.isfinite(seen.jacobian).all():
            return growing(Node(problem, scales, z, seen, tangent_of(seen, scales)), like)
    return None


def _problem(node: Node) -> MapProblem:
    assert isinstance(node.problem, MapProblem)
    return node.problem


def _other(problem: MapProblem, sides: tuple[Sides, ...], miss: Passing) -> tuple[Sides, ...]:
    """Sides with one point on the other side of one border."""
    i, k = problem.pieces.names.index(miss.contact), round(miss.time)
    return (*sides[:k], _flipped(sides[k], i), *sides[k + 1 :])


def _flipped(sides: Sides, border: int) -> Sides:
    """The other side of one border."""
    return (*sides[:border], -sides[border], *sides[border + 1 :])


def _turned(sides: tuple[Sides, ...], miss: Passing) -> tuple[Sides, ...]:
    k = round(miss.time)
    return sides[k:] + sides[:k]


def _small_cycles(maps: dict[int, tuple[Vector, Vector]], border: Vector) -> Iterator[SmallCycle]:
    """The cycles of a piecewise linear map: per side its matrix and what a unit of the parameter adds; c and d."""
    n = len(border) - 1
    for length in range(1, LONGEST + 1):
        for letters in product((-1, 1), repeat=length):
            turns = [letters[i:] + letters[:i] for i in range(length)]
            if letters != max(turns) or letters in turns[1:]:
                continue
            matrix, added = np.eye(n), np.zeros(n)
            for letter in letters:
                matrix, added = maps[letter][0] @ matrix, maps[letter][0] @ added + maps[letter][1]
            try:
                start = np.linalg.solve(np.eye(n) - matrix, added)
            except np.linalg.LinAlgError:
                continue
            y, values = start, []
            for letter in letters:
                values.append(letter * float(border[:n] @ y + border[n]))
                y = maps[letter][0] @ y + maps[letter][1]
            stable = bool(np.abs(np.linalg.eigvals(matrix)).max() < 1.0)
            word = "".join("R" if letter > 0 else "L" for letter in letters)
            if min(values) > FAR or max(values) < -FAR:
                yield SmallCycle(word, min(values) > 0.0, stable, tuple(start.tolist()))
