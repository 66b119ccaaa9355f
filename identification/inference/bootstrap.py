"""Block bootstrap: the fit repeated on blocks drawn with replacement, in parallel, each a search of its own.

A draw takes from every log as many of its clusters (slip segments, cycles) as it has, with replacement: residuals may
depend on one another within a cluster in any way, and the drive speeds stay as they were. Unknowns with a prior get
another prior value each time, drawn from the prior: what is known of the rig is as random as the data. Each draw has
random numbers of its own, by seed and number, so that the result does not depend on how many processes share the work.

Source: Kuensch (1989), Ann. Statist. 17, 1217 (blocks); Davison & Hinkley (1997), Bootstrap Methods, section 3.2
(strata).
"""

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.processes import in_processes
from identification.inference.defaults import DRAWS, SEED
from identification.inference.problem import Evaluation, FitProblem, Solution, Unknown, Wrapped, solve
from identification.inference.profile import Interval

LEAST = 20  # draws below which there is no standard deviation
PATIENCE = 5.0  # s of remaining work below which processes, which take a second or two to start, do not pay
SEARCH = 1e-6  # relative, of each draw's search: far below the spread of the draws


@dataclass(frozen=True, eq=False)
class Draws:
    """Estimates from resampled blocks.

    values: (k, m) of all unknowns; requested: number of draws asked for; failed: those without a fit; interrupted:
    whether the rest was left out; blocks: G/(G - 1) of the clusters of a log, by which a drawn variance is too small.
    """

    values: np.ndarray
    requested: int
    failed: int
    interrupted: bool
    blocks: float

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of all unknowns, (m, m)."""
        return np.atleast_2d(np.cov(self.values, rowvar=False)) * self.blocks

    def interval(self, index: int, name: str, level: float = 0.95) -> Interval:
        """Percentile interval of the unknown number ``index``."""
        low, high = np.quantile(self.values[:, index], [0.5 - level / 2, 0.5 + level / 2])
        return Interval(name, level, float(low), float(high), "bootstrap")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of missing draws."""
        warnings = []
        if self.interrupted:
            warnings.append(f"The bootstrap was stopped: {len(self.values)} of {self.requested} draws count.")
        if self.failed > 0.05 * (len(self.values) + self.failed):
            warnings.append(
                f"{self.failed} of {len(self.values) + self.failed} draws of the bootstrap could not be fitted: the "
                "standard deviations are those of the others."
            )
        return tuple(warnings)


def bootstrap(
    problem: FitProblem,
    solution: Solution,
    *,
    draws: int = DRAWS,
    seed: int = SEED,
    processes: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Draws:
    """Refit resampled blocks ``draws`` times. processes: None for as many as there are cores, if they pay.

    An interrupt (Ctrl-C) ends it with the draws that are finished, if these are `LEAST` or more. StickslipError: fewer
    than `LEAST` draws asked for or fitted, or too few clusters.
    """
    if draws < LEAST:
        raise StickslipError(f"A bootstrap of {draws} draws gives no standard deviation; take 200.")
    strata = _strata(solution.evaluation)
    work = _Work(problem, solution.values, strata, seed)
    estimates: dict[int, np.ndarray | None] = {}
    interrupted = False
    try:
        for number, estimate in _estimates(work, draws, processes):
            estimates[number] = estimate
            if progress is not None:
                progress(len(estimates) / draws)
    except KeyboardInterrupt:
        if sum(estimate is not None for estimate in estimates.values()) < LEAST:
            raise
        interrupted = True
    good = [estimate for _, estimate in sorted(estimates.items()) if estimate is not None]
    if len(good) < LEAST:
        raise StickslipError(
            f"Only {len(good)} of {len(estimates)} draws of the bootstrap could be fitted: the logs hardly determine "
            "the law. Take the jackknife (--covariance jackknife) and see its warnings."
        )
    sizes = np.array([len(labels) for labels in strata])
    return Draws(
        np.array(good), draws, len(estimates) - len(good), interrupted, float(np.sum(sizes) / np.sum(sizes - 1))
    )


def _strata(evaluation: Evaluation) -> list[np.ndarray]:
    """Clusters by log; logs of one cluster share a stratum, as drawing from one is no drawing."""
    strata, lone = [], []
    for log in np.unique(evaluation.log):
        labels = np.unique(evaluation.cluster[evaluation.log == log])
        (strata if len(labels) > 1 else lone).append(labels)
    if lone:
        strata.append(np.concatenate(lone))
    count = sum(len(labels) for labels in strata)
    if count < 5 or any(len(labels) < 2 for labels in strata):
        raise StickslipError(
            f"A bootstrap draws from independent stretches of the logs, and there are {count} (five or more are "
            "needed, two in a log). Record longer, or take --covariance hac."
        )
    return strata


@dataclass(frozen=True, eq=False)
class _Work:
    """All that a process needs to make any draw."""

    problem: FitProblem
    start: np.ndarray
    strata: list[np.ndarray]
    seed: int

    def draw(self, number: int) -> np.ndarray | None:
        """Estimate (m,) of one draw, None where there is no fit."""
        rng = np.random.default_rng([self.seed, number])
        chosen = np.concatenate([rng.choice(labels, len(labels)) for labels in self.strata])
        try:
            drawn = self.problem.resampled(chosen)
            drawn = _KnownElsewise(drawn, tuple(_moved(unknown, rng) for unknown in drawn.unknowns))
            solution = solve(drawn, self.start, tolerance=SEARCH)
        except StickslipError:
            return None
        return solution.values if solution.converged and np.all(np.isfinite(solution.values)) else None


@dataclass(frozen=True, eq=False)
class _KnownElsewise(Wrapped):
    """A problem whose priors have other values, drawn from them: those of the ``moved`` unknowns."""

    moved: tuple[Unknown, ...]

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        return self.moved

    def evaluate(self, x: np.ndarray) -> Evaluation:
        return self.problem.evaluate(x)


def _moved(unknown: Unknown, rng: np.random.Generator) -> Unknown:
    prior = unknown.prior
    if prior is None:
        return unknown
    value = prior.value + prior.standard_uncertainty * rng.standard_normal()
    return replace(unknown, prior=replace(prior, value=float(value)))


def _estimates(work: _Work, draws: int, processes: int | None) -> Iterator[tuple[int, np.ndarray | None]]:
    """Numbers and estimates of the draws as they are finished: the first here, the others in processes if these pay."""
    start = time.perf_counter()
    yield 0, work.draw(0)
    remaining = (time.perf_counter() - start) * (draws - 1)
    count = min(processes or os.cpu_count() or 1, draws - 1)
    if count < 2 or (processes is None and remaining < PATIENCE):
        for number in range(1, draws):
            yield number, work.draw(number)
        return
    for job, estimate in in_processes(work.draw, [(n,) for n in range(1, draws)], processes=count, threads=1):
        if isinstance(estimate, Exception):
            raise estimate
        yield job + 1, estimate
