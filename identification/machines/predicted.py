"""Efforts of logs by a fit's values, beside those that were measured: both after the low-pass of the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.language.mechanism import Mechanism
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import Cutoffs, MachineLog, motions
from identification.machines.regressor import regressor_of


@dataclass(frozen=True, eq=False)
class Predicted:
    """A piece of a log without gaps. time: (n,) s; measured, modelled: (n, joints), in the units of the joints."""

    log: str
    time: np.ndarray
    measured: np.ndarray
    modelled: np.ndarray


def predict_efforts(mechanism: Mechanism, fit: MachineFit, logs: Sequence[MachineLog]) -> list[Predicted]:
    """Efforts that the motion in logs takes by the fit of the same mechanism.

    Raises:
        StickslipError: as in `motions`.
    """
    regressor = regressor_of(mechanism, fit.known)
    places = [regressor.names.index(one.name) for one in fit.parameters]
    values = np.array([one.value for one in fit.parameters])
    return [
        Predicted(
            logs[piece.log].name,
            piece.time[piece.kept],
            piece.thinned(piece.effort),
            piece.thinned(regressor(piece.position, piece.velocity, piece.acceleration)[:, :, places] @ values),
        )
        for piece in motions(logs, regressor.joints, Cutoffs(fit.cutoff, fit.parallel_cutoff))
    ]
