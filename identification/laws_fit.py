"""Friction laws that can be fitted. A law is a value: names, bounds, mu, its gradient, a first guess, its doubts.

Conti: mu(v) = (mu_s - mu_k)/(1 + p v) + mu_k. Source: disc_rig paper, eq. (28), Table 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identification.problem import Unknown


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


def unknowns(law: FittableLaw) -> tuple[Unknown, ...]:
    """Parameters of a law as unknowns of a problem, without priors."""
    return tuple(Unknown(p.name, p.unit, p.minimum, p.maximum, p.description) for p in law.parameters)


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
