"""Cramer-Rao bound: what no unbiased estimator can do better with these sensors, and how near the fit comes to it.

Where the noise is known, residuals have unit variance and the information of rows and priors is G'G + P: the bound is
its inverse. Efficiency is the bound's variance over the stated one, parameter by parameter; it falls short of 1 where
residuals are larger or more coloured than the sensors alone explain. The bound is that of the data the estimator uses:
one that leaves the stick phases out has a larger one.
"""

from __future__ import annotations

import numpy as np

from identification.inference.problem import Problem, Solution, information


def cramer_rao(problem: Problem, solution: Solution) -> np.ndarray | None:
    """Bound (m, m) of the covariance of all unknowns; None where the noise of the sensors is not known."""
    if not problem.noise_known:
        return None
    return np.linalg.inv(information(problem, solution.evaluation))
