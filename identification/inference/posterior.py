"""The posterior of a solved problem, by Markov chains: what is known beforehand times the likelihood of the residuals.

    ln p(x) = -1/2 [S(q*, c) + priors(c) + readings(x)],    q* = q^(c) + C (q - q^(c)),    C' H C = V^-1

x = (q, c): q the unknowns of which nothing is known beforehand (flat within their bounds), c those with a prior. Where
residuals are coloured the plain likelihood is too narrow; C stretches it about its ridge q^(c) until its curvature H in
q is that of the covariance V that allows for the colour (curvature adjustment). Its shape stays, and so do open sides.

Four of five proposals come from Student's distribution about the solution: near it nearly all are taken, so that steps
hardly depend on those before. Some of these are drawn wider: a skewed posterior reaches farther than the distribution
that touches it at the solution, and a walker out there would stay. The others are differences of walkers, which reach
what that does not. Chains count when they are longer than `LENGTHS` autocorrelation times; shorter ones are refused.

Sources: Foreman-Mackey et al. (2013), PASP 125, 306 (emcee); Hesterberg (1995), Technometrics 37, 185 (wider draws);
ter Braak & Vrugt (2008), Stat. Comput. 18, 435 (differences); Goodman & Weare (2010), CAMCoS 5, 65 (autocorrelation);
Ribatet, Cooley & Davison (2012), Stat. Sinica 22, 813 (curvature adjustment).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Tabular
from identification.inference.adjustment import ConstantReading
from identification.inference.problem import FitProblem, Solution, prior_precision

if TYPE_CHECKING:
    import pandas
    from emcee import EnsembleSampler

WALKERS = 32
LENGTHS = 50  # autocorrelation times that a chain must last, the advice of emcee
PACE = 25  # steps between two looks at the autocorrelation
STEPS = 1000  # the most that are made
FREEDOM = 20.0  # of Student's distribution: its tails are a little heavier than those of what it proposes for
INDEPENDENT = 0.8  # of the steps
WIDE, WIDER = 0.15, 3.0  # the share of them that is drawn wider, and how many times
QUANTILES = (0.025, 0.16, 0.5, 0.84, 0.975)
AT_EDGE = 0.01  # of the samples within as much of the range of a search from its bound: the data do not close that side


@dataclass(frozen=True)
class Marginal:
    """One unknown. quantiles: at `QUANTILES`; autocorrelation: steps; open_side: "below", "above", "below and above" or
    "": where the posterior reaches the bound of the search."""

    name: str
    unit: str
    mean: float
    standard_deviation: float
    quantiles: tuple[float, ...]
    autocorrelation: float
    open_side: str = ""


@dataclass(frozen=True)
class Posterior(Tabular):
    """Marginals of all unknowns, in their order. accepted: share of the proposals; samples: (steps x walkers, m), None
    where it was read back."""

    marginals: tuple[Marginal, ...]
    walkers: int
    steps: int
    accepted: float
    seed: int
    samples: np.ndarray | None = field(default=None, repr=False, compare=False)

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each unknown: mean, deviation, quantiles, autocorrelation time in steps."""
        import pandas

        rows = [
            {
                "mean": marginal.mean,
                "sd": marginal.standard_deviation,
                **{f"{100 * level:g} %": value for level, value in zip(QUANTILES, marginal.quantiles, strict=True)},
                "unit": marginal.unit,
                "autocorrelation": marginal.autocorrelation,
                "open": marginal.open_side,
            }
            for marginal in self.marginals
        ]
        return pandas.DataFrame(
            rows, index=pandas.Index([marginal.name for marginal in self.marginals], name="unknown")
        )

    @property
    def independent(self) -> float:
        """How many independent samples the chains are worth, of the unknown that mixes worst."""
        return self.walkers * self.steps / max(marginal.autocorrelation for marginal in self.marginals)

    def _heading(self) -> str:
        return f"Posterior: {self.steps} steps of {self.walkers} walkers, {self.accepted:.0%} of the proposals taken"

    def _contents(self) -> Mapping[str, Any]:
        return {
            marginal.name: f"{marginal.quantiles[2]:.6g} ({marginal.quantiles[0]:.6g} to {marginal.quantiles[-1]:.6g})"
            for marginal in self.marginals
        }


