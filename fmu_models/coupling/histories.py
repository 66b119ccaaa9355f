"""Signals as polynomials: ahead through the points accepted so far, and between two of them.

    p(t) = sum_j D_j (t - t_0) ... (t - t_{j-1}),   D_j = f[t_0 ... t_j],  t_0 the newest point

A point at which the slope is known stands twice, so that a straight line begins at once. On a step of h the same is a
series of Legendre polynomials, p(T + s h) = sum_i a_i P_i(2 s - 1): a_0 is the mean of p, a_0 and a_1 keep its first
two moments.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

HIGHEST = 6  # degree of what is fed
POINTS = HIGHEST + 1
_NODES, _WEIGHTS = legendre.leggauss(POINTS)
_WITHIN = 0.5 * (_NODES + 1.0)
_SERIES = (np.arange(POINTS) + 0.5)[:, None] * legendre.legvander(_NODES, HIGHEST).T * _WEIGHTS
SLOPE_AT_END = np.arange(POINTS) * (np.arange(POINTS) + 1.0)  # of a_i, by the length of the step


class History:
    """Divided differences of ``width`` signals through their newest points.

    Attributes:
        time: of the newest point, s.
        known: number of differences; a polynomial has at most the degree ``known`` - 1.
    """

    def __init__(self, width: int) -> None:
        self.time, self.known = 0.0, 0
        self._ages = np.zeros(POINTS + 1)  # time of the newest point less that of every point
        self._differences = np.zeros((POINTS + 1, width))

    def restart(self, time: float, values: Vector, slopes: Vector | None = None) -> None:
        """Forget all points but one, of which the slopes may be known."""
        self.time, self._differences[0], self.known = time, values, 1
        self._ages[:] = 0.0
        if slopes is not None:
            self._differences[1], self.known = slopes, 2

    def series(self, end: float, degree: int) -> Matrix:
        """(7, width) Legendre coefficients of the polynomials from the newest point to ``end``."""
        factors = (end - self.time) * _WITHIN[:, None] + self._ages[:degree]
        basis = np.ones((POINTS, degree + 1))
        np.multiply.accumulate(factors, axis=1, out=basis[:, 1:])
        return _SERIES @ (basis @ self._differences[: degree + 1])

    def _products(self, end: float) -> Vector:
        """(known + 1,) the products of the distances from ``end`` to the points."""
        products = np.ones(self.known + 1)
        np.multiply.accumulate(end - self.time + self._ages[: self.known], out=products[1:])
        return products

    def defects(self, end: float, values: Vector) -> Matrix:
        """(known, width) values less what the polynomials of degree 0, 1, ... expect at ``end``."""
        terms = self._differences[: self.known] * self._products(end)[:-1, None]
        return values - np.add.accumulate(terms, axis=0)

    def accept(self, end: float, values: Vector, defects: Matrix) -> None:
        """Values at ``end`` become the newest point; defects: of the same values."""
        count = min(self.known, POINTS)
        self._differences[1 : count + 1] = defects[:count] / self._products(end)[1 : count + 1, None]
        self._differences[0] = values
        self._ages[1 : count + 1] = end - self.time + self._ages[:count]
        self.time, self.known = end, count + 1

    def accept_slopes(self, slopes: Vector) -> None:
        """The newest point stands twice, with its slopes."""
        count = min(self.known, POINTS)
        old, ages = self._differences[:count].copy(), self._ages[:count].copy()
        self._differences[1] = slopes
        for j in range(2, count + 1):
            self._differences[j] = (self._differences[j - 1] - old[j - 1]) / ages[j - 1]
        self._ages[1 : count + 1] = ages
        self.known = count + 1


def between(time: float, nodes: Sequence[float], values: Matrix, slopes: Matrix | None = None) -> Vector:
    """(width,) at ``time``: the polynomial through values (n, width) at the nodes, with slopes (n, width) Hermite's."""
    basis, rates = [], []
    for i, node in enumerate(nodes):
        weight, rate = 1.0, 0.0
        for j, other in enumerate(nodes):
            if j != i:
                weight *= (time - other) / (node - other)
                rate += 1.0 / (node - other)
        basis.append(weight)
        rates.append(rate)
    if slopes is None:
        return np.dot(basis, values)
    ahead = [time - node for node in nodes]
    squares = [w * w for w in basis]
    straight = [w * (1.0 - 2.0 * x * rate) for w, x, rate in zip(squares, ahead, rates, strict=True)]
    return np.dot(straight, values) + np.dot([w * x for w, x in zip(squares, ahead, strict=True)], slopes)
