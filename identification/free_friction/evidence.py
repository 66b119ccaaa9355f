"""What slips say of any law by the free curve: a law is judged without another run of the motion.

    -2 ln L(q) = |K (c(q) - c) |^2,    K'K = H_s - P,    K'K c = H_s c_m

H_s is what the slips leave of the curve's coefficients once all else that is shared is eliminated, P what was assumed
of them beforehand, c_m their best values with it; c(q) are the coefficients nearest to a law over the slip speeds seen.
The noise is as large as the residuals of the curve show it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identification.free_friction.curve import TAUS, Gram, Known
from identification.free_friction.guess import Guess
from identification.free_friction.responses import rows_of
from identification.free_friction.result import COEFFICIENTS, SpeedBasis
from identification.free_friction.slips import Slips
from identification.laws import FittableLaw

SPEEDS = 400  # among those seen, over which a law is carried to the curve
SEEN = 1e-9  # of the greatest eigenvalue: less is not told by slips


@dataclass(frozen=True, eq=False)
class SeenLaw:
    """A law as slips see it. values (m,) of its parameters; covariance (m, m), with what is known of the constants of
    the rig; misfit: -2 ln of its likelihood, of ``freedom`` degrees."""

    law: FittableLaw
    values: np.ndarray
    covariance: np.ndarray
    misfit: float
    freedom: int


@dataclass(frozen=True, eq=False)
class Evidence:
    """root (k, COEFFICIENTS): K; target (k,): K c; speeds (n,): slip speeds as often as they were seen, m/s; samples:
    count of what the sensors showed; torn: whether a torque acts that nothing explains."""

    basis: SpeedBasis
    root: np.ndarray
    target: np.ndarray
    speeds: np.ndarray
    samples: int
    torn: bool = False

    @classmethod
    def of(cls, slips: Slips, guess: Guess, tau: float) -> Evidence:
        """Of the curve of a guess that has settled."""
        rows = rows_of(slips, guess)
        gram = Gram.of(rows, guess, tau).alike(rows, torn := slips.torn(tau))
        hessian = gram.least(known := Known.of(slips), guess.values(slips.names)).hessian
        own, others = slice(None, COEFFICIENTS), slice(COEFFICIENTS, None)
        seen = hessian[own, own] - hessian[own, others] @ np.linalg.solve(hessian[others, others], hessian[others, own])
        samples = sum(len(row.residual) for row in rows)
        noise = max(sum(float(row.residual @ row.residual) for row in rows) / samples, 1.0)
        power, axes = np.linalg.eigh(seen - known.precision[own, own])
        determined = power > SEEN * power[-1]
        size, axes = np.sqrt(power[determined]), axes[:, determined].T
        target = axes @ (seen @ guess.coefficients) / size
        slip = np.quantile(np.maximum(slips.slip_speeds(guess), 0.0), np.linspace(0, 1, SPEEDS))
        return cls(
            slips.curve,
            size[:, None] * axes / np.sqrt(noise),
            target / np.sqrt(noise),
            slip,
            samples,
            torn > tau or tau > TAUS[0],
        )

    @cached_property
    def _carried(self) -> np.ndarray:
        """From friction at ``speeds`` to K c (k, n)."""
        return self.root @ np.linalg.pinv(self.basis.weights(self.speeds))

    @cached_property
    def _curve(self) -> np.ndarray:
        """The curve at ``speeds`` as the slips alone tell it (n,)."""
        return self.basis.weights(self.speeds) @ np.linalg.lstsq(self.root, self.target, rcond=None)[0]

    def seen(self, law: FittableLaw, start: np.ndarray | None = None) -> SeenLaw:
        """A law at its most likely values. start (m,): where the search begins; from the curve if left out."""
        from scipy.optimize import least_squares

        low, high = (np.array(side) for side in zip(*((p.minimum, p.maximum) for p in law.parameters), strict=True))
        solution = least_squares(
            lambda q: self._carried @ law.value(self.speeds, q) - self.target,
            np.clip(law.start(self.speeds, self._curve) if start is None else start, low, high),
            jac=lambda q: self._carried @ law.gradient(self.speeds, q).T,  # type: ignore[reportArgumentType]  # as in `Search`
            bounds=(low, high),
            x_scale="jac",
        )
        covariance = np.linalg.pinv(solution.jac.T @ solution.jac, hermitian=True)
        return SeenLaw(law, solution.x, covariance, 2 * float(solution.cost), len(self.target) - len(solution.x))
