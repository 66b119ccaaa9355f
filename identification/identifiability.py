"""Whether parameters can be told apart, and in which direction they cannot.

With the columns of the gradient scaled to length one, S, the collinearity index is 1/(smallest singular value of S):
a change of one parameter can be compensated by the others up to the share 1/index of its effect. Above 10-15 a set is
poorly identifiable. The right singular vector of that value is the direction in which the parameters can move together
almost unseen. What is held by priors is projected out first, as far as the priors leave it free.

Source: Brun, Reichert, Kuensch (2001), Water Resour. Res. 37, 1015, equations (11), (12).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.problem import Problem, Solution, prior_precision

POOR = 15.0  # collinearity index above which parameters count as not told apart (Brun et al.: 10 to 15)
TAKES_PART = 0.1  # share of the largest component below which a parameter has no part in the direction


@dataclass(frozen=True)
class Collinearity:
    """index: 1 for independent effects, more the less they can be told apart; direction: change in per cent of each
    parameter that has a part in the direction of least effect, the largest 1 %."""

    index: float
    direction: dict[str, float]

    @property
    def poor(self) -> bool:
        """Whether the parameters cannot be told apart."""
        return self.index > POOR

    @property
    def words(self) -> str:
        """The direction in a sentence, such as "mu_k up 1 % with p down 0.33 % can hardly be told apart"."""
        moves = [
            f"{name} {'up' if change > 0 else 'down'} {abs(change):.2g} %" for name, change in self.direction.items()
        ]
        if len(moves) < 2:
            return "the parameters act apart from one another"
        verb = "cannot be told apart from no change" if self.poor else "is what the logs see least"
        return f"{moves[0]} together with {' and '.join(moves[1:])} {verb}"


def collinearity(problem: Problem, found: Solution) -> Collinearity:
    """Of the unknowns without a prior, those with one projected out."""
    free = np.array([u.prior is None for u in problem.unknowns])
    gradient = np.vstack([found.evaluation.gradient, np.sqrt(prior_precision(problem))])
    rest = gradient[:, ~free]
    columns = gradient[:, free]
    if rest.shape[1]:
        columns = columns - rest @ np.linalg.lstsq(rest, columns, rcond=None)[0]
    names = [u.name for u in problem.unknowns if u.prior is None]
    return of_gradient(columns, names, found.values[free])


def of_gradient(columns: np.ndarray, names: Sequence[str], values: np.ndarray) -> Collinearity:
    """As `collinearity`, of a gradient (n, m) by parameters of these names and values (m,)."""
    norms = np.linalg.norm(columns, axis=0)
    if not np.all(norms > 0):
        dead = names[int(np.argmin(norms))]
        return Collinearity(float("inf"), {dead: 1.0})
    _, singular, right = np.linalg.svd(columns / norms, full_matrices=False)
    index = float(1 / singular[-1]) if singular[-1] > 0 else float("inf")
    # a step of the scaled problem, back in parameters and relative to them
    scale = np.where(values != 0, np.abs(values), 1.0)
    step = right[-1] / norms / scale
    part = np.abs(right[-1]) >= TAKES_PART * np.max(np.abs(right[-1]))
    step = step / step[np.argmax(np.abs(step) * part)]
    order = np.argsort(-np.abs(step))
    return Collinearity(index, {names[i]: float(step[i]) for i in order if part[i]})
