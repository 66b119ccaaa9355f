"""What the eigenvalues of the derivative of a map say about a fixed point of it.

    eigenvalue        inside the unit circle        on it            outside
    real, positive    monotonic, stable             1: saddle-node   monotonic, unstable
    real, negative    oscillatory, stable           -1: flip         oscillatory, unstable
    zero              degenerate
    complex           spiral, stable                Neimark          spiral, unstable

On the circle the names are those of the bifurcations that may happen there. The negative map has the inverse
eigenvalues, so that stable and unstable change places.

Source: Luo and Guo, Vibro-impact Dynamics (2013), definitions 2.7 to 2.9; there the oscillatory unstable space of
equation (2.24) is printed with -1 < lambda, where lambda < -1 is meant.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.arrays import Complex, Flags, Vector
from fmu_models.base.shown import Shown

# distance from the unit circle, from zero and from the real line that counts as none
ON_CIRCLE = 1e-7
DEGENERATE = 1e-12
# of a product of factors: rounds until its eigenvalues are told apart, at most; those that differ in size by no more
# than this share need not be
SWEEPS, LIKE = 100, 1e4
EPSILON = float(np.finfo(float).eps)


def eigenvalue_class(eigenvalue: complex) -> str:
    """Class of one eigenvalue, as in the table of the module.

    >>> eigenvalue_class(0.5), eigenvalue_class(-1.0), eigenvalue_class(-1.9), eigenvalue_class(0.5 + 0.5j)
    ('monotonic, stable', 'flip', 'oscillatory, unstable', 'spiral, stable')
    """
    size = abs(eigenvalue)
    if size <= DEGENERATE:
        return "degenerate"
    is_real = abs(eigenvalue.imag) <= DEGENERATE * size
    if abs(size - 1.0) <= ON_CIRCLE:
        if not is_real:
            return "Neimark"
        return "saddle-node" if eigenvalue.real > 0 else "flip"
    kind = ("monotonic" if eigenvalue.real > 0 else "oscillatory") if is_real else "spiral"
    return f"{kind}, {'stable' if size < 1.0 else 'unstable'}"


def eigenvalues_of(derivatives: Vector) -> Complex:
    """(..., n) of derivatives (..., n, n), largest modulus first."""
    return _ordered(np.linalg.eigvals(derivatives).astype(complex))


def _ordered(eigenvalues: Complex) -> Complex:
    order = np.lexsort((-np.real(eigenvalues), -np.abs(eigenvalues)), axis=-1)
    return np.take_along_axis(eigenvalues, order, axis=-1)


def product_eigenvalues(factors: Vector) -> Complex:
    """(n,) of A_m ... A_1, largest modulus first, from the factors (m, n, n), A_1 first: also where their moduli range
    over more than rounding of the product would leave.

    Orthogonal iteration of the period: A_k Q_k = Q_(k+1) R_k with Q_1 = Q_(m+1) in the end, up to blocks of eigenvalues
    of like size, whose own products give them. Each factor is wrong by rounding of itself alone.

    Source: Bojanczyk, Golub, Van Dooren, The periodic Schur decomposition (1992); without shifts, since what is to be
    told apart lies far apart.
    """
    n = factors.shape[1]
    start, sweeps = np.eye(n), 0
    while True:
        sweeps += 1
        q, upper = start, []
        for factor in factors:
            q, r = np.linalg.qr(factor @ q)
            upper.append(r)
        turn = start.T @ q  # block triangular, but for what still rotates into one another
        ends = [j for j in range(1, n) if np.abs(turn[j:, :j]).max() <= n * EPSILON]
        blocks = [slice(*bounds) for bounds in itertools.pairwise([0, *ends, n])]
        sizes = np.abs(np.prod([np.diag(r) for r in upper], axis=0))
        if sweeps == SWEEPS or all(sizes[block].max() <= LIKE * sizes[block].min() for block in blocks):
            break
        start = q
    products = (reduce(lambda p, r, at=block: p @ r[at, at], reversed(upper), turn[block, block]) for block in blocks)
    return _ordered(np.concatenate([np.linalg.eigvals(product).astype(complex) for product in products]))


def are_stable(eigenvalues: Complex) -> Flags:
    """(...) whether all eigenvalues (..., n) lie inside the unit circle."""
    return np.asarray(np.all(np.abs(eigenvalues) < 1.0 - ON_CIRCLE, axis=-1))


@dataclass(frozen=True, eq=False)
class Stability(Shown):
    """Eigenvalues at a fixed point.

    Attributes:
        eigenvalues: (n,) largest modulus first.
    """

    eigenvalues: Complex

    @classmethod
    def of(cls, derivative: ArrayLike) -> Stability:
        """The stability from the derivative (n, n) of the map."""
        return cls(eigenvalues_of(np.asarray(derivative, dtype=float)))

    @property
    def classes(self) -> tuple[str, ...]:
        """Class of every eigenvalue."""
        return tuple(eigenvalue_class(complex(eigenvalue)) for eigenvalue in self.eigenvalues)

    @property
    def hyperbolic(self) -> bool:
        """No eigenvalue lies on the unit circle."""
        return bool((np.abs(np.abs(self.eigenvalues) - 1.0) > ON_CIRCLE).all())

    @property
    def stable(self) -> bool:
        """All eigenvalues lie inside the unit circle."""
        return bool(are_stable(self.eigenvalues))

    @property
    def saddle(self) -> bool:
        """Some eigenvalues lie inside the unit circle, some outside, none on it."""
        inside = np.abs(self.eigenvalues) < 1.0
        return self.hyperbolic and bool(inside.any() and not inside.all())

    @property
    def negative(self) -> Stability:
        """Stability of the negative map: inverse eigenvalues; infinite for a degenerate one, which has no inverse."""
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = np.where(np.abs(self.eigenvalues) > 0, 1.0 / self.eigenvalues, np.inf)
        return Stability(inverse[::-1])
