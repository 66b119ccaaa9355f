"""Friction laws on the same log: which one the log prefers, and whether its parameters mean anything.

    effort = sum of the terms that are no friction + S sgn(q') mu(|q'|)

S is the stated normal force, or, where none is known, the root mean square effort; friction is reported as S mu. With
n_eff independent samples (residuals are coloured), k parameters and rss the sum of squares over n samples
    AIC = n_eff ln(rss/n) + 2 k,    BIC = n_eff ln(rss/n) + k ln n_eff,
and the error on blocks of the log that the fit has not seen. A law whose fitted parameters contradict what the law
means is put aside, however well it fits. Source: Burnham, Anderson, Model Selection and Multimodel Inference (2002).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identification.inference.uncertainty import newey_west
from identification.laws import slip_laws
from identification.laws.law import FittableLaw
from identification.one_dof.estimate import INDISTINGUISHABLE, blocks, regressors
from identification.one_dof.memory import memory
from identification.one_dof.recipe import VELOCITY, Recipe
from identification.one_dof.signals import Prepared
from identification.one_dof.terms import KINDS, LINEAR_LAWS, Term, sign_of

BLOCKS = 8  # left out in turn
LEAST_BLOCK = 2  # memories of the residual: shorter blocks are not independent of their neighbours
COEFFICIENT = "mu"  # parameters of a law that begin so are friction coefficients, or proportional to them
EQUAL = 2.0  # BIC: laws closer than this fit alike, and the simpler one is taken


@dataclass(frozen=True)
class FrictionRow:
    """One law. values, deviations (standard, Newey-West; NaN where the log does not determine a parameter), units: by
    parameter of the friction law; unseen_error: |r|/|y| on blocks left out in turn;
    doubts: why its values mean nothing, empty if they do."""

    name: str
    values: dict[str, float]
    deviations: dict[str, float]
    units: dict[str, str]
    relative_error: float
    unseen_error: float
    aic: float
    bic: float
    doubts: tuple[str, ...]


@dataclass(frozen=True)
class FrictionComparison:
    """rows: by BIC, the best first; preferred: name, None if all are doubtful; reason: why it is; aside: why others are
    not considered; scale: S above, in ``scale_unit``."""

    rows: tuple[FrictionRow, ...]
    preferred: str | None
    reason: str
    aside: tuple[str, ...]
    scale: float
    scale_unit: str
    effective_samples: float


def compare_friction(recipe: Recipe, prepared: Prepared) -> FrictionComparison | None:
    """Compare the laws that a recipe names; None if it names none."""
    if not recipe.laws:
        return None
    scale = recipe.normal_force or float(np.sqrt(np.mean(prepared.effort**2)))
    base = tuple(term for term in recipe.terms if not KINDS[term.kind].friction)
    candidates = [
        _Linear(prepared, name, base)
        if name in LINEAR_LAWS
        else _Nonlinear(prepared, slip_laws()[name], base, sign_of(recipe.terms), scale)
        for name in recipe.laws
    ]
    everything = np.ones(len(prepared.time), bool)
    found = [candidate.fit(everything) for candidate in candidates]
    residuals = [candidate.residual(x) for candidate, x in zip(candidates, found, strict=True)]
    colour = memory(min(residuals, key=lambda r: float(r @ r)))
    count = len(everything)
    labels = blocks(count, int(np.clip(count // (LEAST_BLOCK * colour.lags), 2, BLOCKS)))
    rows = [_row(one, x, labels, colour.samples) for one, x in zip(candidates, found, strict=True)]
    rows.sort(key=lambda row: row.bic)
    preferred, reason = _choice(rows)
    aside = tuple(f"{row.name} is put aside: {' '.join(row.doubts)}" for row in rows if row.doubts)
    return FrictionComparison(tuple(rows), preferred, reason, aside, scale, prepared.effort_unit, colour.samples)


class _Candidate(ABC):
    """A model whose unknowns x are the parameters of the base terms, then those of the friction law.

    names, units: of the law's parameters.
    """

    name: str
    names: tuple[str, ...]
    units: tuple[str, ...]

    def __init__(self, prepared: Prepared, base: tuple[Term, ...]) -> None:
        self.prepared, self.base_count = prepared, len(base)
        self.weight = prepared.weight
        self.measured = prepared.effort * self.weight
        self.base = regressors(prepared, base) * self.weight[:, None] if base else np.zeros((len(self.measured), 0))

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Measured less modelled effort (k,), weighted."""
        return self.measured - self.model(x)

    @abstractmethod
    def model(self, x: np.ndarray) -> np.ndarray:
        """Modelled effort (k,), weighted."""

    @abstractmethod
    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Derivatives (k, m) of the model."""

    @abstractmethod
    def fit(self, rows: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        """Unknowns (m,) from some of the samples (k,) of true and false."""

    @abstractmethod
    def shown(self, x: np.ndarray) -> np.ndarray:
        """Parameters of the law as reported."""

    @abstractmethod
    def doubts(self, x: np.ndarray) -> tuple[str, ...]:
        """Why the values mean nothing."""


class _Linear(_Candidate):
    """A law that is a sum of terms."""

    def __init__(self, prepared: Prepared, name: str, base: tuple[Term, ...]) -> None:
        terms = tuple(Term(label, kind) for label, kind in LINEAR_LAWS[name].items())
        # Coulomb friction of each direction holds an offset already: half their difference
        both = any(term.kind == "coulomb+" for term in terms)
        super().__init__(prepared, tuple(term for term in base if not (both and term.kind == "offset")))
        self.name, self.names = name, tuple(term.name for term in terms)
        self.units = tuple(str(term.unit(prepared.turning)) for term in terms)
        self.design = np.concatenate([self.base, regressors(prepared, terms) * self.weight[:, None]], axis=1)

    def model(self, x: np.ndarray) -> np.ndarray:
        return self.design @ x

    def gradient(self, x: np.ndarray) -> np.ndarray:
        return self.design

    def fit(self, rows: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        return np.linalg.lstsq(self.design[rows], self.measured[rows], rcond=None)[0]

    def shown(self, x: np.ndarray) -> np.ndarray:
        return x[self.base_count :]

    def doubts(self, x: np.ndarray) -> tuple[str, ...]:
        wrong = [f"{name} = {value:.4g}" for name, value in zip(self.names, self.shown(x), strict=True) if value < 0]
        return (f"{', '.join(wrong)} below zero: friction that drives.",) if wrong else ()


class _Nonlinear(_Candidate):
    """A law of friction coefficients, times the force S."""

    def __init__(
        self,
        prepared: Prepared,
        law: FittableLaw,
        base: tuple[Term, ...],
        sign: Callable[[np.ndarray], np.ndarray],
        scale: float,
    ) -> None:
        super().__init__(prepared, base)
        self.law, self.sign, self.scale = law, sign, scale
        self.name = law.name
        self.names = tuple(_force_name(p.name) for p in law.parameters)
        self.units = tuple(_force_unit(p.name, p.unit, prepared) for p in law.parameters)

    def model(self, x: np.ndarray) -> np.ndarray:
        q = x[self.base_count :]
        friction = self.prepared.thinned(lambda s: self.sign(s[VELOCITY]) * self.law.value(np.abs(s[VELOCITY]), q))
        return self.base @ x[: self.base_count] + self.scale * self.weight * friction

    def gradient(self, x: np.ndarray) -> np.ndarray:
        q = x[self.base_count :]
        slope = self.prepared.thinned(lambda s: (self.sign(s[VELOCITY]) * self.law.gradient(np.abs(s[VELOCITY]), q)).T)
        return np.concatenate([self.base, self.scale * self.weight[:, None] * slope], axis=1)

    def fit(self, rows: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        from scipy.optimize import least_squares

        def slope(x: np.ndarray) -> np.ndarray:
            return -self.gradient(x)[rows]

        low, high = self._bounds()
        x = self._start() if start is None else start
        inside = 1e-6 * np.where(np.isfinite(high - low), high - low, 0)
        return least_squares(
            lambda x: self.residual(x)[rows],
            np.clip(x, low + inside, high - inside),
            jac=slope,  # type: ignore[arg-type]  # scipy's stub takes the default for the only type
            bounds=(low, high),
            x_scale="jac",
            ftol=1e-12,
            xtol=1e-10,
            gtol=1e-12,
        ).x

    def shown(self, x: np.ndarray) -> np.ndarray:
        factor = [self.scale if p.name.startswith(COEFFICIENT) else 1.0 for p in self.law.parameters]
        return x[self.base_count :] * factor

    def doubts(self, x: np.ndarray) -> tuple[str, ...]:
        low, high = self._bounds()
        edge = 1e-4 * np.maximum(np.abs(x), 1e-6)
        ends = [
            f"{name} = {value:.3g} at the end of its range"
            for name, value, at in zip(
                self.names, self.shown(x), ((x - low < edge) | (high - x < edge))[self.base_count :], strict=True
            )
            if at
        ]
        return (*self.law.doubts(self.shown(x)), *((f"{', '.join(ends)}.",) if ends else ()))

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        free = np.full(self.base_count, np.inf)
        low = np.array([p.minimum for p in self.law.parameters])
        high = np.array([p.maximum for p in self.law.parameters])
        return np.concatenate([-free, low]), np.concatenate([free, high])

    def _start(self) -> np.ndarray:
        """Base terms from a fit with Coulomb and viscous friction; the law's own guess from what these leave."""
        rough = regressors(self.prepared, (Term("F_c", "coulomb"), Term("F_v", "viscous"))) * self.weight[:, None]
        x = np.linalg.lstsq(np.concatenate([self.base, rough], axis=1), self.measured, rcond=None)[0]
        speed, left = self.prepared.speed, self.measured - self.base @ x[: self.base_count]
        moving = np.abs(speed) > 0.05 * np.max(np.abs(speed))
        coefficient = left * np.sign(speed) / (self.scale * self.weight)
        guess = self.law.start(np.abs(speed)[moving], coefficient[moving])
        return np.concatenate([x[: self.base_count], guess])


