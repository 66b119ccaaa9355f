"""Friction laws of each joint of a machine, compared on what its effort holds beside inertia and gravity.

    friction of joint j = tau_j - (Y theta)_j over the base parameters that are not friction, at their values

A law is a function of the joint's own velocity, with a constant offset beside it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmu_models.language.mechanism import Mechanism
from identification.fit.inverse import compared_laws
from identification.inference.comparison import LawComparison
from identification.machines.axis_problem import law_problems
from identification.machines.axis_terms import BY_DIRECTION, Model, Term
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import PER_PERIOD, Cutoffs, MachineLog, Motion, motions
from identification.machines.regressor import Regressor, regressor_of
from identification.measurement.recipe import EFFORT, TIME, VELOCITY
from identification.measurement.signals import Piece, Prepared

LAWS = ("Coulomb", "Coulomb+viscous", "Stribeck+viscous", BY_DIRECTION)
OFFSET = (Term("offset", "offset"),)


def compare_joint_laws(
    mechanism: Mechanism, fit: MachineFit, logs: Sequence[MachineLog], laws: Sequence[str] = LAWS
) -> dict[str, LawComparison]:
    """By joint, laws compared as `inverse_dynamics` does; logs: those of the fit.

    Raises:
        StickslipError: as in `motions`; or a log too short to compare laws by.
    """
    regressor = regressor_of(mechanism, fit.known)
    pieces = motions(logs, regressor.joints, Cutoffs(fit.cutoff, fit.parallel_cutoff))
    friction = [piece.effort - _rest(regressor, fit, piece) for piece in pieces]
    every = max(int(1 / (PER_PERIOD * fit.parallel_cutoff * pieces[0].step)), 1)
    found = {}
    for place, joint in enumerate(fit.joints):
        parts = tuple(
            _part(piece, piece.velocity[:, place], of[:, place]) for piece, of in zip(pieces, friction, strict=True)
        )
        turning = joint.unit == "N m"
        prepared = Prepared(joint.joint, parts, turning, every * pieces[0].step, every, 0.0, ())
        found[joint.joint] = compared_laws(law_problems(prepared, Model(OFFSET, tuple(laws))), joint.joint)
    return found


def _rest(regressor: Regressor, fit: MachineFit, piece: Motion) -> np.ndarray:
    """Efforts (n, joints) without friction, at the full rate."""
    inertial = [one for one in fit.parameters if not one.frictional]
    places = [regressor.names.index(one.name) for one in inertial]
    columns = regressor(piece.position, piece.velocity, piece.acceleration)[:, :, places]
    return columns @ np.array([one.value for one in inertial])


def _part(piece: Motion, velocity: np.ndarray, effort: np.ndarray) -> Piece:
    # the ends, where derivatives have no past, are cut off as in the fit
    used = slice(piece.kept.start, piece.kept.stop)
    return Piece({TIME: piece.time[used], VELOCITY: velocity[used], EFFORT: effort[used]})
