"""lmfit in and out: what a user says of the unknowns, and a solved problem that he goes on with in lmfit.

In: an `lmfit.Parameters` gives first values, bounds and what is held (``vary=False``). Out: an `lmfit.Minimizer` of the
same residuals, with their exact gradient, and a `MinimizerResult` at the solution, whose deviations allow for the
colour of the residuals. `lmfit.fit_report`, `lmfit.conf_interval` and `Minimizer.emcee` take these.

Source: Newville et al., LMFIT (2014), doi 10.5281/zenodo.11813.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from identification.inference.problem import FitProblem, FitSearch, Solution, identifier

if TYPE_CHECKING:
    from lmfit import Minimizer, Parameters


class Bounded(Protocol):
    """What has bounds: an unknown, or a parameter of a law."""

    @property
    def name(self) -> str: ...
    @property
    def minimum(self) -> float: ...
    @property
    def maximum(self) -> float: ...


Some = TypeVar("Some", bound=Bounded)


@dataclass(frozen=True)
class Given:
    """What a user says of unknowns, by their names as lmfit takes them: first values, bounds, and values held."""

    first: Mapping[str, float] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    held: Mapping[str, float] = field(default_factory=dict)

    def check(self, names: Iterable[str]) -> None:
        """Refuse names that are none of these unknowns. StickslipError: which name is unknown."""
        identifiers = [identifier(name) for name in names]
        for name in self.bounds:
            refuse_unknown(name, identifiers, f"The fit has no unknown '{name}'; it has {', '.join(identifiers)}.")

    def fixed(self, problem: FitProblem) -> dict[str, float]:
        """Unknowns of a problem that are held."""
        pairs = {unknown.name: identifier(unknown.name) for unknown in problem.unknowns}
        return {name: self.held[key] for name, key in pairs.items() if key in self.held}

    def start(self, problem: FitProblem) -> np.ndarray:
        """First values (m,) of the unknowns of a problem; its own where nothing is said."""
        return self.put([unknown.name for unknown in problem.unknowns], problem.start(), self.first)

    def put(self, names: Sequence[str], values: np.ndarray, held: Mapping[str, float] | None = None) -> np.ndarray:
        """Values (m,) of these unknowns with ``held`` (those of the user if None) in place."""
        held = self.held if held is None else held
        return np.array([held.get(identifier(name), value) for name, value in zip(names, values, strict=True)])

    def bounded(self, unknowns: Iterable[Some]) -> tuple[Some, ...]:
        """Unknowns with the bounds that both sides allow. StickslipError: there is nothing between them."""
        limited = []
        for unknown in unknowns:
            low, high = self.bounds.get(identifier(unknown.name), (-np.inf, np.inf))
            low, high = max(low, unknown.minimum), min(high, unknown.maximum)
            if low >= high:
                raise StickslipError(
                    f"The bounds of '{unknown.name}' leave nothing: it must lie in "
                    f"[{unknown.minimum:g}, {unknown.maximum:g}]. Widen them, or hold it (vary=False) at a value."
                )
            is_bounded = identifier(unknown.name) in self.bounds
            limited.append(replace(unknown, minimum=low, maximum=high) if is_bounded else unknown)  # type: ignore[type-var]
        return tuple(limited)


NOTHING = Given()


def given(parameters: Mapping[str, Any] | None) -> Given:
    """First values, bounds and held values from `lmfit.Parameters`. StickslipError: a parameter is an expression of
    others, or has no finite value though it is held."""
    first, bounds, fixed = {}, {}, {}
    for name, p in (parameters or {}).items():
        if p.expr is not None:
            raise StickslipError(
                f"The parameter '{name}' is the expression '{p.expr}', whose derivative is not known here. Give it "
                "a value, or bounds."
            )
        bounds[name] = (float(p.min), float(p.max)) if p.vary else (-np.inf, np.inf)
        if p.vary and np.isfinite(p.value):
            first[name] = float(p.value)
        elif not p.vary:
            if not np.isfinite(p.value):
                raise StickslipError(f"The parameter '{name}' is held (vary=False) without a value. Give it one.")
            fixed[name] = float(p.value)
    return Given(first, bounds, fixed)


def lmfit_alone() -> ModuleType:
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


def lmfit_parameters(problem: FitProblem, values: np.ndarray, free: np.ndarray) -> Parameters:
    """The unknowns as `lmfit.Parameters`, in their order. values: (m,); free: (m,) whether each is to be varied."""
    parameters = lmfit_alone().Parameters()
    for unknown, value, vary in zip(problem.unknowns, values, free, strict=True):
        name = identifier(unknown.name)
        parameters.add(name, value=float(value), min=unknown.minimum, max=unknown.maximum, vary=bool(vary))
    return parameters


def values_of(parameters: Parameters) -> np.ndarray:
    """Values (m,) of `lmfit.Parameters`, in their order."""
    return np.array([parameter.value for parameter in parameters.values()])


@dataclass(frozen=True, eq=False)
class Solved:
    """A solved problem, and the covariance (m, m) of all its unknowns that is stated (0 for those held)."""

    problem: FitProblem
    solution: Solution
    covariance: np.ndarray

    def to_lmfit(self) -> tuple[Minimizer, Any]:
        """The problem as an `lmfit.Minimizer`, and its solution as a `MinimizerResult` with the stated deviations.

        Residuals are whitened (in deviations of the noise where it is known); the last rows are those of priors.
        """
        problem, names = self.problem, [identifier(unknown.name) for unknown in self.problem.unknowns]
        free = np.array([unknown.name not in self.solution.fixed for unknown in problem.unknowns])
        search = FitSearch(problem, [True] * len(names), None)

        def residual(p: Parameters) -> np.ndarray:
            return search.at(values_of(p))[0]

        def gradient(p: Parameters) -> np.ndarray:
            return search.at(values_of(p))[1][:, [parameter.vary for parameter in p.values()]]

        parameters = lmfit_parameters(problem, self.solution.values, free)
        minimizer = lmfit_alone().Minimizer(
            residual, parameters, scale_covar=not problem.noise_known, nan_policy="propagate", Dfun=gradient
        )
        result = minimizer.minimize(method="leastsq")
        result.covar = self.covariance[np.ix_(free, free)]
        deviations = dict(zip(result.var_names, np.sqrt(np.diag(result.covar)), strict=True))
        for i, name in enumerate(result.var_names):
            parameter = result.params[name]
            parameter.stderr = float(deviations[name])
            parameter.correl = {
                partner: float(result.covar[i, j] / (deviations[name] * deviations[partner]))
                for j, partner in enumerate(result.var_names)
                if j != i
            }
        result.errorbars = True
        return minimizer, result
