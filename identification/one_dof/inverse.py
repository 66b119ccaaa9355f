"""Inverse dynamics of one degree of freedom: a recipe and a log give parameters, and what to think of them."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.digits import value_with_sd
from identification.one_dof.comparison import FrictionComparison, compare_friction
from identification.one_dof.estimate import (
    LinearFit,
    Score,
    blocks,
    check_terms,
    fit_linear,
    regressors,
    score,
    score_of,
)
from identification.one_dof.recipe import Recipe
from identification.one_dof.signals import Prepared, prepare
from identification.one_dof.terms import KINDS
from rig_io.readers import read_table

POOR = 0.8  # of the variance: a model that explains less does not describe the machine
UNSEEN_WORSE = 1.5  # times the error of the fit: the parameters belong to the log, not to the machine
TOO_SMALL = 1.5  # times: white standard deviations smaller than that by this are worth a warning
BLOCKS = 8


@dataclass(frozen=True)
class Estimate:
    """One parameter. standard_deviation: with the colour of the residuals (Newey-West); white_deviation: as if they
    were white, as publications print it."""

    name: str
    term: str
    value: float
    unit: str
    standard_deviation: float
    white_deviation: float

    @property
    def factor(self) -> float:
        """By how much the white standard deviation is too small."""
        return self.standard_deviation / self.white_deviation if self.white_deviation > 0 else 1.0


@dataclass(frozen=True)
class InverseResult:
    """What a log says of a model. unseen: score of blocks of this log left out in turn; held_out: by log; memory: s
    until the residual forgets; effective_samples: how many independent ones the samples are worth; verdicts: in words.
    """

    title: str
    source: str
    log: str
    samples: int
    estimates: tuple[Estimate, ...]
    score: Score
    unseen: Score
    held_out: dict[str, Score]
    condition: float
    neighbour_correlation: float
    memory: float
    effective_samples: float
    laws: FrictionComparison | None
    verdicts: tuple[str, ...]

    def __getitem__(self, name: str) -> float:
        """Value of a parameter."""
        return next(e.value for e in self.estimates if e.name == name)

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return dataclasses.asdict(self)


@dataclass(frozen=True, eq=False)
class InverseRun:
    """A result with the signals behind it, for figures."""

    result: InverseResult
    prepared: Prepared
    fit: LinearFit


def inverse_dynamics(
    recipe: Recipe, log: str | os.PathLike[str], held_out: Sequence[str | os.PathLike[str]] = ()
) -> InverseRun:
    """Fit the recipe's terms to a log, judge them, and score other logs with the same values.

    Raises:
        StickslipError: a log cannot be read or does not fit the recipe; terms that the log cannot tell apart.
    """
    prepared = prepare(recipe, read_table(log))
    check_terms(recipe, prepared)
    fit = fit_linear(prepared, recipe.terms)
    others = {
        os.fspath(other): score(prepare(recipe, read_table(other)), recipe.terms, fit.values) for other in held_out
    }
    here = score_of(prepared.effort, fit.residual)
    unseen = _unseen(prepared, fit)
    laws = compare_friction(recipe, prepared)
    columns = (recipe.terms, fit.values, fit.deviation, fit.white_deviation)
    estimates = tuple(
        Estimate(t.name, t.kind, float(value), str(t.unit(prepared.turning)), float(sd), float(white))
        for t, value, sd, white in zip(*columns, strict=True)
    )
    verdicts = (
        *_on_fit(here, unseen, others),
        *_on_values(estimates),
        *_on_colour(fit, estimates, prepared.step),
        *((laws.reason, *laws.aside) if laws else ()),
        *prepared.notes,
    )
    result = InverseResult(
        recipe.title,
        recipe.source,
        os.fspath(log),
        len(fit.residual),
        estimates,
        here,
        unseen,
        others,
        fit.condition,
        fit.memory.first,
        fit.memory.lags * prepared.step,
        fit.memory.samples,
        laws,
        verdicts,
    )
    return InverseRun(result, prepared, fit)


def _unseen(prepared: Prepared, fit: LinearFit) -> Score:
    """Score of blocks of the log, each with the values from the others."""
    weight, measured = prepared.weight, prepared.effort
    design = regressors(prepared, fit.terms)
    label = blocks(len(measured), BLOCKS)
    residual = np.empty_like(measured)
    for block in range(BLOCKS):
        rest = label != block
        values = np.linalg.lstsq(design[rest] * weight[rest, None], measured[rest] * weight[rest], rcond=None)[0]
        residual[~rest] = measured[~rest] - design[~rest] @ values
    return score_of(measured, residual)


def _on_fit(here: Score, unseen: Score, others: dict[str, Score]) -> list[str]:
    said = []
    if here.explained < POOR:
        said.append(
            f"Poor fit: the residual is {100 * here.relative_error:.0f} % of the effort, the model fits "
            f"{100 * (1 - here.relative_error):.0f} % of it; {100 * here.explained:.0f} % of its variance explained. "
            "That values can be reproduced does not make them valid: mend the model or the log before you use them "
            "(effort sensor, delay between the signals, play, missing terms)."
        )
    for name, other in {"blocks of this log left out in turn": unseen, **others}.items():
        if other.explained < POOR <= here.explained or other.relative_error > UNSEEN_WORSE * here.relative_error:
            said.append(
                f"Worse on what the fit has not seen: {name}, error {100 * other.relative_error:.0f} % against "
                f"{100 * here.relative_error:.0f} %, {100 * other.explained:.0f} % of the variance explained."
            )
    return said


def _on_values(estimates: Sequence[Estimate]) -> list[str]:
    said = []
    for e in estimates:
        if KINDS[e.term].positive and e.value < 0:
            said.append(
                f"{e.name} = {e.value:.4g} {e.unit} is below zero, which {KINDS[e.term].meaning} cannot be: check the "
                "signs of effort and motion, or leave the term out."
            )
        elif abs(e.value) < 1.96 * e.standard_deviation:
            said.append(f"{e.name} cannot be told from zero: {value_with_sd(e.value, e.standard_deviation, e.unit)}.")
    return said


def _on_colour(fit: LinearFit, estimates: Sequence[Estimate], step: float) -> list[str]:
    factors = {e.name: e.factor for e in estimates}
    if fit.memory.white or max(factors.values()) < TOO_SMALL:
        return []
    told = ", ".join(f"{name} {factor:.1f}" for name, factor in factors.items())
    return [
        f"The residuals are coloured (neighbours {fit.memory.first:+.2f}, memory {fit.memory.lags * step:.2g} s: "
        f"{len(fit.residual)} samples are worth {fit.memory.samples:.0f}). Standard deviations for white noise are too "
        f"small by {told}; those of Newey and West are given."
    ]
