"""Segments of one log whose parameters may move from one to the next, as a random walk.

    minimise  sum r^2 + sum_i |s_i+1 - x(t_i+1; s_i, p_i)|^2/meeting^2 + sum_i (p_i+1 - p_i)^2/(rate^2 (t_i+1 - t_i))

Solved by Gauss-Newton, this is the smoother of Rauch, Tung and Striebel with all its times at once: exact where motion
and measurement are linear in states and parameters. How fast a parameter walks is what makes the log likeliest,

    -2 ln L(rate) = min + ln det H(rate) + sum_i ln(rate^2 (t_i+1 - t_i)),     H = J'J,

by the slopes J at the solution; a rate that gains less than chance does is none.

Sources: Rauch, Tung, Striebel (1965), AIAA J. 3, 1445; Bell (1994), SIAM J. Optim. 4, 626 (Gauss-Newton as smoother);
Self, Liang (1987), JASA 82, 605 (a rate at the edge of what is possible: half of chi-squared).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.calibration.problem import SegmentProblem
from identification.calibration.untold import meeting
from identification.inference.problem import Evaluation, Wrapped
from identification.inference.uncertainty import inverse_information

CHANCE = 2.71  # of -2 ln L: so much is gained by chance in one of twenty constant parameters
LEAST, MOST, STEPS = 1e-2, 1e3, 51  # of the deviation of a constant parameter, over the log: rates that are tried
ROUNDS = 3  # over several parameters


@dataclass(frozen=True, eq=False)
class DriftProblem(Wrapped):
    """problem: each segment a log of its own; walks: (parameters, segments) places of the values among its unknowns;
    spans: (segments - 1,) s between the begins of segments; rates: (parameters,) per root of a second."""

    problem: SegmentProblem
    walks: np.ndarray
    spans: np.ndarray
    rates: np.ndarray

    @property
    def noise_known(self) -> bool:
        return True  # noise is part of what is weighed

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Rows of the segments, then of the walks."""
        here = self.problem.evaluate(x)
        rows = self.steps(len(x)) / np.repeat(self.rates, len(self.spans))[:, None]
        number = np.full(len(rows), len(self.problem.series) + 1)  # joints have the number before
        return Evaluation(
            np.concatenate([here.residual, rows @ x]),
            np.vstack([here.gradient, rows]),
            np.concatenate([here.cluster, number]),
            np.concatenate([here.log, number]),
            np.concatenate([here.slip, np.full(len(rows), np.nan)]),
        )

    def steps(self, count: int) -> np.ndarray:
        """(walks, count) steps of the parameters over the root of their time, by the unknowns."""
        rows = np.zeros((self.walks.size - len(self.walks), count))
        number, roots = np.arange(len(rows)), np.tile(np.sqrt(self.spans), len(self.walks))
        rows[number, self.walks[:, :-1].ravel()] = -1 / roots
        rows[number, self.walks[:, 1:].ravel()] = 1 / roots
        return rows

    def directions(self, x: np.ndarray) -> np.ndarray:
        """(m, k) in which segments still meet: the values of the parameters first, then start states."""
        return meeting(self.problem.evaluate(x), self.problem)

    def covariance(self, x: np.ndarray) -> np.ndarray:
        """(m, m) of all unknowns at a solution."""
        basis, here = self.directions(x), self.evaluate(x)
        rows = here.gradient[here.log != len(self.problem.series)]  # joints are met by the directions
        return basis @ inverse_information(rows @ basis) @ basis.T

    def with_likeliest_rates(self, x: np.ndarray) -> tuple[DriftProblem, np.ndarray]:
        """With the rates that make the log likeliest, by the slopes at x; and (parameters,) what -2 ln L gains over
        parameters that stay. A rate that gains less than `CHANCE` is the least that is tried: none."""
        here, basis = self.problem.evaluate(x), self.directions(x)
        data = here.log < len(self.problem.series)
        slopes = here.gradient[data] @ basis
        information, pull = slopes.T @ slopes, -slopes.T @ here.residual[data]
        steps = self.steps(len(x)).reshape(len(self.walks), len(self.spans), len(x))
        walks = [(part @ basis, part @ x) for part in steps]
        squares = np.array([rows.T @ rows for rows, _ in walks])
        pulls = np.array([-rows.T @ walked for rows, walked in walks])
        lengths = np.array([walked @ walked for _, walked in walks])
        levels = [self._levels(information, squares, number) for number in range(len(walks))]
        rates, gains = self.rates.copy(), np.zeros(len(walks))

        def unlikely(rates: np.ndarray) -> float:
            precision = rates**-2.0
            whole = information + np.tensordot(precision, squares, 1)
            size = np.sqrt(np.diag(whole))
            root = np.linalg.cholesky(whole / np.outer(size, size))
            solved = np.linalg.solve(root, (pull + precision @ pulls) / size)
            determinant = 2 * float(np.sum(np.log(np.diag(root))) + np.sum(np.log(size)))
            walked = 2 * len(self.spans) * float(np.sum(np.log(rates)))
            return determinant + walked + float(precision @ lengths - solved @ solved)

        for _ in range(ROUNDS if len(walks) > 1 else 1):
            for number, tried in enumerate(levels):
                values = [unlikely(np.where(np.arange(len(walks)) == number, rate, rates)) for rate in tried]
                gains[number] = values[0] - min(values)
                rates[number] = tried[int(np.argmin(values))] if gains[number] > CHANCE else tried[0]
        return replace(self, rates=rates), gains

    def _levels(self, information: np.ndarray, squares: np.ndarray, number: int) -> np.ndarray:
        """Rates that are tried for a parameter, from one whose walk is lost in the deviation of a constant."""
        count, places = information.shape[0], self.walks[number]
        others = np.setdiff1d(np.arange(count), places)
        together = np.zeros((count, 1 + len(others)))
        together[places, 0] = 1.0
        together[others, 1 + np.arange(len(others))] = 1.0
        precision = np.where(np.arange(len(self.rates)) == number, 0.0, self.rates**-2.0)
        whole = together.T @ (information + np.tensordot(precision, squares, 1)) @ together
        size = np.sqrt(np.diag(whole))
        deviation = np.sqrt(np.linalg.inv(whole / np.outer(size, size))[0, 0]) / size[0]
        return deviation / np.sqrt(float(np.sum(self.spans))) * np.geomspace(LEAST, MOST, STEPS)
