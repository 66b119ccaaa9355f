"""Where a function of one variable, which may jump and may be undefined in places, meets the diagonal.

    f(x) = x               a fixed point, stable for |slope| < 1
    f(x-) < x < f(x+)      a jump across the diagonal, or the other way about: no fixed point

The function may be a map, an iterate of one, or the return map of a mechanism that costs milliseconds a value. So it is
sampled evenly and then only where it is not straight from sample to sample: 1. every cell beside a sample that is off
the line between its neighbours is halved, a few times over; 2. a cell that stays crooked is narrowed down on the half
that changes more, until it has become straight or is as narrow as a jump; 3. between jumps a change of sign of f(x) - x
is refined to a fixed point, and a dip of it towards zero is followed to its bottom. What is narrower than a cell and
leaves no trace at its ends is not seen.
"""

import bisect
import itertools
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.differentiate import derivative
from scipy.optimize import brentq, minimize_scalar

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown

Function = Callable[[float], float]

DEPTH = 6  # how often a cell between two even samples is halved before it counts as crooked for one narrow reason
SPLIT = 0.4871  # not one half: a function that is odd about the middle of a cell would look straight there
STEEPEST = 1e6  # a fixed point whose residual is worth more than this slope is a jump across the diagonal
STRETCH = 1e-6  # shortest stretch, as a share of the range, that counts as one of fixed points throughout


@dataclass(frozen=True)
class FixedPoint(Shown):
    """A crossing of the diagonal by a continuous piece.

    Attributes:
        x: where.
        slope: of the function there.
        slope_error: estimated error of the slope; 0 if a derivative was given.
    """

    x: float
    slope: float
    slope_error: float = 0.0

    @property
    def stable(self) -> bool:
        """Whether motions near it come closer."""
        return abs(self.slope) < 1.0


@dataclass(frozen=True)
class Jump(Shown):
    """A discontinuity.

    Attributes:
        x: where.
        left, right: values of the function just below and just above.
    """

    x: float
    left: float
    right: float

    @property
    def crosses_diagonal(self) -> bool:
        """Whether the diagonal passes between the two values: a discontinuous crossing, which is no fixed point."""
        return (self.left - self.x) * (self.right - self.x) < 0.0


@dataclass(frozen=True)
class Crossings(Shown):
    """The crossings found, each from left to right.

    Attributes:
        fixed_points: isolated ones.
        jumps: all of them, whether they cross the diagonal or not.
        stretches: (low, high) on which every sample is a fixed point, as about a centre.
        undefined: (low, high) without a value.
        evaluations: how often the function was called.
    """

    fixed_points: tuple[FixedPoint, ...]
    jumps: tuple[Jump, ...]
    stretches: tuple[tuple[float, float], ...]
    undefined: tuple[tuple[float, float], ...]
    evaluations: int

    @property
    def jump_crossings(self) -> tuple[Jump, ...]:
        """The jumps that cross the diagonal."""
        return tuple(jump for jump in self.jumps if jump.crosses_diagonal)


def find_crossings(
    function: Function,
    low: float,
    high: float,
    *,
    samples: int = 200,
    resolution: float = 1e-3,
    accuracy: float = 1e-13,
    noise: float | None = None,
    slope: Function | None = None,
) -> Crossings:
    """Fixed points, jumps and undefined stretches of a function between ``low`` and ``high``.

    Args:
        function: value at x; nan where it has none.
        low, high: the range, in the unit of x.
        samples: number of even samples to begin with.
        resolution: deviation from a straight line, as a share of the range, that is looked into; smaller jumps are
            found only where they cross the diagonal.
        accuracy: of the places of jumps and of the ends of undefined stretches, as a share of the range.
        noise: error of a value, in the unit of x; rounding if left out.
        slope: derivative at x; from differences if left out.

    Raises:
        StickslipError: the range is none, or there are fewer than three samples.
    """
    if not (math.isfinite(low) and math.isfinite(high) and low < high and samples >= 3):
        raise StickslipError(
            f"Crossings are sought from {low} to {high} with {samples} samples. Give two numbers, the smaller one "
            "first, and at least three samples."
        )
    rounding = 8.0 * np.finfo(float).eps * max(abs(low), abs(high))
    scan = _Scan(function, low, high, resolution, max(accuracy * (high - low), rounding), noise or rounding)
    scan.refine(np.linspace(low, high, samples).tolist())
    scan.follow_dips()
    roots, crossed = scan.roots()
    stretches = scan.stretches()
    jumps = scan.merged(crossed)
    isolated = [x for x in roots if not any(a <= x <= b for a, b in stretches)]
    points = [scan.fixed_point(x, jumps, slope) for x in isolated]
    undefined = scan.undefined()
    return Crossings(tuple(scan.apart(points)), tuple(jumps), stretches, undefined, scan.evaluations)


