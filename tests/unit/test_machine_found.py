"""A machine with the values that logs gave it: its efforts are the fit's, and the engine moves it as the free run."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from emulated_arm import ARM, log
from typer.testing import CliRunner

from fmu_models import Mechanism, Signal, StickslipError, load, simulate
from fmu_models.oscillators import load as declared
from identification.commands.application import app
from identification.machines.machine_fit import MachineFit, identify_machine, read_machine_fit
from identification.machines.regressor import Regressor, regressor_of
from identification.machines.simulated import Stretches, run
from identification.transfer.machine import machine_with

DATA = Path(__file__).parents[2] / "data" / "machines"
KNOWN = {"g": ARM["g"], "l1": ARM["l1"]}
RNG = np.random.default_rng(6)


@pytest.fixture(scope="module")
def arm() -> Mechanism:
    return declared(DATA / "two_link_arm.py")


@pytest.fixture(scope="module")
def fit(arm: Mechanism) -> MachineFit:
    return identify_machine(arm, [log(1)], known=KNOWN, method="least squares")


def values(regressor: Regressor, fit: MachineFit) -> np.ndarray:
    """Of all monomials: those of the fit, the others 0."""
    found = {one.name: one.value for one in fit.parameters}
    return np.array([found.get(name, 0.0) for name in regressor.names])


def test_its_efforts_are_those_of_the_fit(arm: Mechanism, fit: MachineFit):
    found = machine_with(arm, fit)
    assert [p.name for p in found.parameters if p.name not in KNOWN] == [
        "J1",
        "J2",
        "m1_r1",
        "m2_r2",
        *["b1", "b2", "f1", "f2"],
    ]
    motion = RNG.normal(size=(3, 30, 2))
    before, after = regressor_of(arm, KNOWN), regressor_of(found, KNOWN)
    assert after(*motion) @ after.declared == pytest.approx(before(*motion) @ values(before, fit), abs=1e-12)


def test_the_engine_moves_it_as_the_free_run(arm: Mechanism, fit: MachineFit):
    """Without dry friction: efforts linear between samples are no approximation there, and steps of 4 ms are fine."""
    smooth = arm.restricted_to([])
    kept = replace(
        fit, machine=smooth.name, parameters=tuple(one for one in fit.parameters if one.name not in ("f1", "f2"))
    )
    regressor, one = regressor_of(smooth, KNOWN), log(2)
    rows = slice(100, 350)
    q, effort = one.position[rows], one.effort[rows]
    v = np.gradient(one.position, one.time, axis=0)[rows]
    step = float(one.time[1] - one.time[0])
    free, _, _ = run(regressor, values(regressor, kept), Stretches(step, q[None], v[None], effort[None]), 0.0)
    time = one.time[rows] - one.time[rows][0]
    engine = simulate(
        load(machine_with(smooth, kept)),
        float(time[-1]),
        start={"q1": q[0, 0], "q2": q[0, 1], "w1": v[0, 0], "w2": v[0, 1]},
        inputs={f"tau{i}": Signal(time, effort[:, i - 1]) for i in (1, 2)},
        output_times=time,
    )
    assert np.ptp(free[0], axis=0).min() > 0.3
    assert np.stack([engine["q1"], engine["q2"]], axis=1) == pytest.approx(free[0], abs=1e-6)


def test_what_cannot_be_a_machine_is_refused(arm: Mechanism, fit: MachineFit):
    with pytest.raises(StickslipError, match="of 'two_link_arm', and not of two_link_arm_free"):
        machine_with(arm.restricted_to([]), fit)
    driving = replace(fit, parameters=tuple(replace(one, value=-one.value) for one in fit.parameters))
    with pytest.raises(StickslipError, match=r"b1 = -0\.0\d+ N m s is friction that drives"):
        machine_with(arm, driving)


def test_friction_that_is_known_to_be_none_is_no_contact(arm: Mechanism):
    fit = identify_machine(arm, [log(1)], known={**KNOWN, "f2": 0.0}, method="least squares")
    found = machine_with(arm, fit)
    assert [contact.name for contact in found.contacts] == ["shoulder"]
    assert {p.name for p in found.parameters} == {*KNOWN, "J1", "J2", "m1_r1", "m2_r2", "b1", "b2", "f1"}


def test_a_result_of_the_command_is_read_again(tmp_path: Path, arm: Mechanism):
    path = tmp_path / "found.json"
    asked = [str(DATA / "two_link_arm.py"), str(DATA / "two_link_arm_1.csv"), "--set", "g=9.81", "--set", "l1=0.3"]
    done = CliRunner().invoke(app, ["inverse", *asked, "--method", "least squares", "-o", str(path), "--json"])
    assert done.exit_code == 0, done.output
    again = read_machine_fit(path)
    said = {one["name"]: one["value"] for one in json.loads(done.stdout)["parameters"]}
    assert {one.name: one.value for one in again.parameters} == said
    assert {p.name: p.value for p in machine_with(arm, again).parameters}["m2_r2"] == said["m2 r2"]
    for text in ("{", "[]", '{"machine": "a"}', json.dumps({**json.loads(path.read_text()), "parameters": [1]})):
        path.write_text(text)
        with pytest.raises(StickslipError, match="is no fit of a machine"):
            read_machine_fit(path)
