"""The mass matrix M = d2T/dv2, that it is regular, and that it is positive definite where impacts need it.

Coordinates that it does not couple are treated apart: M falls into blocks. A block is positive definite, if and only if
the determinants of its upper left squares are positive (Sylvester). They are written out for blocks of at most
``CLOSED_FORM`` coordinates; the engine watches the pivots of larger ones while it factors them. Expressions become
numbers with each shared part once.
"""

import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.declaration import Body
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.quantities import TIME, Coordinate, Parameter

Values = dict[Any, float]

_FUNCTIONS: Mapping[Any, Callable[[float], float]] = {
    sympy.exp: math.exp,
    sympy.log: math.log,
    sympy.sin: math.sin,
    sympy.cos: math.cos,
    sympy.tan: math.tan,
    sympy.sinh: math.sinh,
    sympy.cosh: math.cosh,
    sympy.tanh: math.tanh,
    sympy.atan: math.atan,
}


def evaluated(expression: sympy.Basic, values: Values) -> float:
    """Value of an expression; ``values`` has those of its symbols and keeps those of its parts.

    Returns:
        nan where it has no real value.
    """
    if expression not in values:
        values[expression] = _value(expression, values)
    return values[expression]


def at_start(body: Body) -> Values:
    """Start values of all quantities that the energies of a body may use, at rest."""
    values: Values = {TIME: 0.0}
    values |= {q: q.value for q in (*body.parameters, *body.all_inputs)}
    values |= {u.rate: u.rate.value for u in body.all_inputs}
    for q in body.coordinates:
        values |= {q: q.start, q.v: q.v.start}
    return values


def near_start(body: Body, points: int) -> Iterator[Values]:
    """The same at random places around the start, the same ones each time: no relation holds there by accident."""
    source = random.Random(0)
    for _ in range(points):
        yield {
            quantity: value * (1.0 + 0.2 * source.random()) if value else source.uniform(0.1, 1.0)
            for quantity, value in at_start(body).items()
        }


def _value(e: sympy.Basic, values: Values) -> float:
    try:
        inner = [evaluated(argument, values) for argument in e.args]
        if e.is_Add:
            return math.fsum(inner)
        if e.is_Mul:
            return math.prod(inner)
        if e.is_Pow:
            return math.pow(*inner)
        if e.func in _FUNCTIONS:
            return _FUNCTIONS[e.func](*inner)
        return float(e.func(*inner)) if inner else float(e)  # pyright: ignore[reportArgumentType]
    except (ValueError, OverflowError, TypeError, ZeroDivisionError):
        return math.nan


Entries = Mapping[tuple[int, int], Any]

# coordinates of a block whose determinants and inverse are written out
CLOSED_FORM = 3
# points at which a mass matrix must be singular to be called so, and the pivot that counts as none, of rows of size 1
_POINTS = 4
_NO_PIVOT = 1e-11


@lru_cache(maxsize=8)
def mass_entries(mechanism: Body) -> Entries:
    """The entries of M that are not zero, by row and column."""
    derivatives = Derivatives()
    velocities = [q.v for q in mechanism.coordinates]
    index: dict[Any, int] = {v: i for i, v in enumerate(velocities)}
    entries: dict[tuple[int, int], Any] = {}
    for i, v in enumerate(velocities):
        momentum = derivatives.by(mechanism.kinetic_energy, v)
        for j in sorted(index[w] for w in derivatives.symbols(momentum) if w in index):
            entry = derivatives.by(momentum, velocities[j]) if j >= i else entries.get((j, i), sympy.S.Zero)
            if entry != 0:
                entries[i, j] = entries[j, i] = entry
    return entries


def mass_matrix(mechanism: Body) -> sympy.Matrix:
    """M, (n_coordinates, n_coordinates)."""
    n = len(mechanism.coordinates)
    return sympy.Matrix(n, n, lambda i, j: mass_entries(mechanism).get((int(i), int(j)), sympy.S.Zero))


def blocks(n: int, entries: Entries) -> list[list[int]]:
    """The indices 0 to n-1 in groups that the entries connect, each in order."""
    groups = [[i] for i in range(n)]  # of every index the group that it is in
    for i, j in entries:
        if groups[i] is not groups[j]:
            merged = sorted(groups[i] + groups[j])
            for k in merged:
                groups[k] = merged
    return [group for i, group in enumerate(groups) if group[0] == i]


