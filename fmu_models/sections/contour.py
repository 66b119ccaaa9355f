"""The border of where a function of two numbers is positive, followed in the unit square: zeros and jumps across zero.

    predict   along the last direction, as far as a step h
    correct   on the circle of radius h about the last point, from the predicted direction to the side on which the
              function has the other sign; where that is a root, or a jump across zero, lies the next point
    adapt     the step is shortened where the border turns, or goes over from zeros to jumps, and grows where it is
              straight; a corner is what is left at the shortest step, the crossing of the lines on both its sides

The side on which the function is positive is kept on the left, so that a fold, a tip or a corner is only a turn. The
function need not be continuous; it is asked for one value at a time.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

from fmu_models.base.arrays import Vector

Height = Callable[[float, float], float]

LONGEST, SHORTEST = 0.02, 1e-7  # steps
TURN = 0.15  # largest angle between two steps, but at corners
SHARP = 0.35  # a turn at the shortest step beyond which it is a corner
FINE = 2e-15  # how near a zero is sought
SPECKS = 9  # lone values that are passed over, one after the other
STEEPEST = 1e6  # a difference that is worth more than this slope is a jump
ARMS = 1e-4, 64  # radius and places of the circle about a corner on which further borders are sought
# kinds of points: a zero, a jump across zero, a border of what has no value, a lone value inside a jump
ZERO, JUMP, NOWHERE, SPECK = range(4)


@dataclass(frozen=True, eq=False)
class Border:
    """Places (m, 2), positive on the left; kinds (m - 1,) of the steps; numbers of places that are corners; closed."""

    places: Vector
    kinds: Vector
    corners: tuple[int, ...]
    closed: bool

    def passes(self, place: Vector, direction: float) -> bool:
        """Whether it goes through a place in about a direction."""
        begins, ways = self.places[:-1], np.diff(self.places, axis=0)
        lengths = np.linalg.norm(ways, axis=1)
        along = np.clip(np.einsum("ij,ij->i", place - begins, ways) / np.maximum(lengths, 1e-9) ** 2, 0.0, 1.0)
        beside = np.linalg.norm(place - begins - along[:, None] * ways, axis=1)
        ahead = ways @ np.array([math.cos(direction), math.sin(direction)])
        return bool(((beside < 1e-7 + 0.1 * lengths) & (ahead > -1e-3 * lengths)).any())


@dataclass
class _Way:
    """Places from a begin, kinds of the steps between them, corners among them, and whether it is back."""

    places: list[Vector]
    kinds: list[int] = field(default_factory=list)
    corners: list[int] = field(default_factory=list)
    closed: bool = False

    def add(self, place: Vector, kind: int) -> None:
        self.places.append(place)
        self.kinds.append(kind)

    @property
    def steady(self) -> bool:
        """Whether the direction is known: neither at the begin nor right after a corner, which a step cuts off."""
        return len(self.kinds) > 1 and not (self.corners and self.corners[-1] >= len(self.places) - 2)

    @property
    def length(self) -> float:
        """Of the last step."""
        return float(np.linalg.norm(self.places[-1] - self.places[-2]))

    @property
    def free(self) -> bool:
        """Whether the last two steps are of one piece."""
        return len(self.places) > 3 and not (self.corners and self.corners[-1] >= len(self.places) - 3)

    def back(self) -> float:
        """Take the last step back; the direction of the one before."""
        self.places.pop()
        self.kinds.pop()
        way = self.places[-1] - self.places[-2]
        return math.atan2(way[1], way[0])

    def without_corner(self) -> float:
        """Take back the last corner, two places ago, and what came after; the direction before."""
        self.corners.pop()
        self.back()
        return self.back()

    def place_corner(self) -> None:
        """Put a corner where the lines on both its sides meet, two places after it."""
        k = len(self.places) - 3
        if k >= 2 and k in self.corners:
            self.places[k] = _crossing(self.places[k - 2 : k], self.places[k + 1 :], self.places[k])


class Tracer:
    """Follows borders of one function.

    Args:
        height: of two numbers from 0 to 1; nan where it has no value.
        noise: error of a value.
        fine: how near a jump is sought; two that are nearer to each other are one.
        most: steps of a border.
    """

    def __init__(self, height: Height, noise: float, fine: float = FINE, most: int = 4000) -> None:
        self.height, self.noise, self.fine, self.most = height, noise, fine, most
        self.borders: list[Border] = []

    def follow(self, place: Vector, direction: float) -> list[Border]:
        """The border through a place, in about a direction, and all that meet it at its corners; those that are not
        known yet."""
        seeds, first = [(place, direction)], len(self.borders)
        while seeds:
            place, direction = seeds.pop()
            at = self._next(place, direction, 10.0 * SHORTEST, 0.1, 1)
            if at is None or any(border.passes(place, at[0]) for border in self.borders):
                continue
            direction = at[0]
            border = self._whole(place, direction)
            if border is not None:
                self.borders.append(border)
                seeds += [arm for corner in border.corners for arm in self._arms(border.places[corner])]
        return self.borders[first:]

    def root(self, begin: Vector, end: Vector) -> tuple[Vector, int] | None:
        """Where the function changes its sign between two places, and what is there; None where it does not."""
        way = end - begin
        low, high = self._at(begin), self._at(end)
        if (low > 0.0) == (high > 0.0):
            return None
        at = self._root(lambda t: begin + t * way, 0.0, 1.0, float(np.linalg.norm(way)))
        return begin + at[0] * way, at[1]

    def _at(self, place: Vector) -> float:
        """The height; beyond the square that of its edge, which a border leaves straight, and -inf where there is
        none."""
        value = self.height(*np.clip(place, 0.0, 1.0).tolist())
        return -math.inf if math.isnan(value) else value

    def _root(self, way: Callable[[float], Vector], low: float, high: float, length: float) -> tuple[float, int]:
        """The number between two at which the height changes its sign, and what is there; length: of a unit of it."""

        def above(t: float) -> float:
            return max(self._at(way(t)), -1e9)

        def found(fine: float, low: float, high: float) -> tuple[float, float]:
            tolerance = max(fine / length, 4.0 * np.finfo(float).eps * max(abs(low), abs(high)))
            return float(brentq(above, low, high, xtol=tolerance, rtol=1e-15)), tolerance  # type: ignore[arg-type]

        at, tolerance = found(self.fine, low, high)
        low, high = at - 2.0 * tolerance, at + 2.0 * tolerance
        sides = [self._at(way(low)), self._at(way(high))]
        if -math.inf in sides:
            return at, NOWHERE
        if (sides[0] > 0.0) == (sides[1] > 0.0):
            return at, SPECK
        gap = abs(sides[1] - sides[0])
        if gap > self.noise + STEEPEST * 4.0 * tolerance * length:
            inner = abs(self._at(way(at + tolerance)) - self._at(way(at - tolerance)))
            if inner > 0.75 * gap:  # what is only steep is half as far apart at half the distance
                return at, JUMP
        return found(FINE, low, high)[0] if self.fine > FINE else at, ZERO

    def _whole(self, place: Vector, direction: float) -> Border | None:
        """Both ways from a place."""
        ahead = self._one_way(place, direction, 1)
        if len(ahead.places) < 2:
            return None
        if ahead.closed:
            return Border(np.array(ahead.places), np.array(ahead.kinds), tuple(ahead.corners), True)
        way = place - ahead.places[1]
        behind = self._one_way(place, math.atan2(way[1], way[0]), -1)
        first = len(behind.kinds)
        places = np.array([*behind.places[:0:-1], *ahead.places])
        corners = (*(first - k for k in reversed(behind.corners)), *(first + k for k in ahead.corners))
        return Border(places, np.array([*reversed(behind.kinds), *ahead.kinds]), corners, False)

    def _one_way(self, place: Vector, direction: float, left: int) -> _Way:
        """As far as it goes; left: 1 where the positive side is on the left."""
        way, h, width, last, bend = _Way([place]), 10.0 * SHORTEST, 0.1, direction, 0.0
        while len(way.places) < self.most:
            here, ahead = way.places[-1], last + min(max(bend * h, -TURN), TURN)
            away = float(np.linalg.norm(here - place))
            if len(way.places) > 4 and away <= 1.5 * h:
                at = self._next(here, last, away, 0.1, left)
                if at is not None and np.linalg.norm(self._on(here, away, at[0]) - place) < 1e-3 * away:
                    way.add(place, at[1])
                    way.closed = True
                    break
            at = self._next(here, ahead, h, width, left)
            lost = at is None and h <= SHORTEST
            if lost:  # in a corner: it goes on beyond
                h = 30.0 * SHORTEST
                at = self._next(here, last, h, 0.1, left)
                if at is None:
                    break
            angle, kind = at or (last + math.pi, NOWHERE)
            turn, other = math.remainder(angle - last, math.tau), bool(way.kinds) and kind != way.kinds[-1]
            there = self._on(here, h, angle)
            outside = bool(((there < 0.0) | (there > 1.0)).any())
            sharp = abs(turn) > TURN and way.steady
            if sharp and not (outside or lost) and h < 0.1 * way.length and way.length > 8.0 * SHORTEST and way.free:
                h, width = 0.25 * way.length, 1e-3  # the step before has cut off a corner
                last, bend = way.back(), 0.0
                continue
            if (other or ((sharp or at is None) and not outside)) and h > SHORTEST and not lost:
                h, width = h / 4.0, 1e-3
                continue
            if kind == NOWHERE:
                break
            if other and way.corners and way.corners[-1] == len(way.places) - 2:
                before, other = way.without_corner(), kind != way.kinds[-1]  # a piece of one step is part of it
                beyond = there - way.places[-1]
                turn = math.remainder(math.atan2(beyond[1], beyond[0]) - before, math.tau)
                here = way.places[-1]
            if other or (abs(turn) > SHARP and way.steady and not outside):
                way.corners.append(len(way.places))
                way.add(here, way.kinds[-1])  # it is placed once the line beyond is known
            way.add(np.clip(there, 0.0, 1.0), kind)
            way.place_corner()
            if outside:
                break
            straight = abs(turn) < TURN
            bend = turn / h if straight and way.steady else 0.0
            last, width = angle, max(4.0 * abs(math.remainder(angle - ahead, math.tau)), 1e-9) if straight else 0.1
            h = min(h * (2.0 if abs(turn) < 0.3 * TURN or not straight else 1.0), LONGEST)
        return way

    @staticmethod
    def _on(centre: Vector, radius: float, angle: float) -> Vector:
        return centre + radius * np.array([math.cos(angle), math.sin(angle)])

    def _next(self, here: Vector, ahead: float, h: float, width: float, left: int) -> tuple[float, int] | None:
        """The angle at which the border leaves the circle about a place of it, and what is there."""
        for _ in range(SPECKS):
            inside = self._at(self._on(here, h, ahead)) > 0.0
            turn = -left if inside else left
            near, far = 0.0, width
            while (self._at(self._on(here, h, ahead + turn * far)) > 0.0) == inside:
                if far > 0.97 * math.pi:
                    return None
                near, far = far, min(3.0 * far, 0.98 * math.pi)
            ends = sorted((ahead + turn * near, ahead + turn * far))
            ahead, kind = self._root(lambda t: self._on(here, h, t), *ends, h)
            if kind != SPECK:
                return ahead, kind
            ahead += turn * 4.0 * self.fine / h
        return None

    def _arms(self, corner: Vector) -> Iterator[tuple[Vector, float]]:
        """Places near a corner from which a border leads away or to it, with its direction."""
        radius, count = ARMS
        angles = np.linspace(0.0, math.tau, count + 1)
        inside = [self._at(self._on(corner, radius, t)) > 0.0 for t in angles]
        for k in np.flatnonzero(np.diff(inside)):
            begin, end = (self._on(corner, radius, t) for t in angles[k : k + 2])
            if ((begin < 0.0) | (begin > 1.0)).any():
                continue
            at = self.root(begin, end)
            if at is not None and at[1] in (ZERO, JUMP):  # the positive side is on the left of what leads away
                yield at[0], (angles[k] if inside[k + 1] else angles[k] + math.pi)


def _crossing(before: list[Vector], after: list[Vector], otherwise: Vector) -> Vector:
    """Where the lines through two places each meet; another place where that is far away."""
    (a, b), (c, d) = before, after
    matrix = np.stack([b - a, c - d], axis=1)
    try:
        at = a + np.linalg.solve(matrix, c - a)[0] * (b - a)
    except np.linalg.LinAlgError:
        return otherwise
    return at if np.linalg.norm(at - otherwise) < 30.0 * SHORTEST else otherwise
