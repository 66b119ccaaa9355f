"""Runs that are driven by what was measured and held against it, on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

ARGUMENTS = ("simulate", "disc_rig", "--contacts", "disc0", "--until", "3")


@pytest.fixture
def log(stickslip, tmp_path: Path) -> Path:
    """A drive that speeds up, and what the rig does then: in other units, a column under another name, noise."""
    times = np.linspace(0.0, 3.0, 301)
    pd.DataFrame({"time [s]": times, "w [rad/s]": 0.4 + 0.1 * times}).to_csv(tmp_path / "drive.csv", index=False)
    answer = stickslip(*ARGUMENTS, "--input", "w0=drive.csv:w", "--samples", "301", "-o", "run.csv")
    assert answer.code == 0, answer
    run = pd.read_csv(tmp_path / "run.csv")
    noise = np.random.default_rng(3).normal(0.0, 0.001, times.size)
    table = {"clock [ms]": 1000 * times, "n [rpm]": run["w0 [rad/s]"] * 30 / np.pi}
    table |= {"theta [deg]": np.degrees(run["theta [rad]"] + noise), "speed [rad/s]": run["omega [rad/s]"]}
    path = tmp_path / "log.csv"
    pd.DataFrame(table).to_csv(path, index=False)
    fields = [{"name": "clock", "role": "time"}, {"name": "speed", "variable": "omega"}]
    resource = {"path": path.name, "schema": {"fields": fields}}
    (tmp_path / "datapackage.json").write_text(json.dumps({"resources": [resource]}))
    return path


def test_a_run_is_driven_by_a_log_and_held_against_it(stickslip, tmp_path, log):
    figure = tmp_path / "beside.png"
    beside = ("--input", f"w0={log}:n", "--beside", log, "--within", "0.02")
    found = stickslip(*ARGUMENTS, *beside, "--figure", figure, "--json").json["beside"]
    rows = {row["variable"]: row for row in found["columns"]}
    assert found["within"] and figure.exists()
    assert set(rows) == {"theta", "omega"}, "by the name, and by the variable that the sidecar states"
    assert rows["theta"]["rms"] == pytest.approx(0.001, rel=0.15) and rows["theta"]["samples"] == 301
    assert rows["omega"]["rms"] < 1e-9, "the run is evaluated at the times of the samples"
    shown = stickslip(*ARGUMENTS, *beside).out
    assert "run less measurement" in shown and "rms/span" in shown


def test_a_run_without_an_end_ends_with_its_log(stickslip, tmp_path, log):
    """3 s, where runs of ours are of 20 s and that of the scene of 4 s."""
    for model in ("disc_rig", "disc_rig_class_a"):
        assert stickslip("simulate", model, "--input", f"w0={log}:n", "-o", f"{model}.csv").code == 0
        assert pd.read_csv(tmp_path / f"{model}.csv").iloc[-1, 0] == 3.0


def test_a_run_that_differs_by_more_ends_with_1(stickslip, log):
    answer = stickslip(*ARGUMENTS, "--input", "w0=0.6", "--beside", log, "--within", "0.02")
    assert answer.code == 1 and "Not within the deviation" in answer.out
    by_steps = ("--method", "co-simulation", "--input", f"w0={log}:n", "--beside", log, "--within", "0.05")
    assert stickslip(*ARGUMENTS, *by_steps).code == 0


def test_a_coupled_run_is_held_against_a_log_and_drawn(stickslip, tmp_path, log):
    figure = tmp_path / "coupled.png"
    arguments = ("couple", "disc_rig_motors", "--until", "2", "--input", f"motor0.w_set={log}:n")
    one = ("--beside", f"rig.theta={log}:theta")
    drawn = ("--figure", figure, "--plot", "rig.theta:rig.omega")
    assert stickslip(*arguments, *one, "--within", "10", *drawn).code == 0 and figure.exists()
    for more in ((), ("--solver", "co-simulation", "--step", "0.01")):
        assert stickslip(*arguments, *one, *more, "--within", "1e-6").code == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--within", "1"), "say also from what: --beside LOG"),
        (("--beside", "nowhere.csv"), "There is no log 'nowhere.csv'"),
        (("--beside", "phi=LOG:theta"), "the run has no variable 'phi'"),
        (("--beside", "theta=LOG:angle"), "has no column 'angle', wanted for variable 'theta'"),
        (("--beside", "theta=LOG:speed"), "is in 'rad/s', which cannot be converted to rad"),
        (("--beside", "theta=LOG"), "A column of a log is LOG:COLUMN"),
        (("--input", "w0=LOG:theta"), "is in 'deg', which cannot be converted to rad/s"),
        (("--input", "w0=LOG:n", "--until", "4"), "covers 0 s to 3 s, the run 0 s to 4 s"),
    ],
)
def test_what_cannot_be_held_against_a_run_is_said(stickslip, log, arguments, message):
    given = [text.replace("LOG", str(log)) for text in arguments]
    answer = stickslip(*ARGUMENTS, *given)
    assert answer.code == 2 and message in answer.err
