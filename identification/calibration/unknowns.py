"""What is sought: parameters of a model with first values, bounds and priors, and how the search scales them.

A parameter whose sign is known is sought by its logarithm, within e^-3.5 to e^3.5 of its first value unless bounds are
declared; angles and what begins at zero are sought as they are. Without bounds one bad step gives no finite motion.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from identification.inference.problem import Evaluation, FitProblem, Prior, Unknown, Wrapped

REACH = 3.5  # powers of e about the first value within which a parameter is sought
BOX = 0.7  # powers of e, or rad, about the first value from which the first guesses are drawn

Bounds = tuple[float, float]


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that is sought. first: value; unknown: with its bounds; logarithmic: whether its sign is known."""

    first: float
    unknown: Unknown
    logarithmic: bool

    @property
    def box(self) -> Bounds:
        """Between which first guesses are drawn: about the first value, or between bounds where that says nothing."""
        low, high = self.unknown.minimum, self.unknown.maximum
        if self.logarithmic:
            ends = sorted((self.first * math.exp(-BOX), self.first * math.exp(BOX)))
        elif self.first == 0 and self.unknown.unit != "rad":
            ends = [low, high] if math.isfinite(high - low) else [0.0, 0.0]
        else:
            size = BOX * (1.0 if self.unknown.unit == "rad" else abs(self.first))
            ends = [self.first - size, self.first + size]
        return max(ends[0], low), min(ends[1], high)

    def spread(self, count: int, generator: np.random.Generator) -> np.ndarray:
        """(count,) guesses in the box, one in each of so many parts of it."""
        share = (np.arange(count) + generator.uniform(size=count)) / count
        low, high = self.box
        return (
            np.sign(low) * np.abs(low) ** (1 - share) * np.abs(high) ** share
            if self.logarithmic
            else low + share * (high - low)
        )

    def span(self, value: float) -> float:
        """Length of the box in units in which a slope at ``value`` holds."""
        low, high = self.box
        return abs(value) * abs(math.log(high / low)) if self.logarithmic else high - low


def free_parameters(
    fmu: Fmu,
    free: Sequence[str],
    held: Mapping[str, float],
    bounds: Mapping[str, Bounds],
    priors: Mapping[str, tuple[float, float]],
) -> tuple[FreeParameter, ...]:
    """The parameters ``free`` of an FMU, which begin at ``held`` or their default. priors: value, standard deviation.
    StickslipError: an unknown or structural parameter, one that is named twice, a first value outside its bounds."""
    named = (*free, *held, *bounds, *priors)
    for name in named:
        _check(fmu, name, [*fmu.parameters, *fmu.states, *fmu.memories])
    if states := [name for name in free if name in fmu.states]:
        raise StickslipError(
            f"'{states[0]}' is a state. Its start is sought as it is, or name it: --start {states[0]}."
        )
    twice = sorted({name for name in free if free.count(name) > 1})
    if twice:
        raise StickslipError(f"'{twice[0]}' is free twice.")
    for name in (*bounds, *priors):
        if name not in free:
            raise StickslipError(f"'{name}' has a bound or a prior and is not free. Add it to --free, or hold it.")
    return tuple(_free(fmu, name, held.get(name), bounds.get(name), priors.get(name)) for name in free)


def refuse_arrays(fmu: Fmu, names: Sequence[str]) -> None:
    """Raises StickslipError: a state of the FMU, or one of ``names``, is an array or an element of one."""
    for name in (*names, *fmu.states):
        variable = fmu.variables.get(owner(name, fmu.variables))
        # a coupled system has no variables for the elements of its units' states
        if variable.shape if variable is not None else name in fmu.states:
            raise StickslipError(
                f"'{name}' of '{fmu.description.modelName}' is an array or an element of one. A calibration takes "
                "models whose states are single numbers, and compares and seeks such numbers."
            )


