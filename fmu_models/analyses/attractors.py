"""What runs have come to: periodic motions, claimed by Newton's method alone, and where they attract.

A motion that repeats itself is brought to rounding; its multipliers say whether it attracts at all. About each of its
points the quadratic form V = sum over all steps ahead of |difference|^2 falls with every step of a small difference, by
the exact derivatives; how far out it still falls is tried on steps of the system itself, shell by shell. A motion that
has come inside stays inside.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from fmu_models.base.arrays import Flags, Integers, Varied, Vector
from fmu_models.families import jobs as families
from fmu_models.sections.periodic import (
    Cycles,
    PeriodicMotion,
    corrected_cycles,
    cycles_at,
    least_parts,
    least_periods,
    solved_cycles,
)
from fmu_models.sections.stability import are_stable
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.ensemble import Targets
from fmu_models.simulation.rows import RunRows

NEAR = 1e-3  # of the size of a state: by so much Newton's method may move a point of a motion that repeats itself
ALIKE = 1e-5  # two points of a run that are nearer may be those of a motion that repeats itself
SAME = 1e-6  # two motions whose points are nearer are one
CLAIMED = 1e-11  # by which a step may miss the next point
UNSURE = 1e-3  # of a multiplier at a guess: nearer to the unit circle it says nothing of the motion beside
UNDECIDED = -1  # the label of a start whose attractor is not known
SHELLS, RAYS = 40, 48  # tried about each point of an attractor
LARGEST, SMALLEST = 8.0, 1.25e-5  # radius of the outermost shell in sizes of the states, and of the innermost in it
FALLS = 1e-3  # of the form: less than its fall by so much is none


@dataclass(frozen=True, eq=False)
class Claims:
    """The motions found among m runs.

    Attributes:
        parts: motions of one period each, and the numbers of their runs.
        periods: (m,) 0 where a run repeats itself after no period that was looked for.
    """

    parts: Sequence[tuple[Cycles, Integers]]
    periods: Integers

    @property
    def motions(self) -> list[PeriodicMotion | None]:
        """Per run its motion; None where there is none."""
        motions: list[PeriodicMotion | None] = [None] * len(self.periods)
        for cycles, numbers in self.parts:
            for i, motion in zip(numbers.tolist(), cycles.motions(), strict=True):
                motions[i] = motion
        return motions


def claimed(system: SectionSystem, rows: RunRows, varied: Varied | None = None, *, longest: int = 24) -> Claims:
    """The stable periodic motions that runs have come to, solved to rounding.

    Args:
        rows: of runs; more of them than the longest period, at least.
        varied: values (m,) of parameters that differ from run to run.
        longest: period.
    """
    varied = varied or {}
    periods = np.where(rows.outcomes <= families.ABSORBED, rows.periods, 0)
    finished = (rows.outcomes == families.FINISHED) & (rows.filled > 1)
    for filled in np.unique(rows.filled[finished]):
        indices = np.flatnonzero(finished & (rows.filled == filled))
        periods[indices] = _alike(system, rows.points[indices, :filled], longest)
    groups: list[tuple[Cycles, Integers]] = []
    least = np.zeros(len(periods), np.int64)
    # a motion that comes in from alternate sides looks twice as long as it is: the shorter one is tried first
    shorter = _shorter(system, rows, periods)
    for tried in (shorter, np.where(shorter < periods, periods, 0)):
        possible = (tried > 0) & (tried <= rows.points.shape[1]) & (least == 0)
        indices = [np.flatnonzero(possible & (tried == period)) for period in np.unique(tried[possible])]
        for cycles, numbers in _solved(system, rows, varied, indices, [int(tried[these[0]]) for these in indices]):
            groups.append((cycles, numbers))
            least[numbers] = cycles.period
    return Claims(groups, least)


def _solved(
    system: SectionSystem, rows: RunRows, varied: Varied, groups: Sequence[Integers], periods: Sequence[int]
) -> Iterator[tuple[Cycles, Integers]]:
    """The stable motions of some periods near the last points of a group of runs for each, and the numbers of these."""
    last = [_last(rows, indices, period) for indices, period in zip(groups, periods, strict=True)]
    corrected = corrected_cycles(system, last, [{name: v[i] for name, v in varied.items()} for i in groups])
    for indices, guesses, (cycles, numbers) in zip(groups, last, corrected, strict=True):
        arrived, theirs = _theirs(system, cycles, guesses[numbers])
        yield cycles.only(theirs), indices[numbers[theirs]]
        # what only looks alike needs all of Newton's method, unless that has arrived and found another motion
        sure = np.abs(np.abs(cycles.eigenvalues).max(axis=1, initial=0.0) - 1.0) > UNSURE
        again = rows.periods[indices] == 0
        again[numbers[theirs | (arrived & sure)]] = False
        unsolved = np.flatnonzero(again)
        if unsolved.size:
            values = {name: v[indices[unsolved]] for name, v in varied.items()}
            solved, guessed = solved_cycles(system, guesses[unsolved], values, within=1.0)
            cycles, numbers = cycles_at(system, solved, {name: v[guessed] for name, v in values.items()})
            repeated = unsolved[guessed[numbers]]
            _, theirs = _theirs(system, cycles, guesses[repeated])
            yield cycles.only(theirs), indices[repeated[theirs]]


def _last(rows: RunRows, indices: Integers, period: int) -> Vector:
    """(k, period, n) the last points of some runs."""
    first = np.maximum(rows.filled[indices] - period, 0)
    return rows.points[indices[:, None], first[:, None] + np.arange(period)]


def _shorter(system: SectionSystem, rows: RunRows, periods: Integers) -> Integers:
    """(m,) the least parts of their periods after which the last points of runs look alike."""
    shorter = periods.copy()
    for period in np.unique(periods[periods > 0]):
        indices = np.flatnonzero((periods == period) & (rows.filled >= period))
        shorter[indices] = least_parts(system, _last(rows, indices, int(period)), ALIKE * system.sizes())
    return shorter


def _theirs(system: SectionSystem, cycles: Cycles, guesses: Vector) -> tuple[Flags, Flags]:
    """(k,) motions that are solved, and near the ones of their runs; those that are stable and of that least period."""
    sizes = system.sizes()
    distances = np.abs(system.difference(cycles.points - guesses)) / sizes
    size = 1.0 + np.abs(cycles.points).max(axis=(1, 2))
    arrived = (distances.max(axis=(1, 2)) <= NEAR) & (cycles.residuals <= 100.0 * CLAIMED * size)
    least = least_periods(system, cycles.points, sizes) == cycles.period
    return arrived, arrived & are_stable(cycles.eigenvalues) & least


def _alike(system: SectionSystem, points: Vector, longest: int) -> Integers:
    """(m,) the least numbers of points after which the last ones of runs (m, k, n) look alike; 0 if there is none."""
    least = np.zeros(len(points), np.int64)
    within = ALIKE * system.sizes()
    before = points[:, -2 : -2 - min(longest, points.shape[1] // 2) : -1]
    near = np.asarray(np.all(np.abs(system.difference(points[:, -1:] - before)) <= within, axis=2))
    for n in (np.flatnonzero(near.any(axis=0)) + 1).tolist():
        if (left := np.flatnonzero(near[:, n - 1] & (least == 0))).size:
            distances = system.difference(points[left, -n:] - points[left, -2 * n : points.shape[1] - n])
            least[left[(np.abs(distances) <= within).all(axis=(1, 2))]] = n
    return least


def same_motion(system: SectionSystem, first: PeriodicMotion, second: PeriodicMotion) -> bool:
    """Whether two motions pass through the same points."""
    if first.period != second.period:
        return False
    return any(
        (np.abs(system.difference(first.points - np.roll(second.points, k, axis=0))) <= SAME * system.sizes()).all()
        for k in range(first.period)
    )


def index_of(system: SectionSystem, motion: PeriodicMotion, motions: Sequence[PeriodicMotion]) -> int:
    """Which of the known motions it is; -1 if none."""
    return next((i for i, candidate in enumerate(motions) if same_motion(system, motion, candidate)), -1)


def targets_of(system: SectionSystem, motions: Sequence[PeriodicMotion], largest: float = LARGEST) -> Targets | None:
    """Where runs may end on the way to these stable motions; None if there are no motions.

    largest: radius of the outermost shell that is tried, in sizes of the states.
    """
    if not motions:
        return None
    points, forms, after, orbits, passes = [], [], [], [], []
    for number, motion in enumerate(motions):
        first = len(points)
        shapes = _forms(system, motion)
        radius = _radius(system, motion, shapes, largest)
        for i, (point, form) in enumerate(zip(motion.points, shapes, strict=True)):
            points.append(point)
            forms.append(form / radius**2)
            after.append(first + (i + 1) % motion.period)
            orbits.append(number)
            passes.append(2 * motion.period)
    return Targets(
        np.array(points), np.array(forms), *(np.array(column, np.int64) for column in (after, orbits, passes))
    )


def _forms(system: SectionSystem, motion: PeriodicMotion) -> list[Vector]:
    """A form about each point, which falls with every step by the squares of the differences there."""
    n = motion.points.shape[1]
    steps = system.step(motion.points).derivatives
    weight = np.diag(1.0 / system.sizes() ** 2)
    forms = []
    for i in range(motion.period):
        product, sums = np.eye(n), np.zeros((n, n))
        for k in range(motion.period):
            sums += product.T @ weight @ product
            product = steps[(i + k) % motion.period] @ product
        forms.append(np.asarray(solve_discrete_lyapunov(product.T, sums)))
    return forms


def _radius(system: SectionSystem, motion: PeriodicMotion, forms: Sequence[Vector], largest: float) -> float:
    """Root of the largest value of the forms inside which each step of the system makes them fall."""
    n, period = motion.points.shape[1], motion.period
    rays = np.random.default_rng(0).normal(size=(RAYS, n))
    rays[:, ~system.free] = 0.0
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    if system.free.sum() == 1:
        rays = np.stack([system.free, -1.0 * system.free])
    factors = [np.linalg.cholesky(form + 1e-14 * np.trace(form) * np.eye(n)) for form in forms]
    # on the shell of radius r about point i: V_i = r^2
    shells = [np.linalg.solve(factor.T, rays.T).T for factor in factors]
    radii = np.geomspace(largest, SMALLEST * largest, SHELLS)
    starts = np.stack([motion.points[i] + r * shells[i] for r in radii for i in range(period)])
    images = system.step(starts.reshape(-1, n), derivative=False).points.reshape(len(radii), period, len(rays), n)
    falls = np.ones(len(radii), bool)
    for i in range(period):
        k = (i + 1) % period
        distances = system.difference(images[:, i] - motion.points[k])
        with np.errstate(invalid="ignore"):
            values = np.einsum("rsi,ij,rsj->rs", distances, forms[k], distances)
            fall = FALLS * min(1.0, _least_fall(forms[i], system))
            falls &= (values <= (1.0 - fall) * radii[:, None] ** 2).all(axis=1)
    # the first radius inside the last shell on which they do not all fall
    first = int(np.flatnonzero(~falls).max(initial=-1)) + 1
    return float(radii[first]) if first < len(radii) else 1e-6


def _least_fall(form: Vector, system: SectionSystem) -> float:
    """The least share by which the form falls in a step of a small difference."""
    squares = system.sizes()[system.free, None] ** 2
    return float(1.0 / np.linalg.eigvals(squares * form[np.ix_(system.free, system.free)]).real.max())
