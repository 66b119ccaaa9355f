"""Friction laws compared joint by joint: the one that an emulated arm has is found, on each joint its own."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from checkout import ROOT
from emulated_arm import ARM, log
from scipy.signal import savgol_filter
from typer.testing import CliRunner
from whole_application import app

from fmu_models import Parameter
from fmu_models.oscillators import load
from identification.machines.inverse import identify_machine
from identification.machines.joint_laws import compare_joint_laws
from identification.machines.motion import MachineLog

DATA = ROOT / "data" / "machines"
KNOWN = {"g": ARM["g"], "l1": ARM["l1"]}
FALL, OVER = 0.4, 0.5  # N m, rad/s
DIFFERENCE = 0.05  # N m, half of it
MORE = 0.05  # N m s, viscous friction of the elbow forwards


def with_other_friction(one: MachineLog) -> MachineLog:
    """The shoulder's friction falls with speed; the elbow's viscous one is greater forwards."""
    # smooth over 0.16 s: counts of the encoder would make the friction itself noisy
    v = np.asarray(savgol_filter(one.position, 41, 3, deriv=1, delta=one.time[1] - one.time[0], axis=0))
    shoulder = FALL * np.exp(-((v[:, 0] / OVER) ** 2)) * np.sign(v[:, 0])
    return replace(one, effort=one.effort + np.stack([shoulder, MORE * np.maximum(v[:, 1], 0)], axis=1))


def test_each_joint_has_its_own_law():
    arm = load(DATA / "two_link_arm.py")
    logs = [with_other_friction(log(1)), with_other_friction(log(2))]
    fit = identify_machine(arm, logs, known=KNOWN, method="least squares")
    laws = compare_joint_laws(arm, fit, logs)
    shoulder, elbow = laws["q1"].best, laws["q2"].best
    assert (shoulder.law, elbow.law) == ("Stribeck+viscous", "Coulomb+viscous by direction")
    assert shoulder.values["F_s"] - shoulder.values["F_k"] == pytest.approx(FALL, rel=0.15)
    assert shoulder.values["v_s"] == pytest.approx(OVER, rel=0.15)
    assert shoulder.units["v_s"] == "rad/s" and shoulder.units["F_s"] == "N m"
    assert elbow.values["F_v+"] - elbow.values["F_v-"] == pytest.approx(MORE, rel=0.15)
    assert elbow.values["F_c+"] == pytest.approx(ARM["f2"], rel=0.15)


@pytest.mark.nightly
def test_an_offset_of_the_machine_is_friction_by_direction():
    """The elbow's friction is greater forwards: declared as an offset of its effort, told by laws of either form."""
    arm = load(DATA / "two_link_arm.py")
    q2 = arm.coordinates[1]
    with_offset = replace(arm, applied={**arm.applied, q2: arm.applied[q2] - Parameter("o2", 0.0, "N m", "offset")})
    logs = [replace(log(seed), effort=log(seed).effort + np.array([0.0, DIFFERENCE])) for seed in (1, 2)]
    fit = identify_machine(with_offset, logs, known=KNOWN, method="least squares")
    assert fit["o2"].value == pytest.approx(DIFFERENCE, rel=0.05)
    found = {one.law: one.values for one in compare_joint_laws(with_offset, fit, logs)["q2"].scores}
    assert found["Coulomb+viscous"]["offset"] == pytest.approx(DIFFERENCE, rel=0.05)
    by_direction = found["Coulomb+viscous by direction"]
    assert by_direction["F_c+"] == pytest.approx(ARM["f2"] + DIFFERENCE, rel=0.05)
    assert by_direction["F_c-"] == pytest.approx(ARM["f2"] - DIFFERENCE, rel=0.15)


@pytest.mark.nightly
def test_the_command_compares_laws_of_a_machine():
    arm, one = str(DATA / "two_link_arm.py"), str(DATA / "two_link_arm_1.csv")
    asked = [arm, one, "--set", "g=9.81", "--set", "l1=0.3", "--method", "least squares", "--laws", "usual"]
    found = json.loads(CliRunner().invoke(app, ["inverse", *asked, "--json"]).stdout)
    assert {joint: laws["scores"][0]["law"] for joint, laws in found["laws"].items()} == {
        "q1": "Coulomb+viscous",
        "q2": "Coulomb+viscous",
    }
    shown = CliRunner().invoke(app, ["inverse", *asked]).stdout
    assert "q1: Friction laws" in shown and "q2: Friction laws" in shown


def test_laws_that_are_asked_for_come_before_those_of_a_recipe():
    asked = ["inverse", "axis", str(DATA / "axis.csv"), "--laws", "Coulomb,Coulomb+viscous", "--json"]
    (laws,) = json.loads(CliRunner().invoke(app, asked).stdout)["laws"].values()
    assert {score["law"] for score in laws["scores"]} == {"Coulomb", "Coulomb+viscous"}
