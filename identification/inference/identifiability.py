"""Whether parameters can be told apart, and in which direction they cannot.

With the columns of the gradient scaled to length one, S, the collinearity index is 1/(smallest singular value of S):
a change of one parameter can be compensated by the others up to the share 1/index of its effect. Above 10-15 a set is
poorly identifiable. The right singular vector of that value is the direction in which the parameters can move together
almost unseen. What is held by priors is projected out first, as far as the priors leave it free.

Source: Brun, Reichert, Kuensch (2001), Water Resour. Res. 37, 1015, equations (11), (12).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.inference.problem import FitProblem, Solution, prior_rows

POOR = 15.0  # collinearity index above which parameters are nearly collinear (Brun et al.: 10 to 15)
BLURRED = 10.0  # per cent, of a parameter, over one standard deviation: then parameters are not told apart
TAKES_PART = 0.1  # share of the largest component below which a parameter has no part in the direction
HIGHEST = 1e12  # index of a direction without any effect


@dataclass(frozen=True)
class Collinearity:
    """index: 1 for independent effects, more the more nearly collinear; direction: change of each parameter that has a
    part in the direction of least effect, in its unit, for a move of one standard deviation, the relatively largest
    first; percent: the same relative to the values."""

    index: float
    direction: dict[str, float]
    percent: dict[str, float]

    @property
    def poor(self) -> bool:
        """Whether the parameters are nearly collinear."""
        return self.index > POOR

    @property
    def blurred(self) -> bool:
        """Whether the logs leave the direction open."""
        return self.poor and max(abs(by) for by in self.percent.values()) > BLURRED

    @property
    def words(self) -> str:
        """The direction in a sentence, such as "mu_k up 1 % with p down 3 % cannot be told apart from no change"."""
        together = " with ".join(self._moves[:2]) + "".join(f" and {move}" for move in self._moves[2:])
        judged = "cannot be told apart from no change" if self.blurred else "is what the logs see least"
        return f"{together} {judged} (one standard deviation)"

    @property
    def _moves(self) -> list[str]:
        moves = []
        for name, by in self.direction.items():
            # of a parameter that may as well be zero a share says nothing
            size = f"{abs(self.percent[name]):.2g} %" if abs(self.percent[name]) < 100 else f"by {abs(by):.2g}"
            moves.append(f"{name} {'up' if by > 0 else 'down'} {size}")
        return moves

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings where the logs leave a direction open."""
        if not self.blurred:
            return ()
        return (
            f"Nearly collinear parameters (index {self.index:.0f}): {self.words}. `stickslip design` names the "
            "experiment that helps most.",
        )


def collinearity(problem: FitProblem, solution: Solution, covariance: np.ndarray) -> Collinearity:
    """Collinearity of the unknowns without a prior, the others projected out. covariance: (m, m) of all."""
    free = np.array([u.prior is None for u in problem.unknowns])
    gradient = np.vstack([solution.evaluation.gradient, prior_rows(problem)])
    others = gradient[:, ~free]
    columns = gradient[:, free]
    if others.shape[1]:
        columns = columns - others @ np.linalg.lstsq(others, columns, rcond=None)[0]
    names = [u.name for u in problem.unknowns if u.prior is None]
    return of_gradient(columns, names, solution.values[free], covariance[np.ix_(free, free)])


def of_gradient(columns: np.ndarray, names: Sequence[str], values: np.ndarray, covariance: np.ndarray) -> Collinearity:
    """As `collinearity`, of a gradient (n, m) by parameters of these names and values (m,), with covariance (m, m)."""
    norms = np.linalg.norm(columns, axis=0)
    norms = np.where(norms > 0, norms, np.finfo(float).tiny)
    _, singular, right = np.linalg.svd(columns / norms, full_matrices=False)
    # a step of the scaled problem, back in parameters
    involved = np.abs(right[-1]) >= TAKES_PART * np.max(np.abs(right[-1]))
    step = np.where(involved, right[-1] * np.min(norms) / norms, 0.0)
    seen = float(step @ np.linalg.lstsq(covariance, step, rcond=None)[0])
    step = step / np.sqrt(seen) if seen > 0 else step * HIGHEST
    percent = np.clip(100 * step / np.maximum(np.abs(values), 1 / HIGHEST), -HIGHEST, HIGHEST)
    first = int(np.argmax(np.abs(percent)))
    step, percent = step * np.sign(percent[first]), percent * np.sign(percent[first])
    order = [int(i) for i in np.argsort(-np.abs(percent)) if involved[i]]
    return Collinearity(
        index=float(min(1 / max(singular[-1], 1 / HIGHEST), HIGHEST)),
        direction={names[i]: float(step[i]) for i in order},
        percent={names[i]: float(percent[i]) for i in order},
    )
