"""What the commands refuse: bad input, spoilt logs, places that cannot be written; nothing is lost or half-written."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

RIGS = Path(__file__).parents[2] / "data" / "rigs" / "paper_rubber"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["show", "disc_rgi"], "Did you mean 'disc_rig'"),
        (["map", "henn"], "Did you mean 'henon'"),
        (["map", "henon", "--set", "c=1"], "henon has no parameter 'c'"),
        (["map", "henon", "--set", "b=0", "--negative"], "b = 0"),
        (["map", "piecewise_linear", "--set", "a=0.5"], "must exceed 1"),
        (["map", "henon", "--start", "x=1"], "Add --lyapunov"),
        (["map", "henon", "--lyapunov", "--start", "z=1"], "henon has no state 'z'"),
        (["map", "henon", "--lyapunov", "--start", "x=9"], "leaves every bound"),
        (["map", "logistic", "--negative"], "logistic has no inverse"),
        (["map", "logistic", "--vary", "r"], "NAME=VALUE"),
        (["map", "logistic", "--vary", "q=3"], "logistic has no parameter 'q'"),
        (["map", "logistic", "--set", "r=2", "--period", "2", "--vary", "r=4"], "no motion of period 2"),
        (["map", "logistic", "--period", "0"], "--period"),
        (["export", "disc_rig", "--contacts", "disk0"], "Did you mean 'disc0'"),
        (["export", "disc_rig", "--fmi", "1.0"], "There is no FMI 1.0"),
        (["export", "disc_rig", "-o", "rig.zip"], "must end in .fmu"),
        (["export", "disc_rig", "--set", "J=0"], "J"),
        (["export", "disc_rig", "--platform", "win65"], "There is no platform 'win65'. Did you mean 'win64'"),
        (["export", "disc_rig", "--fitted", "fitted.ssv"], "A parameter set is packed along with --ssp"),
        (["export", "disc_rig_motors", "--ssp", "--set", "J=1"], "is a system: its units say"),
        (["export", "disc_rig_motors", "--ssp", "-o", "x.zip"], "must end in .ssp"),
        (["export", "henon", "--contacts", "x"], "henon is a map: it has no contacts"),
        (["export", "henon", "--set", "period=0"], "period"),
        (["simulate", "disc_rig", "--set", "N0=-1"], "normal force of disc 0"),
        (["simulate", "disc_rig", "--set", "mu_k0=0.9"], "mu_k0 exceeds mu_s0"),
        (["simulate", "disc_rig", "--set", "mu_x0=0.9"], "Did you mean 'mu_s0'"),
        (["simulate", "disc_rig", "--set", "J=heavy"], "NAME=VALUE"),
        (["simulate", "disc_rig", "--set", "J=nan"], "finite"),
        (["simulate", "disc_rig", "--set", "J=1", "--set", "J=2"], "given twice"),
        (["simulate", "disc_rig", "--start", "thta=1"], "Did you mean 'theta'"),
        (["simulate", "disc_rig", "--input", "w2=1"], "has no input 'w2'"),
        (["simulate", "disc_rig", "--until", "-1"], "must end after it starts"),
        (["simulate", "missing.fmu"], "There is no file 'missing.fmu'"),
        (["simulate", "disc_rig", "--figure", "run.bmp"], "run.bmp"),
        (["emulate", "logs", "--material", "steel"], "no material 'steel'"),
        (["emulate", "logs", "--speeds", "fast"], "numbers separated by commas"),
        (["emulate", "logs", "--no-laser", "--no-encoder"], "no sensor sees the disc"),
        (["emulate", "logs", "--disturbance", "onze=5%"], "Did you mean 'once'"),
        (["emulate", "logs", "--disturbance", "drift=5%"], "Its unit is m."),
        (["emulate", "logs", "--disturbance", "once=80%"], "up to 0.5"),
        (["emulate", "logs", "--disturbance", "once=1%", "--second-disc", "0.3"], "with one disc"),
        (["fit", "nowhere"], "nowhere"),
        (["fit", RIGS, "--estimator", "guess"], "No estimator is called 'guess'"),
        (["fit", RIGS, "--law", "Cont"], "Did you mean 'Conti'"),
        (["fit", RIGS, "--set", "M=1"], "no constant 'M'"),
        (["fit", RIGS, "--uncertainty", "J=-1%"], "The uncertainty of J is -1"),
        (["fit", RIGS, "--uncertainty", "k/J=1%"], "An uncertainty of k/J needs its value"),
        (["fit", RIGS, "--set", "J=0.05+-1%", "--uncertainty", "J=1"], "'J' is given twice"),
        (["fit", RIGS / "free-decay.csv"], "no stick-slip log"),
        (["compare", "fit.json", RIGS], "fit.json"),
        (["demo", "."], "exists already"),
    ],
)
def test_bad_input_is_refused_with_a_reason_and_leaves_nothing(stickslip, tmp_path, arguments, said):
    answer = stickslip(*arguments)
    assert answer.code == 2
    assert said in answer.err
    assert "Traceback" not in answer.err
    assert not list(tmp_path.rglob("*"))


def test_what_exists_stays(stickslip, tmp_path):
    for command, target in (
        (("export", "disc_rig", "-o", "kept.fmu"), "kept.fmu"),
        (("simulate", "disc_rig", "--output", "kept.csv"), "kept.csv"),
        (("simulate", "disc_rig", "--figure", "kept.png"), "kept.png"),
        (("fit", RIGS, "--result", "kept.json"), "kept.json"),
        (("emulate", "kept", "--speeds", "0.83"), "kept"),
    ):
        path = tmp_path / target
        if target == "kept":
            path.mkdir()
            path = path / "mine.txt"
        path.write_text("mine")
        answer = stickslip(*command)
        assert answer.code == 2
        assert "exists already" in answer.err or "kept" in answer.err
        assert path.read_text() == "mine"


def test_what_comes_along_is_not_copied_over_what_is_there(stickslip, tmp_path, monkeypatch):
    monkeypatch.setattr("fmu_models.report.manual.manual_site", None)  # refused before it is built
    copied = stickslip("data", "copy", "scenes/disc_rig_class_a", "-o", "mine", "--json")
    (path,) = copied.json["files"]
    (tmp_path / path).write_text("mine")
    refused = {("data", "copy", "scenes/disc_rig_class_a"): "exists already", ("docs",): "holds something"}
    for command, said in refused.items():
        answer = stickslip(*command, "-o", "mine")
        assert answer.code == 2 and said in answer.err
    assert (tmp_path / path).read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0 if hasattr(os, "geteuid") else True, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written(stickslip, tmp_path):
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    answer = stickslip("export", "disc_rig", "-o", "locked/rig.fmu")
    assert (answer.code, "cannot be written" in answer.err) == (2, True)


def test_a_target_below_a_file_cannot_be_written(stickslip, tmp_path):
    (tmp_path / "file").write_text("")
    answer = stickslip("export", "disc_rig", "-o", "file/rig.fmu")
    assert answer.code == 2
    assert "cannot be written" in answer.err


def _spoil(text: str, fault: str) -> str:
    lines = text.splitlines()
    cells = lines[50].split(",")
    if fault == "empty":
        return ""
    if fault == "no laser, no encoder":
        return "\n".join(",".join([line.split(",")[0], *line.split(",")[4:]]) for line in lines)
    if fault == "no count":
        lines[50] = ",".join([*cells[:2], "nan", *cells[3:]])
    if fault == "unsorted":
        lines[50], lines[60] = lines[60], lines[50]
    if fault == "duplicate":
        lines[51] = lines[50]
    if fault == "short":
        lines = lines[:300]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("empty", "empty"),
        ("no laser, no encoder", "encoder"),
        ("no count", "encoder_count"),
        ("unsorted", "line"),
        ("duplicate", "line"),
        ("short", "cycle"),
    ],
)
def test_spoilt_logs_are_refused(stickslip, tmp_path, fault, said):
    shutil.copytree(RIGS, tmp_path / "logs")
    log = tmp_path / "logs" / "paper-rubber-0.83.csv"
    log.write_text(_spoil(log.read_text(), fault))
    sidecar = tmp_path / "logs" / "datapackage.json"
    package = json.loads(sidecar.read_text())
    for resource in package["resources"]:
        resource.pop("hash", None)
        resource.pop("bytes", None)
    sidecar.write_text(json.dumps(package))
    answer = stickslip("fit", tmp_path / "logs" / "paper-rubber-0.83.csv")
    assert answer.code == 2
    assert said in answer.err