def sample(
    target: Target, *, seed: int = 0, steps: int = STEPS, progress: Callable[[float], None] | None = None
) -> Posterior:
    """Sample a posterior, from draws of its proposal on. StickslipError: emcee is not installed, or the chains had not
    converged after ``steps``."""
    emcee = load_emcee()
    count = len(target.at)
    walkers = max(WALKERS, 2 * count + 2)
    random = np.random.RandomState(seed)
    moves = [
        (emcee.moves.MHMove(target.proposal), INDEPENDENT),
        (emcee.moves.DEMove(), 0.8 * (1 - INDEPENDENT)),
        (emcee.moves.DESnookerMove(), 0.2 * (1 - INDEPENDENT)),
    ]
    sampler = emcee.EnsembleSampler(walkers, count, target.log_probability, moves=moves)
    sampler.random_state = random.get_state()
    # emcee's wrapper of it prints the traceback of whatever ends the sampling, of an interrupt too
    sampler.log_prob_fn = target.log_probability
    state: Any = target.first(walkers, random)
    lengths = np.full(count, np.inf)
    while sampler.iteration < steps:
        state = sampler.run_mcmc(state, min(PACE, steps - sampler.iteration))
        with np.errstate(invalid="ignore"):
            lengths = emcee.autocorr.integrated_time(sampler.get_chain(), tol=0, quiet=True)
        lengths[~np.isfinite(lengths)] = np.inf  # of an unknown that no walker has moved yet
        if progress is not None:
            progress(min(sampler.iteration / min(LENGTHS * float(np.max(lengths)), steps), 1.0))
        if sampler.iteration > LENGTHS * np.max(lengths):
            return _posterior(target.problem, sampler, lengths, seed)
    worst = target.problem.unknowns[int(np.argmax(lengths))].name
    raise StickslipError(
        f"The chains have not converged: {sampler.iteration} steps are {sampler.iteration / np.max(lengths):.0f} "
        f"autocorrelation times of '{worst}', {LENGTHS} are needed. Allow more (in Python, steps="
        f"{1.2 * LENGTHS * np.max(lengths):.0f}), or bound what the logs leave open."
    )


def load_emcee() -> ModuleType:
    """The emcee package. StickslipError: it is not installed."""
    try:
        import emcee
    except ImportError as error:
        raise StickslipError("emcee is not installed. Install it: pip install 'stickslip[posterior]'") from error
    return emcee


def _posterior(problem: FitProblem, sampler: EnsembleSampler, lengths: np.ndarray, seed: int) -> Posterior:
    samples = np.asarray(sampler.get_chain(flat=True))
    marginals = []
    for unknown, values, length in zip(problem.unknowns, samples.T, lengths, strict=True):
        moments, quantiles = (float(np.mean(values)), float(np.std(values))), np.quantile(values, QUANTILES)
        open_side = _open_side(values, unknown.minimum, unknown.maximum)
        quantiles = tuple(quantiles.tolist())
        marginals.append(Marginal(unknown.name, unknown.unit, *moments, quantiles, float(length), open_side))
    accepted = float(np.mean(sampler.acceptance_fraction))
    return Posterior(tuple(marginals), sampler.nwalkers, sampler.iteration, accepted, seed, samples)


def _open_side(values: np.ndarray, low: float, high: float) -> str:
    """Where samples (n,) crowd at a finite bound of the search."""
    edge = AT_EDGE * np.ptp(values)
    sides = (
        ("below", np.isfinite(low) and np.mean(values - low < edge) > AT_EDGE / 2),
        ("above", np.isfinite(high) and np.mean(high - values < edge) > AT_EDGE / 2),
    )
    return " and ".join(name for name, reached in sides if reached)


