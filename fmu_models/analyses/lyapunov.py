"""Lyapunov exponents of a map: the mean growth rates, per step, of small differences.

    Q(k+1) R(k+1) = Df(x(k)) Q(k),    lambda_i = mean of ln |R_ii(k)|,    their sum = mean of ln |det Df(x(k))|

Many motions are followed at once, from starts that differ by a millionth of the box. Chaos makes them independent of
each other during the steps that are dropped first, so that the scatter of their means is an honest measure of the
error of the overall mean; on a periodic motion they agree, and the error is that of rounding.

Source: Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.analyses.maps import Iteration
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown

Vector = NDArray[np.float64]

SPREAD = 1e-6
FAR = 1e12


@dataclass(frozen=True, eq=False)
class Exponents(Shown):
    """Lyapunov exponents and how well they are known.

    Attributes:
        values: (n,) per step, largest first; -inf where every difference is lost in one step.
        errors: (n,) standard errors of the values.
        steps: number of steps that the mean is taken of, all motions together.
    """

    values: Vector
    errors: Vector
    steps: int


def lyapunov_exponents(
    iteration: Iteration,
    start: Sequence[float] | None = None,
    *,
    steps: int = 1000,
    motions: int = 256,
    dropped: int = 1000,
    seed: int = 0,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Exponents:
    """All Lyapunov exponents of the motion that ``start`` leads to.

    Args:
        iteration: the map.
        start: (n,) state; that of the declaration if left out.
        steps: of each motion, for the mean.
        motions: how many are followed, at least 2.
        dropped: steps of each before that, in which it comes to where it stays.
        seed: of the starts.
        progress: called with the fraction done.

    Raises:
        StickslipError: the motion goes to infinity, or fewer than 2 motions or 1 step are asked for.
    """
    if motions < 2 or steps < 1 or dropped < 0:
        raise StickslipError(f"Exponents of {motions} motions over {steps} steps: take at least 2 motions and 1 step.")
    begin = np.array([x.start for x in iteration.map.states]) if start is None else np.asarray(start, dtype=float)
    size = iteration.box[:, 1] - iteration.box[:, 0]
    x = begin + SPREAD * size * np.random.default_rng(seed).uniform(-1.0, 1.0, (motions, len(begin)))
    frames = np.broadcast_to(np.eye(len(begin)), (motions, len(begin), len(begin)))
    total = np.zeros((motions, len(begin)))
    for k in range(dropped + steps):
        grown, volumes = iteration.jacobian(x) @ frames, np.abs(iteration.determinant(x))
        x = iteration(x)
        if not (np.abs(x) < FAR).all():
            place = ", ".join(f"{name} = {value:g}" for name, value in zip(iteration.states, begin, strict=True))
            raise StickslipError(
                f"{iteration.map.name}: the motion from {place} leaves every bound after {k + 1} steps, so it has no "
                "exponents. Start elsewhere, or change the parameters."
            )
        frames, sizes = np.linalg.qr(grown)
        if k >= dropped:
            total += _growth(np.abs(np.diagonal(sizes, axis1=1, axis2=2)), volumes)
        if k % 100 == 0:
            progress(k / (dropped + steps))
    means = total / steps
    values = means.mean(axis=0)
    order = np.argsort(-values, kind="stable")
    with np.errstate(invalid="ignore"):
        scatter = means.std(axis=0, ddof=1) / np.sqrt(motions)
    return Exponents(values[order], np.where(np.isfinite(values), scatter, 0.0)[order], steps * motions)


def _growth(sizes: Vector, volumes: Vector) -> Vector:
    """(m, n) ln of the sizes, the last of which, lost in the rounding of a strong stretch, follows from the volume."""
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = np.log(sizes)
        grown[:, -1] = np.log(volumes) - grown[:, :-1].sum(axis=1)
    return np.where(np.isnan(grown), -np.inf, grown)
