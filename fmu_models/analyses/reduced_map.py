"""A section of the map of a strobe: one state before and after a step, all others the same after as before.

    x -> P(x, y)_x    where    P(x, y)_y = y

Its fixed points are all periodic motions of the step, stable or not, and its slope there, with M the derivative of P,

    slope = M_xx + M_xy (1 - M_yy)^-1 M_yx

is above, at or below 1 as the motion's largest multipliers are: a peak or a jump shows what the whole map folds or
tears. The curve is followed from a start by steps in x, both ways, until y goes on no further.

Source: Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), figure 10.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from fmu_models.analyses.declaration import CROSSED, STATE, Analysis
from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Pictured
from fmu_models.sections.system import SectionSystem

# Newton's method: steps, the residual of a root in sizes of the states, and halvings of a step in x where it fails
STEPS, ROOT, HALVINGS = 12, 1e-12, 12


@dataclass(frozen=True, eq=False)
class ReducedMap(Pictured):
    """Of m places.

    Attributes:
        model, of: names of the model and of the state x.
        values, images, slopes: (m,) of x before and after the step, and of the map.
        points: (m, n) all states before.
        states: names.
        fixed: (k, n) the periodic motions; fixed_slopes: (k,).
        units: of the states.
    """

    COLUMNS: ClassVar = ("{states}=points", "{of}_after=images", "slope=slopes")

    model: str
    of: str
    states: tuple[str, ...]
    values: Vector
    images: Vector
    slopes: Vector
    points: Vector
    fixed: Vector
    fixed_slopes: Vector
    units: Mapping[str, str] = field(default_factory=dict)

    def _heading(self) -> str:
        return f"Reduced map of {self.model} over {self.of}: {len(self.values)} places, {len(self.fixed)} fixed points"

    def _contents(self) -> Mapping[str, Any]:
        index = self.states.index(self.of)
        return {self.of: self.values, "after": self.images, "fixed": self.fixed[:, index], "slopes": self.fixed_slopes}


def reduced_map(
    system: SectionSystem,
    of: str,
    values: Sequence[float] | Vector,
    *,
    start: Mapping[str, float] | Sequence[float] | None = None,
) -> ReducedMap:
    """Take the section of a map over one state, all others the same after a step as before, and its fixed points.

    Args:
        system: at its section; ``every`` of a strobe says how many periods are a step.
        of: name of the state x.
        values: (m,) of it, ascending; those that the curve does not reach are left out.
        start: near a point of the curve.

    Raises:
        StickslipError: no such state, values that do not ascend, no point of the curve near the start.
    """
    refuse_unknown(of, system.states, f"'{system.name}' has no state '{of}'.")
    places = np.asarray(values, dtype=float)
    if places.ndim != 1 or places.size < 2 or not np.isfinite(places).all() or (np.diff(places) <= 0.0).any():
        raise StickslipError(f"The values of '{of}' must be finite and ascending, two at least, found {places.shape}.")
    curve = _Curve(system, system.states.index(of))
    middle_point = curve.at(system.start(start))
    if middle_point is None:
        raise StickslipError(
            f"No motion of {system.name} was found near that start whose other states are after a step as before. "
            "Start nearer, on a periodic motion for one."
        )
    middle = float(middle_point[0][curve.place])
    curve_points = [*reversed([*curve.followed(middle_point, places[places <= middle][::-1])])]
    curve_points += curve.followed(middle_point, places[places > middle])
    if len(curve_points) < 2:
        raise StickslipError(f"The curve at {of} = {middle:g} reaches none of the values from {places[0]:g} on.")
    fixed = [*curve.fixed(curve_points)]
    points, after, slopes = (np.array(column) for column in zip(*curve_points, strict=True))
    return ReducedMap(
        system.name, of, tuple(system.states), points[:, curve.place], after, slopes, points,
        np.array([point[0] for point in fixed]).reshape(-1, points.shape[1]), np.array([point[2] for point in fixed]),
        system.units(*system.states),
    )  # fmt: skip


def _numbers(result: ReducedMap) -> dict[str, float]:
    top = result.images.argmax()
    numbers = {
        "fixed_points": float(len(result.fixed)),
        "peak": float(result.images[top]),
        "peak_at": float(result.values[top]),
    }
    for i, (point, slope) in enumerate(zip(result.fixed, result.fixed_slopes, strict=True), 1):
        numbers |= {f"{name}_{i}": float(coordinate) for name, coordinate in zip(result.states, point, strict=True)}
        numbers[f"slope_{i}"] = float(slope)
    return numbers


ANALYSIS = Analysis(
    function=reduced_map,
    numbers=_numbers,
    results="`fixed_points`, how many; `<state>_1` and `slope_1` of the first; `peak` and `peak_at`, the largest value",
    example="forced_stick_slip --forcing omega --every 2 --set omega=1.67587 --start x=1.6528 --start v=-0.8359 "
    "--over x=1.2:2.3:221 --figure map.png",
    label="reduced map",
    axes=STATE,
    without=CROSSED,
    page=False,
)


_Place = tuple[Vector, float, float]  # a point (n,), x after the step, the slope there


class _Curve:
    """Where all states but one are after a step as before."""

    def __init__(self, system: SectionSystem, index: int) -> None:
        self.system, self.place = system, index
        self.others = np.delete(np.arange(len(system.states)), index)

    def at(self, point: Vector, complete: bool = False) -> _Place | None:
        """The point of the curve near a point, at its x, by Newton's method; of the motion that repeats itself if it is
        to be the whole point that does."""
        moved = np.arange(len(point)) if complete else self.others
        sizes, x = self.system.sizes(), point.copy()
        for _ in range(STEPS):
            step = self.system.step(x[None])
            if step.why or not np.isfinite(step.derivatives).all():
                return None
            matrix = step.derivatives[0]
            residual = self.system.difference(step.points[0] - x)[moved]
            reduced = np.eye(len(moved)) - matrix[np.ix_(moved, moved)]
            if np.abs(residual / sizes[moved]).max(initial=0.0) < ROOT:
                return x, float(step.points[0, self.place]), self._slope(matrix)
            try:
                x[moved] += np.linalg.solve(reduced, residual)
            except np.linalg.LinAlgError:
                return None
        return None

    def _slope(self, matrix: Vector) -> float:
        y, x = self.others, self.place
        reduced = np.eye(len(y)) - matrix[np.ix_(y, y)]
        return float(matrix[x, x] + matrix[x, y] @ np.linalg.lstsq(reduced, matrix[y, x])[0])

    def followed(self, first: _Place, values: Vector) -> Iterator[_Place]:
        """Places of the curve at values, from the nearest on, as far as it goes."""
        last, before = first, None
        for value in values:
            for _ in range(HALVINGS):
                following = self._towards(last, before, value)
                if following is None:
                    return
                last, before = following, last
                if following[0][self.place] == value:
                    yield following
                    break

    def _towards(self, last: _Place, before: _Place | None, value: float) -> _Place | None:
        """The place at a value, or as far towards it as Newton's method goes."""
        x = last[0][self.place]
        for halving in range(HALVINGS):
            goal = value if halving == 0 else x + (value - x) / 2.0**halving
            guess = last[0].copy()
            if before is not None and before[0][self.place] != x:
                guess += (goal - x) / (x - before[0][self.place]) * (last[0] - before[0])
            guess[self.place] = goal
            point = self.at(guess)
            if point is not None and np.abs(point[0] - guess).max() <= max(10.0 * abs(goal - x), 1e-9):
                return point
        return None

    def fixed(self, places: Sequence[_Place]) -> Iterator[_Place]:
        """Periodic motions between places."""
        for (first, image, _), (second, other_image, _) in pairwise(places):
            rise, other_rise = image - first[self.place], other_image - second[self.place]
            if rise * other_rise > 0.0 or rise == other_rise:
                continue
            fixed_point = self.at(first + rise / (rise - other_rise) * (second - first), complete=True)
            if fixed_point is not None:
                yield fixed_point