class _Scan:
    """Samples of a function, in order, and the cells between them that are jumps."""

    def __init__(
        self, function: Function, low: float, high: float, resolution: float, accuracy: float, noise: float
    ) -> None:
        self.function, self.low, self.high = function, low, high
        self.resolution, self.accuracy, self.noise = resolution, accuracy, noise
        # a dip that comes no nearer to the diagonal than this, between samples that the line joins, does not reach it
        self.near = 4.0 * resolution * (high - low)
        # a jump whose place is known to the accuracy starts from the diagonal, or ends on it, up to this distance
        self.touch = 4.0 * self.accuracy + noise
        self.value: dict[float, float] = {}
        self.places: list[float] = []
        self.gaps: set[tuple[float, float]] = set()
        self.evaluations = 0

    def __call__(self, x: float) -> float:
        """Value at x, remembered; nan if it is not finite."""
        if x not in self.value:
            value = float(self.function(x))
            self.value[x] = value if math.isfinite(value) else math.nan
            self.evaluations += 1
            bisect.insort(self.places, x)
        return self.value[x]

    def above(self, x: float) -> float:
        """How far the function lies above the diagonal."""
        return self(x) - x

    def squashed(self, x: float) -> float:
        """The value, with the far away drawn near: infinitely deep dips have a bottom, and cost no more than others."""
        half = (self.high - self.low) / 2
        return math.atan((self(x) - (self.low + half)) / half) / 2

    def crooked(self, a: float, m: float, b: float) -> bool:
        """Whether the value at m is off the line from a to b; so is a value that is none."""
        along = (m - a) / (b - a)
        line = (1 - along) * self.squashed(a) + along * self.squashed(b)
        return not abs(self.squashed(m) - line) <= self.resolution

    def refine(self, places: list[float]) -> None:
        """Sample evenly, then where the function is not straight; narrow down what stays crooked."""
        triples = zip(places, places[1:], places[2:], strict=False)
        marked = {cell for a, m, b in triples if self.crooked(a, m, b) for cell in ((a, m), (m, b))}
        cells = deque((a, b, DEPTH) for a, b in sorted(marked))
        while cells:
            a, b, depth = cells.popleft()
            defined = [x for x in (a, b) if not math.isnan(self(x))]
            if len(defined) < 2:
                self._narrow_edge(a, b) if defined else None
                continue
            m = a + SPLIT * (b - a)
            if math.isnan(self(m)) or (depth and self.crooked(a, m, b)):
                cells += [(a, m, depth - 1), (m, b, depth - 1)]
            elif not depth:
                cells += [(*cell, 1) for cell in self._narrow(a, b)]

    def _narrow_edge(self, a: float, b: float) -> None:
        """Bisect for the end of an undefined stretch; exactly one of a and b has a value."""
        undefined = math.isnan(self(a))
        self._bisected(a, b, lambda x: math.isnan(self(x)) == undefined)

    def _bisected(self, inside: float, outside: float, holds: Callable[[float], bool]) -> float:
        """Where something ends that holds at one of two places, from that side."""
        while abs(outside - inside) > self.accuracy:
            m = (inside + outside) / 2
            inside, outside = (m, outside) if holds(m) else (inside, m)
        return inside

    def _narrow(self, a: float, b: float) -> list[tuple[float, float]]:
        """Follow the half that changes more; a jump if it never becomes straight. Cells that end in the undefined."""
        while b - a > self.accuracy:
            if abs(self.squashed(b) - self.squashed(a)) <= self.resolution:
                return []
            m = (a + b) / 2
            if math.isnan(self(m)):
                return [(a, m), (m, b)]
            left_rise, right = abs(self.squashed(m) - self.squashed(a)), abs(self.squashed(b) - self.squashed(m))
            a, b = (a, m) if left_rise >= right else (m, b)
        self.gaps.add((a, b))
        return []

    def cells(self) -> list[tuple[float, float]]:
        """Neighbouring samples with values and no jump between them."""
        pairs = itertools.pairwise(list(self.places))
        return [(a, b) for a, b in pairs if (a, b) not in self.gaps and not math.isnan(self(a) + self(b))]

    def follow_dips(self) -> None:
        """Sample the bottom of every dip of the distance to the diagonal that could reach it."""
        for (a, m), (following, b) in itertools.pairwise(self.cells()):
            ga, gm, gb = abs(self.above(a)), abs(self.above(m)), abs(self.above(b))
            same = self.above(a) * self.above(m) > 0 and self.above(m) * self.above(b) > 0
            if m == following and same and self.noise < gm <= min(ga, gb, self.near):
                sign = math.copysign(1.0, self.above(m))
                self._bottom(lambda x, sign=sign: sign * self.above(x), a, b)

    def roots(self) -> tuple[list[float], list[Jump]]:
        """Zeros of the distance to the diagonal; and jumps across it that were too small to stand out."""
        zeros = [x for x in self.places if abs(self.above(x)) == 0.0]
        jumps = []
        stack = [cell for cell in self.cells() if self.above(cell[0]) * self.above(cell[1]) < 0.0]
        while stack:
            a, b = stack.pop()
            try:
                x = self._root(a, b)
            except ValueError:  # the function has no value somewhere inside
                continue
            tolerance = self.accuracy / 100 + 4 * np.finfo(float).eps * abs(x)
            if abs(self.above(x)) > self.noise + STEEPEST * tolerance:
                sides = (max(a, x - self.accuracy), min(b, x + self.accuracy))
                jumps.append(Jump(x, self(sides[0]), self(sides[1])))
                continue
            zeros.append(x)
            stack += self._beside(a, x, b)
        return self._touching(zeros), jumps

    def _root(self, a: float, b: float) -> float:
        def above(x: float) -> float:
            value = self.above(float(x))
            if math.isnan(value):
                raise ValueError(x)
            return value

        root = brentq(above, a, b, xtol=self.accuracy / 100, rtol=4 * np.finfo(float).eps)
        return float(np.asarray(root))

    def _beside(self, a: float, x: float, b: float) -> list[tuple[float, float]]:
        """Cells between a and b with further zeros: those of the distance to the diagonal over that to the zero x."""
        points = []
        for end in (a, b):
            inner = x + 1e-3 * (end - x)
            if abs(inner - x) <= self.accuracy or min(abs(self.above(end)), abs(self.above(inner))) <= self.noise:
                continue
            sign = math.copysign(1.0, self.above(end))
            if sign * self.above(inner) < 0.0:
                points.append((min(inner, end), max(inner, end)))
            elif max(abs(self.above(a)), abs(self.above(b))) <= self.near:
                low, high = min(inner, end), max(inner, end)
                bottom = self._bottom(lambda y, sign=sign: sign * self.above(y) / abs(y - x), low, high)
                if sign * self.above(bottom) < 0.0:
                    points += [(low, bottom), (bottom, high)]
        return points

    def _bottom(self, height: Function, low: float, high: float) -> float:
        """Where a positive function is least."""
        options = {"xatol": max(self.accuracy, 1e-9 * (high - low))}
        lowest = minimize_scalar(lambda x: height(float(x)), bounds=(low, high), method="bounded", options=options)
        return float(lowest.x)

    def _touching(self, zeros: list[float]) -> list[float]:
        """The zeros, and where the distance to the diagonal is least and no more than the noise, or ends so."""
        remaining = [
            m
            for a, m, b in zip(self.places, self.places[1:], self.places[2:], strict=False)
            if abs(self.above(m)) <= self.noise
            and abs(self.above(m)) <= min(abs(self.above(a)), abs(self.above(b)))
            and self.above(a) * self.above(b) > 0.0
        ]
        ends = [x for x in (self.low, self.high) if abs(self.above(x)) <= self.noise]
        beside_jumps = [x for gap in self.gaps for x in gap if abs(self.above(x)) <= self.touch]
        return sorted({*zeros, *remaining, *ends, *beside_jumps})

    def stretches(self) -> tuple[tuple[float, float], ...]:
        """Where every sample is a fixed point, up to the noise; the ends are bisected."""
        stretches = []
        for flat, run in itertools.groupby(list(self.places), key=lambda x: abs(self.above(x)) <= self.noise):
            inside = list(run)
            if not flat or len(inside) < 3 or inside[-1] - inside[0] <= STRETCH * (self.high - self.low):
                continue
            stretches.append((self._end(inside[0], -1), self._end(inside[-1], 1)))
        return tuple(stretches)

    def _end(self, inside: float, step: int) -> float:
        at = self.places.index(inside) + step
        if not 0 <= at < len(self.places):
            return inside
        return self._bisected(inside, self.places[at], lambda x: abs(self.above(x)) <= self.noise)

    def merged(self, crossed: list[Jump]) -> list[Jump]:
        """All jumps in order; two with less between them than the accuracy are one, with a lone value inside."""
        jumps: list[Jump] = []
        for jump in sorted([self._jump(a, b) for a, b in self.gaps] + crossed, key=lambda jump: jump.x):
            if jumps and jump.x - jumps[-1].x <= 2 * self.accuracy:
                jump = Jump((jumps[-1].x + jump.x) / 2, jumps.pop().left, jump.right)
            jumps.append(jump)
        return jumps

    def _jump(self, a: float, b: float) -> Jump:
        x = (a + b) / 2
        left_value, right = (x if abs(self.above(end)) <= self.touch else self(end) for end in (a, b))
        return Jump(x, left_value, right)

    def fixed_point(self, x: float, jumps: list[Jump], slope: Function | None) -> FixedPoint:
        """The fixed point at x, its slope taken on the piece that it lies on."""
        if slope is not None:
            return FixedPoint(x, float(slope(x)))
        holes = self.undefined()
        lower = [self.low, *(jump.x for jump in jumps), *(end for _, end in holes)]
        upper = [self.high, *(jump.x for jump in jumps), *(end for end, _ in holes)]
        below = x - max((end for end in lower if end <= x), default=x)
        over = min((end for end in upper if end >= x), default=x) - x
        reach = 0.01 * (self.high - self.low)
        side = 0 if min(below, over) > 100 * self.accuracy else (1 if over > below else -1)
        room = max(below, over) if side else min(below, over)
        first, tolerances = min(reach, 0.5 * room), {"rtol": 1e-12, "atol": 1e-12}
        slope_estimate = derivative(self.values, x, initial_step=first, step_direction=side, tolerances=tolerances)
        self.evaluations += int(slope_estimate.nfev)
        return FixedPoint(x, float(slope_estimate.df), float(slope_estimate.error))

    def values(self, x: np.ndarray) -> np.ndarray:
        """The function at each x; not as a ufunc, which reads the processor's flags: compiled code may raise them."""
        return np.reshape([float(self.function(float(abscissa))) for abscissa in np.ravel(x)], np.shape(x))

    def apart(self, points: list[FixedPoint]) -> list[FixedPoint]:
        """The fixed points without those that only the noise sets apart."""
        distinct: list[FixedPoint] = []
        for point in points:
            separation = 10 * self.accuracy + 4 * self.noise / max(abs(1 - point.slope), 1e-8)
            if distinct and point.x - distinct[-1].x <= separation:
                continue
            distinct.append(point)
        return distinct

    def undefined(self) -> tuple[tuple[float, float], ...]:
        """Runs of samples without a value, from the last sample with one to the next with one."""
        runs = []
        places = list(self.places)
        for missing, run in itertools.groupby(range(len(places)), key=lambda i: math.isnan(self(places[i]))):
            inside = list(run)
            if missing:
                first, last = max(inside[0] - 1, 0), min(inside[-1] + 1, len(places) - 1)
                runs.append((places[first], places[last]))
        return tuple(runs)
