"""Measured machines of several joints: the DFKI's double pendulum and what cutoffs do to its values; a Staubli TX40.

The logs are not part of the project; without them these tests are skipped.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas
import pytest
import sympy
from dfki_double_pendulum import MODEL

from fmu_models import Coulomb, Friction, Mechanism, Parameter
from identification.machines.identify import least_squares
from identification.machines.inverse import identify_machine
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import Cutoffs, MachineLog, motions
from identification.machines.read import read_machine_log
from identification.machines.regressor import base_parameters, regressor_of
from identification.machines.rows import balanced, rows_of
from identification.machines.urdf import mechanism_from_urdf

DATA = Path(__file__).parents[2].parent / "shared" / "data"
FOLDER, ROBOT = DATA / "dfki_double_pendulum_C0", DATA / "staubli_tx40"
COLUMNS = {"q1": "pos_meas1", "q2": "pos_meas2", "tau1": "tau_meas1", "tau2": "tau_meas2"}
KNOWN = {"l1": 0.2, "gr": 6.0, "g": 9.81}
RATIOS = (32, 32, 45, -48, 45, 32)  # of the gears of the TX40; joint 6 turns with motor 5 too
VISCOUS = (8.05, 5.53, 1.97, 1.11, 1.86, 0.65)  # N m s, published
DRY = (7.14, 8.26, 6.34, 2.48, 3.03, 0.282)  # N m, published
TENTHS = 10
INERTIAL = ("I2", "m1 r1", "m2 r2")


def measured(number: int) -> MachineLog:
    path = FOLDER / f"trajectory_{number:02d}.csv"
    if not path.exists():
        pytest.skip(f"the measured log {path.name} is not here: it is shared beside the project, not in it")
    return read_machine_log(path, MODEL, COLUMNS)


@pytest.fixture(scope="module")
def fits() -> dict[float, MachineFit]:
    """By cutoff, Hz, from all logs."""
    logs = [measured(number) for number in (0, 1, 2, 3, 4, 5, 6, 12, 13)]
    return {cutoff: identify_machine(MODEL, logs, known=KNOWN, cutoff=cutoff) for cutoff in (4.0, 20.0)}


def published() -> dict[str, float]:
    regressor = regressor_of(MODEL, KNOWN)
    base = base_parameters(regressor)
    return dict(zip(base.names, base.combine @ regressor.declared, strict=True))


@pytest.mark.nightly
def test_instruments_hardly_move_with_the_cutoff_and_lie_near_the_publication(fits: dict[float, MachineFit]):
    for name in INERTIAL:
        low, high = fits[4.0][name].value, fits[20.0][name].value
        assert high == pytest.approx(low, rel=0.03)
        assert low == pytest.approx(published()[name], rel=0.07)
        assert high == pytest.approx(published()[name], rel=0.07)


def test_least_squares_is_flagged_where_noise_is_in_its_columns(fits: dict[float, MachineFit]):
    assert not any("Least squares is biased" in said for said in fits[4.0].verdicts)
    assert any("Least squares is biased in I1, I2" in said for said in fits[20.0].verdicts)
    assert fits[20.0]["m2 r2"].least_squares < 0.5 * fits[20.0]["m2 r2"].value


def values_of(fit: MachineFit) -> dict[str, float]:
    return {one.name: one.value for one in fit.parameters}


def test_half_of_the_free_runs_stay_near_the_logs_and_swing_ups_decide_the_rest(fits: dict[float, MachineFit]):
    """Upright the pendulum is unstable: what the windows give together says little of the values."""
    for one, bound in zip(fits[4.0].joints, (0.04, 0.08), strict=True):
        assert one.usual_run is not None and one.usual_run < bound
    assert sum("hangs on where it begins" in said for said in fits[4.0].verdicts) == 2


def test_unseen_logs_are_predicted_as_well_as_by_the_publication():
    """Values from seven logs on the two others, per joint: at most three points worse than published values."""
    fit = identify_machine(MODEL, [measured(number) for number in (0, 1, 3, 4, 6, 12, 13)], known=KNOWN, cutoff=4.0,
                   held_out=[measured(2), measured(5)])  # fmt: skip
    regressor = regressor_of(MODEL, KNOWN)
    base = base_parameters(regressor)
    unseen = rows_of(regressor, base, motions([measured(2), measured(5)], regressor.joints, Cutoffs(4.0, 4.0)))
    theirs, ours = (np.array([of[name] for name in base.names]) for of in (published(), values_of(fit)))
    for place in range(len(fit.joints)):
        mine = unseen.joint == place
        of_theirs, of_ours = (np.linalg.norm(unseen.residual(one)[mine]) for one in (theirs, ours))
        assert of_ours < of_theirs + 0.03 * np.linalg.norm(unseen.effort[mine])


def robot() -> Mechanism:
    """The TX40 of its URDF, with what motor 6 shares between the joints of the wrist."""
    file = ROBOT / "tx40_mdh_modified.urdf"
    if not file.exists():
        pytest.skip(f"the robot {file.name} is not here: it is shared beside the project, not in it")
    arm = mechanism_from_urdf(file)
    w5, w6 = (q.v for q in arm.coordinates[4:])
    inertia, viscous = Parameter("Iam6", 0.0, "kg m2", "rotor 6"), Parameter("fvm6", 0.0, "N m s", "viscous")
    dry = Coulomb(N=sympy.S.One, mu=Parameter("fsm6", 0.0, "N m", "Coulomb"))
    return replace(
        arm,
        kinetic_energy=arm.kinetic_energy + inertia * w5 * w6,
        dissipation=arm.dissipation + viscous * w5 * w6,
        contacts=[*arm.contacts, Friction(name="wrist", slip=w5 + w6, law=dry)],
    )


def robot_log() -> MachineLog:
    """Joints from motors: positions (rad) by the inverse of the gears, torques (N m) by their transpose."""
    positions, currents = (pandas.read_csv(ROBOT / name).to_numpy() for name in ("pos_read_data.csv", "curr_data.csv"))
    gears = np.diag(np.array(RATIOS, dtype=float))
    gears[5, 4] = RATIOS[5]
    joints = np.linalg.solve(gears, positions.T).T + np.array([0, -np.pi / 2, np.pi / 2, 0, 0, 0])
    return MachineLog("tx40", 2e-4 * np.arange(len(joints)), joints, currents @ gears)


def test_a_robot_of_six_joints_shows_its_published_friction_and_predicts_what_it_has_not_seen():
    """Every second tenth of the log is left out; the columns are those of a 45 000 rows at 5 kHz."""
    regressor = regressor_of(robot())
    base = base_parameters(regressor)
    assert len(base.parameters) == 61
    pieces = motions([robot_log()], regressor.joints, Cutoffs(200.0, 10.0))
    rows = balanced(rows_of(regressor, base, pieces))
    found = least_squares(rows)
    values, deviations = (dict(zip(base.names, of, strict=True)) for of in (found.values, found.deviation))
    for joint, (viscous, dry) in enumerate(zip(VISCOUS, DRY, strict=True), 1):
        assert abs(values[f"fv{joint}"] - viscous) < 2 * deviations[f"fv{joint}"]
        assert abs(values[f"fs{joint}"] - dry) < 2 * deviations[f"fs{joint}"]
    count = np.count_nonzero(rows.joint == 0)
    tenth = np.tile(np.arange(count) * TENTHS // count, len(regressor.joints))
    seen, left_out = rows.where(tenth % 2 == 0), rows.where(tenth % 2 == 1)
    off = left_out.residual(least_squares(seen).values)
    assert np.linalg.norm(off) < 0.09 * np.linalg.norm(left_out.effort)
