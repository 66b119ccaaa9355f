"""A machine with the values that logs gave it: its efforts are the fit's, and the engine moves it as the free run."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from checkout import ROOT
from emulated_arm import ARM, log
from typer.testing import CliRunner
from whole_application import app

from fmu_models import Mechanism, Signal, StickslipError, load, simulate
from fmu_models.fmu.fmu import Fmu
from fmu_models.oscillators import load as declared
from identification.fitted_model.machine import machine_with
from identification.machines.inverse import identify_machine
from identification.machines.machine_fit import MachineFit, read_machine_fit
from identification.machines.regressor import Regressor, regressor_of
from identification.machines.simulated import Stretches, run
from identification.model_check.machine_runs import machine_runs

DATA = ROOT / "data" / "machines"
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


def command(*arguments: str | Path) -> dict[str, Any]:
    done = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    assert done.exit_code == 0, f"{done.exception} {done.output}"
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result of the command."""
    path = tmp_path_factory.mktemp("saved") / "found.json"
    known = ("--set", "g=9.81", "--set", "l1=0.3")
    asked = (DATA / "two_link_arm.py", DATA / "two_link_arm_1.csv", *known, "--method", "least squares")
    said = command("inverse", *asked, "-o", path)["parameters"]
    again = read_machine_fit(path)
    assert {one.name: one.value for one in again.parameters} == {one["name"]: one["value"] for one in said}
    assert again.declaration == str(DATA / "two_link_arm.py")
    return path


def test_it_is_run_beside_logs_window_by_window(arm: Mechanism, saved: Path):
    fit, one = read_machine_fit(saved), log(2)
    (found,) = machine_runs(arm, fit, [one], window=0.5)
    assert not found.given_up and len(found.ends) == 19
    begins = np.append(0, found.ends[:-1] + 1)
    assert np.array_equal(found.simulated[begins], found.measured[begins])
    # what is left of a joint's motion, over that motion
    left = np.sqrt(np.mean((found.simulated - found.measured) ** 2, axis=0)) / np.std(found.measured, axis=0)
    assert [one.relative for one in found.joints] == pytest.approx(left)
    assert found.measured[:, 0] == pytest.approx(np.interp(found.time, one.time, one.position[:, 0]), abs=0.01)
    parameters = [replace(p, value=2 * p.value) if p.name == "J2" else p for p in fit.parameters]
    (wrong,) = machine_runs(arm, replace(fit, parameters=tuple(parameters)), [one], window=0.5)
    for right, other in zip(found.joints, wrong.joints, strict=True):
        assert right.relative is not None and other.relative is not None
        assert right.relative < 0.03 and other.relative > 5 * right.relative


@pytest.mark.nightly
def test_the_commands_take_it_further(tmp_path: Path, saved: Path):
    """Compare, report, apply: figures, a page that holds the fit, an FMU and a system with its values."""
    fit = read_machine_fit(saved)
    logs = [DATA / f"two_link_arm_{number}.csv" for number in (1, 2)]
    compared = command("compare", saved, *logs, "--figure", tmp_path / "runs.png")
    assert [one["log"] for one in compared["logs"]] == [one.name for one in logs]
    assert all(joint["relative"] < 0.05 for one in compared["logs"] for joint in one["joints"])
    assert (tmp_path / "runs.png").stat().st_size > 10000
    command("report", saved, *logs, "-o", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    held = json.loads(page.partition('id="data">')[2].partition("</script>")[0])
    assert held["fit"]["parameters"] == json.loads(saved.read_text())["parameters"]
    assert page.count("<svg") == 4 and "m1 r1 + 0.3 m2" in page and "http://" not in page.replace("http://www.w3", "")
    command("apply", saved, "-o", tmp_path / "arm.fmu")
    values = {one.name.replace(" ", "_"): one.value for one in fit.parameters}
    fmu = Fmu.open(tmp_path / "arm.fmu")
    assert {name: float(str(fmu.variables[name].start)) for name in fmu.parameters} == {**KNOWN, **values}
    command("apply", saved, "-o", tmp_path / "arm.ssp", "--only", "J2")
    with zipfile.ZipFile(tmp_path / "arm.ssp") as file:
        assert "resources/two_link_arm_found.fmu" in file.namelist()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["compare", "LOG", "--scene", "a.toml"], "that of a machine; --scene: for that of a rig"),
        (["report", "LOG", "--interactive"], "that of a machine; --interactive: for that of a rig"),
        (["compare", "LOG", "--machine", "gone.py"], "gone.py"),
        (["compare", "LOG", "--window", "30"], "holds no window of 30 s"),
        (["apply", "-o", "a.fmu", "--only", "J9"], "hands on no 'J9'"),
    ],
)
def test_what_does_not_go_with_a_machine_is_said(saved: Path, arguments: list[str], said: str):
    asked = [str(DATA / "two_link_arm_1.csv") if one == "LOG" else one for one in arguments[1:]]
    done = CliRunner().invoke(app, [arguments[0], str(saved), *asked])
    assert done.exit_code != 0 and said in f"{done.exception} {done.output}"


def test_a_fit_that_is_none_is_refused(tmp_path: Path, saved: Path):
    path = tmp_path / "found.json"
    for text in ("{", "[]", '{"machine": "a"}', json.dumps({**json.loads(saved.read_text()), "parameters": [1]})):
        path.write_text(text)
        with pytest.raises(StickslipError, match="is no fit of a machine"):
            read_machine_fit(path)
