"""Fit of a friction law to averaged friction coefficients.

Every estimator reduces its logs to equations of one form,
    sum_j average_j mu(slip_ij; q) = measured_i,     i = 1..n,
with residuals that depend on one another inside a slip segment (a cluster). They are solved by least squares (lmfit)
after whitening each cluster by the known colour of the sensor noise.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.errors import StickslipError
from identification.laws.law import FittableLaw


@dataclass(frozen=True, eq=False)
class Regression:
    """The equations of an estimator.

    slip: (n, w) m/s, >= 0; average: (w,), sums to 1; measured: (n,) friction coefficient; cluster: (n,) labels, equal
    ones adjacent; whiten: for each cluster in order a matrix (n_g, n_g) or weights (n_g,).
    """

    slip: np.ndarray
    average: np.ndarray
    measured: np.ndarray
    cluster: np.ndarray
    whiten: tuple[np.ndarray, ...]

    def model(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Averaged law (n,)."""
        return law.value(self.slip, q) @ self.average

    def model_gradient(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Derivatives (n, m) of the averaged law."""
        return (law.gradient(self.slip, q) @ self.average).T

    def whitened(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, m) cluster by cluster times ``whiten``."""
        ends = np.cumsum([len(w) for w in self.whiten])[:-1]
        parts = np.split(values, ends)
        return np.concatenate(
            [w @ part if w.ndim == 2 else (w * part.T).T for w, part in zip(self.whiten, parts, strict=True)]
        )


@dataclass(frozen=True, eq=False)
class Solution:
    """Least-squares solution: values (m,); whitened gradient (n, m) and residual (n,); raw residual (n,)."""

    values: np.ndarray
    gradient: np.ndarray
    residual: np.ndarray
    raw_residual: np.ndarray
    converged: bool
    message: str
    at_bound: tuple[bool, ...]


def _lmfit() -> Any:
    """lmfit without matplotlib, which it imports if it can and which takes longer than a fit."""
    hidden = "matplotlib" not in sys.modules and "lmfit" not in sys.modules
    if hidden:
        sys.modules["matplotlib"] = None  # type: ignore[assignment]  # None stands for a module that is not there
    try:
        import lmfit
    finally:
        if hidden:
            del sys.modules["matplotlib"]
    return lmfit


def solve(regression: Regression, law: FittableLaw, start: np.ndarray | None = None) -> Solution:
    """Least squares by lmfit (trust region, bounds of the law). start: (m,) or None for the law's own guess.

    Raises:
        StickslipError: fewer equations than parameters.
    """
    lmfit = _lmfit()

    count = len(law.parameters)
    if len(regression.measured) <= count:
        raise StickslipError(
            f"{len(regression.measured)} values of friction cannot determine the {count} parameters of '{law.name}'. "
            "Record longer logs, or at more drive speeds."
        )
    low = np.array([p.minimum for p in law.parameters])
    high = np.array([p.maximum for p in law.parameters])
    if start is None:
        start = law.start(regression.slip @ regression.average, regression.measured)
    start = np.clip(start, low + 1e-6 * (high - low), high - 1e-6 * (high - low))
    parameters = lmfit.Parameters()
    for spec, value in zip(law.parameters, start, strict=True):
        parameters.add(spec.name, value=float(value), min=spec.minimum, max=spec.maximum)

    def values(p: Any) -> np.ndarray:
        return np.array([p[spec.name].value for spec in law.parameters])

    def residual(p: Any) -> np.ndarray:
        return regression.whitened(regression.model(law, values(p)) - regression.measured)

    def gradient(p: Any) -> np.ndarray:
        return regression.whitened(regression.model_gradient(law, values(p)))

    # lmfit computes a covariance of its own (not used here), which for an exact fit divides zero by zero
    with np.errstate(invalid="ignore", divide="ignore"):
        found = lmfit.Minimizer(residual, parameters).minimize(
            method="least_squares", jac=gradient, x_scale="jac", ftol=1e-12, xtol=1e-12, gtol=1e-12, max_nfev=500
        )
    q = values(found.params)
    raw = regression.model(law, q) - regression.measured
    edge = 1e-6 * np.maximum(np.abs(q), 1e-3)
    return Solution(
        values=q,
        gradient=regression.whitened(regression.model_gradient(law, q)),
        residual=regression.whitened(raw),
        raw_residual=raw,
        converged=bool(found.success),
        message=str(found.message),
        at_bound=tuple(bool(b) for b in (q - low < edge) | (high - q < edge)),
    )
