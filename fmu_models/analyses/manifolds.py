"""Stable and unstable manifolds of saddles, as curves.

    of a map or section, along one eigenvector of a periodic motion of it: the first piece lies on the eigenvector, from
    a point to its image; all others are images of that, with points put in between where neighbours come apart. A
    stable manifold is an unstable one of the inverse: x with P(x) = y is found by Newton's method beside a neighbour
    that is known, so that no formula of the inverse is needed.

    of an equilibrium: the motion that begins beside it on the eigenvector, forward in time; backward, for the stable
    one, by the rates, in the contact states that hold at each point.

Where the derivative is singular, or the motion sticks, several pasts lead to the same point, and a stable manifold
ends.

Source: Krauskopf, Osinga, Growing 1D and quasi-2D unstable manifolds of maps, Journal of Computational Physics 146
(1998), for the distance between neighbours.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from scipy.integrate import solve_ivp

from fmu_models.analyses.declaration import EITHER, Analysis, Option, Range
from fmu_models.analyses.homoclinic import Homoclinic
from fmu_models.analyses.homoclinic import homoclinic as locate_homoclinic
from fmu_models.analyses.saddle import Saddle, saddle_of
from fmu_models.base.arrays import Complex, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contact_kinds import STICK
from fmu_models.sections.periodic import find_cycles, motion_at
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.run import simulate

if TYPE_CHECKING:
    import pandas

BESIDE = 1e-6  # of the sizes of the states: where a manifold begins, beside its saddle
FINEST = 1e-11  # of the first piece: points are put in between no finer than that
STEPS, ACCURATE = 30, 1e-12  # Newton's method for the past of a point
# growth of a motion beside an equilibrium, in powers of e, its points, and what else is tried where it is not done then
GROWTH, SAMPLES, LONGER = 45.0, 4001, (3.0, 10.0)
# of each half, and between neighbours on a curve
LENGTH, SPACING = 20.0, 0.05
UNFINISHED = "it goes on"


@dataclass(frozen=True, eq=False)
class Manifold:
    """One half of a manifold, from the saddle outward.

    Attributes:
        kind: "stable" or "unstable".
        eigenvalue: of the direction it leaves along; of a periodic motion the multiplier.
        points: (m, n).
        end: why it is no longer.
    """

    RECORD: ClassVar = ("kind", "eigenvalue", "end", "points")

    kind: str
    eigenvalue: float
    points: Vector
    end: str


@dataclass(frozen=True, eq=False)
class Manifolds(Pictured):
    """The manifolds of a saddle.

    Attributes:
        model: its name.
        states: names.
        saddle: (p, n) the equilibrium, or the points of the periodic motion.
        eigenvalues: (n,) of an equilibrium, 1/s; multipliers of a periodic motion.
        curves: both halves of each.
        of: the states that a picture shows.
    """

    RECORD: ClassVar = ("model", "states", "saddle", "eigenvalues", "curves")

    model: str
    states: tuple[str, ...]
    saddle: Vector
    eigenvalues: Complex
    curves: tuple[Manifold, ...]
    of: tuple[str, ...]

    @property
    def frame(self) -> "pandas.DataFrame":
        """One row per point; ``curve`` is the number of its curve."""
        import pandas

        columns = list(self.states)
        tables = (pandas.DataFrame(curve.points, columns=columns) for curve in self.curves)
        frames = [table.assign(curve=i, kind=self.curves[i].kind) for i, table in enumerate(tables)]
        return pandas.concat(frames, ignore_index=True)

    def _heading(self) -> str:
        return f"Manifolds of a saddle of {self.model}: {len(self.curves)} curves"

    def _contents(self) -> Mapping[str, Any]:
        points = [f"{curve.kind}, {len(curve.points)} points" for curve in self.curves]
        return {"saddle": self.saddle[0], "eigenvalues": self.eigenvalues, "curves": points}


def manifolds(
    system: SectionSystem | Fmu,
    start: Mapping[str, float] | Sequence[float] | None = None,
    *,
    parameters: Mapping[str, float] | None = None,
    period: int = 1,
    length: float = LENGTH,
    spacing: float = SPACING,
    of: Sequence[str] = (),
) -> Manifolds:
    """Those of the saddle near a start: of a periodic motion of a section system, or of an equilibrium of an FMU.

    Args:
        system: a map, an oscillator at its section, or an FMU of this suite.
        start: a point near it; as declared what is left out.
        parameters: of an FMU, and its inputs, that are not at their default.
        period: steps of the section in the motion.
        length: of each half, in sizes of the states.
        spacing: between neighbours on a curve, in the same.
        of: two states that a picture shows; the first two if left out.

    Raises:
        StickslipError: no saddle there, unknown names, lengths that are none, or a section whose points are bound.
    """
    if not (length > 0.0 and spacing > 0.0 and np.isfinite([length, spacing]).all()):
        raise StickslipError(f"Length and spacing of a manifold are positive numbers, found {length} and {spacing}.")
    if isinstance(system, Fmu):
        result = manifolds_of(saddle_of(system, dict(start or {}), parameters), length, spacing)  # type: ignore[arg-type]
    else:
        if parameters:
            system = system.at(**parameters)
        result = _of_motion(system, system.start(start), period, length, spacing)
    axes = tuple(of) or result.states[:2]
    if unknown := [name for name in axes if name not in result.states]:
        raise StickslipError(f"'{result.model}' has no state '{unknown[0]}'; a picture shows two of {result.states}.")
    return Manifolds(result.model, result.states, result.saddle, result.eigenvalues, result.curves, axes)


def manifolds_of(saddle: Saddle, length: float, spacing: float, growths: Sequence[float] = (1.0, *LONGER)) -> Manifolds:
    """Those of an equilibrium; growths: times that are tried, in that in which a motion beside it grows to its size."""
    names, sizes = tuple(saddle.fmu.states), saddle.sizes
    curves = []
    for kind, indices in (("unstable", saddle.unstable), ("stable", saddle.stable)):
        for i in indices:
            for side in (1.0, -1.0):
                departure = saddle.point + side * BESIDE * saddle.direction(i) * sizes
                rate = float(saddle.values[i].real)
                follow = _forward if kind == "unstable" else _backward
                points, end = np.empty((0, len(sizes))), UNFINISHED
                for longer in growths:
                    if end == UNFINISHED:
                        duration = longer * GROWTH / abs(rate)
                        points, end = _cut(*follow(saddle, departure, duration), sizes, length, spacing)
                curves.append(Manifold(kind, rate, np.vstack([saddle.point, points]), end))
    return Manifolds(saddle.name, names, saddle.point[None], saddle.values, tuple(curves), ())


def _forward(saddle: Saddle, departure: Vector, duration: float) -> tuple[Vector, str]:
    """(m, n) the motion from a point, as long as the engine can follow it."""
    ending = UNFINISHED
    for _ in range(8):
        try:
            times = np.linspace(0.0, duration, SAMPLES)
            run = simulate(saddle.fmu, duration, output_times=times, **saddle.as_run(departure))
            return np.column_stack([run[name] for name in saddle.fmu.states]), ending
        except StickslipError as error:
            ending, duration = str(error), duration / 2.0
    raise StickslipError(f"The unstable manifold cannot be followed: {ending}")


def _backward(saddle: Saddle, departure: Vector, duration: float) -> tuple[Vector, str]:
    """(m, n) the motion that leads to a point, as long as there is one."""
    why = UNFINISHED

    def rates(time: float, x: Vector) -> Vector:
        nonlocal why
        try:
            sample = saddle.field.at(x)
        except StickslipError as error:
            why = str(error)
            return np.full_like(x, np.nan)
        if STICK in sample.contacts:
            why = "it sticks there, and several pasts lead to the same point"
            return np.full_like(x, np.nan)
        return -sample.rates

    def far(time: float, x: Vector) -> float:
        return float(np.abs((x - saddle.point) / saddle.sizes).max()) - 1e6

    far.terminal = True  # type: ignore[attr-defined] # as solve_ivp reads it
    with np.errstate(all="ignore"):
        solution = solve_ivp(
            rates, (0.0, duration), departure, method="DOP853", rtol=1e-12, atol=1e-14 * float(saddle.sizes.min()),
            dense_output=True, events=far,
        )  # fmt: skip
    finite = solution.y[:, np.isfinite(solution.y).all(axis=0)]
    times = np.linspace(0.0, solution.t[finite.shape[1] - 1], SAMPLES)
    return solution.sol(times).T, why


def _cut(points: Vector, end: str, sizes: Vector, length: float, spacing: float) -> tuple[Vector, str]:
    """A curve no longer than so much, without neighbours that are nearer than a spacing by far."""
    steps = np.linalg.norm(np.diff(points, axis=0) / sizes, axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    if along[-1] > length:
        many = int(np.searchsorted(along, length))
        points, along, end = points[: many + 1], along[: many + 1], "it has the length that was asked for"
    elif along[-1] - along[len(along) * 9 // 10] < 1e-3 * spacing:
        end = "it comes to rest"
    _, indices = np.unique(np.floor(along / (0.2 * spacing)), return_index=True)
    return points[np.append(indices, len(points) - 1)], end


def _of_motion(system: SectionSystem, point: Vector, period: int, length: float, spacing: float) -> Manifolds:
    n = len(system.states)
    if system.dimension != n:
        raise StickslipError(
            f"A point of this section of '{system.name}' has numbers that are bound; take a strobe of it, or a map."
        )
    cycle = [point]
    for _ in range(period - 1):
        cycle.append(_step(system, cycle[-1]))
    cycles = find_cycles(system, np.array(cycle)[None])
    if not len(cycles):
        raise StickslipError(
            f"No motion of period {period} of '{system.name}' was found near that start. Start nearer to the saddle."
        )
    motion = motion_at(system, cycles[0])
    multipliers = np.asarray(motion.stability.eigenvalues)
    size = np.abs(multipliers)
    if not (size.max() > 1.0 > size.min()):
        listing = ", ".join(f"{multiplier:.4g}" for multiplier in multipliers)
        raise StickslipError(
            f"The motion of '{system.name}' near that start is no saddle: its multipliers are {listing}."
        )
    at = _Return(system, period)
    eigen: Any = np.linalg.eig(at(cycles[0][0])[1])
    values, vectors = eigen
    curves = []
    for kind in ("unstable", "stable"):
        for i in np.flatnonzero((np.abs(values) > 1.0) == (kind == "unstable")):
            if abs(values[i].imag) > 0.0 or abs(values[i]) < 1e-12:
                continue
            for side in (1.0, -1.0):
                value = float(values[i].real)
                curve = _Curve(at, cycles[0][0], side * vectors[:, i].real, value, system.sizes())
                points, end = curve.grown(length, spacing)
                curves.append(Manifold(kind, value, points, end))
    return Manifolds(system.name, system.states, cycles[0], multipliers, tuple(curves), ())


def _step(system: SectionSystem, x: Vector) -> Vector:
    step = system.step(x[None], derivative=False)
    if step.why:
        raise StickslipError(f"'{system.name}' has no step from there: {next(iter(step.why.values()))}")
    return step.points[0]


@dataclass(frozen=True)
class _Return:
    """Several steps of a section as one, with their derivative."""

    system: SectionSystem
    period: int

    def __call__(self, x: Vector) -> tuple[Vector, Vector]:
        derivative = np.eye(len(x))
        for _ in range(self.period):
            step = self.system.step(x[None])
            if step.why:
                raise StickslipError(next(iter(step.why.values())))
            x, derivative = step.points[0], step.derivatives[0] @ derivative
        return x, derivative


class _Curve:
    """One half of a manifold of a fixed point, grown piece by piece.

    Args:
        at: the map and its derivative.
        vector, value: of the half; where the value is negative, pieces are images of two steps.
    """

    def __init__(self, at: _Return, saddle: Vector, vector: Vector, value: float, sizes: Vector) -> None:
        self.at, self.saddle, self.sizes = at, saddle, sizes
        self.twice, self.inverse = value < 0.0, abs(value) < 1.0
        factor = abs(value) ** (2 if self.twice else 1)
        self.factor = 1.0 / factor if self.inverse else factor
        self.vector = BESIDE * vector / np.linalg.norm(vector / sizes)

    def grown(self, length: float, spacing: float) -> tuple[Vector, str]:
        """(m, n) the curve and why it ends."""
        shares = [0.0, 1.0]
        pieces = [[self._first(share) for share in shares]]
        points, total = [self.saddle, *pieces[0]], 0.0
        while True:
            piece = [pieces[-1][-1]]
            i = 1
            while i < len(shares):
                image = self._image(pieces[-1][i], piece[-1])
                distance = np.inf if image is None else self._apart(image, piece[-1])
                if image is None or distance > spacing:
                    if shares[i] - shares[i - 1] < FINEST:
                        return np.array(points), "it is torn there, or several pasts lead to the same point"
                    self._insert(shares, pieces, i)
                    continue
                piece.append(image)
                points.append(image)
                total += distance
                if total > length:
                    return np.array(points), "it has the length that was asked for"
                i += 1
            if self._apart(piece[-1], piece[0]) < 1e-3 * BESIDE:
                return np.array(points), "it comes to rest at another motion"
            pieces.append(piece)

    def _first(self, share: float) -> Vector:
        return self.saddle + self.vector * self.factor**share

    def _apart(self, x: Vector, y: Vector) -> float:
        return float(np.linalg.norm(self.at.system.difference(x - y) / self.sizes))

    def _insert(self, shares: list[float], pieces: list[list[Vector]], i: int) -> None:
        """A point between two neighbours, in all pieces."""
        shares.insert(i, (shares[i - 1] + shares[i]) / 2.0)
        pieces[0].insert(i, self._first(shares[i]))
        for before, piece in pairwise(pieces):
            image = self._image(before[i], piece[i - 1])
            piece.insert(i, piece[i - 1] if image is None else image)

    def _image(self, x: Vector, neighbour: Vector) -> Vector | None:
        """The next point after x, near a known one; None where there is none."""
        for _ in range(2 if self.twice else 1):
            try:
                if not self.inverse:
                    x = self.at(x)[0]
                    continue
                image = self._past(x, neighbour)
            except (StickslipError, np.linalg.LinAlgError):
                return None
            if image is None:
                return None
            x = image
        return x

    def _past(self, x: Vector, neighbour: Vector) -> Vector | None:
        """y with P(y) = x, near a known one."""
        difference = self.at.system.difference
        y = neighbour
        for _ in range(STEPS):
            image, derivative = self.at(y)
            step = np.linalg.solve(derivative, difference(x - image))
            size = float(np.abs(step / self.sizes).max())
            if not size < 1e3:
                return None
            y = self.at.system.wrapped(y + step)
            if size < ACCURATE:
                return y
        return None


def grow_manifolds(
    subject: SectionSystem | Fmu,
    start: Mapping[str, float] | Sequence[float] | None = None,
    *,
    parameters: Mapping[str, float] | None = None,
    steps: Annotated[int, Option("Steps of the section in the motion of the saddle.", minimum=1, metavar="N")] = 1,
    length: Annotated[float, Option("Of each half, in sizes of the states.")] = LENGTH,
    spacing: Annotated[float, Option("Between neighbours on a curve, in the same.")] = SPACING,
    homoclinic: Annotated[Range | None, Option("Instead: where an equilibrium has a motion to itself.")] = None,
) -> Manifolds | Homoclinic:
    """Stable and unstable manifolds of a saddle: an equilibrium, or, with a section, a periodic motion, or of a map.

    Raises:
        StickslipError: a homoclinic point of what is no equilibrium, and as ``manifolds`` and ``homoclinic``.
    """
    if homoclinic is None:
        return manifolds(subject, start, parameters=parameters, period=steps, length=length, spacing=spacing)
    if not isinstance(subject, Fmu):
        raise StickslipError("A homoclinic point is that of an equilibrium of an oscillator: leave the section out.")
    guess: Any = start
    return locate_homoclinic(subject, homoclinic[0], homoclinic[1:], start=guess, parameters=parameters)


def _numbers(grown: Manifolds) -> dict[str, float]:
    numbers = {f"{name}_saddle": float(value) for name, value in zip(grown.states, grown.saddle[0], strict=True)}
    for i, eigenvalue in enumerate(grown.eigenvalues, 1):
        numbers |= {f"eigenvalue{i}_real": float(eigenvalue.real), f"eigenvalue{i}_imag": float(eigenvalue.imag)}
    for name, column in zip(grown.states, np.concatenate([half.points for half in grown.curves]).T, strict=True):
        numbers |= {f"{name}_min": float(column.min()), f"{name}_max": float(column.max())}
    return numbers


ANALYSIS = Analysis(
    function=grow_manifolds,
    numbers=_numbers,
    results=(
        "`<state>_saddle`, of a periodic motion at its first point, `eigenvalue1_real`, `eigenvalue1_imag` and so on, "
        "`<state>_min` and `<state>_max` of all curves"
    ),
    example="henon --start x=0.63 --start y=0.19 --length 3 --spacing 0.01 --figure manifolds.png",
    label="growing",
    subject=EITHER,
    page=False,
)
