"""Surfaces of a planar flow, where contacts change their states, and what motions do at them.

    f+, f-    the rates on both sides, n the normal from - to +
    n f+ < 0 < n f-    the surface attracts: motions that meet it slide, or stick, at  a f+ + (1 - a) f-  along it
    n f- < 0 < n f+    it repels: motions may leave it at any time
    else               they cross
    sliding at no rate a pseudo-equilibrium; all along an interval, a set that sticks

Nodes of a grid have words, the states of all contacts; between two neighbours with different ones the surface is found
by bisection. A contact whose friction at rest is larger than that of the slowest slip holds on beyond the interval that
is told here: where it begins to stick.

Source: Filippov, Differential Equations with Discontinuous Righthand Sides (1988), section 4.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import brentq

from fmu_models.base.arrays import Complex, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.simulation.field import FieldRates, VectorField

CELLS = 60  # of the grid along each state
OFFSET = 0.381  # of a cell: no node lies on a surface through round numbers
BISECTIONS, BESIDE = 40, 1e-9  # of an edge between two nodes; of its length, where a side is looked at
SURELY = 5e-12  # of the rates: less towards a surface is rounding
RESTS = 1e-9  # of the largest rate along a surface: less is none
FARTHER = 2.5  # points beyond the last that slides, where the end is sought: a corner has none in between
STILL = 3  # neighbours without a rate are a set


@dataclass(frozen=True, eq=False)
class Rest:
    """A point of rest.

    Attributes:
        kind: "stable node", "unstable focus", "saddle", "centre"; "on a surface", where slopes jump; of a sliding
            motion "stable pseudo-equilibrium", "unstable pseudo-equilibrium" where the surface repels too,
            "pseudo-saddle"; "end of a set that sticks".
        point: (2,) states.
        eigenvalues: (k,) 1/s, by falling real part; on a surface of both sides, one after the other; of sliding the one
            along the surface; none of a set.
    """

    RECORD: ClassVar = ("kind", "point", "eigenvalues")

    kind: str
    point: Vector
    eigenvalues: Complex

    @property
    def stable(self) -> bool:
        """Whether motions near it stay there."""
        return self.kind.startswith("stable") or self.kind == "end of a set that sticks"


@dataclass(frozen=True, eq=False)
class Sliding:
    """A part of a surface along which motions slide, or stick.

    Attributes:
        contact: whose surface.
        points: (m, 2) along it, its ends first and last.
        attracting: else it repels.
    """

    RECORD: ClassVar = ("contact", "attracting", "points")

    contact: str
    points: Vector
    attracting: bool


class Surface:
    """A surface of a contact as a line.

    Args:
        field: the rates.
        limits: (2, 2) least and largest value of each state.
        contact: its number.
        edges: (m, 2, 2) neighbours on both sides, in order along it: in one state of the contact, and in another.
    """

    def __init__(self, field: VectorField, limits: Vector, contact: int, edges: Vector) -> None:
        self.field, self.limits, self.contact, self.edges = field, limits, contact, edges
        self.size = limits[1] - limits[0]
        self.state = self._word(edges[0, 0])[contact]
        self.points = np.array([self._between(edge) for edge in edges])
        self._along = np.diff(self.points, axis=0, append=2.0 * self.points[-1:] - self.points[-2:-1]) / self.size

    def _word(self, point: Vector) -> tuple[int | None, ...]:
        seen = rates_at(self.field, point)
        return (None,) * len(self.field.contacts) if seen is None else seen.contacts

    def _between(self, edge: Vector) -> Vector:
        inside, outside = edge
        for _ in range(BISECTIONS):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if self._word(middle)[self.contact] == self.state else (inside, middle)
        return 0.5 * (inside + outside)

    def at(self, i: int, edge: Vector, point: Vector | None = None) -> tuple[Vector, Vector, float, float]:
        """On an edge beside point i: the point, how surely the surface attracts and repels there (> 0: it does), in
        shares of the rates, the rate along it and the largest beside it, in boxes a second."""
        point = self._between(edge) if point is None else point
        along = self._along[i] / np.linalg.norm(self._along[i])
        normal, step = np.array([-along[1], along[0]]), BESIDE * (edge[0] - edge[1])
        normal *= np.sign(normal @ (step / self.size)) or 1.0
        sides = [rates_at(self.field, point + sense * step) for sense in (1.0, -1.0)]
        if sides[0] is None or sides[1] is None:
            return point, np.full(2, -1.0), np.nan, 0.0
        inner, outer = (side.rates / self.size for side in sides if side is not None)
        towards, largest = np.array([-normal @ inner, normal @ outer]), np.abs([inner, outer]).max() or 1.0
        surely = np.array([towards.min(), (-towards).min()]) / largest - SURELY
        if not ((point >= self.limits[0]) & (point <= self.limits[1])).all():
            surely[:] = -1.0
        slid = (towards[1] * inner + towards[0] * outer) / (towards.sum() or np.inf)
        return point, surely, float(along @ slid), largest

    def slidings(self) -> Iterator[tuple[Sliding, list[Rest]]]:
        """The parts along which motions slide, with the points of rest on each."""
        seen = [self.at(i, *pair) for i, pair in enumerate(zip(self.edges, self.points, strict=True))]
        for column, attracting in ((0, True), (1, False)):
            for slides, run in groupby(range(len(seen)), key=lambda i, column=column: seen[i][1][column] > 0.0):
                if not slides:
                    continue
                inside = list(run)
                ends = [(i, self._end(i, sense, column)) for i, sense in ((inside[0], -1.0), (inside[-1], 1.0))]
                stations = [ends[0], *((i, self.edges[i]) for i in inside), ends[1]]
                passed = [self.at(*ends[0]), *(seen[i] for i in inside), self.at(*ends[1])]
                points = np.array([station[0] for station in passed])
                part = Sliding(self.field.contacts[self.contact], points, attracting)
                yield part, self._rests(stations, passed, attracting)

    def _end(self, i: int, sense: float, column: int) -> Vector:
        """The edge on which motions still slide, beyond point i along the surface."""
        words, farther = [self._word(side) for side in self.edges[i]], sense * FARTHER * self._along[i] * self.size

        def slides(share: float) -> bool:
            edge = self.edges[i] + share * farther
            return [self._word(side) for side in edge] == words and bool(self.at(i, edge)[1][column] > 0.0)

        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if slides(middle) else (low, middle)
        return self.edges[i] + low * farther

    def _rests(self, stations: list[tuple[int, Vector]], seen: list[Any], attracting: bool) -> list[Rest]:
        if len(seen) >= STILL and all(abs(rate) < RESTS * largest for _, _, rate, largest in seen):
            kind = "end of a set that sticks" if attracting else "saddle"
            return [Rest(kind, end, np.zeros(0, complex)) for end in (seen[0][0], seen[-1][0])]
        rests = []
        for ((i, a), (_, b)), (before, after) in zip(pairwise(stations), pairwise(seen), strict=True):
            if not before[2] * after[2] < 0.0:
                continue
            share = float(brentq(lambda s, i=i, a=a, b=b: self.at(i, (1.0 - s) * a + s * b)[2], 0.0, 1.0, xtol=1e-14))  # type: ignore[arg-type]
            beside = [self.at(i, (1.0 - s) * a + s * b) for s in (share - 1e-3, share, share + 1e-3)]
            slope = (beside[2][2] - beside[0][2]) / float(np.linalg.norm((beside[2][0] - beside[0][0]) / self.size))
            same = (slope < 0.0) == attracting
            kind = f"{'stable' if attracting else 'unstable'} pseudo-equilibrium" if same else "pseudo-saddle"
            rests.append(Rest(kind, beside[1][0], np.array([slope], complex)))
        return rests


def rates_at(field: VectorField, point: Vector) -> FieldRates | None:
    """The rates at a point (2,); None where the engine refuses it, as behind a wall."""
    try:
        return field.at(point)
    except StickslipError:
        return None


def grid_of(limits: Vector, cells: int = CELLS) -> Vector:
    """(cells + 2, cells + 2, 2) nodes that cover a box (2, 2)."""
    step = (limits[1] - limits[0]) / cells
    axes = [limits[0, i] + step[i] * (np.arange(cells + 2) - OFFSET) for i in range(2)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def surfaces_of(field: VectorField, limits: Vector) -> list[Surface]:
    """The surfaces in a box (2, 2), each as often as a contact has a state on one side of it alone."""
    from contourpy import contour_generator

    nodes = grid_of(limits)
    seen = [[rates_at(field, node) for node in row] for row in nodes]
    found = []
    for contact in range(len(field.contacts)):
        states = np.array([[np.nan if at is None else at.contacts[contact] for at in row] for row in seen])
        # of two states one side says it all
        for state in np.unique(states[np.isfinite(states)])[1:]:
            for line in map(np.asarray, contour_generator(z=(states == state).T.astype(float)).lines(0.5)):
                low, high = np.floor(line).astype(int), np.ceil(line).astype(int)
                edges = np.stack([nodes[tuple(end.T)] for end in (low, high)], axis=1)
                inside = states[tuple(low.T)] == state
                edges[~inside] = edges[~inside, ::-1]
                kept = np.isfinite(states[tuple(low.T)] + states[tuple(high.T)])
                if kept.sum() > 1:
                    found.append(Surface(field, limits, contact, edges[kept]))
    return found
