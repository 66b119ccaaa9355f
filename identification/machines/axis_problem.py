"""Linear inverse dynamics of one degree of freedom, perhaps with a friction law that is not linear.

    D (effort - sum_i parameter_i regressor_i(motion) - sgn(v) F(|v|; q)) = residual,    D = diag(weights)

Terms: `axis_terms`; their regressors: `axis`. F: a law of friction coefficients times the normal force, or, where none
is known, times the root mean square effort; its parameters are then forces. Regressors and friction go through the same
filter as the effort. Residuals may depend on one another inside a block of the log (a cluster).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.problem import Evaluation, Problem, Unknown
from identification.laws import find_law
from identification.laws.law import FittableLaw, unknowns
from identification.machines.axis import columns_of
from identification.machines.axis_terms import BY_DIRECTION, DIRECTIONS, KINDS, Model, Term, sign_of
from identification.measurement.recipe import VELOCITY
from identification.measurement.signals import Prepared

PARTS = 8  # of a log, left out in turn
BLOCKS = 3 * PARTS  # of a log: clusters, each longer than the lags of Newey and West
INDISTINGUISHABLE = 1e8  # condition of the scaled regressors from which on terms cannot be told apart
COEFFICIENT = "mu"  # parameters of a law that begin so are friction coefficients, or proportional to them
STILL = 0.05  # of the greatest speed: slower samples say nothing to a law's first guess


@dataclass(frozen=True, eq=False)
class InverseProblem(Problem):
    """unknowns: parameters of the terms, then of the law; design: (n, m) weighted regressors of the terms; effort: (n,)
    weighted; rows: (n,) of these among the samples of the log; cluster: (n,)."""

    prepared: Prepared
    terms: tuple[Term, ...]
    law: FittableLaw | None
    sign: Callable[[np.ndarray], np.ndarray]
    unknowns: tuple[Unknown, ...]
    design: np.ndarray
    effort: np.ndarray
    rows: np.ndarray
    cluster: np.ndarray
    noise_known = False

    def start(self) -> np.ndarray:
        """The solution itself of terms alone; with a law, terms from a fit with Coulomb and viscous friction, and the
        law's own guess from what these leave."""
        if self.law is None:
            return np.linalg.lstsq(self.design, self.effort, rcond=None)[0]
        weight = self.prepared.weight[self.rows]
        rough = regressors(self.prepared, (Term("F_c", "coulomb"), Term("F_v", "viscous")))[self.rows]
        whole = np.concatenate([self.design, rough * weight[:, None]], axis=1)
        x = np.linalg.lstsq(whole, self.effort, rcond=None)[0][: len(self.terms)]
        speed = self.prepared.speed[self.rows]
        moving = (np.abs(speed) > STILL * np.max(np.abs(speed))) & (weight > 0)
        friction = (self.effort - self.design @ x)[moving] * np.sign(speed[moving]) / weight[moving]
        return np.concatenate([x, self.law.start(np.abs(speed[moving]), friction)])

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Weighted residuals, effort modelled less measured."""
        count = len(self.terms)
        residual, gradient = self.design @ x[:count] - self.effort, self.design
        if self.law is not None:
            friction, slope = self._friction(self.law, x[count:])
            residual, gradient = residual + friction, np.concatenate([gradient, slope], axis=1)
        log = np.zeros(len(self.rows), dtype=int)
        return Evaluation(residual, gradient, self.cluster, log, np.abs(self.prepared.speed[self.rows]))

    def _friction(self, law: FittableLaw, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Weighted friction (n,) and its derivatives (n, m)."""
        weight, thinned = self.prepared.weight[self.rows], self.prepared.thinned
        friction = thinned(lambda s: self.sign(s[VELOCITY]) * law.value(np.abs(s[VELOCITY]), q))[self.rows]
        slope = thinned(lambda s: (self.sign(s[VELOCITY]) * law.gradient(np.abs(s[VELOCITY]), q)).T)[self.rows]
        return weight * friction, weight[:, None] * slope

    def resampled(self, clusters: np.ndarray) -> InverseProblem:
        """As in `Problem`."""
        places = [np.flatnonzero(self.cluster == label) for label in clusters]
        labels = np.repeat(np.arange(len(places)), [len(part) for part in places])
        chosen = np.concatenate(places)
        columns = {name: getattr(self, name)[chosen] for name in ("design", "effort", "rows")}
        return replace(self, **columns, cluster=labels)


def regressors(prepared: Prepared, terms: Sequence[Term]) -> np.ndarray:
    """Decimated regressors (k, m), not weighted."""
    return prepared.thinned(columns_of(tuple(terms), prepared.turning))


