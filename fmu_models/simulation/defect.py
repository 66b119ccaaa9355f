"""Whether a run obeys its equations, judged without the series that made it.

    defect = x(b) - x(a) - integral of f over [a, b]       f and every deciding function by evaluation at single points

Between consecutive events and knots of inputs lie pieces with eight Gauss points each. Where the values at these are
not those of a polynomial, since f or a deciding function has something narrow there, a piece is cut in four.
A deciding function (gap, slip, margin of stick, force of a closed contact, region, guard) that is negative at a point
contradicts the state that its contact has in the run.

What is narrower than the points are apart, and far from any of them, is not seen: that is what the steps must exclude.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from fmu_models.base.arrays import Flags, Vector

Record = Callable[[Vector], Vector]  # times (n,) to rows (n, 2 s + d): s states, their rates, d deciding functions

_NODES, _WEIGHTS = legendre.leggauss(8)
# from values at the nodes to coefficients of Legendre polynomials
_COEFFICIENTS = np.linalg.inv(legendre.legvander(_NODES, 7))
_PIECES, _LEAST, _MOST = 1024, 64, 1 << 16  # of a run, of an interval between events, and of a run that is refined
_GRADED = 4.0 ** -np.arange(12, 0, -1)  # of the first and the last piece: laws have their narrow features at events
_DEPTH = 18  # times that pieces are cut
_ROUNDING = 2.0**-52
_CONTRADICTS = 1e-9  # of the largest value of a deciding function


@dataclass(frozen=True)
class Defect:
    """The defect of a run of s states.

    Attributes:
        edges: (k,) s, of the pieces, from the start to the end, without those that events make.
        time: (k,) s, ends of the pieces.
        sums: (k, s) defects up to there, added up.
        contradiction: s and index of the deciding function that first contradicts its contact's state, None if none.
        resolved: everything seen was resolved with the pieces allowed.
    """

    edges: Vector
    time: Vector
    sums: Vector
    contradiction: tuple[float, int] | None
    resolved: bool


def defect_of(record: Record, breaks: Vector, states: int) -> Defect:
    """The defect of the run that ``record`` repeats; its rates may jump at ``breaks``, its start and end among them."""
    starts, right = _first_pieces(np.unique(breaks))
    done: list[tuple[Vector, ...]] = []
    resolved, largest = True, np.zeros(0)
    for depth in range(_DEPTH + 1):
        times, rows = _sampled(record, starts, right)
        largest = np.maximum(np.abs(rows).max(axis=(0, 1), initial=0.0), largest if largest.size else 0.0)
        coarse = _is_coarse(rows, right - starts, states, largest)
        if depth == _DEPTH or 4 * coarse.sum() + sum(len(piece[0]) for piece in done) > _MOST:
            resolved, coarse = not coarse.any(), np.zeros(starts.size, dtype=bool)
        done.append((starts[~coarse], right[~coarse], times[~coarse], rows[~coarse]))
        if not coarse.any():
            break
        quarters = np.linspace(starts[coarse], right[coarse], 5)
        starts, right = quarters[:-1].ravel(), quarters[1:].ravel()
    starts, right, times, rows = (np.concatenate(column) for column in zip(*done, strict=True))
    order = np.argsort(starts)
    starts, right, times, rows = starts[order], right[order], times[order], rows[order]
    rates = np.einsum("j,kjs->ks", _WEIGHTS, rows[:, 1:-1, states : 2 * states]) * (0.5 * (right - starts))[:, None]
    sums = np.cumsum(rows[:, -1, :states] - rows[:, 0, :states] - rates, axis=0)
    edges = np.setdiff1d(starts, np.nextafter(breaks, np.inf))
    return Defect(edges, right, sums, _contradiction(times, rows[:, :, 2 * states :]), resolved)


def _first_pieces(breaks: Vector) -> tuple[Vector, Vector]:
    """Ends of pieces: between events equal ones, the outermost cut ever finer towards the events."""
    count = max(_LEAST, _PIECES // max(breaks.size - 1, 1))
    count = max(1, min(count, _MOST // (2 * breaks.size)))
    shares = np.linspace(0.0, 1.0, count + 1)
    graded = _GRADED[:: 1 if breaks.size < 256 else 4] / count
    shares = np.unique(np.concatenate([shares, graded, 1.0 - graded]))
    # events are known to one rounding of time
    begins = np.append(breaks[:1], np.nextafter(breaks[1:-1], np.inf))
    ends = np.append(np.nextafter(breaks[1:-1], -np.inf), breaks[-1])
    edges = begins[:, None] + shares * (ends - begins)[:, None]
    edges[:, -1] = ends
    starts, right = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    # what is as short as rounding of time has no points inside
    wide = right - starts > 64 * _ROUNDING * np.maximum(np.abs(starts), np.abs(right))
    return starts[wide], right[wide]


def _sampled(record: Record, starts: Vector, right: Vector) -> tuple[Vector, Vector]:
    """Times (k, 10) of the pieces' ends and points, and rows (k, 10, m) there."""
    half, middle = 0.5 * (right - starts)[:, None], 0.5 * (right + starts)[:, None]
    times = np.hstack([starts[:, None], middle + half * _NODES, right[:, None]])
    distinct, where = np.unique(times, return_inverse=True)
    return times, record(distinct)[where.reshape(times.shape)]


def _is_coarse(rows: Vector, length: Vector, states: int, largest: Vector) -> Flags:
    """(k,) whether the values in a piece are not those of a polynomial by more than rounding of the largest of them."""
    values = rows[:, 1:-1, states:]
    coefficients = np.abs(np.einsum("ij,kjs->kis", _COEFFICIENTS, values))
    last, size = coefficients[:, 6:].max(axis=1), coefficients.max(axis=1)
    rates, deciding = slice(0, states), slice(states, None)
    # the error of the Gauss sum is of twice the order of the last coefficient
    error = length[:, None] * last[:, rates] ** 2 / np.maximum(size[:, rates], np.finfo(float).tiny)
    noise = 8.0 * _ROUNDING * (largest[:states] + largest[states : 2 * states] * length[:, None])
    unclear = (values[:, :, deciding].min(axis=1) < 10.0 * last[:, deciding]) & (
        last[:, deciding] > _CONTRADICTS * largest[2 * states :]
    )
    return (error > noise).any(axis=1) | unclear.any(axis=1)


def _contradiction(times: Vector, values: Vector) -> tuple[float, int] | None:
    """The first time and the deciding function, of (k, 10, d), at which one is below zero by more than rounding."""
    if not values.size:
        return None
    below = values < -_CONTRADICTS * np.abs(values).max(axis=(0, 1))
    piece, point, state = np.nonzero(below)
    if not piece.size:
        return None
    first = int(np.argmin(times[piece, point]))
    return float(times[piece[first], point[first]]), int(state[first])
