"""Drift of the laser, slow or at random, as the encoder shows it.

    edge - laser = (delay + drift of a clock s) angle' + error of the line in this direction
                   - sum_n d_n cos(n pi s)/cos(angle),   d_n normal with deviation a/n

s is the share of the log that is gone; d in rad, displacement over R: these are the cosines of a random walk. The lines
of an encoder are misplaced, but always by the same, and the laser's gain counts for the same at each, so that what
changes from pass to pass is the laser. Whether it drifts is judged by the likelihood of a on means over short pieces of
the log; the drift is the most likely one with that a. What is left of it has the variance

    sqrt(q r)/2 + q/6,    q = pi^2 a^2/(2 T) `PIECE`,

q by which a walk grows in a piece, r the variance of the mean of one, T how long the log lasts.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.measurement.motion import WANDERS, DiscMotion, EdgeEquations

PIECE = WANDERS  # s of a log in one mean: longer than a window that smooths the laser
LEAST, MOST = 20, 300  # pieces with edges of a log, each of which has a cosine
SIZES = 10.0 ** np.arange(-6, 6, 0.5)  # of (a over the noise of a mean)^2
SHIFTED = 2.0  # deviations of a drift in a log, by which its mean may be off: in this and in the decay that tells zero
CHANCE = 20.0  # of 2 ln L, that a drift must gain: without one it gains less than 3


def without_drift(motions: Sequence[DiscMotion], equations: EdgeEquations) -> tuple[list[DiscMotion], tuple[str, ...]]:
    """The motions with the laser's drift taken off where it is no chance, and what to say."""
    share = np.array([_share(motions[i], t) for t, i in zip(equations.time, equations.motion, strict=True)])
    level = np.sqrt(1 + equations.design[:, 0] ** 2)  # 1/cos of the angle
    # each line, passed upward and downward, has an error of its own
    passage = 2 * equations.line.astype(int) + (equations.design[:, 1] > 0)
    label = np.unique(passage, return_inverse=True)[1]
    mended, notes = list(motions), []
    for number, motion in enumerate(motions):
        mine = equations.motion == number
        pieces = min(int((motion.time[-1] - motion.time[0]) / PIECE), MOST)
        block = np.unique((share[mine] * pieces).astype(int), return_inverse=True)[1]
        if len(np.unique(block)) < LEAST:
            continue
        curves = -level[mine, None] * _cosines(share[mine], pieces)
        speed = equations.design[mine, 1]
        columns = np.column_stack([speed, speed * share[mine], equations.edge[mine], curves])
        projected = within(columns, label[mine])  # one constant for each label is projected out by its mean
        tilted, curves = projected[:, :2], projected[:, 2:]
        projected = _means(curves - tilted @ np.linalg.lstsq(tilted, curves, rcond=None)[0], block)
        found = _wandering(projected[:, 0], projected[:, 1:])
        if found is None:
            continue
        coefficients, size, noise = found
        each, grown = noise * len(projected) / np.count_nonzero(mine), np.pi**2 * size * noise / (2 * pieces)
        drift = _cosines(_share(motion, motion.time), pieces) @ coefficients
        mended[number] = replace(
            motion,
            angle=np.arcsin(np.clip(np.sin(motion.angle) - drift, -1, 1)),
            wander=float(np.sqrt(np.sqrt(grown * each) / 2 + grown / 6)),
            shift=SHIFTED * float(np.std(drift)),
        )
        size = 1e3 * motion.log.rig.value("R") * float(np.max(np.abs(drift)))
        notes.append(
            f"Log '{motion.log.name}': the laser drifts against the encoder, by up to {size:.2g} mm. That was "
            "taken off; let the laser warm up, and fix it better."
        )
    return mended, tuple(notes)


def _share(motion: DiscMotion, time: np.ndarray | float) -> np.ndarray | float:
    return (time - motion.time[0]) / (motion.time[-1] - motion.time[0])


def _cosines(share: np.ndarray | float, count: int) -> np.ndarray:
    """cos(n pi s)/n (..., count): those of a random walk of any size."""
    orders = np.arange(1, count + 1)
    return np.cos(np.pi * np.multiply.outer(np.asarray(share), orders)) / orders


def within(columns: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Columns (n, m) less their means over equal labels (n,)."""
    counts = np.maximum(np.bincount(label), 1)
    return np.stack([column - (np.bincount(label, column) / counts)[label] for column in columns.T], axis=1)


def _means(columns: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Means of columns (n, m) over blocks, times the root of their numbers of rows."""
    counts = np.bincount(block)
    return np.stack([np.bincount(block, column) for column in columns.T], axis=1) / np.sqrt(counts)[:, None]


def _wandering(edge: np.ndarray, curves: np.ndarray) -> tuple[np.ndarray, float, float] | None:
    """Coefficients (m,) of curves (n, m), normal with one deviation, that means of edges (n,) follow, their variance
    over that of the noise, and the latter; None where it may as well be chance."""
    if not np.any(edge):
        return None
    basis, singular, across = np.linalg.svd(curves, full_matrices=False)
    along = basis.T @ edge
    across_all, beside = np.outer(SIZES, singular**2), float(edge @ edge - along @ along)
    squares = beside + np.sum(along**2 / (1 + across_all), axis=1)
    gain = len(edge) * np.log(float(edge @ edge) / squares) - np.sum(np.log1p(across_all), axis=1)
    best = int(np.argmax(gain))
    if not gain[best] > CHANCE:
        return None
    coefficients = across.T @ (singular * along / (1 / SIZES[best] + singular**2))
    return coefficients, float(SIZES[best]), float(squares[best]) / len(edge)