def inverse_problem(prepared: Prepared, terms: tuple[Term, ...], law: FittableLaw | None = None) -> InverseProblem:
    """The problem of these terms, and of a law of friction force.

    Raises:
        StickslipError: fewer samples than parameters, an effort that never changes, or terms that the log cannot tell
            apart.
    """
    measured, weight = prepared.effort, prepared.weight
    count = len(terms) + (0 if law is None else len(law.parameters))
    if len(measured) <= count:
        raise StickslipError(
            f"{len(measured)} samples of {prepared.source} cannot determine {count} parameters. Lower 'least_speed' or "
            "'decimate', or record a longer log."
        )
    if np.ptp(measured) == 0:
        raise StickslipError(
            f"{prepared.source}: the effort is {measured[0]:g} {prepared.effort_unit} throughout, which says nothing "
            "of a model. Check its column."
        )
    design = regressors(prepared, terms) * weight[:, None] if terms else np.zeros((len(measured), 0))
    _check_rank(design, terms, prepared.source)
    rows = np.arange(len(measured))
    named = tuple(Unknown(t.name, str(t.unit(prepared.turning)), description=KINDS[t.kind].meaning) for t in terms)
    return InverseProblem(
        prepared,
        terms,
        law,
        sign_of(terms),
        (*named, *(unknowns(law) if law else ())),
        design,
        measured * weight,
        rows,
        rows * BLOCKS // len(rows),
    )


def law_problems(prepared: Prepared, model: Model) -> dict[str, InverseProblem]:
    """The problems of the laws that a recipe compares, each in place of the model's friction terms.

    Raises:
        StickslipError: as in `inverse_problem`.
    """
    scale = model.normal_force or float(np.sqrt(np.mean(prepared.effort**2)))
    base = tuple(term for term in model.terms if not KINDS[term.kind].friction)
    problems = {}
    for name in model.laws:
        if name == BY_DIRECTION:
            # Coulomb friction of each direction holds an offset already: half their difference
            rest = tuple(term for term in base if term.kind != "offset")
            both = tuple(Term(label, kind) for label, kind in DIRECTIONS.items())
            problems[name] = inverse_problem(prepared, (*rest, *both))
        else:
            made = inverse_problem(prepared, base, force_law(find_law(name), scale, prepared))
            problems[name] = replace(made, sign=sign_of(model.terms))
    return problems


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceLaw(FittableLaw):
    """A law of friction force. coefficients: the law that it is of; scale: N or N m, force of a coefficient of 1;
    factor: (m,) of its parameters over those of the coefficients."""

    coefficients: FittableLaw
    scale: float
    factor: np.ndarray

    def start(self, v: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """First guess, as in `FittableLaw`; mu: rough forces (n,)."""
        return self.factor * self.coefficients.start(v, mu / self.scale)

    def warnings(self, q: np.ndarray) -> tuple[str, ...]:
        """Those of the coefficients: they compare parameters of one kind, whatever its unit."""
        return self.coefficients.warnings(q)


def force_law(law: FittableLaw, scale: float, prepared: Prepared) -> FittableLaw:
    """A law of friction coefficients as one of friction force. scale: N or N m, force of a coefficient of 1."""
    factor = np.array([scale if p.name.startswith(COEFFICIENT) else 1.0 for p in law.parameters])
    shape = (-1, 1)
    parameters = tuple(
        replace(
            p,
            name=_force_name(p.name),
            unit=_force_unit(p.name, p.unit, prepared),
            minimum=by * p.minimum,
            maximum=by * p.maximum,
        )
        for p, by in zip(law.parameters, factor, strict=True)
    )
    made: dict[str, Any] = {
        "parameters": parameters,
        "value": lambda v, q: scale * law.value(v, q / factor),
        "gradient": lambda v, q: scale * law.gradient(v, q / factor) / factor.reshape(shape),
    }
    return ForceLaw(**vars(law) | made, coefficients=law, scale=scale, factor=factor)


def _force_name(name: str) -> str:
    return "F" + name.removeprefix(COEFFICIENT) if name.startswith(COEFFICIENT) else name


def _force_unit(name: str, unit: str, prepared: Prepared) -> str:
    """Unit of a parameter of a law where friction is an effort and the slip speed that of the coordinate."""
    turned = unit.replace("s/m", "s/rad").replace("m/s", "rad/s") if prepared.turning else unit
    if not name.startswith(COEFFICIENT):
        return turned
    return prepared.effort_unit if unit == "1" else f"{prepared.effort_unit} {turned}"


def _check_rank(design: np.ndarray, terms: Sequence[Term], source: str) -> None:
    """Terms whose regressors are sums of others are named: those that the weakest direction is made of."""
    size = np.linalg.norm(design, axis=0)
    still = [term.name for term, length in zip(terms, size, strict=True) if length == 0]
    if still:
        raise StickslipError(f"{source} says nothing of {', '.join(still)}: the regressor is zero throughout.")
    if not terms:
        return
    _, strength, directions = np.linalg.svd(design / size, full_matrices=False)
    if strength[0] > INDISTINGUISHABLE * strength[-1]:
        share = np.abs(directions[-1])
        names = [term.name for term, part in zip(terms, share, strict=True) if part > 0.1 * share.max()]
        raise StickslipError(
            f"{source} cannot tell the terms {', '.join(names)} apart: each is a sum of the others. Leave one out."
        )
