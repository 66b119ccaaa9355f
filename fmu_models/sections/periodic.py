"""Fixed and periodic points of a system at its section, by Newton's method on all points of the motion at once.

    x1 = f(x0), x2 = f(x1), ..., x0 = f(x(n-1))

Taken one by one the points of an unstable motion stay within the reach of Newton's method where the n-th iterate, whose
slopes multiply, is out of it. The derivatives are exact. Motions are sought from guesses, those of a map from a grid of
starts and, for a map of one variable, also between its jumps (``crossings``); none of this proves that there are no
others.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.arrays import Complex, Flags, Integers, Varied, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.families.stepwise import Step
from fmu_models.sections.iteration import Iteration, find_iterate_crossings, iterate
from fmu_models.sections.newton import newton
from fmu_models.sections.stability import Stability, eigenvalues_of
from fmu_models.sections.system import SectionSystem

SETTLED = 1e-9  # relative size of a step, and of a miss, at which Newton's method has arrived
SAME = 1e-8  # motions nearer to each other than this share of the box are one


@dataclass(frozen=True, eq=False)
class PeriodicMotion(Shown):
    """A fixed point or a cycle of points.

    Attributes:
        points: (period, n) states, one after the other.
        stability: eigenvalues of the derivative over the period, and what they mean.
        time: of the period, in the unit of the system.
        began: (contacts,) how often each contact or stick begins in a period.
        residual: largest distance by which a step misses the next point.
    """

    RECORD: ClassVar = ("period", "points")

    points: Vector
    stability: Stability
    time: float = 1.0
    began: tuple[int, ...] = ()
    residual: float = 0.0

    @property
    def period(self) -> int:
        """Number of points."""
        return len(self.points)

    @property
    def word(self) -> str:
        """n-p-q: its period, and how often each contact begins in it."""
        return "-".join(map(str, (self.period, *self.began)))


def find_periodic(
    iteration: Iteration, period: int = 1, *, box: ArrayLike | None = None, starts: int = 5000
) -> tuple[PeriodicMotion, ...]:
    """The motions of least period ``period`` whose points all lie in the box, ordered by their least state.

    Args:
        iteration: the map.
        period: number of points, at least 1.
        box: (n, 2) range of each state; that of the declaration if left out.
        starts: number of starts for Newton's method, about.

    Raises:
        StickslipError: a period below one.
    """
    if period < 1:
        raise StickslipError(f"A motion of period {period} is asked for. The shortest has period 1, a fixed point.")
    bounds = iteration.box if box is None else np.asarray(box, dtype=float)
    guesses = _guesses(iteration, period, bounds, starts)
    if len(bounds) == 1 and not iteration.map.modulus:
        seeds = [point.x for point in find_iterate_crossings(iteration, period, box=bounds).fixed_points]
        if seeds:
            cycles = iterate(iteration, np.array(seeds)[:, None], period - 1)
            guesses = np.concatenate([np.moveaxis(cycles, 0, 1), guesses])
    motions: list[Vector] = []
    size = bounds[:, 1] - bounds[:, 0]
    candidates = find_cycles(iteration, guesses)
    _, distinct = np.unique(np.round(candidates / (10 * SAME * size)), axis=0, return_index=True)
    for points in candidates[np.sort(distinct)]:
        inside = (points >= bounds[:, 0] - SAME * size) & (points <= bounds[:, 1] + SAME * size)
        if inside.all() and least_periods(iteration, points[None], size)[0] == period:
            points = _from_least(points, size)
            if not any(_same(iteration, points, motion, size) for motion in motions):
                motions.append(points)
    motions.sort(key=lambda points: tuple(_rounded(points[0], size)))
    return tuple(motion_at(iteration, points) for points in motions)


@dataclass(frozen=True, eq=False)
class Cycles:
    """Motions of one period, k of them, each as ``PeriodicMotion`` has it.

    Attributes:
        points: (k, period, n).
        eigenvalues: (k, dimension) largest modulus first.
        times, residuals: (k,).
        began: (k, contacts).
    """

    points: Vector
    eigenvalues: Complex
    times: Vector
    began: Integers
    residuals: Vector

    @property
    def period(self) -> int:
        """Number of points."""
        return self.points.shape[1]

    def only(self, indices: NDArray[Any]) -> Cycles:
        """Some of them."""
        points, times, residuals = self.points[indices], self.times[indices], self.residuals[indices]
        return Cycles(points, self.eigenvalues[indices], times, self.began[indices], residuals)

    def motions(self) -> list[PeriodicMotion]:
        """One by one."""
        began = map(tuple, self.began.tolist())
        stability, times = map(Stability, self.eigenvalues), self.times.tolist()
        rows = zip(self.points, stability, times, began, self.residuals.tolist(), strict=True)
        return [PeriodicMotion(*columns) for columns in rows]


def motion_at(system: SectionSystem, points: Vector) -> PeriodicMotion:
    """The motion through these points (period, n), which are taken to be a cycle.

    Raises:
        StickslipError: a step from one of them does not arrive or has no derivative; says why.
    """
    step = system.step(points)
    if step.why:
        raise StickslipError(f"{system.name} has no step from a point of that motion: {next(iter(step.why.values()))}")
    (motion,) = _through(system, points[None], step, np.ones(1, bool)).motions()
    return motion


def _through(system: SectionSystem, cycles: Vector, step: Step, sound: Flags) -> Cycles:
    """The motions through those of cycles (m, period, n) that are sound, from all of whose points a step was made."""
    m, period, n = cycles.shape
    points = cycles[sound]
    derivatives = step.derivatives.reshape(m, period, n, n)[sound]
    monodromy = np.tile(np.eye(n), (len(points), 1, 1))
    for i in range(period):
        monodromy = derivatives[:, i] @ monodromy
    miss = system.difference(step.points.reshape(cycles.shape)[sound] - np.roll(points, -1, axis=1))
    # a number of a point that the others determine has an eigenvalue 0 of its own
    eigenvalues = eigenvalues_of(monodromy)[:, : system.dimension - len(system.drifting)]
    times, began = step.times.reshape(m, period), step.began.reshape(m, period, step.began.shape[1])
    sums = times[sound].sum(axis=1), began[sound].sum(axis=1)
    return Cycles(points, eigenvalues, *sums, np.abs(miss).max(axis=(1, 2)))


def _stepped(
    system: SectionSystem, groups: Sequence[Vector], varied: Sequence[Varied], *, derivative: bool = True
) -> list[tuple[Step, Flags]]:
    """For each group of cycles (m, period, n), at values (m,) of parameters, one step from all points, and whether each
    arrives (m,). All are made by one call."""
    pairs = list(zip(groups, varied, strict=True))
    values = {name: np.concatenate([np.repeat(at[name], g.shape[1]) for g, at in pairs]) for name in varied[0]}
    points = [group.reshape(-1, group.shape[2]) for group in groups]
    whole, begin = system.step(np.concatenate(points), values, derivative=derivative), 0
    steps: list[tuple[Step, Flags]] = []
    for group, flat in zip(groups, points, strict=True):
        step, sound = whole.part(begin, begin + len(flat)), np.ones(len(group), bool)
        sound[[i // group.shape[1] for i in step.why]] = False
        steps.append((step, sound))
        begin += len(flat)
    return steps


def cycles_at(system: SectionSystem, cycles: Vector, varied: Varied | None = None) -> tuple[Cycles, Integers]:
    """The motions through cycles (m, period, n) at values (m,) of parameters, without those from which a step has no
    derivative, and their numbers (k,)."""
    ((step, sound),) = _stepped(system, [cycles], [varied or {}])
    return _through(system, cycles, step, sound), np.flatnonzero(sound)


def corrected_cycles(
    system: SectionSystem, groups: Sequence[Vector], varied: Sequence[Varied]
) -> list[tuple[Cycles, Integers]]:
    """The motions one step of Newton's method from cycles that are nearly solved, of each group (m, period, n), without
    those of which a step has no derivative, and their numbers (k,). Eigenvalues are those at the guess."""
    if not groups:
        return []
    before, cycles = _stepped(system, groups, varied), []
    for guesses, (step, sound) in zip(groups, before, strict=True):
        m, period, n = guesses.shape
        miss = system.difference(step.points.reshape(guesses.shape) - np.roll(guesses, -1, axis=1))
        matrix = _cycle_matrix(step.derivatives.reshape(m, period, n, n))
        matrix[~sound], miss[~sound] = np.eye(period * n), 0.0
        try:
            moved = np.linalg.solve(matrix, miss.reshape(m, -1, 1)).reshape(guesses.shape)
        except np.linalg.LinAlgError:  # one of them lies on a continuum of motions: the least move
            moved = (np.linalg.pinv(matrix) @ miss.reshape(m, -1, 1)).reshape(guesses.shape)
        cycles.append(system.wrapped(guesses - moved))
    found = []
    after = _stepped(system, cycles, varied, derivative=False)
    for points, (step, sound), (arrived, still) in zip(cycles, before, after, strict=True):
        sound &= still
        motions = _through(system, points, replace(arrived, derivatives=step.derivatives), sound)
        found.append((motions, np.flatnonzero(sound)))
    return found


def _cycle_matrix(derivatives: Vector) -> Vector:
    """(m, period n, period n) derivative of the misses of cycles by their points, from (m, period, n, n)."""
    m, period, n, _ = derivatives.shape
    matrix = np.zeros((m, period, n, period, n))
    for i in range(period):
        matrix[:, i, :, i, :] += derivatives[:, i]
        matrix[:, i, :, (i + 1) % period, :] -= np.eye(n)
    return matrix.reshape(m, period * n, period * n)


def find_cycles(system: SectionSystem, guesses: Vector, varied: Varied | None = None) -> Vector:
    """(k, period, n) cycles that Newton's method comes to from guesses (m, period, n); those it loses are left out."""
    return solved_cycles(system, guesses, varied)[0]


