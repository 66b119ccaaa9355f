"""Diagrams of maps of one number that may jump: where f^n meets the diagonal, over a parameter.

    fixed points      f^n(x, p) = x, stable for |slope| < 1
    jump crossings    f^n jumps across the diagonal: no motion, but what branches of fixed points end on
    bands             f^n(x, p) = x on a whole stretch, as about a centre

Fixed points and jump crossings together are the border of where f^n(x, p) > x in the plane of p and x. So one curve
leads from a branch over the jump that ends it to the next branch, and an island is a closed curve. Some values of the
parameter are scanned for where curves begin (``find_crossings``); from there they are followed (``contour``), and from
their corners every other one that meets them there. What no scanned value and no corner touches is not found.

    border collision  a branch comes to a jump (or a kink) of f^n: "fold" if what goes on is on the same side of the
                      parameter, "persistence" if on the other one. Beside it f(x + d) - f(x) ~ d^q: exponent q = 1 in
                      the piecewise linear normal form, whose slopes are told, 1/2 in that of the square root
    fold, flip        slope 1 and -1; where a flip of f^m is a corner of f^n, the cycle of n points begins

Source: Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), section 4, figures 16, 17 and 19.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from scipy.optimize import brentq

from fmu_models.analyses.declaration import NO_BOX, RANGE, Analysis, Box, Option
from fmu_models.base.arrays import Flags, Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Pictured, Shown
from fmu_models.sections.contour import FINE, JUMP, ZERO, Border, Tracer
from fmu_models.sections.diagonal import find_crossings
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.system import SectionSystem, ascending

if TYPE_CHECKING:
    import pandas

POINTS, JUMPS, BAND = "fixed points", "jump crossings", "band"
NEAR = 1e-6  # distance beside a border, in the range of the state, at which slopes and values on its sides are taken
KINK = 1e-3  # a slope that passes by 1 or -1 without coming nearer has a kink there
TINY = 1e-6  # a piece shorter than this in the unit square is part of a corner, as the steep begin of a root
ASIDE = 0.382  # of the way from one scan to the next: not where people put what is special
SAME = 1e-8  # two points in the unit square nearer than this are one


@dataclass(frozen=True, eq=False)
class CrossingCurve(Shown):
    """A piece without corners.

    Attributes:
        kind: "fixed points", "jump crossings" or "band", of which it is an edge.
        period: the least n of its fixed points; of jump crossings and bands that of the iterate.
        values, points: (m,) of the parameter and of the state.
        slopes: (m,) of the n-th iterate; nan where it is no fixed point.
    """

    kind: str
    period: int
    values: Vector
    points: Vector
    slopes: Vector

    @property
    def stable(self) -> Flags:
        """(m,) whether motions near it come closer."""
        with np.errstate(invalid="ignore"):
            return np.abs(self.slopes) < 1.0


@dataclass(frozen=True, eq=False)
class CrossingPoint(Shown):
    """Where curves meet or turn; see the module.

    Attributes:
        kind: "border collision", "fold", "flip" or "corner of jumps".
        period: n of the iterate.
        value, x: of the parameter and of the state.
        form: of a border collision "fold" or "persistence"; else empty.
        slopes, exponents, limits: of the iterate below and above x: its slope, q, and its value.
    """

    kind: str
    period: int
    value: float
    x: float
    form: str
    slopes: tuple[float, float]
    exponents: tuple[float, float]
    limits: tuple[float, float]

    @property
    def normal_form(self) -> str:
        """Of a border collision: "piecewise linear" or "square root"; "" where it is neither, or none."""
        known = {1.0: "piecewise linear", 0.5: "square root"}
        near = {name for q in self.exponents for at, name in known.items() if abs(q - at) < 0.05}
        least = "square root" if "square root" in near else "piecewise linear"
        return least if self.kind == "border collision" and near else ""


@dataclass(frozen=True, eq=False)
class CrossingDiagram(Pictured):
    """Curves of the iterates 1 to n, and their special points.

    Attributes:
        model, over, of: names of the model, the parameter and the state.
        period: n.
        curves, special: see their classes; special points by period and value.
        evaluations: steps that were made.
        units: of the state and the parameter.
    """

    RECORD: ClassVar = ("model", "over", "of", "period", "curves", "special", "evaluations")

    model: str
    over: str
    of: str
    period: int
    curves: tuple[CrossingCurve, ...]
    special: tuple[CrossingPoint, ...]
    evaluations: int
    units: Mapping[str, str] = field(default_factory=dict)
    iterates: tuple["_Iterate", ...] = field(default=(), repr=False)

    @property
    def frame(self) -> "pandas.DataFrame":
        """One row per place of a curve."""
        import pandas

        columns = ("values", "points", "slopes")
        parts = [pandas.DataFrame({name: getattr(curve, name) for name in columns}) for curve in self.curves]
        for k, (part, curve) in enumerate(zip(parts, self.curves, strict=True)):
            part[["period", "kind", "curve"]] = curve.period, curve.kind, k
        names = {"values": self.over, "points": self.of, "slopes": "slope"}
        return pandas.concat(parts, ignore_index=True).rename(columns=names) if parts else pandas.DataFrame()

    def at(self, value: float) -> list[tuple[str, int, float, float]]:
        """Kind, period, state and slope of all that is there at a value of the parameter, by period and state."""
        found = {
            (curve.kind, curve.period, *place)
            for curve in self.curves
            for iterate in self.iterates[curve.period - 1 : curve.period]
            for place in iterate.at(curve, value)
        }
        return sorted(found, key=lambda row: (row[1], row[2]))

    def _heading(self) -> str:
        return f"Crossings of {self.model} over {self.over}: {len(self.curves)} curves, to period {self.period}"

    def _contents(self) -> Mapping[str, Any]:
        counts = Counter(f"{curve.kind}, period {curve.period}" for curve in self.curves)
        points = {
            f"{point.kind}, {point.form}" if point.form else point.kind: f"{point.value:.12g}, {self.of} {point.x:.12g}"
            for point in self.special
        }
        return {**counts, **points, "evaluations": self.evaluations}


def crossing_diagram(
    system: SectionSystem,
    over: str,
    between: tuple[float, float],
    *,
    iterates: Annotated[int, Option("Iterates of the map, from the first to this one.", minimum=1)] = 1,
    box: Annotated[Box, Option("Range of the state (default: that of a map's declaration).")] = NO_BOX,
    scans: Annotated[int, Option("Values of the parameter at which curves are sought.", minimum=3)] = 17,
    noise: Annotated[float, Option("Error of a value of the map; 0: rounding.")] = 0.0,
    accuracy: Annotated[float, Option("Of the places of jumps, in the range; 0: rounding.")] = 0.0,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> CrossingDiagram:
    """Follow fixed points and jumps across the diagonal of a map of one number over a parameter.

    Args:
        system: a declared map, a return map, or another section whose points have one number.
        over, between: the parameter, and its range.
        iterates: n; the iterates 1 to n are followed.
        box: (low, high) of the state by its name.
        scans: values, the ends of the range among them, at which the whole box is looked through.
        noise: in the unit of the state; what is nearer to the diagonal counts as on it.
        accuracy: two jumps nearer to each other are one, as where two impacts count as simultaneous on a short stretch.
        progress: called with the fraction done.

    Raises:
        StickslipError: several states, or an angle; no such parameter; a range or box that is none.
    """
    if len(system.states) != 1 or np.isfinite(system.turns).any():
        raise StickslipError(
            f"Crossings with the diagonal are those of a map of one number that is no angle; points of {system.name} "
            f"have {', '.join(system.states)}. Take a return map of one state: "
            "--level STATE=VALUE --returns STATE, or these in a scene."
        )
    (of,) = system.states
    declared = {of: tuple(system.box[0].tolist())} if isinstance(system, Iteration) else {}
    for name in box:
        refuse_unknown(name, system.states, f"{system.name} has no state '{name}'.")
    if not box and not declared:
        raise StickslipError(f"Say in which range of '{of}' crossings are sought: two ascending numbers, as box.")
    between, (low, high) = ascending(over, between), ascending(of, {**declared, **box}[of])
    system.check(over, np.array(between))
    noise = noise or 8.0 * np.finfo(float).eps * max(abs(low), abs(high))
    plane = between, (low, high)
    powers = tuple(_Iterate(system, over, plane, n, noise, accuracy or FINE) for n in range(1, iterates + 1))
    curves: list[CrossingCurve] = []
    special: list[CrossingPoint] = []
    for k, iterate in enumerate(powers):
        iterate.seek(scans, lambda done, k=k: progress((k + done) / iterates))
        for border in iterate.borders.borders:
            curves += iterate.curves(border)
            special += iterate.corners(border)
        curves += [iterate.curve(BAND, b.places, np.full(len(b.places), np.nan)) for b in iterate.bands.borders]
        special += [point for c in curves if c.period == iterate.n and c.kind == POINTS for point in iterate.turns(c)]
    apart: list[CrossingPoint] = []
    for point in sorted(special, key=lambda point: (point.period, point.value, point.x)):
        near = (abs(point.value - q.value) + abs(point.x - q.x) for q in apart if q.period == point.period)
        apart += [point] if min(near, default=math.inf) > SAME * (high - low) else []
    units = {name: system.unit_of(name) for name in (of, over)}
    steps = sum(iterate.steps for iterate in powers)
    return CrossingDiagram(system.name, over, of, iterates, tuple(curves), tuple(apart), steps, units, powers)


class _Iterate:
    """f^n over the unit square of the parameter and the state."""

    def __init__(
        self, system: SectionSystem, over: str, ranges: Sequence[tuple[float, float]], n: int, noise: float, fine: float
    ) -> None:
        self.system, self.over, self.n, self.noise, self.steps = system, over, n, noise, 0
        self.low = np.array([low for low, _ in ranges])
        self.size = np.array([high - low for low, high in ranges])
        # what counts as on the diagonal is not above it
        self.borders = Tracer(lambda u, v: self._above(u, v) - noise, noise, fine)
        self.bands = Tracer(lambda u, v: noise - abs(self._above(u, v)), noise)

    def value(self, p: float, x: float, n: int = 0) -> float:
        """f^n(x, p); nan where there is none."""
        return self._images(p, x, n or self.n)[-1][0]

    def slope(self, p: float, x: float) -> float:
        """Its derivative by x."""
        return math.prod(slope for _, slope in self._images(p, x, self.n, derivative=True)[1:])

    def _images(self, p: float, x: float, n: int, *, derivative: bool = False) -> list[tuple[float, float]]:
        images, varied = [(x, 1.0)], {self.over: np.array([p])}
        for _ in range(n):
            step = self.system.step(np.array([[images[-1][0]]]), varied, derivative=derivative)
            slope = float(step.derivatives[0, 0, 0]) if derivative else math.nan
            images.append((float(step.points[0, 0]) if not step.why else math.nan, slope))
            self.steps += 1
            if math.isnan(images[-1][0]):
                break
        return images

    def _above(self, u: float, v: float) -> float:
        p, x = self.plane(np.array([u, v])).tolist()
        return self.value(p, x) - x

    def plane(self, places: Vector) -> Vector:
        """(..., 2) parameter and state at places of the unit square."""
        return self.low + places * self.size

    def seek(self, scans: int, progress: Callable[[float], Any]) -> None:
        """Look through the state at some values of the parameter, and follow what begins there."""
        low, high = float(self.low[1]), float(self.low[1] + self.size[1])
        beside = NEAR * (high - low)
        places = [0.0, *((np.arange(scans - 2) + ASIDE) / (scans - 2)), 1.0]
        for k, u in enumerate(map(float, places)):
            p = float(self.plane(np.array([u, 0.0]))[0])
            found = find_crossings(
                lambda x, p=p: self.value(p, x), low, high, noise=self.noise, accuracy=self.borders.fine,
                slope=lambda x, p=p: (self.value(p, x + beside) - self.value(p, x - beside)) / (2.0 * beside),
            )  # fmt: skip
            upward = {point.x: point.slope > 1.0 for point in found.fixed_points}
            upward |= {jump.x: jump.right > jump.left for jump in found.jump_crossings}
            bands = {end: is_low for stretch in found.stretches for end, is_low in zip(stretch, (1, 0), strict=True)}
            for tracer, seeds in ((self.borders, upward), (self.bands, bands)):
                for x, positive_above in seeds.items():
                    place = np.array([u, (x - low) / (high - low)])
                    tracer.follow(place, 0.0 if positive_above else math.pi)
            progress((k + 1) / scans)

    def curves(self, border: Border) -> Iterator[CrossingCurve]:
        """Its pieces between corners; without those whose fixed points have a smaller period."""
        for first, last in pairwise(sorted({0, *border.corners, len(border.places) - 1})):
            places = border.places[first : last + 1]
            if np.abs(np.diff(places, axis=0)).sum() < TINY:
                continue
            if border.kinds[first] == JUMP:
                yield self.curve(JUMPS, places, np.full(len(places), np.nan))
                continue
            inner = places.copy()  # at its ends the map may be that of another piece
            inner[0], inner[-1] = 0.5 * (places[0] + places[1]), 0.5 * (places[-1] + places[-2])
            images = [self._images(p, x, self.n, derivative=True) for p, x in self.plane(inner).tolist()]
            slopes = np.array([math.prod(slope for _, slope in row[1:]) for row in images])
            own = [self._period(row) == self.n for row in images]
            for is_own, run in groupby(range(len(places)), key=own.__getitem__):
                indices = list(run)
                if is_own and len(indices) > 1:
                    yield self.curve(POINTS, places[indices], slopes[indices])

    def curve(self, kind: str, places: Vector, slopes: Vector) -> CrossingCurve:
        """A curve through places of the unit square."""
        values, points = self.plane(places).T
        return CrossingCurve(kind, self.n, values, points, slopes)

    def _period(self, images: Sequence[tuple[float, float]]) -> int:
        """After how many steps the first of n + 1 images is there again."""
        near = (m for m in range(1, self.n) if self.n % m == 0 and m < len(images))
        return next((m for m in near if abs(images[m][0] - images[0][0]) < NEAR * self.size[1]), self.n)

    def corners(self, border: Border) -> Iterator[CrossingPoint]:
        """Its corners, but for the flips of smaller iterates."""
        steps = np.diff(border.places, axis=0) @ np.array([1.0, 1.0j])
        together: list[list[int]] = []
        for k in border.corners:
            near = together and np.abs(border.places[k] - border.places[together[-1][-1]]).sum() < TINY
            together = [*together[:-1], [*together[-1], k]] if near else [*together, [k]]
        for several in together:  # the sharpest is the corner, beside which a steep begin looks like a jump
            k = max(several, key=lambda k: abs(np.angle(steps[k] * np.conj(steps[k - 1]))))
            kinds = set(border.kinds[k - 1 : k + 1].tolist())
            off = border.places - border.places[k]
            away = np.flatnonzero(np.abs(off).sum(axis=1) > TINY)
            before_after = off[away[away < k][-1:], 0].sum() * off[away[away > k][:1], 0].sum()
            form = "fold" if before_after > 0.0 else "persistence"
            if kinds == {JUMP}:
                yield self._special("corner of jumps", border.places[k], "")
                continue
            p, x = self.plane(border.places[k]).tolist()
            images = self._images(p, x, self.n)
            if kinds != {ZERO} or self._period(images) == self.n:
                yield self._special("border collision", border.places[k], form)

    def turns(self, curve: CrossingCurve) -> Iterator[CrossingPoint]:
        """Folds and flips, and kinks at which the slope passes by 1 or -1."""
        places = (np.stack([curve.values, curve.points], axis=1) - self.low) / self.size
        for kind, target in (("fold", 1.0), ("flip", -1.0)):
            for k in np.flatnonzero(np.diff(np.sign(curve.slopes - target)) != 0.0):
                found = self._passing(places[k], places[k + 1], target)
                if found is not None and abs(found[1] - target) < KINK:
                    yield self._special(kind, found[0], "")
                elif found is not None:
                    yield self._special("border collision", found[0], "fold" if kind == "fold" else "persistence")

    def _passing(self, begin: Vector, end: Vector, target: float) -> tuple[Vector, float] | None:
        """The place between two of a curve where the slope passes a number, and the slope there."""
        way = end - begin
        across = 0.3 * np.array([-way[1], way[0]])
        last: list[tuple[Vector, float]] = []

        def test(t: float) -> float:
            middle = begin + t * way
            at = self.borders.root(middle - across, middle + across)
            place = middle if at is None else at[0]
            last.append((place, self.slope(*self.plane(place).tolist())))
            return last[-1][1] - target

        if not test(1e-9) * test(1.0 - 1e-9) < 0.0:
            return None
        brentq(test, 1e-9, 1.0 - 1e-9, xtol=1e-11)
        return min(last, key=lambda pair: abs(pair[1] - target))

    def _special(self, kind: str, place: Vector, form: str) -> CrossingPoint:
        """With what the iterate is like on both sides."""
        (p, x), sides = self.plane(place).tolist(), []
        for side in (-1.0, 1.0):
            f = [self.value(p, x + side * k * 10.0 * NEAR * self.size[1]) for k in (1e-4, 1.0, 2.0, 4.0)]
            rise = (f[3] - f[2]) / (f[2] - f[1]) if f[2] != f[1] else 2.0
            exponent = math.log2(rise) if rise > 0.0 else math.nan
            sides.append((self.slope(p, x + side * NEAR * self.size[1]), exponent, f[0]))
        slopes, exponents, limits = ((below, above) for below, above in zip(*sides, strict=True))
        return CrossingPoint(kind, self.n, p, x, form, slopes, exponents, limits)

    def at(self, curve: CrossingCurve, value: float) -> Iterator[tuple[float, float]]:
        """State and slope of a curve at a value of the parameter."""
        tracer = self.bands if curve.kind == BAND else self.borders
        beyond = curve.values >= value if value >= self.low[0] + self.size[0] else curve.values > value
        for k in np.flatnonzero(beyond[:-1] != beyond[1:]):
            t = (value - curve.values[k]) / (curve.values[k + 1] - curve.values[k])
            x = curve.points[k] + t * (curve.points[k + 1] - curve.points[k])
            place = (np.array([value, x]) - self.low) / self.size
            for reach in np.geomspace(1e-9, 0.03, 12):
                at = tracer.root(*(place + np.array([0.0, side * reach]) for side in (-1.0, 1.0)))
                if at is not None:
                    x = float(self.plane(at[0])[1])
                    yield x, self.slope(value, x) if curve.kind == POINTS else math.nan
                    break


def _numbers(result: CrossingDiagram, values: Sequence[float]) -> list[tuple[float, dict[str, float]]]:
    rows: list[tuple[float, dict[str, float]]] = []
    special, counts = {}, Counter[str]()
    for point in result.special:
        name = f"{point.kind.replace(' ', '_')}_{point.period}"
        counts[name] += 1
        special |= {f"{name}_{counts[name]}": point.value, f"{name}_{counts[name]}_{result.of}": point.x}
    for value in values:
        numbers, seen = {} if rows else special, Counter[str]()
        for kind, period, x, slope in result.at(value):
            name = f"{kind.split()[0]}_{period}"
            seen[name] += 1
            numbers = {**numbers, f"{name}_{seen[name]}": x}
            numbers |= {f"slope_{period}_{seen[name]}": slope} if kind == POINTS else {}
        rows.append((value, {**numbers, **{name: float(count) for name, count in seen.items()}}))
    return rows


ANALYSIS = Analysis(
    function=crossing_diagram,
    numbers=_numbers,
    results=(
        "a row per value, n the iterate and k from the least: `fixed_n_k`, `slope_n_k`, `jump_n_k`, ends `band_n_k`, "
        "and `fixed_n` how many; the first has `border_collision_n_k`, `fold_n_k`, `flip_n_k` too, values of the "
        "parameter, and `border_collision_n_k_<state>`"
    ),
    example="piecewise_linear --over r=-1:4 --iterates 2 --figure crossings.png",
    label="following",
    axes=RANGE,
    without=("autonomous", "workers", "scheduler"),
    page=False,
)
