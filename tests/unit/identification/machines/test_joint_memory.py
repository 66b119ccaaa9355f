"""Joints whose friction remembers: laws found along their way, and refused where a log tells nothing of memory."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from remembering_joint import SLIDING, STIFF, VISCOUS, J, Trajectory, dahl, joint, log, lugre, maxwell, rigid
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from identification.inference.comparison import LawComparison
from identification.machines.inverse import identify_machine
from identification.machines.joint_laws import compare_joint_laws, with_laws
from identification.machines.motion import MachineLog

SLIDERS = {"k_1": 20.0, "k_2": 7.5, "D_1": 0.01, "D_2": 0.04}
BRISTLES = {"F_k": 0.5, "F_f": 0.2, "p": 5.0, "sigma0": STIFF}


def compared(logs: list[MachineLog], *laws: str) -> LawComparison:
    machine = joint()
    fit = identify_machine(machine, logs, method="least squares")
    return compare_joint_laws(machine, fit, logs, laws)["q"]


@pytest.mark.parametrize(
    ("friction", "law", "truth"),
    [
        (dahl, "Dahl+viscous", {"sigma": STIFF, "F_c": SLIDING, "J": J, "F_v": VISCOUS}),
        pytest.param(maxwell, "MaxwellSlip-2+viscous", SLIDERS, marks=pytest.mark.nightly),
        pytest.param(lugre, "LuGre+viscous", BRISTLES, marks=pytest.mark.nightly),
    ],
)
def test_a_joint_with_memory_is_found(friction: Callable[..., Any], law: str, truth: dict[str, float]):
    """Two logs, each from a memory of its own, that no estimator made."""
    found = compared([log(1, friction), log(2, friction)], "Coulomb+viscous", law)
    assert found.preferred == law
    for name, value in truth.items():
        assert abs(found.best.values[name] - value) < 2.5 * found.best.deviations[name], name
        assert found.best.deviations[name] < 0.3 * value, name
    assert found.best.units.get("sigma", "N m/rad") == "N m/rad"
    assert found.best.rms < 0.05 * found.scores[1].rms


def test_rigid_friction_has_no_stiffness():
    """Coulomb's friction is taken for what it is, and the stiffness said to be open."""
    logs = [log(1, rigid)]
    machine = joint()
    fit = identify_machine(machine, logs, method="least squares")
    judged = with_laws(machine, fit, logs, ("Coulomb+viscous", "Dahl+viscous"))
    assert judged.laws["q"].preferred == "Coulomb+viscous"
    said = " ".join(judged.verdicts)
    assert "Dahl+viscous is put aside on 'q': Its stiffness is not determined: it is larger than" in said


def test_presliding_within_a_step_of_the_encoder_is_open():
    found = compared([log(1, dahl, count=0.05)], "Coulomb+viscous", "Dahl+viscous")
    (warning, *_) = next(score for score in found.scores if score.law == "Dahl+viscous").warnings
    assert "N m/rad, for it gives way within a step of its encoder, 0.05" in warning
    assert found.preferred != "Dahl+viscous"


class Forwards(Trajectory):
    """A joint that never comes back."""

    def __call__(self, t: np.ndarray, order: int = 0) -> np.ndarray:
        onwards = 3.0 * t if order == 0 else np.full_like(t, 3.0) if order == 1 else np.zeros_like(t)
        return super().__call__(t, order) + onwards


def test_a_joint_that_never_reverses_is_left_aside():
    found = compared([log(1, rigid, way=Forwards(1))], "Coulomb+viscous", "Dahl", "MaxwellSlip-2")
    assert set(found.aside) == {"Dahl", "MaxwellSlip-2"}
    assert found.aside["Dahl"] == "It never reverses in these logs: they tell nothing of a stiffness."
    assert [score.law for score in found.scores] == ["Coulomb+viscous"]


def followed(friction: Callable[..., Any], **how: bool) -> tuple[MachineLog, np.ndarray, np.ndarray]:
    """A log whose friction follows a normal force about 40 N, and warms by 12 K, 1 % weaker with each."""
    plain, way = log(3, friction, noise=0.0), Trajectory(3)
    t = plain.time
    load, kelvin = 40.0 * (1 + 0.4 * np.sin(2.3 * t)), 300.0 + 2 * t
    dry = friction(way, t, np.random.default_rng(1003).uniform(-0.02, 0.02))
    factor = (load / 40.0 if how.get("load") else 1.0) * (1 - 0.01 * (kelvin - 306.0) if how.get("warm") else 1.0)
    noise = 0.02 * np.random.default_rng(7).normal(size=(len(t), 1))
    return replace(plain, effort=plain.effort + (dry * (factor - 1))[:, None] + noise), load, kelvin