def _force_name(name: str) -> str:
    return "F" + name.removeprefix(COEFFICIENT) if name.startswith(COEFFICIENT) else name


def _force_unit(name: str, unit: str, prepared: Prepared) -> str:
    """Unit of a parameter of a law where friction is an effort and the slip speed that of the coordinate."""
    turned = unit.replace("s/m", "s/rad").replace("m/s", "rad/s") if prepared.turning else unit
    if not name.startswith(COEFFICIENT):
        return turned
    return prepared.effort_unit if unit == "1" else f"{prepared.effort_unit} {turned}"


def _row(candidate: _Candidate, x: np.ndarray, labels: np.ndarray, samples: float) -> FrictionRow:
    residual, size = candidate.residual(x), float(np.linalg.norm(candidate.measured))
    unseen = np.concatenate(
        [candidate.residual(candidate.fit(labels != label, x))[labels == label] for label in np.unique(labels)]
    )
    fit = samples * float(np.log(np.mean(residual**2)))
    return FrictionRow(
        candidate.name,
        dict(zip(candidate.names, map(float, candidate.shown(x)), strict=True)),
        dict(zip(candidate.names, map(float, candidate.shown(_deviation(candidate, x))), strict=True)),
        dict(zip(candidate.names, candidate.units, strict=True)),
        float(np.linalg.norm(residual)) / size,
        float(np.linalg.norm(unseen)) / size,
        fit + 2 * len(x),
        fit + len(x) * float(np.log(samples)),
        candidate.doubts(x),
    )


