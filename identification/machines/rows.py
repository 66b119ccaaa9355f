"""The linear problem that logs make of a machine: a row for each joint at each thinned sample.

    weight (effort - given - columns theta) = residual

What is given is the effort of parts that hold nothing to be found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.problem import Unknown
from identification.machines.motion import JointMotion, in_rows, stacked
from identification.machines.regressor import Base, Regressor

WEIGHTS = 3  # rounds
PARTS = 8  # of a log, left out in turn
BLOCKS = 3 * PARTS  # of a log: each longer than the lags of Newey and West
INDISTINGUISHABLE = 1e8  # condition of the scaled columns from which on base parameters are one
WHOLE = ("unknowns", "deviation")  # fields that are not by row
SHARE = 0.1  # of the greatest: parts of the weakest direction that name it


@dataclass(frozen=True, eq=False)
class Rows:
    """unknowns: the parameters (b,); columns: theirs (rows, b); given: effort of what is known, effort, speed of the
    joint: (rows,); series (joint of a piece), joint, log: labels (rows,); block: 24th of its log (rows,), counted on
    from log to log; trust: weight of the sample (rows,); deviation: (joints,) of the residuals."""

    unknowns: tuple[Unknown, ...]
    columns: np.ndarray
    given: np.ndarray
    effort: np.ndarray
    speed: np.ndarray
    series: np.ndarray
    joint: np.ndarray
    log: np.ndarray
    block: np.ndarray
    trust: np.ndarray
    deviation: np.ndarray

    @property
    def weight(self) -> np.ndarray:
        """Weight of each row (rows,)."""
        return self.trust / self.deviation[self.joint]

    @property
    def used(self) -> np.ndarray:
        """Which rows have a weight (rows,)."""
        return self.trust > 0

    @property
    def part(self) -> np.ndarray:
        """Eighth of its log (rows,), counted on from log to log."""
        return self.block * PARTS // BLOCKS

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [unknown.name for unknown in self.unknowns]

    @property
    def weighted(self) -> tuple[np.ndarray, np.ndarray]:
        """Weighted columns (rows, b), and the weighted effort (rows,) that they make up."""
        return self.columns * self.weight[:, None], (self.effort - self.given) * self.weight

    def where(self, chosen: np.ndarray) -> Rows:
        """The chosen rows, by index or by a mask (rows,)."""
        taken = {field.name: getattr(self, field.name)[chosen] for field in fields(self) if field.name not in WHOLE}
        return replace(self, **taken)

    def residual(self, values: np.ndarray) -> np.ndarray:
        """Measured less modelled effort (rows,), without weights."""
        return self.effort - self.given - self.columns @ values


def rows_of(regressor: Regressor, base: Base, pieces: Sequence[JointMotion]) -> Rows:
    """The linear problem of measured motion, with joints of equal weight."""
    joints = len(regressor.joints)
    used = base.places if base.given is None else [*base.places, base.given]
    matrix = stacked(pieces, lambda p: loaded(regressor(p.position, p.velocity, p.acceleration)[:, :, used], base, p))
    columns, offset = matrix[:, : len(base.places)], matrix[:, len(base.places) :].sum(axis=1)
    each = [np.broadcast_to(np.arange(joints), (len(piece.indices), joints)) for piece in pieces]
    return Rows(
        tuple(
            Unknown(parameter.name, parameter.unit, description=parameter.combination) for parameter in base.parameters
        ),
        columns,
        offset,
        stacked(pieces, lambda p: p.effort),
        stacked(pieces, lambda p: p.velocity),
        in_rows([number * joints + joint for number, joint in enumerate(each)]),
        in_rows(each),
        in_rows([np.full_like(joint, piece.log) for joint, piece in zip(each, pieces, strict=True)]),
        in_rows([np.broadcast_to(block[:, None], (len(block), joints)) for block in _blocks(pieces)]),
        in_rows([piece.weight[piece.indices] for piece in pieces]),
        np.ones(joints),
    )


def loaded(columns: np.ndarray, base: Base, piece: JointMotion) -> np.ndarray:
    """Columns (n, joints, b or more) of a piece with those of friction in proportion to its load."""
    if piece.load is not None:
        frictional = [number for number, parameter in enumerate(base.parameters) if parameter.frictional]
        columns[:, :, frictional] *= piece.load[:, None, None]
    return columns


def _blocks(pieces: Sequence[JointMotion]) -> list[np.ndarray]:
    """24th of its log of each thinned sample (k,), counted on from log to log."""
    counts = [len(piece.indices) for piece in pieces]
    blocks = []
    for number, piece in enumerate(pieces):
        mine = [index for index, sibling in enumerate(pieces) if sibling.log == piece.log]
        before = sum(counts[index] for index in mine if index < number)
        total = sum(counts[index] for index in mine)
        blocks.append(piece.log * BLOCKS + (before + np.arange(counts[number])) * BLOCKS // total)
    return blocks


def balanced(rows: Rows) -> Rows:
    """With the deviations of the residuals of each joint, as least squares with them finds them again; a joint alone
    has no other to be weighted against."""
    if len(rows.deviation) == 1:
        return rows
    for _ in range(WEIGHTS):
        columns, effort = rows.weighted
        off = rows.residual(np.linalg.lstsq(columns, effort, rcond=None)[0])
        joints = range(len(rows.deviation))
        deviation = np.array([np.sqrt(np.mean(off[rows.used & (rows.joint == joint)] ** 2)) for joint in joints])
        rows = replace(rows, deviation=np.maximum(deviation, 1e-12 * np.max(np.abs(rows.effort))))
    return rows


def check_excited(rows: Rows, where: str) -> None:
    """Refuse logs that say nothing of parameters, or in which some go together. where: the logs, as they are called.
    StickslipError: which."""
    names = rows.names
    if len(rows.effort) <= len(names):
        raise StickslipError(
            f"{len(rows.effort)} samples of {where} cannot determine {len(names)} parameters. Record a longer log, or "
            "keep more samples: a higher cutoff, in a recipe a lower 'least_speed' or 'decimate'."
        )
    for joint in range(len(rows.deviation)):
        mine = rows.effort[rows.joint == joint]
        if np.ptp(mine) == 0:
            raise StickslipError(
                f"{where}: an effort is {mine[0]:g} throughout, which says nothing of a machine. Check its column."
            )
    sizes = np.linalg.norm(rows.columns * rows.weight[:, None], axis=0)
    idle = [name for name, size in zip(names, sizes, strict=True) if size == 0]
    if idle:
        raise StickslipError(
            f"{where} says nothing of {', '.join(idle)}: no motion in it needs it. Record one that does, or leave it "
            "out."
        )
    if not names:
        return
    condition, inseparable = together(rows)
    if condition > INDISTINGUISHABLE:
        raise StickslipError(
            f"{where} cannot tell {', '.join(inseparable)} apart: each is a sum of the others there. "
            "Record a motion that excites all joints, at several speeds, take some as known, or leave one out."
        )


def together(rows: Rows) -> tuple[float, list[str]]:
    """Condition of the weighted columns, each scaled to one, and the parameters that they tell apart least."""
    columns, _ = rows.weighted
    _, singular, directions = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    shares = np.abs(directions[-1])
    inseparable = [name for name, share in zip(rows.names, shares, strict=True) if share > SHARE * shares.max()]
    return float(singular[0] / max(singular[-1], 1e-300)), inseparable