def is_singular(mechanism: Body) -> bool:
    """Whether some motion has no kinetic energy: M is singular at every random point around the start."""
    entries = mass_entries(mechanism)
    groups = blocks(len(mechanism.coordinates), entries)
    regular = [False] * len(groups)
    looked = False
    for values in near_start(mechanism, _POINTS):
        rows = [_scaled(_numbers(entries, group, values)) for group in groups]
        if any(x != x for matrix in rows for row in matrix for x in row):
            continue
        looked = True
        regular = [is_regular or _has_pivots(matrix) for is_regular, matrix in zip(regular, rows, strict=True)]
    return looked and not all(regular)


def inertia_requirements(mechanism: Body) -> tuple[Requirement, ...]:
    """What makes M positive definite, as far as the parameters alone decide it and their signs do not show it."""
    entries = mass_entries(mechanism)
    requirements = []
    for block in blocks(len(mechanism.coordinates), entries):
        if len(block) > CLOSED_FORM:
            continue
        for n in range(1, len(block) + 1):
            square = _square(entries, block[:n])
            if not all(isinstance(symbol, Parameter) for symbol in square.free_symbols):
                break
            minor: Any = sympy.expand(square.det())
            if not minor.is_positive:
                determinant = _determinant(mechanism.coordinates, block[:n])
                sentence = f"the mass matrix must be positive definite; {determinant} is not positive"
                requirements.append(Requirement(minor, sentence, strict=True))
    return tuple(requirements)


def check_definite(mechanism: Body) -> None:
    """Refuse a mass matrix that is not positive definite at the start values of everything. StickslipError: which
    determinant shows it."""
    values = at_start(mechanism)
    entries = mass_entries(mechanism)
    for block in blocks(len(mechanism.coordinates), entries):
        minor = 1.0
        for n, pivot in enumerate(_pivots(_numbers(entries, block, values)), start=1):
            minor *= pivot
            if not pivot > 0.0:
                raise StickslipError(
                    f"{mechanism.name}: the mass matrix is not positive definite at the start values "
                    f"({_determinant(mechanism.coordinates, block[:n])} is {minor:g}), so that some motion would have "
                    "no positive kinetic energy and an impact no answer. Look at the signs and cross terms of the "
                    "kinetic energy."
                )


def _square(entries: Entries, rows: Sequence[int]) -> sympy.Matrix:
    return sympy.Matrix([[entries.get((i, j), sympy.S.Zero) for j in rows] for i in rows])


def _numbers(entries: Entries, rows: Sequence[int], values: Values) -> list[list[float]]:
    return [[evaluated(entries[i, j], values) if (i, j) in entries else 0.0 for j in rows] for i in rows]


def _scaled(matrix: list[list[float]]) -> list[list[float]]:
    """Rows and columns divided by the roots of the largest entries of the rows: the scales of the coordinates."""
    size = [max(map(abs, row)) ** 0.5 or 1.0 for row in matrix]
    return [[x / (size[i] * size[j]) for j, x in enumerate(row)] for i, row in enumerate(matrix)]


def _has_pivots(matrix: list[list[float]]) -> bool:
    """Whether elimination finds a pivot in every column."""
    rows = [list(row) for row in matrix]
    for k in range(len(rows)):
        best = max(range(k, len(rows)), key=lambda i, k=k: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        if abs(rows[k][k]) <= _NO_PIVOT:
            return False
        for i in range(k + 1, len(rows)):
            _subtract(rows, i, k)
    return True


def _pivots(matrix: list[list[float]]) -> list[float]:
    """Pivots in order, to the first that is not positive: each is a leading minor over the one before."""
    rows = [list(row) for row in matrix]
    pivots = []
    for k in range(len(rows)):
        pivots.append(rows[k][k])
        if not rows[k][k] > 0.0:
            break
        for i in range(k + 1, len(rows)):
            _subtract(rows, i, k)
    return pivots


def _subtract(rows: list[list[float]], i: int, k: int) -> None:
    """Row k from row i, so that column k is zero there."""
    if rows[i][k] != 0.0:
        factor = rows[i][k] / rows[k][k]
        for j in range(k, len(rows)):
            rows[i][j] -= factor * rows[k][j]


def _determinant(coordinates: Sequence[Coordinate], rows: Sequence[int]) -> str:
    if rows == list(range(len(rows))):
        n = len(rows)
        return "its first entry" if n == 1 else f"the determinant of its first {n} rows and columns"
    names = ", ".join(coordinates[i].name for i in rows)
    return f"its entry of {names}" if len(rows) == 1 else f"the determinant of its rows and columns of {names}"