def _deviation(candidate: _Candidate, x: np.ndarray) -> np.ndarray:
    """Standard deviations (m,) of the unknowns; NaN where the log does not determine them."""
    gradient, residual = candidate.gradient(x), candidate.residual(x)
    size = np.linalg.norm(gradient, axis=0)
    if np.any(size == 0) or np.linalg.cond(gradient / size) > INDISTINGUISHABLE:
        return np.full(len(x), np.nan)
    lags = min(memory(residual).newey_west_lags, len(residual) // 2)
    return np.sqrt(np.diag(newey_west(gradient / size, residual, lags=lags))) / size


def _choice(rows: Sequence[FrictionRow]) -> tuple[str | None, str]:
    """The preferred law and why. rows: by BIC."""
    sound = [row for row in rows if not row.doubts]
    if not sound:
        return None, "None of the laws has values that mean what it says."
    alike = [row for row in sound if row.bic - sound[0].bic < EQUAL]
    best = min(alike, key=lambda row: len(row.values))
    others = [row for row in sound if row is not best]
    if not others:
        return best.name, f"{best.name} is preferred: it alone has values that mean what it says."
    second = others[0]
    return best.name, (
        f"{best.name} is preferred: BIC {second.bic - best.bic:+.1f} for {second.name}, the next; error on blocks left "
        f"out {100 * best.unseen_error:.2f} % against {100 * second.unseen_error:.2f} %."
    )
