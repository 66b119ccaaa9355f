"""Efforts of logs by a fit's values, beside those that were measured: both after the low-pass of the fit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.language.mechanism import Mechanism
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import Cutoffs, JointMotion, MachineLog, motions
from identification.machines.regressor import base_parameters, regressor_of
from identification.machines.rows import Rows, rows_of


@dataclass(frozen=True, eq=False)
class Predicted:
    """A piece of a log without gaps. time: (n,) s; velocity, measured and modelled effort, friction in the latter: (n,
    joints), in the units of the joints."""

    log: str
    time: np.ndarray
    velocity: np.ndarray
    measured: np.ndarray
    modelled: np.ndarray
    friction: np.ndarray


def predict_efforts(mechanism: Mechanism, fit: MachineFit, logs: Sequence[MachineLog]) -> list[Predicted]:
    """Efforts that the motion in logs takes by the fit of the same mechanism; errors as for `motions`."""
    regressor = regressor_of(mechanism, fit.known)
    pieces = motions(fit.conditions.relative(logs), regressor.joints, cutoffs_of(fit))
    rows = rows_of(regressor, base_parameters(regressor), pieces)
    return _predicted(fit, rows, pieces, [log.name for log in logs])


def fitted_efforts(fit: MachineFit) -> list[Predicted]:
    """The predicted efforts of the logs of a fit that was not read from a file. StickslipError: it was."""
    if fit.identified is None:
        raise StickslipError("This fit was read from a file, which holds no logs: predict the efforts of logs instead.")
    return _predicted(fit, fit.identified.rows, fit.identified.pieces, fit.logs)


def _predicted(fit: MachineFit, rows: Rows, pieces: Sequence[JointMotion], logs: Sequence[str]) -> list[Predicted]:
    values = np.array([fit[name].value for name in rows.names])
    friction = np.array([fit[name].frictional for name in rows.names])
    modelled, dry = rows.given + rows.columns @ values, rows.columns @ (values * friction)
    predictions, start = [], 0
    for piece in pieces:
        end = start + len(piece.indices) * len(fit.joints)
        velocity, measured, model, force = (
            values[start:end].reshape(len(fit.joints), -1).T for values in (rows.speed, rows.effort, modelled, dry)
        )
        predictions.append(Predicted(logs[piece.log], piece.time[piece.indices], velocity, measured, model, force))
        start = end
    return predictions


def friction_curves(mechanism: Mechanism, fit: MachineFit, speeds: np.ndarray) -> np.ndarray:
    """Friction (n, joints) of each joint, moving alone at speeds (n, joints), the others at rest."""
    regressor = regressor_of(mechanism, fit.known)
    places = [regressor.names.index(parameter.name) for parameter in fit.parameters]
    values = np.array([parameter.value if parameter.frictional else 0.0 for parameter in fit.parameters])
    forces = np.empty_like(speeds)
    for joint, column in enumerate(speeds.T):
        v = np.zeros_like(speeds)
        v[:, joint] = column
        zeros = np.zeros_like(v)
        forces[:, joint] = regressor(zeros, v, zeros)[:, joint, places] @ values
    return forces


def cutoffs_of(fit: MachineFit) -> Cutoffs | None:
    """The filters by which the logs of a fit were made ready."""
    if fit.cutoff is None:
        return None
    return Cutoffs(fit.cutoff, fit.parallel_cutoff or fit.cutoff, fit.still)
