"""Inverse dynamics as a problem of least squares, perhaps with a friction law that is not linear in its parameters.

    weight (columns theta + F(motion; q) - effort) = residual

F is the friction of one joint: sgn(v) F(|v|; q), or that of a law that remembers (`memory`). Columns and friction go
through the same filter as the effort. Residuals may depend on one another inside a block of a log (a cluster).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.inference.problem import Evaluation, FitProblem, Solution, Unknown
from identification.laws.law import FittableLaw, unknowns
from identification.machines.motion import JointMotion
from identification.machines.rows import Rows

STILL = 0.05  # of the greatest speed: slower samples say nothing to a law's first guess

Sign = Callable[[np.ndarray], np.ndarray]  # of velocities (n,), with the limits -1 and 1


class Friction(ABC):
    """Friction of one joint. unknowns: of it, in order."""

    unknowns: tuple[Unknown, ...]

    @abstractmethod
    def __call__(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Friction (rows of the joint,) and its derivatives (rows, m)."""

    @abstractmethod
    def start(self, rows: Rows, chosen: np.ndarray) -> np.ndarray:
        """Where a search begins, of the parameters of ``rows``, which are ``chosen`` among those of the joint, then of
        the unknowns."""

    @abstractmethod
    def warnings(self, problem: MachineProblem, solution: Solution) -> tuple[str, ...]:
        """Why values found mean nothing, in sentences."""


@dataclass(frozen=True, eq=False)
class JointFriction(Friction):
    """A friction law of one joint. pieces: of the logs, as rows were made of them; sign: that goes with the law."""

    law: FittableLaw
    pieces: Sequence[JointMotion]
    joint: int
    sign: Sign

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:  # type: ignore[override]  # those of the law
        return unknowns(self.law)

    def __call__(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        law, sign = self.law, self.sign
        return (
            self._thinned(lambda v: sign(v) * law.value(np.abs(v), q)),
            self._thinned(lambda v: (sign(v) * law.gradient(np.abs(v), q)).T),
        )

    def start(self, rows: Rows, chosen: np.ndarray) -> np.ndarray:
        """Parameters from a fit with Coulomb and viscous friction, and the law's own guess from what these leave."""
        columns, effort = rows.weighted
        rough = self._thinned(lambda v: np.stack([np.sign(v), v], axis=1))[chosen]
        weight, speed = rows.weight, rows.speed
        extended = np.concatenate([columns, rough * weight[:, None]], axis=1)
        x = np.linalg.lstsq(extended, effort, rcond=None)[0][: columns.shape[1]]
        moving = (np.abs(speed) > STILL * np.max(np.abs(speed))) & (weight > 0)
        residual = rows.residual(x)[moving] * np.sign(speed[moving])
        return np.concatenate([x, self.law.start(np.abs(speed[moving]), residual)])

    def warnings(self, problem: MachineProblem, solution: Solution) -> tuple[str, ...]:
        return self.law.warnings(solution.values[len(problem.rows.unknowns) :])

    def _thinned(self, of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """A function of the joint's velocities (n,) in the rows of the joint."""
        return np.concatenate([piece.thinned(of(piece.velocity[:, self.joint])) for piece in self.pieces])


@dataclass(frozen=True, eq=False)
class MachineProblem(FitProblem):
    """rows: linear part, of the joint alone where there is a law; chosen: (rows,) of these among all of them; cluster:
    (rows,); unknowns: parameters of the rows, then of the law."""

    rows: Rows
    unknowns: tuple[Unknown, ...]
    chosen: np.ndarray
    cluster: np.ndarray
    friction: Friction | None = None
    noise_known = False

    def start(self) -> np.ndarray:
        """The solution itself of rows alone; with a law, where its search begins."""
        columns, effort = self.rows.weighted
        if self.friction is None:
            return np.linalg.lstsq(columns, effort, rcond=None)[0]
        return self.friction.start(self.rows, self.chosen)

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Weighted residuals, effort modelled less measured."""
        columns, effort = self.rows.weighted
        count = columns.shape[1]
        residual, gradient = columns @ x[:count] - effort, columns
        if self.friction is not None:
            weight = self.rows.weight
            force, slope = (values[self.chosen] for values in self.friction(x[count:]))
            residual, gradient = residual + weight * force, np.concatenate([gradient, weight[:, None] * slope], axis=1)
        log = np.zeros(len(residual), dtype=int)
        return Evaluation(residual, gradient, self.cluster, log, np.abs(self.rows.speed))

    def resampled(self, clusters: np.ndarray) -> MachineProblem:
        places = [np.flatnonzero(self.cluster == label) for label in clusters]
        labels = np.repeat(np.arange(len(places)), [len(rows) for rows in places])
        taken = np.concatenate(places)
        return replace(self, rows=self.rows.where(taken), chosen=self.chosen[taken], cluster=labels)


def machine_problem(rows: Rows, friction: Friction | None = None) -> MachineProblem:
    """The problem of these rows, and of a law of friction force of their joint."""
    added = friction.unknowns if friction else ()
    cluster = np.unique(rows.block, return_inverse=True)[1]
    used = np.flatnonzero(rows.used)
    return MachineProblem(rows.where(used), (*rows.unknowns, *added), used, cluster[used], friction)