def solved_cycles(
    system: SectionSystem, guesses: Vector, varied: Varied | None = None, *, within: float = np.inf
) -> tuple[Vector, Integers]:
    """Cycles (k, period, n) from guesses (m, period, n), and the numbers (k,) of the guesses that they come from.

    Args:
        varied: values (m,) of parameters by name, one per guess.
        within: in sizes of the states; a search that leads farther from its guess ends, before a step from there, which
            may take long.
    """
    m, period, n = guesses.shape
    names, width = list(varied or {}), period * n
    # a value that is held, and the number of the guess, travel with the points
    fixed = np.stack([*(np.asarray((varied or {})[name], dtype=float) for name in names), np.arange(m, dtype=float)], 1)

    def equations(flat: Vector) -> tuple[Vector, Vector]:
        points, fixed_columns = flat[:, :width].reshape(-1, period, n), flat[:, width:]
        moved = np.abs(system.difference(points - guesses[fixed_columns[:, -1].astype(int)]) / system.sizes())
        points = np.where(moved.max(axis=(1, 2), keepdims=True) <= within, points, np.nan)
        values = {name: np.repeat(fixed_columns[:, i], period) for i, name in enumerate(names)}
        step = system.step(points.reshape(-1, n), values)
        miss = system.difference(step.points.reshape(points.shape) - np.roll(points, -1, axis=1))
        extended = np.zeros((len(flat), flat.shape[1], flat.shape[1]))
        extended[:, :width, :width] = _cycle_matrix(step.derivatives.reshape(-1, period, n, n))
        extended[:, width:, width:] = np.eye(fixed_columns.shape[1])
        return np.concatenate([miss.reshape(-1, width), np.zeros_like(fixed_columns)], axis=1), extended

    def scale(flat: Vector) -> Vector:
        return 1.0 + np.abs(flat[:, :width]).max(axis=1)

    first_guess = np.concatenate([guesses.reshape(m, width), fixed], axis=1)
    solution = newton(equations, first_guess, accuracy=SETTLED, until_settled=True, scale=scale)
    flat = solution.points[solution.converged]
    return system.wrapped(flat[:, :width].reshape(-1, period, n)), flat[:, -1].round().astype(np.int64)


