"""`stickslip calibrate` as a user meets it: a table, JSON, a result, and what bad input answers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate
from identification.calibration.result import read_calibration


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    """40 s of a block on a belt, 5 mm of noise."""
    time = np.linspace(0, 40, 401)
    run = simulate(load("forced_stick_slip"), 40.0, output_times=time)
    place = run["x"] + 5e-3 * np.random.default_rng(0).normal(size=401)
    file = tmp_path_factory.mktemp("log") / "run.csv"
    np.savetxt(file, np.column_stack([time, 1e3 * place]), delimiter=",", header="time [s],x [mm]", comments="")
    return file


def test_a_log_in_other_units_gives_parameters_with_intervals(stickslip, log, tmp_path):
    result, figure = tmp_path / "r.json", tmp_path / "r.svg"
    answer = stickslip(
        *("calibrate", "forced_stick_slip", log, "--free", "a0,k", "--set", "a0=1.1", "--set", "k=1.3"),
        *(
            "--bound",
            "k=0.5:2",
            "--prior",
            "a0=1.5+-0.5",
            "--held-out",
            log,
            "-o",
            result,
            "--figure",
            figure,
            "--json",
        ),
    )
    assert answer.code == 0, answer.err
    values = {one["name"]: one for one in answer.json["parameters"]}
    for name, truth in (("a0", 1.5), ("k", 1.0)):
        assert abs(values[name]["value"] - truth) < 4 * values[name]["standard_deviation"]
    assert answer.json["files"] == [str(result), str(figure)]
    found = read_calibration(result)
    assert found["k"].value == values["k"]["value"] and found["k"].maximum == 2.0
    assert json.loads(result.read_text())["type"] == "stickslip calibration"
    assert "Residuals" in found.summary()
    fmu = tmp_path / "belt.fmu"
    assert stickslip("apply", result, "-o", fmu).code == 0
    starts = {name: float(variable.start or 0) for name, variable in load(fmu).variables.items()}
    assert (starts["a0"], starts["k"]) == pytest.approx((values["a0"]["value"], values["k"]["value"]), rel=1e-15)
    assert stickslip("apply", result, "-o", tmp_path / "belt.ssv").code == 0
    assert 'name="k"' in (tmp_path / "belt.ssv").read_text()
    compared = stickslip("compare", result, log, "--figure", tmp_path / "c.svg", "--json")
    (one,) = compared.json["logs"]
    assert one["residuals"][0]["rms"] == pytest.approx(5e-3, rel=0.15) and not one["residuals"][0]["held_out"]
    assert (tmp_path / "c.svg").stat().st_size > 1000
    assert stickslip("report", result, log, "-o", tmp_path / "r.html").code == 0
    assert "run.csv" in (tmp_path / "r.html").read_text()
    ranked = stickslip("design", result, "--try", "omega=0.8,1.2", "--for", "k", "--json")
    assert {one["settings"]["omega"] for one in ranked.json["candidates"]} == {0.8, 1.2}
    assert ranked.json["candidates"][0]["deviations"]["k"] < ranked.json["deviations"]["k"]
    speed = tmp_path / "speed.csv"
    asked = ("--input", "v_dr=0.6:1.4", "--levels", "3", "--samples", "50", "--duration", "10")
    planned = stickslip("design", result, *asked, "--for", "k", "-o", speed)
    assert planned.code == 0 and "best of random" in planned.out and "written" in planned.out
    assert stickslip("simulate", "forced_stick_slip", "--input", f"v_dr={speed}:v_dr", "--until", "10").code == 0
    assert "-o writes inputs" in stickslip("design", result, "--within", "omega=1:2", "-o", speed).err
    assert "values, --try" in stickslip("design", result, "--for", "k").err
    refused = stickslip("compare", result, log, "--scene", "a.toml")
    assert refused.code == 2 and "that of any model; --scene: for that of a rig or a machine" in refused.err


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--free", "a0,kk"], "has no parameter 'kk'"),
        (["--free", "k", "--bound", "k=2"], "--bound takes NAME=LOW:HIGH"),
        (["--free", "k", "--prior", "k=1"], "--prior takes a value and its standard deviation"),
        (["--free", "k", "--column", "y=x"], "no state, output or input"),
        (["--free", "k", "--sensor", "x"], "--sensor takes NAME:gain,offset,delay"),
        (["--free", "k", "--resume"], "--resume goes on with a store: name it, --store search.zarr."),
        (["--free", "k", "--clip", "x=1:0"], "--clip takes NAME=LOW:HIGH with two ascending numbers"),
    ],
)
def test_bad_input_is_a_sentence(stickslip, log, more, words):
    answer = stickslip("calibrate", "forced_stick_slip", log, *more)
    assert answer.code == 2
    assert words in answer.err.replace("\n", " ")


def test_profile_and_posterior_are_as_wide_as_deviations_where_all_is_nearly_linear(stickslip, log, tmp_path):
    asked = ("calibrate", "forced_stick_slip", log, "--free", "k", "--start", "x", "--guesses", 1, "--attempts", 1)
    corner = tmp_path / "corner.png"
    answer = stickslip(*asked, "--profile", "--corner", corner, "-o", tmp_path / "r.json", "--json")
    assert answer.code == 0, answer.err
    assert corner.exists() and answer.json["files"] == [str(tmp_path / "r.json"), str(corner)]
    found = read_calibration(tmp_path / "r.json")
    k, (profiled,) = found["k"], (one for one in found.intervals if one.name == "k")
    assert found.interval("k") == profiled.ends and profiled.kind == "profile"
    wide = 2 * 1.966 * float(k.standard_deviation or np.nan)  # Student's t of 399 degrees of freedom
    assert profiled.ends[1] - profiled.ends[0] == pytest.approx(wide, rel=0.05)
    assert found.posterior is not None
    drawn = next(one for one in found.posterior.marginals if one.name == "k")
    assert drawn.standard_deviation == pytest.approx(k.standard_deviation, rel=0.15)
    assert "Posterior" in found.summary()
    assert "exists" in stickslip(*asked, "--corner", corner).err


def test_a_ball_is_calibrated_from_a_column_of_impact_times(stickslip, tmp_path):
    run = simulate(load("bouncing_ball"), 3.0, parameters={"e": 0.7, "A": 6e-3})
    times = [event.time for event in run.impacts]
    np.savetxt(tmp_path / "impacts.csv", times, header="t_hit", comments="")
    answer = stickslip(
        *("calibrate", "bouncing_ball", tmp_path / "impacts.csv", "--events", "table=t_hit", "--free", "e,A"),
        *("--set", "e=0.5", "--set", "A=0.004", "--json"),
    )
    assert answer.code == 0, answer.err
    values = {one["name"]: one["value"] for one in answer.json["parameters"]}
    # the times are exact but for six digits of the file's numbers and of the search
    assert values == pytest.approx({"e": 0.7, "A": 6e-3}, rel=1e-4)


def test_a_parameter_is_tracked_along_a_log(stickslip, log, tmp_path):
    figure = tmp_path / "a0.svg"
    answer = stickslip(
        *("track", "forced_stick_slip", log, "--drift", "a0", "--segments", "12", "--figure", figure),
        *("-o", tmp_path / "course.json", "--json"),
    )
    assert answer.code == 0, answer.err
    (a0,) = answer.json["parameters"]
    assert a0["name"] == "a0" and len(a0["values"]) == len(answer.json["nodes"])
    assert a0["values"][5] == pytest.approx(1.5, abs=0.02) and figure.stat().st_size > 1000
    asked = ("track", "forced_stick_slip", log, "--drift", "a0", "--rate", "a0=0.01")
    filtered = stickslip(*asked, "--online", "--json")
    assert filtered.code == 0 and filtered.json["online"] and len(filtered.json["nodes"]) > 100
    assert "--rate is of a filter" in stickslip(*asked).err
    table = stickslip("track", "forced_stick_slip", log, "--state", "v")
    assert table.code == 0 and "in the middle" in table.out
