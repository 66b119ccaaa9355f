"""Parameters of the linear inverse-dynamics model by (weighted) least squares.

    y = W theta + r,    theta = argmin |D (y - W theta)|,    D = diag(weights)

The standard deviations for white residuals, s^2 (W'W)^-1, are those that publications print; where residuals are
coloured they are too small, and those of Newey and West stand beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.uncertainty import newey_west, plain_covariance
from identification.one_dof.memory import Memory, memory
from identification.one_dof.recipe import EFFORT, Recipe
from identification.one_dof.signals import Prepared
from identification.one_dof.terms import KINDS, Term

INDISTINGUISHABLE = 1e8  # condition of the scaled regressors from which on terms cannot be told apart


@dataclass(frozen=True, eq=False)
class LinearFit:
    """values, deviation (Newey-West), white_deviation: (m,); residual: (k,) effort; condition: of the regressors in
    their units; memory: of the residual."""

    terms: tuple[Term, ...]
    values: np.ndarray
    deviation: np.ndarray
    white_deviation: np.ndarray
    residual: np.ndarray
    condition: float
    memory: Memory


@dataclass(frozen=True)
class Score:
    """How well a model explains a log. relative_error: |r|/|y|; explained: share of the variance of the effort."""

    relative_error: float
    explained: float


def regressors(prepared: Prepared, terms: Sequence[Term]) -> np.ndarray:
    """Decimated regressors (k, m)."""
    return prepared.thinned(lambda s: np.stack([term.regressor(s) for term in terms], axis=1))


def check_terms(recipe: Recipe, prepared: Prepared) -> None:
    """Refuse terms that the log has no signal for, or that this kind of motion does not have.

    Raises:
        StickslipError: which, and what is missing.
    """
    if not recipe.terms:
        raise StickslipError(f"Recipe {recipe.path.name} has no [terms]; it is one for 'stickslip slips'.")
    for term in recipe.terms:
        needs = KINDS[term.kind].needs
        if needs and needs not in recipe.signals:
            raise StickslipError(
                f"{recipe.path.name}: term '{term.name}' ({term.kind}) needs the signal '{needs}'. Add "
                f"[signals.{needs}]."
            )
        if term.unit(prepared.turning) is None:
            raise StickslipError(
                f"{recipe.path.name}: term '{term.name}' ({term.kind}) is one of a body that turns; this one slides."
            )
    for name in (EFFORT, "velocity"):
        if name not in recipe.signals:
            raise StickslipError(f"{recipe.path.name} has no signal '{name}'. Add [signals.{name}].")


def fit_linear(prepared: Prepared, terms: tuple[Term, ...]) -> LinearFit:
    """Least squares.

    Raises:
        StickslipError: fewer samples than parameters, or terms that the log cannot tell apart.
    """
    weight = prepared.weight
    plain, measured = regressors(prepared, terms), prepared.effort
    if len(measured) <= len(terms):
        raise StickslipError(
            f"{len(measured)} samples of {prepared.source} cannot determine {len(terms)} parameters. Lower "
            "'least_speed' or 'decimate', or record a longer log."
        )
    if np.ptp(measured) == 0:
        raise StickslipError(
            f"{prepared.source}: the effort is {measured[0]:g} {prepared.effort_unit} throughout, which says nothing "
            "of a model. Check its column."
        )
    design, effort = plain * weight[:, None], measured * weight
    _check_rank(design, terms, prepared.source)
    values = np.linalg.lstsq(design, effort, rcond=None)[0]
    residual = effort - design @ values
    found = memory(residual)
    lags = min(found.newey_west_lags, len(residual) // 2)
    return LinearFit(
        terms,
        values,
        np.sqrt(np.diag(newey_west(design, residual, lags=lags))),
        np.sqrt(np.diag(plain_covariance(design, residual))),
        measured - plain @ values,
        float(np.linalg.cond(design)),
        found,
    )


def score(prepared: Prepared, terms: Sequence[Term], values: np.ndarray) -> Score:
    """How well given parameters (m,) explain a log, seen or unseen."""
    return score_of(prepared.effort, prepared.effort - regressors(prepared, terms) @ values)


def score_of(effort: np.ndarray, residual: np.ndarray) -> Score:
    """Score of a residual (k,) of an effort (k,)."""
    return Score(
        float(np.linalg.norm(residual) / np.linalg.norm(effort)),
        float(1 - np.mean(residual**2) / np.var(effort)),
    )


def blocks(count: int, number: int) -> np.ndarray:
    """Labels (count,) of ``number`` adjacent blocks of one length."""
    return np.arange(count) * number // count


def _check_rank(design: np.ndarray, terms: Sequence[Term], source: str) -> None:
    """Terms whose regressors are sums of others are named: those that the weakest direction is made of."""
    size = np.linalg.norm(design, axis=0)
    still = [term.name for term, length in zip(terms, size, strict=True) if length == 0]
    if still:
        raise StickslipError(f"{source} says nothing of {', '.join(still)}: the regressor is zero throughout.")
    _, strength, directions = np.linalg.svd(design / size, full_matrices=False)
    if strength[0] > INDISTINGUISHABLE * strength[-1]:
        share = np.abs(directions[-1])
        names = [term.name for term, part in zip(terms, share, strict=True) if part > 0.1 * share.max()]
        raise StickslipError(
            f"{source} cannot tell the terms {', '.join(names)} apart: each is a sum of the others. Leave one out."
        )
