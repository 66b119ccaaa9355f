"""A joint that rests at its turns, held there by friction: motion and effort are given in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from checkout import ROOT
from emulated_arm import ARM, log

from fmu_models import Coordinate, Coulomb, Friction, Input, Mechanism, Parameter, StickslipError
from fmu_models.oscillators import load
from identification.machines.inverse import identify_machine
from identification.machines.joint_laws import compare_joint_laws
from identification.machines.motion import MachineLog

DATA = ROOT / "data" / "machines"
J, B, F = 0.5, 0.8, 2.0  # kg m2, N m s, N m
REST = 0.12  # s
STEP = 0.002  # s
NOISE = 0.02  # N m


def slider() -> Mechanism:
    q, tau = Coordinate("q", "rad", "angle"), Input("tau", 0.0, "N m", "torque")
    inertia, viscous, dry = (
        Parameter(name, 1.0, unit, "") for name, unit in zip("Jbf", ("kg m2", "N m s", "N m"), strict=True)
    )
    return Mechanism(
        name="slider", title="slider", source="", coordinates=[q], applied={q: tau},
        kinetic_energy=inertia * q.v**2 / 2, dissipation=viscous * q.v**2 / 2,
        contacts=[Friction(name="bearing", slip=q.v, law=Coulomb(N=sympy.S.One, mu=dry))],
    )  # fmt: skip


def resting(seed: int) -> MachineLog:
    """Strokes of least jerk to and fro; in each rest the effort goes from one side of the friction to the other."""
    rng = np.random.default_rng(seed)
    position, effort, side, at = [], [], 1.0, 0.0
    for length, duration in zip(rng.uniform(0.3, 1.5, 24), rng.uniform(0.4, 0.9, 24), strict=True):
        s = np.arange(0, 1, STEP / duration)
        v = 30 * s**2 * (1 - s) ** 2 * length / duration
        a = 60 * s * (1 - s) * (1 - 2 * s) * length / duration**2
        position += [at + side * length * (10 * s**3 - 15 * s**4 + 6 * s**5)]
        effort += [side * (J * a + B * v + F)]
        at += side * length
        turn = np.arange(0, 1, STEP / REST)
        position += [np.full(len(turn), at)]
        effort += [side * F * (1 - 2 * turn)]
        side = -side
    q, tau = np.concatenate(position), np.concatenate(effort)
    time = STEP * np.arange(len(q))
    return MachineLog(f"resting {seed}", time, q[:, None], (tau + NOISE * rng.normal(size=len(tau)))[:, None])


@pytest.mark.nightly_for("instruments")
@pytest.mark.parametrize("method", ["instruments", "least squares"])
def test_a_joint_that_rests_at_its_turns_is_told_and_left_out_there(method: str):
    logs = [resting(1), resting(2)]
    with_rests = identify_machine(slider(), logs, method=method)
    (said,) = (one for one in with_rests.verdicts if "hardly move" in one)
    assert "f 2.01" in said and said.endswith("--still 0.1.")
    assert abs(with_rests["f"].value / F - 1) > 0.2
    assert not any("is biased" in one for one in with_rests.verdicts)  # not the noise of the positions
    without = identify_machine(slider(), logs, method=method, still=0.1, held_out=[resting(3)])
    for name, true in (("J", J), ("b", B), ("f", F)):
        # instruments take friction on a motion after a lower cutoff, which rounds the strokes
        assert without[name].value == pytest.approx(true, rel=0.015)
    assert not any("hardly move" in one for one in without.verdicts)
    assert without.still == 0.1 and without.samples < 0.8 * with_rests.samples
    (joint,) = without.joints
    # what is scored are the rows that count
    assert joint.held_out["resting 3"].relative_error < 0.02 < 2 * with_rests.joints[0].seen.relative_error
    law = compare_joint_laws(slider(), without, logs, ["Coulomb", "Coulomb+viscous"])["q"].best
    assert law.values["F"] == pytest.approx(F, rel=0.01)


@pytest.mark.nightly
def test_joints_that_slide_throughout_lose_nothing_by_it():
    arm, known = load(DATA / "two_link_arm.py"), {"g": ARM["g"], "l1": ARM["l1"]}
    whole, moving = (identify_machine(arm, [log(1), log(2)], known=known, still=still) for still in (0.0, 0.1))
    assert not any("hardly move" in one for one in whole.verdicts)
    for one in whole.parameters:
        assert abs(moving[one.name].value - one.value) < 3 * moving[one.name].standard_deviation
    behind = moving.identified
    assert behind is not None
    # those who leave a log out begin from the same equations
    every = np.ones(len(behind.rows.effort), dtype=bool)
    assert behind.from_rows(every) == pytest.approx([one.value for one in moving.parameters], rel=1e-10)


def test_a_share_that_is_none_is_refused():
    with pytest.raises(StickslipError, match=r"still = 1\.5 is no share of the usual speed"):
        identify_machine(slider(), [resting(1)], still=1.5)
    with pytest.raises(StickslipError, match="says 'least_speed'"):
        identify_machine(slider(), [resting(1)], cutoff=None, still=0.1)
