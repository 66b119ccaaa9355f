"""Inverse dynamics as a problem of least squares, perhaps with a friction law that is not linear in its parameters.

    weight (columns theta + F(motion; q) - effort) = residual

F is the friction of one joint: sgn(v) F(|v|; q), or that of a law that remembers (`memory`). Columns and friction go
through the same filter as the effort. Residuals may depend on one another inside a block of a log (a cluster).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.inference.problem import Evaluation, FitProblem, Solution, Unknown
from identification.laws.law import FittableLaw, unknowns
from identification.machines.motion import JointMotion
from identification.machines.rows import Rows

STILL = 0.05  # of the greatest speed: slower samples say nothing to a law's first guess

WARMED = 1.0  # K: a temperature that changes less says nothing of friction
RISE = Unknown("a_T", "1/K", -0.2, 0.2, "share by which friction rises with each kelvin")

Sign = Callable[[np.ndarray], np.ndarray]  # of velocities (n,), with the limits -1 and 1


def load_of(piece: JointMotion) -> np.ndarray:
    """Factor (n, 1) of friction in a piece: its load; 1 (1, 1) where that is constant."""
    return np.ones((1, 1)) if piece.load is None else piece.load[:, None]


class Friction(ABC):
    """Friction of one joint, in proportion to its load, and to 1 + a_T (T - T_0) where temperatures are recorded.
    pieces: of the logs, as rows were made of them; own: unknowns of the law."""

    pieces: Sequence[JointMotion]
    own: tuple[Unknown, ...]

    @abstractmethod
    def along(self, q: np.ndarray) -> Iterable[np.ndarray]:
        """Of each piece friction and its derivatives by the law's unknowns (n, 1 + m)."""

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Those of the law, then a_T where there is one."""
        return (*self.own, *([RISE] if self.warms else []))

    @property
    def warms(self) -> bool:
        """Whether temperatures change enough to show."""
        rows = [piece.warmer for piece in self.pieces if piece.warmer is not None]
        return bool(rows) and float(np.ptp(np.concatenate(rows))) >= WARMED

    def __call__(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Friction (rows of the joint,) and its derivatives (rows, m)."""
        thin = []
        for piece, friction in zip(self.pieces, self.along(q[: len(self.own)]), strict=True):
            followed = friction * load_of(piece)
            if self.warms and piece.warmer is not None:
                warmer = piece.warmer[:, None]
                followed = np.hstack([followed * (1 + q[-1] * warmer), followed[:, :1] * warmer])
            thin.append(piece.thinned(followed))
        rows = np.concatenate(thin)
        return rows[:, 0], rows[:, 1:]

    @abstractmethod
    def start(self, rows: Rows, chosen: np.ndarray) -> np.ndarray:
        """Where a search begins, of the parameters of ``rows``, which are ``chosen`` among those of the joint, then of
        the unknowns."""

    @abstractmethod
    def warnings(self, problem: MachineProblem, solution: Solution) -> tuple[str, ...]:
        """Why values found mean nothing, in sentences."""


@dataclass(frozen=True, eq=False)
class JointFriction(Friction):
    """A friction law of one joint. sign: that goes with the law."""

    law: FittableLaw
    pieces: Sequence[JointMotion]
    joint: int
    sign: Sign

    @cached_property
    def own(self) -> tuple[Unknown, ...]:  # type: ignore[override]  # those of the law
        return unknowns(self.law)

    def along(self, q: np.ndarray) -> Iterable[np.ndarray]:
        for piece in self.pieces:
            v = piece.velocity[:, self.joint]
            shown = np.vstack([self.law.value(np.abs(v), q), self.law.gradient(np.abs(v), q)])
            yield (self.sign(v) * shown).T

    def start(self, rows: Rows, chosen: np.ndarray) -> np.ndarray:
        """Parameters from a fit with Coulomb and viscous friction, and the law's own guess from what these leave."""
        columns, effort = rows.weighted
        speeds = [piece.velocity[:, self.joint] for piece in self.pieces]
        rough = [
            np.stack([np.sign(v), v], axis=1) * load_of(piece) for piece, v in zip(self.pieces, speeds, strict=True)
        ]
        rough = np.concatenate([piece.thinned(part) for piece, part in zip(self.pieces, rough, strict=True)])[chosen]
        weight, speed = rows.weight, rows.speed
        extended = np.concatenate([columns, rough * weight[:, None]], axis=1)
        x = np.linalg.lstsq(extended, effort, rcond=None)[0][: columns.shape[1]]
        moving = (np.abs(speed) > STILL * np.max(np.abs(speed))) & (weight > 0)
        residual = rows.residual(x)[moving] * np.sign(speed[moving])
        return np.concatenate([x, self.law.start(np.abs(speed[moving]), residual), np.zeros(int(self.warms))])

    def warnings(self, problem: MachineProblem, solution: Solution) -> tuple[str, ...]:
        before = len(problem.rows.unknowns)
        return self.law.warnings(solution.values[before : before + len(self.own)])


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