def _check(fmu: Fmu, name: str, known: Sequence[str]) -> None:
    refuse_arrays(fmu, [name])
    variable = fmu.variables.get(name)
    if variable is not None and variable.causality == "structuralParameter":
        raise StickslipError(
            f"'{name}' is a structural parameter, on which sizes of arrays depend: it cannot be sought. Load the FMU "
            "with another value of it."
        )
    refuse_unknown(name, known, f"'{fmu.description.modelName}' has no parameter '{name}'.")


def _free(
    fmu: Fmu, name: str, value: float | None, bounds: Bounds | None, prior: tuple[float, float] | None
) -> FreeParameter:
    variable = fmu.variables[name]
    unit, first = str(variable.unit or "1"), float(variable.start or 0.0) if value is None else float(value)
    declared = (getattr(variable, "min", None), -math.inf), (getattr(variable, "max", None), math.inf)
    least, most = (float(text) if text is not None else end for text, end in declared)
    low, high = bounds or (least, most)
    low, high = max(low, least), min(high, most)
    if not low <= first <= high or low == high:
        raise StickslipError(
            f"'{name}' begins at {first:g} {unit}, outside of its bounds {low:g} to {high:g}. Give another first value "
            f"(--set {name}=...) or other bounds."
        )
    logarithmic = first != 0 and unit != "rad" and (low >= 0 or high <= 0 or bounds is None)
    if logarithmic:
        reach = sorted((first * math.exp(-REACH), first * math.exp(REACH)))
        low, high = max(low, reach[0]), min(high, reach[1])
    elif unit == "rad" and bounds is None:
        low, high = max(low, first - 2 * math.pi), min(high, first + 2 * math.pi)
    known = Prior(name, prior[0], unit, prior[1], "given") if prior else None
    return FreeParameter(first, Unknown(name, unit, low, high, str(variable.description or ""), known), logarithmic)


@dataclass(frozen=True, eq=False)
class Scaled(Wrapped):
    """A problem whose unknowns are sought by their logarithms where ``signs`` (m,) are not 0. Priors are taken to first
    order: the search needs no more."""

    signs: np.ndarray

    @property
    def unknowns(self) -> tuple[Unknown, ...]:  # type: ignore[override]  # those of the problem, scaled
        return tuple(_scaled(one, sign) for one, sign in zip(self.problem.unknowns, self.signs, strict=True))

    def scaled(self, x: np.ndarray) -> np.ndarray:
        """The unknowns (m,) as they are sought."""
        return np.where(self.signs != 0, np.log(np.maximum(np.abs(x), np.finfo(float).tiny)), x)

    def natural(self, x: np.ndarray) -> np.ndarray:
        """The unknowns (m,) as they are."""
        return np.where(self.signs != 0, self.signs * np.exp(np.where(self.signs != 0, x, 0.0)), x)

    def start(self) -> np.ndarray:
        return self.scaled(self.problem.start())

    def residual(self, x: np.ndarray) -> np.ndarray:
        return self.problem.residual(self.natural(x))

    def evaluate(self, x: np.ndarray) -> Evaluation:
        natural = self.natural(x)
        evaluation = self.problem.evaluate(natural)
        return replace(evaluation, gradient=evaluation.gradient * np.where(self.signs != 0, natural, 1.0))


def signs_of(problem: FitProblem) -> np.ndarray:
    """(m,) sign of the unknowns that are sought by their logarithms: those whose bounds lie on one side of zero."""
    low, high = problem.limits
    one_sided = np.isfinite(low) & np.isfinite(high) & (np.sign(low) * np.sign(high) > 0)
    return np.where(one_sided, np.sign(low), 0.0)


def _scaled(unknown: Unknown, sign: float) -> Unknown:
    if not sign:
        return unknown
    tiny = np.finfo(float).tiny
    low, high = sorted(math.log(max(abs(end), tiny)) for end in (unknown.minimum, unknown.maximum))
    prior = unknown.prior
    if prior is not None:
        value = max(abs(prior.value), tiny)
        prior = replace(prior, value=math.log(value), standard_uncertainty=prior.standard_uncertainty / value)
    return replace(unknown, minimum=low, maximum=high, prior=prior)
