"""Robots from URDF: efforts against equations typed by hand, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from emulated_arm import ARM, log, torques
from typer.testing import CliRunner
from urdf_robots import QUARTER, arm, joint, link
from whole_application import app

from fmu_models import StickslipError
from identification.machines.read import declared_machine
from identification.machines.regressor import Regressor, regressor_of
from identification.machines.urdf import mechanism_from_urdf

RNG = np.random.default_rng(5)


def regressor_from(folder: Path, text: str) -> Regressor:
    path = folder / "robot.urdf"
    path.write_text(text)
    return regressor_of(mechanism_from_urdf(path))


def efforts(regressor: Regressor, changed: Mapping[str, float], *motion: np.ndarray) -> np.ndarray:
    values = {**dict(zip(regressor.names, regressor.declared, strict=True)), **changed}
    return regressor(*motion) @ np.array([values[name] for name in regressor.names])


def test_a_planar_arm_takes_the_torques_of_lagranges_equations(tmp_path: Path):
    regressor = regressor_from(tmp_path, arm())
    friction = {"fv1": ARM["b1"], "fv2": ARM["b2"], "fs1": ARM["f1"], "fs2": ARM["f2"]}
    motion = RNG.normal(size=(3, 40, 2))
    assert efforts(regressor, friction, *motion) == pytest.approx(torques(*motion), abs=1e-12)
    assert regressor.efforts == ("tau1", "tau2")


def test_a_cart_with_a_pole_and_a_tool_that_is_fixed(tmp_path: Path):
    """(M + m) a + m l (cos q b - sin q w^2); m l^2 b + m l (cos q a - g sin q): the pole stands, in a turned frame;
    all of its mass is a tool that is fixed to it."""
    M, m, length = 2.0, 0.3, 0.4
    text = [
        link("rail"),
        link("cart", M),
        link("pole"),
        link("tool-0", m),
        joint("slide", "prismatic", "rail", "cart", xyz="0 0 1", axis="0 0 1", rpy=f"0 {QUARTER} 0"),
        joint("swing", "revolute", "cart", "pole", rpy=f"0 -{QUARTER} 0"),
        joint("flange", "fixed", "pole", "tool-0", xyz=f"0 0 {length}"),
    ]
    regressor = regressor_from(tmp_path, f'<robot name="1 cart">{"".join(text)}</robot>')
    q, v, a = RNG.normal(size=(3, 20, 2))
    pole, rate, bend = q[:, 1], v[:, 1], a[:, 1]
    cart = (M + m) * a[:, 0] + m * length * (np.cos(pole) * bend - np.sin(pole) * rate**2)
    swing = m * length**2 * bend + m * length * (np.cos(pole) * a[:, 0] - 9.81 * np.sin(pole))
    assert efforts(regressor, {}, q, v, a) == pytest.approx(np.stack([cart, swing], axis=1), abs=1e-12)
    assert dict(zip(regressor.names, regressor.units, strict=True))["fv1"] == "N s/m"


def test_branches_swing_by_themselves(tmp_path: Path):
    """Two pendulums on a table that turns about their axis: m l^2 (a0 + a_i) + m g l sin of where each points."""
    parts = [link("base"), link("table"), joint("turn", "revolute", "base", "table")]
    for side, mass in (("left", 0.5), ("right", 0.8)):
        parts += [link(side, mass, "0 0 -0.3"), joint(f"to-{side}", "revolute", "table", side)]
    regressor = regressor_from(tmp_path, f'<robot name="tree">{"".join(parts)}</robot>')
    q, v, a = RNG.normal(size=(3, 20, 3))
    single = [
        mass * 0.09 * (a[:, 0] + a[:, i]) + mass * 9.81 * 0.3 * np.sin(q[:, 0] + q[:, i])
        for i, mass in ((1, 0.5), (2, 0.8))
    ]
    assert efforts(regressor, {}, q, v, a) == pytest.approx(np.stack([sum(single), *single], axis=1), abs=1e-12)


TWO = link("a") + link("b") + link("c", 1.0)
BAD = {
    "broken": ("<robot><link", "is no URDF (unclosed token"),
    "other": ("<sdf/>", "begins with <sdf>, a URDF with <robot>"),
    "empty": ("<robot/>", "has 0 bases"),
    "twice": (
        TWO + joint("j", "revolute", "a", "b") + joint("k", "revolute", "a", "c") + joint("l", "fixed", "b", "c"),
        "Link 'c' of '{}' hangs on two joints, 'k' and 'l'",
    ),
    "loop": (
        TWO
        + link("d")
        + joint("j", "revolute", "a", "b")
        + joint("k", "fixed", "c", "d")
        + joint("l", "fixed", "d", "c"),
        "Joint 'k' of '{}' is one of a loop",
    ),
    "mimic": (
        TWO
        + joint("j", "revolute", "a", "b")
        + joint("k", "revolute", "b", "c").replace("<axis", '<mimic joint="j"/><axis'),
        "Joint 'k' of '{}' mimics 'j'",
    ),
    "bases": (TWO + joint("j", "revolute", "a", "c") + joint("k", "revolute", "b", "d"), "has 2 bases (a, b)"),
    "floating": (TWO + joint("j", "floating", "a", "b"), "Joint 'j' of '{}' is 'floating'"),
    "fixed": (TWO + joint("j", "fixed", "a", "b"), "No joint of '{}' moves"),
    "nowhere": (TWO + joint("j", "revolute", "a", "z"), "leads to 'z', and no link is called so"),
    "axis": (TWO + joint("j", "revolute", "a", "b", axis="0 0 0"), "The axis of joint 'j' is zero"),
    "two numbers": (TWO + joint("j", "revolute", "a", "b", axis="0 1"), "'0 1' is not three numbers"),
    "words": (TWO + joint("j", "revolute", "a", "b", xyz="0 ${l} 1"), "'0 ${l} 1' is not three numbers"),
    "mass": (link("a").replace('"0.0"', '"${m}"'), "The value in the inertial part of link 'a' is '${m}'"),
    "no parent": ('<joint name="j" type="fixed"/>', "Joint 'j' has no parent or no child"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_robot_is_refused_with_words(tmp_path: Path, case: str):
    text, said = BAD[case]
    path = tmp_path / "robot.urdf"
    path.write_text(text if text.startswith(("<robot", "<sdf")) else f"<robot>{text}</robot>")
    with pytest.raises(StickslipError) as error:
        mechanism_from_urdf(path)
    assert said.replace("{}", str(path)) in str(error.value)


def test_what_is_declared_without_energies_is_no_machine():
    with pytest.raises(StickslipError, match="is of class Automaton: efforts follow from energies"):
        declared_machine("fmu_models.oscillators.planar_hopf:MODEL")


def test_the_command_takes_a_urdf(tmp_path: Path):
    (tmp_path / "arm.urdf").write_text(arm())
    one = log(1)
    rows = np.column_stack([one.time, one.position, one.effort])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="time,q1,q2,tau1,tau2", comments="")
    asked = [str(tmp_path / "arm.urdf"), str(tmp_path / "log.csv"), "--method", "least squares", "--json"]
    done = CliRunner().invoke(app, ["inverse", *asked, "-o", str(tmp_path / "found.json")])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["machine"] == "two_link_arm"
    frictional = {one["name"] for one in found["parameters"] if one["frictional"]}
    assert frictional == {"fv1", "fs1", "fv2", "fs2"}  # an offset may have either sign


@pytest.mark.nightly
def test_a_robot_on_a_wall_has_its_gravity_from_the_command(tmp_path: Path):
    """The same arm in logs where gravity acts along its base's x: weight follows the cosine of where a link points."""
    (tmp_path / "arm.urdf").write_text(arm())
    one = log(1)
    q, p = one.position, ARM
    both = np.cumsum(q, axis=1)
    moments = np.array([p["m1"] * p["r1"] + p["m2"] * p["l1"], p["m2"] * p["r2"]]) * p["g"]

    def weight(of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        lower = moments[1] * of(both[:, 1])
        return np.stack([moments[0] * of(q[:, 0]) + lower, lower], axis=1)

    turned = one.effort - weight(np.sin) + weight(np.cos)
    rows = np.column_stack([one.time, q, turned])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="time,q1,q2,tau1,tau2", comments="")
    asked = ["inverse", str(tmp_path / "arm.urdf"), str(tmp_path / "log.csv"), "--method", "least squares", "--json"]

    def found(*more: str) -> float:
        done = CliRunner().invoke(app, [*asked, *more])
        assert done.exit_code == 0, done.output
        return max(one["seen"]["relative_error"] for one in json.loads(done.stdout)["joints"])

    assert found("--gravity", "9.81,0,0") < 0.03 and found() > 0.1
    for text, said in (("9.81", "--gravity takes three numbers"), ("0,0,x", "found '0,0,x'")):
        done = CliRunner().invoke(app, [*asked, "--gravity", text])
        assert done.exit_code != 0 and said in f"{done.exception}"
    with pytest.raises(StickslipError, match="declares its potential energy itself"):
        declared_machine("my_robot.py", (0.0, 0.0, -1.0))