def _guesses(iteration: Iteration, period: int, bounds: Vector, starts: int) -> Vector:
    """(m, period, n) motions of a grid of starts, kept in the box, and points at random in it."""
    n = len(bounds)
    per_state = max(round((starts / 2) ** (1 / n)), 3)
    axes = [low + (np.arange(per_state) + 0.5) * (high - low) / per_state for low, high in bounds]
    grid = np.array(list(itertools.product(*axes)))
    run = [grid]
    for _ in range(period - 1):
        after = iteration(run[-1])
        run.append(np.clip(np.where(np.isfinite(after), after, bounds.mean(axis=1)), bounds[:, 0], bounds[:, 1]))
    scattered = np.random.default_rng(0).uniform(bounds[:, 0], bounds[:, 1], (len(grid), period, n))
    return np.concatenate([np.stack(run, axis=1), scattered])


def least_periods(system: SectionSystem, cycles: Vector, size: Vector) -> Integers:
    """(m,) numbers of points after which cycles (m, period, n) repeat themselves."""
    return least_parts(system, cycles, 100 * SAME * size)


def least_parts(system: SectionSystem, cycles: Vector, within: Vector) -> Integers:
    """(m,) the least parts of their period after which cycles (m, period, n) repeat themselves, to (n,)."""
    m, period, _ = cycles.shape
    lengths = np.full(m, period, np.int64)
    for length in (divisor for divisor in range(period - 1, 0, -1) if period % divisor == 0):
        distances = system.difference(cycles - cycles[:, np.arange(-length, period - length)])
        lengths[(np.abs(distances) <= within).all(axis=(1, 2))] = length
    return lengths


def _same(system: SectionSystem, points: Vector, others: Vector, size: Vector) -> bool:
    return bool((np.abs(system.difference(points - others)) <= SAME * size).all())


def _rounded(points: Vector, size: Vector) -> Vector:
    """Values rounded for an order in which what rounding tells apart counts as equal."""
    return np.round(points / (1e3 * SAME * size))


def _from_least(points: Vector, size: Vector) -> Vector:
    """The cycle from its least point on."""
    rounded = _rounded(points, size)
    first = min(range(len(points)), key=lambda i: tuple(rounded[i]))
    return np.roll(points, -first, axis=0)
