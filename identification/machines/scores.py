"""How well efforts are predicted, joint by joint: in the logs of a fit, in parts that it has not seen, in others; how
far the simulated machine comes from its logs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.machines.identify import Identified
from identification.machines.motion import JointMotion
from identification.machines.rows import Rows
from identification.machines.simulated import Stretches, run

FREE_RUN = 1.0  # s


@dataclass(frozen=True)
class Score:
    """How well a model explains efforts. relative_error: |residual|/|effort|; explained: share of their variance."""

    relative_error: float
    explained: float


@dataclass(frozen=True)
class JointScore:
    """How well one joint's effort is predicted: seen: in the logs of the fit; left_out: each of these by the others (of
    one log: eighths of it); held_out: by log that was held out; free_run: of its position over 1 s from the measured
    state by the measured efforts, rms error over the standard deviation of its motion, None where the simulation leaves
    the logs or there are no positions; usual_run: the same, which half of the windows of 1 s stay below."""

    joint: str
    unit: str
    seen: Score
    left_out: Score
    held_out: Mapping[str, Score]
    free_run: float | None
    usual_run: float | None


def joint_scores(result: Identified, others: Mapping[str, Rows], units: Sequence[str]) -> tuple[JointScore, ...]:
    """The scores of each joint. others: rows of held-out logs, by name; units: of the efforts."""
    rows, values = result.rows, result.best.values
    left_out = _left_out(result)
    return tuple(
        JointScore(
            name,
            unit,
            _score(rows, rows.residual(values), index),
            _score(rows, left_out, index),
            {log: _score(seen, seen.residual(values), index) for log, seen in others.items()},
            *error,
        )
        for index, (name, unit, error) in enumerate(zip(result.regressor.joints, units, free_run(result), strict=True))
    )


def _score(rows: Rows, residual: np.ndarray, joint: int) -> Score:
    """The score of one joint. residual: (rows,), without weights."""
    mine = rows.used & (rows.joint == joint)
    off, effort = residual[mine], rows.effort[mine]
    return Score(float(np.linalg.norm(off) / np.linalg.norm(effort)), float(1 - np.mean(off**2) / np.var(effort)))


def _left_out(result: Identified) -> np.ndarray:
    """Residual (rows,) of each log with the values from the others; of one log: of eighths of it."""
    rows = result.rows
    folds = rows.log if len(np.unique(rows.log)) > 1 else rows.part
    residual = np.empty(len(rows.effort))
    for fold in np.unique(folds):
        mine = folds == fold
        residual[mine] = rows.residual(result.from_rows(~mine))[mine]
    return residual


def free_run(result: Identified) -> list[tuple[float | None, float | None]]:
    """By joint, of all windows and of the usual one, see `JointScore`: windows one after the other, all at once. With
    the modelled efforts in place of the measured ones it errs by 2e-4 of the motion: it judges the model."""
    regressor, pieces = result.regressor, result.pieces
    length = max(int(FREE_RUN / pieces[0].step), 2)
    windows = [
        (piece, start)
        for piece in pieces
        for start in range(piece.span.start, max(piece.span.stop - length, piece.span.start), length)
    ]
    spread = np.std(np.concatenate([piece.position for piece in pieces]), axis=0)
    if not windows or not np.all(spread > 0):
        return [(None, None)] * len(regressor.joints)

    def taken(of: Callable[[JointMotion], np.ndarray]) -> np.ndarray:
        return np.stack([of(piece)[start : start + length] for piece, start in windows])

    measured = taken(lambda p: p.position)
    stretches = Stretches(pieces[0].step, measured, taken(lambda p: p.velocity), taken(lambda p: p.effort))
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            position, _, _ = run(regressor, result.base.whole(result.best.values), stretches, 0.0)
    except np.linalg.LinAlgError:
        return [(None, None)] * len(regressor.joints)
    errors = np.mean((position - measured) ** 2, axis=1)  # (windows, joints)
    overall, usual = (np.sqrt(squares) / spread for squares in (np.mean(errors, axis=0), np.median(errors, axis=0)))
    return [
        (float(error), float(median)) if np.isfinite(error) and error < 10 else (None, None)
        for error, median in zip(overall, usual, strict=True)
    ]
