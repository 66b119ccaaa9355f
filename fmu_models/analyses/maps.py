"""Fixed and periodic points of a declared map, by Newton's method on all points of the motion at once.

    x1 = f(x0), x2 = f(x1), ..., x0 = f(x(n-1))

Taken one by one the points of an unstable motion stay within the reach of Newton's method where the n-th iterate, whose
slopes multiply, is out of it. The derivatives are SymPy's. Motions are sought from a grid of starts and, for a map of
one variable, also between its jumps (``crossings``); none of this proves that there are no others.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from fmu_models.analyses.crossings import Crossings, find_crossings
from fmu_models.analyses.newton import newton
from fmu_models.analyses.stability import Stability
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.language.maps import Map
from fmu_models.language.values import check_values

Vector = NDArray[np.float64]

# relative size of a step, and of a miss, at which Newton's method has arrived
SETTLED = 1e-9
# motions nearer to each other than this share of the box are one
SAME = 1e-8


@dataclass(frozen=True, eq=False)
class Iteration(Shown):
    """A map with numbers for its parameters, so that it can be iterated.

    Attributes:
        map: the declaration.
        parameters: their values, in the order of ``map.parameters``.
        backward: the negative map, which is the inverse of the declared one.
    """

    map: Map
    parameters: tuple[float, ...]
    backward: bool = False

    @classmethod
    def of(cls, declared: Map, values: Mapping[str, float] | None = None, *, backward: bool = False) -> Iteration:
        """The map at these values; parameters not named keep their defaults.

        Raises:
            StickslipError: a value that the map cannot have, or no inverse to go backward by.
        """
        given = values or {}
        check_values(declared, given)
        if backward and declared.inverse is None:
            raise StickslipError(
                f"{declared.name} has no inverse: several states lead to the same one, or the declaration does not say "
                "which does. Only the positive map can be followed."
            )
        made = cls(declared, tuple(float(given.get(p.name, p.value)) for p in declared.parameters), backward)
        if backward and np.isnan(made(np.array([state.start for state in declared.states]))).any():
            found = ", ".join(f"{p.name} = {v:g}" for p, v in zip(declared.parameters, made.parameters, strict=True))
            raise StickslipError(
                f"{declared.name} has no inverse at {found}: its formula has no value there. Choose other parameters, "
                "or follow the positive map."
            )
        return made

    @property
    def states(self) -> list[str]:
        """Names of the states."""
        return [state.name for state in self.map.states]

    @property
    def box(self) -> Vector:
        """(n, 2) range of each state in which motions are sought."""
        return np.array([self.map.box[state] for state in self.map.states])

    def __call__(self, x: Any) -> Vector:
        """(..., n) next states, angles within their modulus; nan where there is none."""
        return self.wrapped(self.lifted(x))

    def lifted(self, x: Any) -> Vector:
        """(..., n) next states without taking remainders."""
        return _evaluate(_functions(self.map, self.backward)[0], np.asarray(x, dtype=float), self.parameters)

    def jacobian(self, x: Any) -> Vector:
        """(..., n, n) derivative of the next states."""
        x = np.asarray(x, dtype=float)
        flat = _evaluate(_functions(self.map, self.backward)[1], x, self.parameters)
        return flat.reshape(*x.shape, x.shape[-1])

    def determinant(self, x: Any) -> Vector:
        """(...) determinant of the derivative, by which small areas or volumes grow; cancelled by SymPy beforehand."""
        x = np.asarray(x, dtype=float)
        return _evaluate(_functions(self.map, self.backward)[2], x, self.parameters)[..., 0]

    def wrapped(self, x: Vector) -> Vector:
        """(..., n) angles from 0 to their modulus, other states as they are."""
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(_moduli(self.map)), np.mod(x, _turns(self.map)), x)

    def difference(self, x: Vector) -> Vector:
        """(..., n) the shortest difference that x, a difference of states, stands for."""
        with np.errstate(invalid="ignore"):
            turns = np.round(x / _turns(self.map))
        return np.where(np.isfinite(_moduli(self.map)), x - turns * _turns(self.map), x)


@dataclass(frozen=True, eq=False)
class PeriodicMotion(Shown):
    """A fixed point or a cycle of points.

    Attributes:
        points: (period, n) states, one after the other.
        stability: eigenvalues of the derivative over the period, and what they mean.
    """

    points: Vector
    stability: Stability

    @property
    def period(self) -> int:
        """Number of points."""
        return len(self.points)


def iterate(iteration: Iteration, start: Any, steps: int) -> Vector:
    """(steps + 1, ..., n) states from ``start`` (..., n); nan from where the motion leaves every bound."""
    states = [np.asarray(start, dtype=float)]
    for _ in range(steps):
        states.append(iteration(states[-1]))
    return np.stack(states)


def find_periodic(
    iteration: Iteration,
    period: int = 1,
    *,
    box: Any = None,
    starts: int = 5000,
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
    found = find_cycles(iteration, guesses)
    _, distinct = np.unique(np.round(found / (10 * SAME * size)), axis=0, return_index=True)
    for points in found[np.sort(distinct)]:
        inside = (points >= bounds[:, 0] - SAME * size) & (points <= bounds[:, 1] + SAME * size)
        if inside.all() and _least_period(iteration, points, size) == period:
            points = _from_least(points, size)
            if not any(_same(iteration, points, other, size) for other in motions):
                motions.append(points)
    return tuple(
        motion_at(iteration, points) for points in sorted(motions, key=lambda points: tuple(_rounded(points[0], size)))
    )


def motion_at(iteration: Iteration, points: Vector) -> PeriodicMotion:
    """The motion through these points (period, n), which are taken to be a cycle."""
    monodromy = np.eye(points.shape[1])
    for jacobian in iteration.jacobian(points):
        monodromy = jacobian @ monodromy
    return PeriodicMotion(points, Stability.of(monodromy))


def find_cycles(iteration: Iteration, guesses: Vector) -> Vector:
    """(m, period, n) cycles that Newton's method comes to from guesses (.., period, n); those it loses are left out."""
    _, period, n = guesses.shape

    def equations(flat: Vector) -> tuple[Vector, Vector]:
        points = flat.reshape(-1, period, n)
        miss = iteration.difference(iteration.lifted(points) - np.roll(points, -1, axis=1))
        jacobians = iteration.jacobian(points)
        matrix = np.zeros((len(points), period, n, period, n))
        for i in range(period):
            matrix[:, i, :, i, :] += jacobians[:, i]
            matrix[:, i, :, (i + 1) % period, :] -= np.eye(n)
        return miss.reshape(flat.shape), matrix.reshape(*flat.shape, period * n)

    found = newton(equations, guesses.reshape(-1, period * n), accuracy=SETTLED, until_settled=True)
    return iteration.wrapped(found.points[found.converged].reshape(-1, period, n))


