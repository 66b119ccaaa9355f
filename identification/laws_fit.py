"""Fit of a friction law to averaged friction coefficients.

Every estimator reduces its logs to equations of one form,
    sum_j average_j mu(slip_ij; q) = measured_i,     i = 1..n,
with residuals that depend on one another inside a slip segment (a cluster). They are solved by least squares
after whitening each cluster by the known colour of the sensor noise. A law is a value: names, bounds, mu, its gradient.

Conti: mu(v) = (mu_s - mu_k)/(1 + p v) + mu_k. Source: disc_rig paper, eq. (28), Table 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fmu_models.errors import StickslipError


@dataclass(frozen=True)
class LawParameter:
    """A parameter of a law: unit and the bounds of the search."""

    name: str
    unit: str
    minimum: float
    maximum: float
    description: str


@dataclass(frozen=True)
class FittableLaw:
    """A friction law to be fitted.

    value(v, q): friction coefficients, shape of v (slip speed >= 0, m/s), for parameters q (m,);
    gradient(v, q): their derivatives by q, (m, *shape of v);
    start(v, mu): first guess (m,) from slip speeds (n,) and rough coefficients (n,);
    doubts(q): sentences about values that no friction law of this form should have.
    """

    name: str
    parameters: tuple[LawParameter, ...]
    value: Callable[[np.ndarray, np.ndarray], np.ndarray]
    gradient: Callable[[np.ndarray, np.ndarray], np.ndarray]
    start: Callable[[np.ndarray, np.ndarray], np.ndarray]
    doubts: Callable[[np.ndarray], tuple[str, ...]]


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


def solve(regression: Regression, law: FittableLaw, start: np.ndarray | None = None) -> Solution:
    """Least squares within the bounds of the law, by a trust region. start: (m,) or None for the law's own guess.

    Raises:
        StickslipError: fewer equations than parameters.
    """
    from scipy.optimize import least_squares

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

    def residual(q: np.ndarray) -> np.ndarray:
        return regression.whitened(regression.model(law, q) - regression.measured)

    def gradient(q: np.ndarray) -> np.ndarray:
        return regression.whitened(regression.model_gradient(law, q))

    found = least_squares(
        residual,
        start,
        jac=gradient,  # pyright: ignore[reportArgumentType]  # a function, which the stubs do not know
        bounds=(low, high),
        x_scale="jac",
        ftol=1e-12,
        xtol=1e-12,
        gtol=1e-12,
        max_nfev=500,
    )
    q = np.asarray(found.x)
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


def _conti_value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return (q[0] - q[1]) / (1 + q[2] * v) + q[1]


def _conti_gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    share = 1 / (1 + q[2] * v)
    return np.stack([share, 1 - share, -(q[0] - q[1]) * v * share**2])


def _conti_start(v: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """For fixed p the law is linear in mu_s and mu_k: the best of a range of p."""
    best, least = np.zeros(3), np.inf
    for p in np.geomspace(0.2 / np.max(v), 100 / np.max(v), 25):
        share = 1 / (1 + p * v)
        design = np.stack([share, 1 - share], axis=1)
        pair = np.linalg.lstsq(design, mu, rcond=None)[0]
        misfit = float(np.sum((design @ pair - mu) ** 2))
        if misfit < least and np.all(pair > 0):
            best, least = np.array([pair[0], pair[1], p]), misfit
    return best if np.isfinite(least) else np.array([np.max(mu), np.min(mu), 1 / np.max(v)])


def _conti_doubts(q: np.ndarray) -> tuple[str, ...]:
    if q[0] >= q[1]:
        return ()
    return (
        f"mu_s = {q[0]:.4g} is less than mu_k = {q[1]:.4g}: friction rises with slip speed, which the Conti law does "
        "not mean. A law with a viscous term is more likely right; check also the signs of angle and drive.",
    )


CONTI = FittableLaw(
    name="Conti",
    parameters=(
        LawParameter("mu_s", "1", 0.0, 10.0, "friction coefficient at vanishing slip speed"),
        LawParameter("mu_k", "1", 0.0, 10.0, "friction coefficient at great slip speed"),
        LawParameter("p", "s/m", 0.0, 1e4, "slope of the fall of friction with slip speed"),
    ),
    value=_conti_value,
    gradient=_conti_gradient,
    start=_conti_start,
    doubts=_conti_doubts,
)

LAWS = {law.name: law for law in (CONTI,)}