def test_friction_follows_a_normal_force():
    one, load, _ = followed(rigid, load=True)
    one = replace(one, load=load)
    fit = identify_machine(joint(), [one], method="least squares")
    assert fit.conditions.load == np.median(load)
    assert fit["f"].value * 40.0 / float(np.median(load)) == pytest.approx(SLIDING, rel=0.01)
    ignored = identify_machine(joint(), [replace(one, load=None)], method="least squares")
    assert ignored.joints[0].seen.relative_error > 5 * fit.joints[0].seen.relative_error
    assert "in proportion to the normal force, 24 to 56 N" in fit.verdicts[0]
    with pytest.raises(StickslipError, match="Some logs have a normal force and others none"):
        identify_machine(joint(), [one, replace(one, load=None)])
    with pytest.raises(StickslipError, match="The normal force falls to -56 N"):
        identify_machine(joint(), [replace(one, load=-load)])


@pytest.mark.parametrize(
    ("friction", "law"), [(rigid, "Coulomb+viscous"), pytest.param(dahl, "Dahl+viscous", marks=pytest.mark.nightly)]
)
def test_laws_follow_load_and_temperature(friction: Callable[..., Any], law: str):
    one, load, kelvin = followed(friction, load=True, warm=True)
    one = replace(one, load=load, temperature=kelvin)
    fit = identify_machine(joint(), [one], method="least squares")
    assert "The temperature changes by 12 K" in " ".join(fit.verdicts)
    found = compare_joint_laws(joint(), fit, [one], ("Coulomb", law))["q"].best
    assert found.law == law
    # at the medians of both
    there = SLIDING * float(np.median(load)) / 40.0 * (1 - 0.01 * (float(np.median(kelvin)) - 306.0))
    force = found.values["F_c" if law.startswith("Dahl") else "F"]
    assert force == pytest.approx(there, rel=0.01)
    assert (
        abs(found.values["a_T"] + 0.01 * SLIDING * float(np.median(load)) / 40.0 / there) < 3 * found.deviations["a_T"]
    )
    assert found.deviations["a_T"] < 0.001


@pytest.fixture
def machine_and_log(tmp_path: Path) -> list[str]:
    """A declaration and a log as files."""
    here = Path(__file__).parent
    declared = tmp_path / "link.py"
    declared.write_text(
        f"import sys\nsys.path.insert(0, {str(here)!r})\nfrom remembering_joint import joint\nMODEL = joint()\n"
    )
    one = log(1, dahl)
    rows = np.column_stack([one.time, one.position, one.effort, 20 + one.time, 0 * one.time + 0.03])
    header = "time,q,tau,Motor [degC],Fn [kN]"
    np.savetxt(tmp_path / "log.csv", rows, "%.9g", ",", header=header, comments="")
    return [str(declared), str(tmp_path / "log.csv")]


def test_the_command_compares_laws_by_name(machine_and_log: list[str]):
    asked = ["inverse", *machine_and_log, "--method", "least squares", "--laws"]
    found = json.loads(CliRunner().invoke(app, [*asked, "Coulomb,Dahl+viscous", "--json"]).stdout)
    assert next(score["law"] for score in found["laws"]["q"]["scores"]) == "Dahl+viscous"
    assert "a_T" not in found["laws"]["q"]["scores"][0]["values"]
    beside = ["--column", "temperature=Motor", "--column", "normal_force=Fn", "--json"]
    found = json.loads(CliRunner().invoke(app, [*asked, "Coulomb,Coulomb+viscous", *beside]).stdout)
    assert found["conditions"] == {"load": 30.0, "temperature": pytest.approx(296.15, abs=0.01)}
    assert set(found["laws"]["q"]["scores"][0]["units"].values()) >= {"1/K"}
    refused = CliRunner().invoke(app, [*asked, "Coulomb,Dahll"])
    assert "There is no friction law 'Dahll'. Did you mean 'Dahl'?" in str(refused.exception)
