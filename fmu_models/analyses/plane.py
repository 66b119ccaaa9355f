"""The phase plane of a model with two states that nothing forces: what rests, slides and returns in it, and the flow.

    rests      zeros of the rates by Newton's method from a grid, and those of sliding motions (``plane_surfaces``)
    cycles     each goes around a point of rest that is no saddle, and so meets the half-line from it along the first
               state: r -> P(r), the distance at the next passage in the same direction. All fixed points of log P over
               log r are found (``find_crossings``), those of cycles that are not stable among them; slopes exact
    manifolds  of saddles; of a point of rest on a surface those halves that lie on a side where it is one

A cycle that is narrower than a sample of the half-line and leaves no trace beside it is not seen.

Source: Perko, Differential Equations and Dynamical Systems (2001), sections 3.4 and 3.12.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np

from fmu_models.analyses.declaration import NO_BOX, OSCILLATOR, Analysis, Box, Option
from fmu_models.analyses.manifolds import Manifold, manifolds_of
from fmu_models.analyses.plane_surfaces import Rest, Sliding, grid_of, rates_at, surfaces_of
from fmu_models.analyses.saddle import Saddle, rest_near
from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Pictured
from fmu_models.continuation.problem.equilibrium import ordered
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.amounts import Measured
from fmu_models.sections.diagonal import find_crossings
from fmu_models.sections.return_map import ReturnMap
from fmu_models.sections.system import ascending
from fmu_models.simulation.field import VectorField, is_forced
from fmu_models.simulation.run import check_settings, simulate
from fmu_models.simulation.sections import Section

SIZES, ROOM, GUESSES = 10.0, 0.25, 9  # a box where none is given, in sizes; around what is found; along each state
SAME, NEAR = 1e-6, 2e-3  # of the box: two points of rest are one; what a manifold comes to
# of the box: the least distance of the half-line; its samples; rounding of log P; times in which a box is crossed
NARROW, SAMPLES, NOISE, PATIENCE = 1e-5, 100, 1e-11, 300.0
LENGTH, SPACING, POINTS = 60.0, 0.01, 2001  # of a manifold, in boxes; samples of a cycle
FAR = 1.0  # boxes beyond the box: a manifold that goes there does not come back
ROUNDING = 1e-9  # of eigenvalues: real parts below are none
BESIDE, ALIKE = 1e-6, 1e-4  # of the box: whose sides a point of rest has; of the slopes: no two sides


@dataclass(frozen=True, eq=False)
class PlaneCycle:
    """A cycle.

    Attributes:
        period: s.
        multiplier: of the return map; 0 where it slides.
        points: (m, 2) along it, from the half-line.
        low, high: (2,) least and largest values of the states.
    """

    RECORD: ClassVar = ("period", "multiplier", "stable", "low", "high", "points")

    period: float
    multiplier: float
    points: Vector
    low: Vector
    high: Vector

    @property
    def stable(self) -> bool:
        """Whether motions near it come to it."""
        return abs(self.multiplier) < 1.0

    @property
    def word(self) -> str:
        """In words."""
        return f"{'stable' if self.stable else 'unstable'} cycle of {self.period:.6g} s"


@dataclass(frozen=True, eq=False)
class PhasePlane(Pictured):
    """What there is in a phase plane.

    Attributes:
        model, states: names.
        limits: (2, 2) least and largest values of the states.
        rests: points of rest, by their first state.
        cycles: by their period.
        centres: (low, high) distances on a half-line on which all motions are cycles.
        surfaces: (m, 2) each, where contacts change.
        slidings: parts of these along which motions slide.
        manifolds: halves of those of saddles; ``end`` says what each comes to, or from.
        flow: (m, 2) each, motions.
        units: of the states.
    """

    COLUMNS: ClassVar = ("kind=rests.kind", "{states}=points")
    RECORD: ClassVar = ("model", "states", "limits", "rests", "cycles", "centres", "slidings", "manifolds")

    model: str
    states: tuple[str, ...]
    limits: Vector
    rests: tuple[Rest, ...]
    cycles: tuple[PlaneCycle, ...]
    centres: tuple[tuple[float, float], ...]
    surfaces: tuple[Vector, ...]
    slidings: tuple[Sliding, ...]
    manifolds: tuple[Manifold, ...] = ()
    flow: tuple[Vector, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def points(self) -> Vector:
        """(k, 2) those of rest."""
        return np.array([rest.point for rest in self.rests]).reshape(-1, 2)

    def _heading(self) -> str:
        return f"Phase plane of {self.model}"

    def _contents(self) -> Mapping[str, Any]:
        parts = [("slides" if part.attracting else "repels", part) for part in self.slidings]
        return {
            **{f"{rest.kind} {i}": (rest.point, rest.eigenvalues) for i, rest in enumerate(self.rests, 1)},
            **{f"cycle {i}": f"{c.word}, multiplier {c.multiplier:.6g}" for i, c in enumerate(self.cycles, 1)},
            "centres": self.centres or None,
            **{f"{word} {i}": (part.contact, *part.points[[0, -1]]) for i, (word, part) in enumerate(parts, 1)},
            **{f"{half.kind} manifold {i}": half.end for i, half in enumerate(self.manifolds, 1)},
        }


@dataclass(frozen=True, eq=False)
class _Plane:
    """The flow in a box.

    Attributes:
        rates: of the model.
        given: values of parameters and inputs that are not at their default.
        limits: (2, 2).
    """

    rates: VectorField
    given: Mapping[str, float]
    limits: Vector

    @property
    def fmu(self) -> Fmu:
        return self.rates.fmu

    @property
    def size(self) -> Vector:
        return self.limits[1] - self.limits[0]

    @cached_property
    def time(self) -> float:
        """s, in which a motion crosses the box, about."""
        seen = (rates_at(self.rates, node) for row in grid_of(self.limits, GUESSES) for node in row)
        speeds = [float(np.linalg.norm(at.rates / self.size)) for at in seen if at is not None]
        return 1.0 / (float(np.median(speeds)) or 1.0)

    def holds(self, points: Vector, beyond: float = 0.0) -> Any:
        """Whether points (..., 2) lie in the box, or no more than so many boxes beyond it."""
        return (np.abs(points - self.limits.mean(axis=0)) <= (0.5 + beyond) * self.size).all(axis=-1)

    def run(self, point: Vector) -> dict[str, Any]:
        """Arguments of ``simulate`` for the motion from a point (2,)."""
        return {**self.fmu.settings(self.given), "start": dict(zip(self.fmu.states, point.tolist(), strict=True))}

    def motion(self, point: Vector, duration: float, samples: int) -> Vector:
        """(samples, 2) the motion from a point. StickslipError: the engine cannot continue it."""
        times = np.linspace(0.0, duration, samples)
        motion = simulate(self.fmu, duration, output_times=times, **self.run(point))
        return np.column_stack([motion[name] for name in self.fmu.states])

    def zeros(self) -> list[Vector]:
        """Where the rates are zero."""
        found: list[Vector] = []
        for guess in grid_of(self.limits, GUESSES).reshape(-1, 2):
            with suppress(StickslipError):
                point, _ = rest_near(self.fmu, self.rates, guess)
                if self.holds(point) and all(np.abs((point - other) / self.size).max() > SAME for other in found):
                    found.append(point)
        return found

    def sides(self, point: Vector) -> list[tuple[tuple[int, ...], Vector]]:
        """The contact states about a point of rest, and the slopes in each."""
        angles = np.pi * (np.arange(8) + 0.3) / 4.0
        around = point + BESIDE * self.size * np.column_stack([np.cos(angles), np.sin(angles)])
        words = {}
        for place in around:
            seen = rates_at(self.rates, place)
            if seen is not None and seen.contacts not in words:
                words[seen.contacts] = self.rates.slopes(place, ())
        return list(words.items())

    def rest(self, point: Vector) -> Rest:
        """A zero of the rates, by its eigenvalues."""
        slopes = [slopes for _, slopes in self.sides(point)]
        if max(np.abs(other - slopes[0]).max() for other in slopes) < ALIKE * np.abs(slopes).max():
            slopes = [self.rates.slopes(point, ())]
        each = [ordered(side) for side in slopes]
        return Rest(_kind(each[0]) if len(each) == 1 else "on a surface", point, np.concatenate(each))

    def halves(self, rest: Rest) -> list[Manifold]:
        """The manifolds of a saddle, on each side."""
        found = []
        for word, slopes in self.sides(rest.point):
            if not np.linalg.det(slopes) < 0.0:
                continue
            saddle = Saddle(self.fmu, self.rates, self.given, rest.point, slopes)
            boxes = float((self.size / saddle.sizes).max())
            for half in manifolds_of(saddle, LENGTH * boxes, SPACING * boxes, (1.0,)).curves:
                beside = rates_at(self.rates, half.points[1])
                if beside is not None and beside.contacts == word:
                    outside = np.flatnonzero(~self.holds(half.points, FAR))
                    many = outside[0] + 1 if outside.size else len(half.points)
                    found.append(replace(half, points=half.points[:many]))
        return found

    def comes_to(self, half: Manifold, rests: Sequence[Rest], cycles: Sequence[PlaneCycle]) -> Manifold:
        """The half of a manifold, with what it comes to, or from, in words."""
        word, end = "comes to" if half.kind == "unstable" else "comes from", half.points[-1]
        ends = [
            (f"the {rest.kind} at ({', '.join(f'{x:.6g}' for x in rest.point)})", rest.point[None]) for rest in rests
        ]
        ends += [(f"the {cycle.word}", cycle.points) for cycle in cycles]
        if not self.holds(end, FAR):
            return replace(half, end="leaves the box" if half.kind == "unstable" else "comes from outside the box")
        near = (what for what, points in ends if np.abs((points - end) / self.size).max(axis=1).min() < NEAR)
        return replace(half, end=" ".join((word, what)) if (what := next(near, "")) else half.end)

    def cycles_around(self, centre: Vector) -> tuple[list[PlaneCycle], tuple[tuple[float, float], ...]]:
        """The cycles that meet the half-line from a point of rest along the first state, and where all do."""
        along = _HalfLine(self, centre)
        least, most = NARROW * self.size[0], self.limits[1, 0] - centre[0]
        if not most > least:
            return [], ()
        ends = math.log(least), math.log(most)
        found = find_crossings(along, *ends, samples=SAMPLES, noise=NOISE, slope=along.slope)
        centres = tuple((math.exp(low), math.exp(high)) for low, high in found.stretches)
        return [self._cycle(along, point.x, point.slope) for point in found.fixed_points], centres

    def _cycle(self, along: "_HalfLine", x: float, multiplier: float) -> PlaneCycle:
        start, period = along.point(x), along.period(x)
        sides = Measured(self.fmu).extremes((0.0, period), self.run(start))
        low, high = np.array([sides[name] for name in self.fmu.states]).T
        return PlaneCycle(period, multiplier, self.motion(start, period, POINTS), low, high)

    def flow(self, lines: int) -> list[Vector]:
        """Motions from the nodes of a grid, as far as they go in a part of the time that crosses the box."""
        found = []
        for seed in grid_of(self.limits, lines)[1:-1, 1:-1].reshape(-1, 2):
            with suppress(StickslipError):
                points = self.motion(seed, 4.0 * self.time / lines, 101)
                found.append(points[np.logical_and.accumulate(self.holds(points))])
        return [points for points in found if len(points) > 1]


class _HalfLine:
    """log P(r) over log r, the distance at which a motion is back on the half-line; nan where it is not."""

    def __init__(self, plane: _Plane, centre: Vector) -> None:
        self.plane, self.centre = plane, centre
        (x, y), level = plane.fmu.states, float(centre[1])
        settings: dict[str, Any] = {
            "cap": PATIENCE * plane.time, "start": {y: level}, **plane.fmu.settings(plane.given),
            "accept": lambda passage: passage.states[x] > centre[0],
        }  # fmt: skip
        self._maps = {sense: ReturnMap(plane.fmu, x, section=Section(y, level, sense), **settings) for sense in (1, -1)}

    def point(self, x: float) -> Vector:
        """(2,) at log r."""
        return np.array([self.centre[0] + math.exp(x), self.centre[1]])

    def _map(self, x: float) -> ReturnMap:
        return self._maps[1 if self.plane.rates.at(self.point(x)).rates[1] > 0.0 else -1]

    def __call__(self, x: float) -> float:
        with suppress(StickslipError):  # it goes to infinity
            return math.log(self._map(x)(float(self.point(x)[0])) - self.centre[0])
        return math.nan

    def slope(self, x: float) -> float:
        """Of P at a fixed point; nan where it has none."""
        with suppress(StickslipError):
            return self._map(x).slope(float(self.point(x)[0]))
        return math.nan

    def period(self, x: float) -> float:
        """s, until it is back."""
        passage = self._map(x).crossing(float(self.point(x)[0]))
        assert passage is not None  # at a fixed point
        return passage.time


def _kind(eigenvalues: np.ndarray) -> str:
    real, sizes = np.real(eigenvalues), np.abs(eigenvalues)
    if sizes.min() < SAME * sizes.max():
        return "saddle-node"
    if np.abs(real).max() < ROUNDING * sizes.max():
        return "centre"
    if real.min() < 0.0 < real.max():
        return "saddle"
    stable = "stable" if real.max() < 0.0 else "unstable"
    return f"{stable} {'focus' if np.imag(eigenvalues).any() else 'node'}"


def phase_plane(
    fmu: Fmu,
    *,
    start: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    box: Annotated[Box, Option("Ranges of states that are shown and searched; default: about what is found.")] = NO_BOX,
    lines: Annotated[int, Option("Motions of the flow along each state.", minimum=1)] = 8,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> PhasePlane:
    """The phase plane of two states that nothing forces: points of rest, cycles, sliding, manifolds, the flow.

    Args:
        fmu: of this suite.
        start: about where a box lies that is not given.
        parameters: values of parameters and inputs that are not at their default; inputs are held.
        box: least and largest value by state; a state that is left out is shown about what is found.
        lines: motions along each state.
        progress: called with the share that is done.

    Raises:
        StickslipError: a model of others, more or fewer states than two, one that is forced, unknown names, ranges that
            are none.
    """
    given, start = dict(parameters or {}), dict(start or {})
    check_settings(fmu, "parameter or input", given, [*fmu.parameters, *fmu.inputs])
    check_settings(fmu, "state", start, fmu.states)
    name = str(fmu.description.modelName)
    rates = VectorField(fmu, given)
    if len(fmu.states) != 2:
        raise StickslipError(
            f"'{name}' has {len(fmu.states)} states ({', '.join(fmu.states)}), and a phase plane is of two. Leave "
            "contacts out (--contacts), or look at its sections (section) and branches (branch, equilibria)."
        )
    middle = np.array([float(start.get(state, fmu.start_of(state))) for state in fmu.states])
    if is_forced(rates, middle):
        raise StickslipError(
            f"'{name}' is forced: its flow changes with time and has no phase plane. Set the amplitude of the force to "
            "zero, hold the input, or look at it once a period (section, branch)."
        )
    sizes = np.array([fmu.size_of(state) for state in fmu.states])
    plane = _Plane(rates, given, _limits(fmu, box, np.array([middle - SIZES * sizes, middle + SIZES * sizes])))
    found = _found(plane, progress)
    if set(box) != set(fmu.states):
        ends = [end for cycle in found.cycles for end in (cycle.low, cycle.high)]
        about = np.array([middle, *(rest.point for rest in found.rests), *ends])
        room = np.maximum(ROOM * np.ptp(about, axis=0), sizes)
        plane = replace(plane, limits=_limits(fmu, box, np.array([about.min(axis=0) - room, about.max(axis=0) + room])))
        found = _found(plane, progress)
    halves = [half for rest in found.rests if rest.kind in ("saddle", "on a surface") for half in plane.halves(rest)]
    ended = tuple(plane.comes_to(half, found.rests, found.cycles) for half in halves)
    return replace(found, manifolds=ended, flow=tuple(plane.flow(lines)))


def _limits(fmu: Fmu, box: Box, limits: Vector) -> Vector:
    """(2, 2) with the ranges that are given."""
    for state, ends in box.items():
        refuse_unknown(state, fmu.states, f"'{fmu.description.modelName}' has no state '{state}'.")
        limits[:, fmu.states.index(state)] = ascending(state, ends)
    return limits


def _found(plane: _Plane, progress: Callable[[float], Any]) -> PhasePlane:
    """What there is in the box, without manifolds and flow."""
    surfaces = surfaces_of(plane.rates, plane.limits)
    parts = [part for surface in surfaces for part in surface.slidings()]
    rests = [plane.rest(point) for point in plane.zeros()] + [rest for _, sliding in parts for rest in sliding]
    rests.sort(key=lambda rest: rest.point.tolist())
    cycles: list[PlaneCycle] = []
    centres: tuple[tuple[float, float], ...] = ()
    for i, rest in enumerate(rests):
        progress(0.1 + 0.7 * i / len(rests))
        found, stretches = ([], ()) if "saddle" in rest.kind else plane.cycles_around(rest.point)
        centres += stretches
        for cycle in found:
            if all(np.abs((cycle.high - other.high) / plane.size).max() > SAME for other in cycles):
                cycles.append(cycle)
    cycles.sort(key=lambda cycle: cycle.period)
    fmu, lines, slidings = plane.fmu, tuple(surface.points for surface in surfaces), tuple(part for part, _ in parts)
    units = {state: str(fmu.variables[state].unit or "1") for state in fmu.states}
    of = str(fmu.description.modelName), tuple(fmu.states), plane.limits
    return PhasePlane(*of, tuple(rests), tuple(cycles), centres, lines, slidings, units=units)


def _numbers(plane: PhasePlane) -> dict[str, float]:
    of = {"rests": plane.rests, "cycles": plane.cycles, "slides": plane.slidings, "manifolds": plane.manifolds}
    numbers = {name: float(len(parts)) for name, parts in of.items()}
    numbers["stable"] = float(sum(part.stable for part in (*plane.rests, *plane.cycles)))
    for i, rest in enumerate(plane.rests, 1):
        numbers |= {f"{name}_{i}": float(x) for name, x in zip(plane.states, rest.point, strict=True)}
        for k, eigenvalue in enumerate(rest.eigenvalues.tolist(), 1):
            numbers |= {f"eigenvalue{k}_real_{i}": eigenvalue.real, f"eigenvalue{k}_imag_{i}": eigenvalue.imag}
    for i, cycle in enumerate(plane.cycles, 1):
        numbers |= {f"period_{i}": cycle.period, f"multiplier_{i}": cycle.multiplier}
        for name, low, high in zip(plane.states, cycle.low, cycle.high, strict=True):
            numbers |= {f"{name}_min_{i}": float(low), f"{name}_max_{i}": float(high)}
    for i, sliding in enumerate(plane.slidings, 1):
        for name, ends in zip(plane.states, sliding.points[[0, -1]].T, strict=True):
            numbers |= {f"{name}_slide_{i}_low": float(ends.min()), f"{name}_slide_{i}_high": float(ends.max())}
    return numbers


ANALYSIS = Analysis(
    function=phase_plane,
    numbers=_numbers,
    results=(
        "how many `rests`, `cycles`, `slides`, `manifolds`, how many rests and cycles are `stable`; of each rest, "
        "by its first state, `<state>_1`, `eigenvalue1_real_1` and so on; of each cycle, by its period, `period_1`, "
        "`multiplier_1`, `<state>_min_1`, `<state>_max_1`; of each sliding part `<state>_slide_1_low` and `_high`"
    ),
    example="planar_hopf --box x1=-6:2 --box x2=-3:3 --figure plane.png",
    label="looking around",
    subject=OSCILLATOR,
    page=False,
)
