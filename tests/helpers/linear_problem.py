"""Problems with known answers: linear in their unknowns, or given by a function with its gradient."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from identification.inference.problem import Evaluation, FitProblem, Unknown


@dataclass(frozen=True, eq=False)
class Curve(FitProblem):
    """value(x) - measured, each row of unit deviation; ``slope`` its gradient (n, m)."""

    value: Callable[[np.ndarray], np.ndarray]
    slope: Callable[[np.ndarray], np.ndarray]
    measured: np.ndarray
    unknowns: tuple[Unknown, ...]
    begin: np.ndarray
    cluster: np.ndarray
    log: np.ndarray
    noise_known: bool = True
    rows: np.ndarray | None = None

    def start(self) -> np.ndarray:
        return self.begin

    def evaluate(self, x: np.ndarray) -> Evaluation:
        rows = np.arange(len(self.measured)) if self.rows is None else self.rows
        residual = (self.value(x) - self.measured)[rows]
        nothing = np.full(len(rows), np.nan)
        return Evaluation(residual, self.slope(x)[rows], self.cluster[rows], self.log[rows], nothing)

    def resampled(self, clusters: np.ndarray) -> Curve:
        return replace(self, rows=np.concatenate([np.flatnonzero(self.cluster == label) for label in clusters]))


@dataclass(frozen=True)
class Product:
    """x -> design x, which can be sent to another process."""

    design: np.ndarray

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return self.design @ x


@dataclass(frozen=True)
class Same:
    """x -> design."""

    design: np.ndarray

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return self.design


def linear(
    design: np.ndarray,
    measured: np.ndarray,
    *,
    cluster: np.ndarray | None = None,
    log: np.ndarray | None = None,
    unknowns: tuple[Unknown, ...] = (),
) -> Curve:
    """measured (n,) = design (n, m) x + noise; unknowns a, b, ... without bounds if not given."""
    count = len(measured)
    return Curve(
        value=Product(design),
        slope=Same(design),
        measured=measured,
        unknowns=unknowns or tuple(Unknown("abcdef"[i], "1") for i in range(design.shape[1])),
        begin=np.zeros(design.shape[1]),
        cluster=np.arange(count) if cluster is None else cluster,
        log=np.zeros(count, dtype=int) if log is None else log,
    )


def line(seed: int, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Design (n, 2) of a line and values of 2 + 3 t with unit noise."""
    rng = np.random.default_rng(seed)
    design = np.stack([np.ones(count), rng.uniform(-1, 1, count)], axis=1)
    return design, design @ np.array([2.0, 3.0]) + rng.standard_normal(count)