class Target:
    """ln p about a solved problem, all of whose unknowns were searched, and proposals for it.

    covariance: (q, q) of the unknowns without a prior, the others being held; None for that of the residuals as they
    are. readings: what else is known of products of unknowns. spread: (m, m), covariance of the normal distribution
    that touches ln p at the solution. StickslipError: unknowns were held.
    """

    def __init__(
        self,
        problem: FitProblem,
        solution: Solution,
        covariance: np.ndarray | None = None,
        readings: Sequence[ConstantReading] = (),
    ) -> None:
        if solution.fixed:
            raise StickslipError(
                f"A posterior of unknowns that are held ({', '.join(solution.fixed)}) is none. Free them, or take "
                "--profile."
            )
        self.problem, self.at = problem, solution.values
        self.readings = _Readings(readings, [unknown.name for unknown in problem.unknowns])
        self.squares = problem.squares()
        point = solution.evaluation
        self.least = point.sum
        self.noise = 1.0 if problem.noise_known else point.sum / (len(point.residual) - point.eliminated - len(self.at))
        precision = prior_precision(problem)
        self.precision = np.diag(precision)
        self.prior = np.array([0.0 if u.prior is None else u.prior.value for u in problem.unknowns])
        self.flat = self.precision == 0.0
        curvature = point.gradient.T @ point.gradient / self.noise
        self.stretch = _stretch(curvature, self.flat, covariance)
        low, high = problem.limits
        # where nothing bounds an unknown but its search, proposals are as wide as that
        precision = precision + self.readings.curvature(self.at) + np.diag(12 / (high - low) ** 2)
        self.spread = np.linalg.inv(self.stretch.T @ curvature @ self.stretch + precision)
        self.root = np.linalg.cholesky(self.spread)

    def log_probability(self, x: np.ndarray) -> float:
        """ln p, up to a constant; minus infinity beyond the bounds and where there is no motion."""
        low, high = self.problem.limits
        stretched = self.at + self.stretch @ (x - self.at)
        if np.any(x < low) or np.any(x > high) or np.any(stretched < low) or np.any(stretched > high):
            return -np.inf
        try:
            total = (self.squares(stretched) - self.least) / self.noise
        except StickslipError:
            return -np.inf
        total += float(self.precision @ (x - self.prior) ** 2)
        total += self.readings.squares(x)
        return -0.5 * total if np.isfinite(total) else -np.inf

    def first(self, walkers: int, random: np.random.RandomState) -> np.ndarray:
        """Where the walkers begin (walkers, m)."""
        begun = []
        for _ in range(100 * walkers):
            x = self._drawn(1, random)[0]
            if np.isfinite(self.log_probability(x)):
                begun.append(x)
            if len(begun) == walkers:
                return np.array(begun)
        raise StickslipError("The model follows the logs nowhere near the solution: there is no posterior to sample.")

    def proposal(self, coordinates: np.ndarray, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
        """Independent of where the walkers (n, m) are; and ln of the ratio of densities, back over forth (n,)."""
        drawn = self._drawn(len(coordinates), random)
        return drawn, self._density(coordinates) - self._density(drawn)

    def _drawn(self, count: int, random: np.random.RandomState) -> np.ndarray:
        normal = random.standard_normal((count, len(self.at))) @ self.root.T
        width = np.where(random.random_sample((count, 1)) < WIDE, WIDER, 1.0)
        return self.at + width * normal / np.sqrt(random.chisquare(FREEDOM, (count, 1)) / FREEDOM)

    def _density(self, x: np.ndarray) -> np.ndarray:
        """ln of the density, up to a constant."""
        count = len(self.at)
        squares = np.sum(np.linalg.solve(self.root, (x - self.at).T) ** 2, axis=0) / FREEDOM
        narrow, wide = (-0.5 * (FREEDOM + count) * np.log1p(squares / width**2) for width in (1.0, WIDER))
        return np.logaddexp(np.log(1 - WIDE) + narrow, np.log(WIDE) - count * np.log(WIDER) + wide)


class _Readings:
    """Readings: products of powers of some unknowns, known with a deviation."""

    def __init__(self, readings: Sequence[ConstantReading], names: Sequence[str]) -> None:
        used = sorted({names.index(name) for reading in readings for name in reading.powers})
        rows = [[reading.powers.get(names[index], 0) / reading.deviation for index in used] for reading in readings]
        self.used, self.rows = used, np.array(rows).reshape(len(readings), len(used))
        self.values = np.array([np.log(reading.value) / reading.deviation for reading in readings])

    def squares(self, x: np.ndarray) -> float:
        """Sum of squares at x (m,), of logarithms in deviations."""
        missed = self.rows @ np.log(x[self.used]) - self.values
        return float(missed @ missed)

    def curvature(self, x: np.ndarray) -> np.ndarray:
        """Half the second derivative of it (m, m), where they are met."""
        slopes = np.zeros((len(self.rows), len(x)))
        slopes[:, self.used] = self.rows / x[self.used]
        return slopes.T @ slopes


def _stretch(curvature: np.ndarray, flat: np.ndarray, covariance: np.ndarray | None) -> np.ndarray:
    """x - solution -> where the likelihood is asked (m, m): q about its ridge, c as it is."""
    stretch = np.eye(len(flat))
    if covariance is None or not flat.any():
        return stretch
    block = curvature[np.ix_(flat, flat)]
    ridge = -np.linalg.solve(block, curvature[np.ix_(flat, ~flat)])  # dq^/dc
    lower, target = np.linalg.cholesky(block), np.linalg.cholesky(np.linalg.inv(covariance))
    adjusted = np.linalg.solve(lower.T, target.T)
    stretch[np.ix_(flat, flat)] = adjusted
    stretch[np.ix_(flat, ~flat)] = ridge - adjusted @ ridge
    return stretch
