"""Length and order of the steps of a co-simulation.

    d      what the inputs turned out to be at the end of a step, less what was expected
    W      the largest answer of the signals, at that time or later, to an impulse at an input: of the coupled system
           near the point, x' = A x + B d, from the responses of its units
    error  the largest of W |d| T / ((k + 2) size tol) and |d| / (c size tol); T the length of the run, k the degree of
           what was expected, size = nominal + largest value so far, c = 5, or 1.5 for a signal that never jumps, or 1
           where a unit tells no response

The first is the error at the end of the run if all steps were as this one: it knows no unit of time. The second keeps
what is read between two points. The step and the degree out of k - 1, k, k + 1 are those of the longest step expected.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from fmu_models.coupling.histories import HIGHEST, Matrix, Vector
from fmu_models.coupling.response import Response

SAFETY, SHRINK, GROW = 0.8, 0.2, 2.5
PLAIN = 5.0  # times the tolerance by which a signal may be wrong where its effect is known
SHARE = 0.3  # of the sum of the largest answers to the errors of all steps: they do not all stay so, nor point one way
IMPRESSED = 1.5  # the same, where a body in contact may follow the signal as it is
ONCE = 0.1  # of the tolerance, for the effect of a single jump
SAMPLES = 6  # doublings of a fifth of the shortest time


class StepControl:
    """Estimates of ``n`` signals.

    Args:
        span: length of the run, s.
        nominal: (n,) sizes of the signals.
        lines, polygons: (n,) those fed by lines or held values, and by two lines without a jump.

    Attributes:
        size: (n,) nominal and largest values so far.
        rate: 1/s, the fastest one of the coupled system.
    """

    def __init__(
        self, tolerance: float, span: float, nominal: Vector, lines: NDArray[np.bool_], polygons: NDArray[np.bool_]
    ) -> None:
        self.tolerance, self.span, self.size = tolerance, span, nominal.copy()
        self._allowed = tolerance * nominal
        self._pace, self._last = np.zeros(nominal.size), np.zeros(nominal.size)
        self._nominal, self._corrected = nominal, lines
        self._missed = np.where(lines, 1.0, np.where(polygons, 1.0, 0.0))
        self._bend_by = self._turn_by = np.zeros(nominal.size)
        n = nominal.size
        self._impulse, self._bend = np.zeros((n, n)), np.zeros((2, n, n))
        self._plain = np.ones(n)
        self.rate = 0.0

    def answers(self, left: float, a: Matrix, b: Matrix, c: Matrix, d: Matrix, known: NDArray[np.bool_]) -> None:
        """Take the system near a point: x' = a x + b u, and u = c x + d u what the exchange gives for the signals;
        known: (n,) those whose unit tells it; left: the time to the end of the run, s."""
        self._plain = np.where(known, np.where(self._corrected, PLAIN, IMPRESSED), 1.0)
        # a loop without a solution is told by the exchange
        with contextlib.suppress(np.linalg.LinAlgError):
            c = np.asarray(np.linalg.solve(np.eye(d.shape[0]) - d, c), dtype=float)
        closed = a + b @ c
        self.rate = float(np.abs(np.linalg.eigvals(closed)).max(initial=0.0))
        time = min(0.2 / self.rate, left) if self.rate > 0.0 else left
        later = _exponential(closed * time)
        first, second, third = a @ b, a @ a @ b, a @ a @ a @ b
        self._bend_by, self._turn_by = _combination(b, first, second)
        left_over = second - np.where(self._corrected, self._bend_by * b + self._turn_by * first, 0.0)
        starts = np.hstack([b, left_over, third - np.where(self._corrected, self._turn_by * second, 0.0)])
        largest = np.abs(c @ starts)
        for _ in range(SAMPLES):
            largest = np.maximum(largest, np.abs(c @ (later @ starts)))
            later, time = later @ later, 2.0 * time
            if time > left:
                break
        n = d.shape[0]
        self._impulse, self._bend = largest[:, :n], np.array([largest[:, n : 2 * n], largest[:, 2 * n :]])
        # who tells no response is taken to answer as fast as its inputs move
        rates = np.where(known, 0.0, self._pace / self.size)
        self._impulse += np.diag(rates)
        self._bend[0] += np.diag(rates**3)
        self.rate = max(self.rate, float(rates.max(initial=0.0)))

    def see(self, values: Vector, h: float = 0.0) -> None:
        """Sizes of the signals so far, and how fast they have moved where the last point was h ago."""
        if h > 0.0:
            np.maximum(self._pace, np.abs(values - self._last) / h, out=self._pace)
        self._last = values
        np.maximum(self.size, self._nominal + np.abs(values), out=self.size)
        np.multiply(self.size, self.tolerance, out=self._allowed)

    def errors(self, defects: Matrix, degree: int) -> Vector:
        """Of a step with what was expected by this degree and the next ones, over the tolerance; defects: (m, n)."""
        sizes = np.abs(defects)
        degrees = np.arange(degree + 2.0, degree + 2.0 + len(defects))
        lasting = (sizes @ self._impulse.T) * (SHARE * self.span / degrees)[:, None]
        return np.maximum.reduce(np.maximum(lasting, sizes / self._plain) / self._allowed, axis=1, initial=0.0)

    def happens_once(self, h: float, defect: Vector) -> bool:
        """Whether a jump by the defect within a step of h does no harm."""
        return bool((h * (self._impulse @ np.abs(defect)) <= ONCE * self._allowed).all())

    def straightened(self, h: float, series: Matrix) -> Matrix:
        """The series (7, n) with lines that make up for what they leave out of it: the state after the step answers
        a_2 by A^2 b h^3 / 60, which is as good as a little more of b and A b."""
        if not self._corrected.any():
            return series
        bend = np.where(self._corrected, series[2], 0.0) * h**2
        mean = bend * self._bend_by / 60.0
        corrected = series.copy()
        corrected[0] += mean
        corrected[1] += 3.0 * mean - bend * self._turn_by / (10.0 * h)
        return corrected

    def feed_error(self, h: float, bend: Vector) -> float:
        """Of inputs fed by lines, from the third coefficients (n,) that lines leave out, over the tolerance."""
        x = min(h, 1.0 / self.rate) if self.rate > 0.0 else h
        wrong = (self._bend[0] / 60.0 + x * self._bend[1] / 120.0) @ np.abs(bend * self._missed) * x**2
        return float((wrong / self._allowed).max(initial=0.0)) * SHARE * self.span

    def choose(self, defects: Matrix, degree: int) -> tuple[int, float]:
        """Degree of the next step, and its length over that of this one; defects: (known, n) of every degree."""
        lowest = max(degree - 1, 0)
        highest = min(degree + 1, HIGHEST, defects.shape[0] - 1)
        best, factor = degree, 0.0
        for k, error in enumerate(self.errors(defects[lowest : highest + 1], lowest).tolist(), lowest):
            longer = SAFETY * max(error, 1e-12) ** (-1.0 / (k + 2))
            if longer > factor:
                best, factor = k, longer
        return best, min(max(factor, SHRINK), GROW)

    def first(self, slopes: Vector | None) -> float:
        """Length of a step from a point without history, s; slopes: (n,) of the signals, or unknown."""
        rate, degree = self.rate, 0 if slopes is None else 1
        steep = np.abs(slopes) if slopes is not None else self.size * max(rate, 1.0 / self.span)
        rate = max(rate, float((steep / self.size).max(initial=0.0)))
        h = min(0.1 / rate, 0.1 * self.span) if rate > 0.0 else 0.1 * self.span
        bend = np.maximum(steep, 1e-3 * self.size * rate) * (rate if degree else 1.0)
        while h > 1e-12 * self.span and self.errors(bend[None] * h ** (degree + 1) / (degree + 1), degree)[0] > 0.5:
            h *= 0.5
        return h


def joined(
    responses: Sequence[Response | None],
    inputs: Sequence[NDArray[np.int_]],
    sources: Sequence[Sequence[tuple[int, int, float]]],
    n: int,
) -> tuple[Matrix, Matrix, Matrix, Matrix, NDArray[np.bool_]]:
    """Responses of units as one of the coupled system, as ``StepControl.answers`` takes it.

    Args:
        inputs: of every unit, the places of its inputs among the n signals.
        sources: of every unit, (place of its output, signal that it feeds, factor).
    """
    known, d = np.ones(n, dtype=bool), np.zeros((n, n))
    blocks = [response.a for response in responses if response is not None]
    states = sum(len(block) for block in blocks)
    b, c, first = np.zeros((states, n)), np.zeros((n, states)), 0
    for response, places, feeds in zip(responses, inputs, sources, strict=True):
        if response is None:
            known[places] = False
            continue
        end = first + len(response.a)
        b[first:end, places] = response.b[:, : places.size]
        for output, signal, factor in feeds:
            c[signal, first:end] = factor * response.c[output]
            d[signal, places] = factor * response.d[output, : places.size]
        first = end
    a = np.asarray(block_diag(*blocks)) if blocks else np.zeros((0, 0))
    return a, b, c, d, known


def _combination(b: Matrix, first: Matrix, second: Matrix) -> tuple[Vector, Vector]:
    """Of every column, how much of b and A b comes nearest to A^2 b."""
    bb, bf, ff = (np.einsum("ij,ij->j", x, y) for x, y in ((b, b), (b, first), (first, first)))
    bs, fs = (np.einsum("ij,ij->j", x, second) for x in (b, first))
    determinant = bb * ff - bf**2
    apart = determinant > 1e-9 * bb * ff
    safe = np.where(apart, determinant, 1.0)
    turn = np.where(apart, (bb * fs - bf * bs) / safe, 0.0)
    return np.where(bb > 0.0, (bs - turn * bf) / np.where(bb > 0.0, bb, 1.0), 0.0), turn


def _exponential(m: Matrix) -> Matrix:
    """exp(m) of a matrix whose eigenvalues are at most a fifth."""
    term = result = np.eye(len(m))
    for j in range(1, 9):
        term = term @ m / j
        result = result + term
    return result
