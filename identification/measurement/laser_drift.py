"""Slow drift of the laser, as the encoder shows it.

    edge - laser = (delay + drift of a clock s) angle' + error of the line in this direction
                   - sum_k d_k cos(k pi s)/cos(angle)

s is the share of the log that is gone, k = 1 .. 6; d in rad, displacement over R. The lines of an encoder are
misplaced, but always by the same, and the laser's gain counts for the same at each, so that what changes from pass to
pass is the laser. Whether it drifts is judged by means over natural periods, which are independent: F, and BIC.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.measurement.motion import DiscMotion, EdgeEquations

COSINES = 6
CHANCE = 1e-3  # of an F so large without any drift
LEAST_PERIODS = 2 * COSINES + 4  # natural periods with edges in a log


def without_drift(
    motions: Sequence[DiscMotion], equations: EdgeEquations, period: float
) -> tuple[list[DiscMotion], tuple[str, ...]]:
    """The motions with the laser's drift taken off where it is no chance, and what to say. period: s, natural one."""
    share = np.array([_share(motions[i], t) for t, i in zip(equations.time, equations.motion, strict=True)])
    level = np.sqrt(1 + equations.design[:, 0] ** 2)  # 1/cos of the angle
    # each line, passed upward and downward, has an error of its own
    passage = 2 * equations.line.astype(int) + (equations.design[:, 1] > 0)
    label = np.unique(passage, return_inverse=True)[1]
    mended, notes = list(motions), []
    for number, motion in enumerate(motions):
        mine = equations.motion == number
        block = np.unique(((equations.time[mine] - motion.time[0]) / period).astype(int), return_inverse=True)[1]
        if len(np.unique(block)) < LEAST_PERIODS:
            continue
        curves = -level[mine, None] * _cosines(share[mine])
        speed = equations.design[mine, 1]
        columns = np.column_stack([speed, speed * share[mine], equations.edge[mine], curves])
        projected = _within(columns, label[mine])  # one constant for each label is projected out by its mean
        projected = _residual(projected[:, :2], projected[:, 2:])
        edge, curves = projected[:, 0], projected[:, 1:]
        if not _drifts(_means(edge, block), _means(curves, block)):
            continue
        coefficients = np.linalg.lstsq(curves, edge, rcond=None)[0]
        drift = _cosines(_share(motion, motion.time)) @ coefficients
        mended[number] = replace(motion, angle=np.arcsin(np.clip(np.sin(motion.angle) - drift, -1, 1)))
        size = 1e3 * motion.log.rig.value("R") * float(np.max(np.abs(drift)))
        notes.append(
            f"Log '{motion.log.name}': the laser drifts slowly against the encoder, by up to {size:.2g} mm. That was "
            "taken off; let the laser warm up, and fix it better."
        )
    return mended, tuple(notes)


def _share(motion: DiscMotion, time: np.ndarray | float) -> np.ndarray | float:
    return (time - motion.time[0]) / (motion.time[-1] - motion.time[0])


def _cosines(share: np.ndarray | float) -> np.ndarray:
    return np.cos(np.pi * np.multiply.outer(np.asarray(share), np.arange(1, COSINES + 1)))


def _within(columns: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Columns (n, m) less their means over equal labels (n,)."""
    counts = np.maximum(np.bincount(label), 1)
    return np.stack([column - (np.bincount(label, column) / counts)[label] for column in columns.T], axis=1)


def _residual(others: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """The residual of (n,) or (n, k) projected on the columns of another matrix (n, m)."""
    return columns - others @ np.linalg.lstsq(others, columns, rcond=None)[0]


def _means(values: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Means over blocks, times the root of their numbers of rows."""
    counts = np.bincount(block)
    columns = values.reshape(len(values), -1).T
    return (np.stack([np.bincount(block, column) for column in columns], axis=1) / np.sqrt(counts)[:, None]).squeeze()


def _drifts(edge: np.ndarray, curves: np.ndarray) -> bool:
    """Whether means of edges (n,) follow the curves (n, m) by more than chance."""
    from scipy.special import fdtrc

    freedom = len(edge) - curves.shape[1] - 1
    residual = _residual(curves, edge)
    least = float(residual @ residual)
    if not least > 0:
        return False
    fall = (float(edge @ edge) - least) / least
    chance = float(fdtrc(curves.shape[1], freedom, fall * freedom / curves.shape[1]))
    return chance < CHANCE and len(edge) * np.log1p(fall) > curves.shape[1] * np.log(len(edge))
