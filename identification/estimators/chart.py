"""Coordinates in which the search for friction laws goes straight.

Slip speeds from v_1 to v_2 tell the coefficients there, mu(v_1) and mu(v_2), and little of how the law bends between.
The parameters mu_s, mu_k and p (or v_s) then hang together along a curved valley, down which steps in these parameters
are short; two discs, one of which touches for short, make it long. In
    y = (mu(v_1), ln(mu(v_1) - mu(v_2)), ln p)
the valley is straight. The law is linear in mu_s and mu_k, so that the way back is a pair of linear equations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.inference.problem import Evaluation, FitProblem, Progress, Solution, solve
from identification.laws.joint_law import laws_of
from identification.laws.law import FittableLaw

BENT = ("mu_s", "mu_k")  # first parameters of a law with such a valley; the third is the scale of speed between them
EDGE = 1e-3  # of a value, within which a bound may have been met
LEAST_SCALE = 1e-4  # s/m or m/s


@dataclass(frozen=True)
class Bend:
    """One law within the unknowns: its first place, and two slip speeds that it was seen at, v_1 < v_2, m/s."""

    law: FittableLaw
    first: int
    speeds: tuple[float, float]

    def coordinates(self, q: np.ndarray) -> np.ndarray:
        """y (m,) of the law's parameters q (m,)."""
        slow, fast = self.law.value(np.array(self.speeds), q)
        return np.array([slow, np.log(slow - fast), np.log(q[2]), *q[3:]])

    def parameters(self, y: np.ndarray) -> np.ndarray:
        """q (m,) of y (m,)."""
        scale, speeds = float(np.exp(y[2])), np.array(self.speeds)
        none = np.zeros(len(y) - 3)
        unit = [self.law.value(speeds, np.array([*levels, scale, *none])) for levels in ((1.0, 0.0), (0.0, 1.0))]
        remainder = self.law.value(speeds, np.array([0.0, 0.0, scale, *y[3:]]))
        pair = np.linalg.solve(np.stack(unit, axis=1), np.array([y[0], y[0] - np.exp(y[1])]) - remainder)
        return np.array([*pair, scale, *y[3:]])

    def slope(self, q: np.ndarray) -> np.ndarray:
        """dq/dy (m, m)."""
        slow, fast = self.law.value(np.array(self.speeds), q)
        by = self.law.gradient(np.array(self.speeds), q)
        straight = np.eye(len(q))
        straight[:3] = by[:, 0], (by[:, 0] - by[:, 1]) / (slow - fast), straight[2] / q[2]
        return np.linalg.inv(straight)

    @property
    def places(self) -> slice:
        """Places of the parameters among the unknowns."""
        return slice(self.first, self.first + len(self.law.parameters))


@dataclass(frozen=True, eq=False)
class Charted(FitProblem):
    """A problem in straight coordinates, in which the valley of its sum of squares does not bend."""

    problem: FitProblem
    bends: tuple[Bend, ...]

    def __post_init__(self) -> None:
        free = list(self.problem.unknowns)
        for bend in self.bends:
            *pair, scale = free[bend.first : bend.first + 3]
            pair = [replace(unknown, minimum=-np.inf, maximum=np.inf) for unknown in pair]
            low, high = np.log([max(scale.minimum, LEAST_SCALE), scale.maximum])
            free[bend.first : bend.first + 3] = [*pair, replace(scale, minimum=float(low), maximum=float(high))]
        object.__setattr__(self, "unknowns", tuple(free))
        object.__setattr__(self, "noise_known", self.problem.noise_known)

    def start(self) -> np.ndarray:
        """The point where the problem begins, in straight coordinates."""
        return self.coordinates(self.problem.start())

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """y (m,) of x (m,)."""
        y = np.array(x, dtype=float)
        for bend in self.bends:
            y[bend.places] = bend.coordinates(x[bend.places])
        return y

    def back(self, y: np.ndarray) -> np.ndarray:
        """x (m,) of y (m,)."""
        x = np.array(y, dtype=float)
        for bend in self.bends:
            x[bend.places] = bend.parameters(y[bend.places])
        return x

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Residuals and gradient at y."""
        at = self.back(x)
        evaluation = self.problem.evaluate(at)
        slope = np.eye(len(at))
        for bend in self.bends:
            slope[bend.places, bend.places] = bend.slope(at[bend.places])
        return replace(evaluation, gradient=evaluation.gradient @ slope)

    def resampled(self, clusters: np.ndarray) -> Charted:
        return Charted(self.problem.resampled(clusters), self.bends)


def bends_of(
    law: FittableLaw, contacts: Sequence[str], q: np.ndarray, speeds: np.ndarray, disc: np.ndarray
) -> tuple[Bend, ...]:
    """The laws whose valley can be straightened at parameters q (m,).

    speeds: (n,) m/s at which friction was seen, each on the disc ``disc`` (n,) of the contacts.
    """
    bends = []
    for number, single in enumerate(laws_of(law, contacts)):
        seen = speeds[disc == number]
        if single.law.names[:2] != BENT or not len(seen):
            continue
        slow, fast = np.quantile(seen, [0.1, 0.9])
        values = q[single.place]
        falling = fast > slow and values[2] > 0 and np.diff(single.law.value(np.array([slow, fast]), values))[0] < 0
        if falling:
            bends.append(Bend(single.law, single.place.start, (float(slow), float(fast))))
    return tuple(bends)


def solve_straight(
    problem: FitProblem,
    bends: tuple[Bend, ...],
    *,
    fixed: Mapping[str, float],
    progress: Progress | None,
    tolerance: float,
) -> Solution:
    """`solve` in straight coordinates; the solution in the problem's own. What is held is straight in these alone."""
    if not bends or fixed:
        return solve(problem, fixed=fixed, progress=progress, tolerance=tolerance)
    charted = Charted(problem, bends)
    solution = solve(charted, progress=progress, tolerance=tolerance)
    x = charted.back(solution.values)
    low, high = problem.limits
    edge = EDGE * np.maximum(np.abs(x), 1e-3)
    if np.any((x < low + edge) | (x > high - edge)):
        # bounds are straight in the problem's own coordinates
        return solve(problem, np.clip(x, low, high), progress=progress, tolerance=tolerance)
    return replace(solution, values=x, evaluation=problem.evaluate(x))