def find_iterate_crossings(iteration: Iteration, period: int = 1, *, box: Any = None, **search: Any) -> Crossings:
    """Fixed points and jumps of the n-th iterate of a map of one variable, told apart.

    Args:
        iteration: the map.
        period: n.
        box: (1, 2) range; that of the declaration if left out.
        search: samples, resolution, accuracy, noise of ``find_crossings``.

    Raises:
        StickslipError: more than one state, or an angle, whose rule jumps wherever it is wrapped.
    """
    if len(iteration.states) != 1 or iteration.map.modulus:
        raise StickslipError(
            f"{iteration.map.name} has the states {', '.join(iteration.states)}: crossings with the diagonal are those "
            "of a map of one variable that is no angle. Look for its periodic motions."
        )
    bounds = iteration.box if box is None else np.asarray(box, dtype=float)

    def points(x: float) -> Vector:
        return iterate(iteration, [x], period)[:, 0]

    def slope(x: float) -> float:
        return float(np.prod(iteration.jacobian(points(x)[:-1, None])))

    search = {"samples": min(200 * period, 2000)} | search
    return find_crossings(
        lambda x: float(points(x)[-1]), float(bounds[0, 0]), float(bounds[0, 1]), slope=slope, **search
    )


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


def _least_period(iteration: Iteration, points: Vector, size: Vector) -> int:
    """The number of points after which the cycle repeats."""
    period = len(points)
    for part in range(1, period):
        if period % part == 0 and _same(iteration, points, np.roll(points, part, axis=0), size, 100 * SAME):
            return part
    return period


def _same(iteration: Iteration, points: Vector, others: Vector, size: Vector, within: float = SAME) -> bool:
    return bool((np.abs(iteration.difference(points - others)) <= within * size).all())


def _rounded(points: Vector, size: Vector) -> Vector:
    """For an order in which what rounding tells apart counts as equal."""
    return np.round(points / (1e3 * SAME * size))


def _from_least(points: Vector, size: Vector) -> Vector:
    """The cycle from its least point on."""
    rounded = _rounded(points, size)
    first = min(range(len(points)), key=lambda i: tuple(rounded[i]))
    return np.roll(points, -first, axis=0)


@cache
def _functions(declared: Map, backward: bool) -> tuple[Any, Any, Any]:
    """The next states, their derivatives row by row, and their determinant, of states and parameters."""
    rule = (declared.inverse if backward else declared.rule) or {}
    # the sign inside a modulus stays a symbol until after differentiation: SymPy differentiates |z| only where it
    # knows z to be real, which it does not know of a quotient, and the determinant cancels only without case
    signs: dict[sympy.Expr, sympy.Dummy] = {}
    smooth = [rule[x].replace(sympy.Abs, lambda z: signs.setdefault(z, sympy.Dummy()) * z) for x in declared.states]
    jacobian = sympy.Matrix(smooth).jacobian(list(declared.states))
    cases = {sign: sympy.Piecewise((-1, z < 0), (1, True)) for z, sign in signs.items()}
    arguments = [*declared.states, *declared.parameters]
    expressions = (
        [rule[x] for x in declared.states],
        [entry.subs(cases) for entry in jacobian],
        [sympy.expand(jacobian.det()).subs(cases)],
    )
    states, derivatives, determinant = (sympy.lambdify(arguments, e, "numpy", cse=True) for e in expressions)
    return states, derivatives, determinant


def _evaluate(function: Any, x: Vector, parameters: tuple[float, ...]) -> Vector:
    with np.errstate(all="ignore"):
        found = function(*np.moveaxis(x, -1, 0), *parameters)
    whole = np.stack([np.broadcast_to(np.asarray(one, dtype=float), x.shape[:-1]) for one in found], axis=-1)
    return np.where(np.isfinite(whole), whole, np.nan)


@cache
def _moduli(declared: Map) -> Vector:
    """(n,) modulus of each state; infinite for those that are no angles."""
    return np.array([float(declared.modulus.get(state, sympy.oo)) for state in declared.states])


@cache
def _turns(declared: Map) -> Vector:
    """(n,) modulus of each state; 1, to be divided by, for those that are no angles."""
    return np.where(np.isfinite(_moduli(declared)), _moduli(declared), 1.0)
