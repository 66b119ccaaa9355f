"""What a friction law to be fitted is: a value with names, bounds, mu and its gradient, and how it is simulated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identification.inference.problem import Unknown


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
    warnings(q): sentences about values that no friction law of this form should have;
    model: name of the law in ``fmu_models/language/laws`` that simulates it, None for the one that the rig has (Conti);
    simulated(q, N): that law's parameters by name (the contact's number left out) for a normal force N in newton;
    linear in q.
    """

    name: str
    parameters: tuple[LawParameter, ...]
    value: Callable[[np.ndarray, np.ndarray], np.ndarray]
    gradient: Callable[[np.ndarray, np.ndarray], np.ndarray]
    start: Callable[[np.ndarray, np.ndarray], np.ndarray]
    warnings: Callable[[np.ndarray], tuple[str, ...]]
    model: str | None
    simulated: Callable[[np.ndarray, float], dict[str, float]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return tuple(parameter.name for parameter in self.parameters)


def unknowns(law: FittableLaw) -> tuple[Unknown, ...]:
    """Parameters of a law as unknowns of a problem, without priors."""
    return tuple(Unknown(p.name, p.unit, p.minimum, p.maximum, p.description) for p in law.parameters)


def coefficient(name: str, description: str) -> LawParameter:
    """A friction coefficient."""
    return LawParameter(name, "1", 0.0, 10.0, description)


VISCOUS = LawParameter("mu_v", "s/m", 0.0, 100.0, "rise of the friction coefficient with slip speed, viscous")


def fall_start(
    v: np.ndarray,
    mu: np.ndarray,
    scales: np.ndarray,
    share: Callable[[np.ndarray, float], np.ndarray],
    *,
    viscous: bool = False,
) -> np.ndarray:
    """First guess (mu_s, mu_k, scale[, mu_v]) of mu = mu_s share + mu_k (1 - share) [+ mu_v v].

    For a fixed scale the law is linear in the others: the best of a range of scales, with no negative coefficient.
    """
    from scipy.optimize import nnls

    best, least = np.zeros(0), np.inf
    for scale in scales:
        part = share(v, float(scale))
        design = np.stack([part, 1 - part, *([v] if viscous else [])], axis=1)
        found, misfit = nnls(design, mu)
        if misfit < least:
            best, least = np.array([found[0], found[1], scale, *found[2:]]), misfit
    return best


def falling_warnings(law: str, mu_s: float, mu_k: float) -> tuple[str, ...]:
    """What to say where a law whose friction is to fall with slip speed was found to rise."""
    if mu_s >= mu_k:
        return ()
    return (
        f"mu_s = {mu_s:.4g} is less than mu_k = {mu_k:.4g}: friction rises with slip speed, which the {law} law does "
        "not mean. A law with a viscous term (Coulomb+viscous) is more likely right; check also the signs of angle "
        "and drive.",
    )
