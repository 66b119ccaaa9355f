"""The least shock that takes a motion out of its basin, in a norm |s| with s_i = weight_i times the jump of state i.

far      directions on spheres of twice the radius each, until one leaves the basin; then spheres between the two
border   along the best direction, bisected; the border there is followed to its edge state (``edge``)
least    where that is a motion that repeats itself, the border is where its normal, carried back by the exact
         derivatives of the steps, has no part: the shortest shock to it is solved for. Otherwise directions at
         random about the best one are tried, and what is found is an upper bound
judged   the radius is bisected by what starts come to, along the direction found; where they change sides more than
         once along it nearby, the border is folded or fractal, and the radius an upper bound
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from fmu_models.analyses.declaration import NO_NUMBERS, WATCHED, Analysis, Numbers, Option
from fmu_models.analyses.edge import Border, Edge
from fmu_models.analyses.labels import FAILED, INFINITE, Labeller, watched
from fmu_models.analyses.unforced import LONGEST, MOST, Most
from fmu_models.base.arrays import Flags, Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Pictured
from fmu_models.families.execution import Runner
from fmu_models.sections.periodic import PeriodicMotion
from fmu_models.sections.subject import Subject

LABELS = 500
SMALLEST, DOUBLINGS = 2.0**-6, 20  # radius of the first sphere, and how often it is doubled, or halved
DIRECTIONS, BETWEEN = 16, 2  # of a sphere, and spheres between the last two
EXACT = 1e-9  # relative distance to which a radius is bisected
AROUND = 1e-3  # relative distance from the border of starts that are well beside it
# steps to an edge state at most, how near to it the border comes, in sizes, and when it has left again
FOLLOWED, REACHED, APART_AGAIN = 400, 0.1, 4.0
# of the search for the least radius: rounds, the gradient at which it ends, the longest step, accuracy of radii
ROUNDS, FLAT, WIDEST, ROUGH = 12, 1e-4, 0.3, 1e-7
SPARE = 80  # labels that are kept for what follows it
NARROWER, TRIES = 0.85, 80  # the cap about the best direction, where a try finds nothing better
LINE = 24  # starts along the direction found


@dataclass(frozen=True, eq=False)
class LeastShock(Pictured):
    """A shock that leaves a basin.

    Attributes:
        model, states: its name, and those of the numbers of a point.
        point: (n,) where the motion is when it is struck: on its attractor.
        shock: (n,) by which it jumps.
        size: norm of the shock.
        upper_bound: whether a smaller one may be next to it: the border is fractal, folded, or of no known motion.
        clear: radius up to which none of the directions tried leaves.
        comes_from, leads_to: what the motion was, and what it comes to after a shock slightly larger, in words.
        edge: what a shock of just this size leads to, in words: the edge state of the border, or how that is.
        labels: starts that were labelled.
        weights: by state; those that are not named are not struck.
        units: of the states.
        how: of ``SectionSystem``.
    """

    COLUMNS: ClassVar = ("state=states", "at=point", "shock=shock")
    RECORD: ClassVar = (
        *("model", "states", "point", "shock", "size", "upper_bound", "clear", "comes_from", "leads_to", "edge"),
        *("labels", "weights", "how"),
    )

    model: str
    states: tuple[str, ...]
    point: Vector
    shock: Vector
    size: float
    upper_bound: bool
    clear: float
    comes_from: str
    leads_to: str
    edge: str
    labels: int
    weights: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict)
    how: str = ""

    def _heading(self) -> str:
        return f"Least shock of {self.model} out of {self.comes_from}: {self.size:.8g}{', at most' * self.upper_bound}"

    def _contents(self) -> Mapping[str, Any]:
        jumps = {name: f"{at:.6g} + {by:.6g}" for name, at, by in zip(self.states, self.point, self.shock, strict=True)}
        told = {"leads_to": self.leads_to, "edge": self.edge, "clear": self.clear, "labels": self.labels}
        return {**jumps, **told, "how": self.how or None}


def least_shock(
    system: Subject,
    start: Mapping[str, float] | None = None,
    *,
    weights: Annotated[
        Numbers, Option("Weight of a state that is struck, in the norm.", default="all states, by their nominal values")
    ] = NO_NUMBERS,
    labels: Annotated[int, Option("Starts to label, at most.", minimum=2)] = LABELS,
    most: Most = MOST,
    longest: int = LONGEST,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> LeastShock:
    """Find the least shock that takes a motion out of its basin.

    Args:
        system: a map, an oscillator at a section, or a model as it is, where nothing forces it.
        start: comes to the attractor whose motion is struck at one of its points at the section; where that has no
            period, the start itself is struck.
        weights: by state, those of the norm; a state that is not named is not struck. One over its nominal value each
            if left out.
        labels: starts that are labelled, at most.
        most, longest: of ``basins``.
        progress: called with the share of the labels that are used up.

    Raises:
        StickslipError: unknown states, weights that are not positive, a start that comes to no attractor, no shock that
            leaves the basin.
    """
    system = watched(system)
    for name, weight in weights.items():
        refuse_unknown(name, system.states, f"'{system.name}' has no state '{name}'.")
        if not (np.isfinite(weight) and weight > 0.0):
            raise StickslipError(f"The weight of '{name}' must be positive, found {weight:g}. Leave out what stays.")
    sizes = dict(zip(system.states, system.sizes().tolist(), strict=True))
    used = dict(weights) or {name: 1.0 / size for name, size in sizes.items() if np.isfinite(size)}
    first = system.start(start)
    with Runner(system) as runner:
        labeller = Labeller(runner, system, most, longest)
        home = int(labeller.label(first[None]).labels[0])
        if home < 0:
            raise StickslipError(f"That start of {system.name} comes to no attractor: it is {labeller.word(home)}.")
        attractor = labeller.attractors[home]
        points = attractor.points if isinstance(attractor, PeriodicMotion) else first[None]
        rows = np.array([[(name == state) / weight for state in system.states] for name, weight in used.items()])
        search = _Search(labeller, home, points, rows, labels, progress)
        point, shock, edge, upper_bound = search.made()
    jump = shock @ rows
    after = int(labeller.label((point + (1.0 + AROUND) * jump)[None]).labels[0])
    words = attractor.word, labeller.word(after), edge
    names, units = (system.name, tuple(system.states)), system.units(*system.states)
    size = float(np.linalg.norm(shock))
    told = size, upper_bound, min(search.clear, size), *words, labeller.count, used
    return LeastShock(*names, point, jump, *told, units, system.how)


class _Search:
    """Shocks s (d,) from points (k, n), which take them to point + s @ rows, for rows (d, n)."""

    def __init__(
        self, labeller: Labeller, home: int, points: Vector, rows: Vector, most: int, progress: Callable[[float], Any]
    ) -> None:
        self.labeller, self.home, self.points, self.rows = labeller, home, points, rows
        self.most, self.progress, self.clear = most, progress, 0.0
        self.random = np.random.default_rng(0)

    @property
    def left(self) -> int:
        """Labels that are left."""
        return self.most - self.labeller.count

    def leave(self, point: Vector, shocks: Vector) -> Flags:
        """(m,) whether shocks (m, d) leave the basin."""
        self.progress(self.labeller.count / self.most)
        labels = self.labeller.label(point + shocks @ self.rows).labels
        return (labels != self.home) & ((labels >= 0) | (labels == INFINITE))

    def made(self) -> tuple[Vector, Vector, str, bool]:
        """Where the motion is struck, the least shock, the edge state in a word, and whether it is an upper bound."""
        k, shock = self._first()
        point = self.points[k]
        shock = self._bisected(point, shock, self.clear / float(np.linalg.norm(shock)))
        pair = point + np.array([1.0 - 2.0 * EXACT, 1.0])[:, None] * (shock @ self.rows)
        inner, outer = self.labeller.label(pair).labels.tolist()
        word, edge = "a wall" if inner == FAILED else "not decided", None
        if inner == self.home:
            word, edge = Border(self.labeller, pair, self.most, sides=(inner, outer)).followed()
        best = None if edge is None or len(shock) == 1 else self._solved(point, shock, edge)
        upper_bound = best is None and len(shock) > 1
        if best is None and len(shock) > 1:
            best = self._tried(point, shock)
        shock = shock if best is None else best
        return point, shock, word, upper_bound or self._folded(point, shock)

    def _directions(self) -> Vector:
        """(m, d) unit vectors: evenly on a circle, at random in more dimensions, along all axes."""
        d = len(self.rows)
        axes = np.concatenate([np.eye(d), -np.eye(d)])
        if d == 1:
            return axes
        if d == 2:
            angles = 2.0 * np.pi * (np.arange(DIRECTIONS) + self.random.uniform()) / DIRECTIONS
            return np.stack([np.cos(angles), np.sin(angles)], axis=1)
        others = self.random.normal(size=(DIRECTIONS, d))
        return np.concatenate([axes, others / np.linalg.norm(others, axis=1)[:, None]])

    def _sphere(self, radius: float) -> tuple[int, Vector] | None:
        """The number of a point, and a shock of this size that leaves from there."""
        for k, point in enumerate(self.points):
            shocks = radius * self._directions()
            leaving = np.flatnonzero(self.leave(point, shocks))
            if leaving.size:
                return k, shocks[self._shortest(point, shocks, leaving, radius)]
        return None

    def _shortest(self, point: Vector, shocks: Vector, leaving: Any, radius: float) -> int:
        """Of shocks that leave, the one that may be made shortest and still leaves, in three bisections."""
        low, high = np.full(len(leaving), self.clear / radius), np.ones(len(leaving))
        for _ in range(BETWEEN if len(leaving) > 1 else 0):
            middle = 0.5 * (low + high)
            out = self.leave(point, middle[:, None] * shocks[leaving])
            high, low = np.where(out, middle, high), np.where(out, low, middle)
        return int(leaving[high.argmin()])

    def _first(self) -> tuple[int, Vector]:
        """Of a shock that leaves the number of its point and itself; ``clear`` is nearly as large."""
        radius, found = SMALLEST, None
        for _ in range(DOUBLINGS):
            found = self._sphere(radius)
            if found is not None or self.left <= DIRECTIONS:
                break
            self.clear, radius = radius, 2.0 * radius
        while (
            found is not None and self.clear == 0.0 and radius > SMALLEST * 2.0**-DOUBLINGS and self.left > DIRECTIONS
        ):
            shorter = self._sphere(radius / 2.0)
            radius /= 2.0
            if shorter is None:
                self.clear = radius
            found = shorter or found
        if found is None:
            raise StickslipError(
                f"No shock of {self.labeller.system.name} up to {self.clear:g} leaves the basin, in any of the "
                f"directions tried with {self.labeller.count} starts. Weigh the states otherwise, or allow more labels."
            )
        for _ in range(BETWEEN):
            top = float(np.linalg.norm(found[1]))
            middle = float(np.sqrt(self.clear * top))
            shorter = self._sphere(middle) if self.left > 4 * DIRECTIONS else None
            if shorter is None:
                self.clear = middle
            found = shorter or found
        return found

    def _bisected(self, point: Vector, shock: Vector, low: float, exact: float = EXACT) -> Vector:
        """The shock made just so short that it still leaves; ``low``: a share of it that does not."""
        high = 1.0
        while high - low > exact * high and self.left > 0:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.leave(point, middle * shock[None])[0] else (middle, high)
        return high * shock

    def _solved(self, point: Vector, shock: Vector, edge: Edge) -> Vector | None:
        """The shortest shock near one on the border, by gradients of the logarithm of the radius over directions u,
        g = -(n - (n.u) u)/(n.u) with the normal n; None where the border is not seen to lead to the edge state."""
        radius = float(np.linalg.norm(shock))
        u, share, before = shock / radius, 1.0, None
        for _ in range(ROUNDS):
            normal = self._normal(edge, point, radius * u)
            if normal is None:
                return None
            gradient = u - normal / (normal @ u)
            if np.linalg.norm(gradient) < FLAT or self.left < SPARE:
                break
            if before is not None:  # as long a step as its curvature says
                moved, changed = u - before[0], gradient - before[1]
                share = float(moved @ moved / abs(moved @ changed))
            step = -share * gradient * min(1.0, WIDEST / (share * float(np.linalg.norm(gradient))))
            before = u, gradient
            turned = (u + step) / np.linalg.norm(u + step)
            reached = self._radius(point, turned, radius * float(1.0 + gradient @ step), float(step @ step))
            if reached is None:
                return None
            u, radius = turned, reached
        return self._bisected(point, (1.0 + ROUGH) * radius * u, 1.0 - 2.0 * ROUGH)

    def _radius(self, point: Vector, u: Vector, guess: float, within: float) -> float | None:
        """At which shocks along u begin to leave, to ROUGH, near a guess; None where it is not met."""
        within = max(within, 4.0 * ROUGH)
        while within < 1.0:
            inner, outer = self.leave(point, guess * np.array([1.0 - within, 1.0 + within])[:, None] * u)
            if outer and not inner:
                low = (1.0 - within) / (1.0 + within)
                return float(np.linalg.norm(self._bisected(point, (1.0 + within) * guess * u, low, ROUGH)))
            within *= 4.0
        return None

    def _normal(self, edge: Edge, point: Vector, shock: Vector) -> Vector | None:
        """(d,) the normal of the border at a shock, of length one: the row of the edge state's unstable direction
        carried back by the steps to where the motion is nearest to it; None where that is not near."""
        x, slope, normal, nearest = (point + shock @ self.rows)[None], self.rows.T, None, REACHED
        for _ in range(FOLLOWED):
            step = edge.section.step(x)
            if step.why:
                break
            x, slope = step.points, step.derivatives[0] @ slope
            miss = edge.section.difference(x[0] - edge.motion.points[0]) / edge.section.sizes()
            if (distance := float(np.abs(miss).max())) < nearest:
                nearest, normal = distance, edge.normal @ slope
            elif nearest < REACHED and distance > APART_AGAIN * nearest:
                break
        return None if normal is None else normal / np.linalg.norm(normal)

    def _tried(self, point: Vector, shock: Vector) -> Vector:
        """The best of directions at random in a cap about the best one, which becomes narrower."""
        cap, kept = 0.5 * np.pi, 2 * LINE
        for _ in range(TRIES):
            if self.left <= kept:
                break
            turned = shock / np.linalg.norm(shock) + np.tan(0.5 * cap) * self.random.normal(size=len(shock))
            shorter = (1.0 - 1e-6) * np.linalg.norm(shock) * turned / np.linalg.norm(turned)
            if self.leave(point, shorter[None])[0]:
                shock = self._bisected(point, shorter, min(self.clear / float(np.linalg.norm(shorter)), 0.999))
            else:
                cap *= NARROWER
        return shock

    def _folded(self, point: Vector, shock: Vector) -> bool:
        """Whether shorter shocks along the same line leave too, or some that are hardly longer do not."""
        shares = np.concatenate([np.linspace(0.5, 1.0 - AROUND, LINE // 2), 1.0 + np.geomspace(1e-6, 1e-2, LINE // 2)])
        out = self.leave(point, shares[:, None] * shock)
        return bool((out != (shares > 1.0)).any())


def _numbers(result: LeastShock) -> dict[str, float]:
    jumps = {name: float(by) for name, by in zip(result.states, result.shock, strict=True)}
    told = {"size": result.size, "upper_bound": float(result.upper_bound), "clear": result.clear}
    return {**told, **jumps, "labels": float(result.labels)}


ANALYSIS = Analysis(
    function=least_shock,
    numbers=_numbers,
    results="`size`, `<state>` by which each jumps, `upper_bound` (1 where it is no more), `clear` and `labels`",
    example="bouncing_ball --forcing omega --weights v=1",
    label="shocks",
    without=WATCHED,
    page=False,
)
