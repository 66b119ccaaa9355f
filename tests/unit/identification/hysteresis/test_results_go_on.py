"""Results of loops and decays where other fits go: compared with other logs, reported, handed on, pasted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from emulated_loop import growing, noisy, of_bouc_wen, of_sliders
from fmpy import simulate_fmu
from typer.testing import CliRunner
from whole_application import app

from fmu_models import BoucWen, Hysteresis, MaxwellSlip, Signal, simulate
from fmu_models import load as load_model
from fmu_models.base.trust import command_line
from identification import LoopLog, identify_hysteresis, read_calibration
from identification.calibration.result import calibrated_fmu
from identification.hysteresis.again import loop_log

SPRINGS, BOUNDS = [3.0, 1.0], [0.1, 0.5]


def run(*arguments: object) -> dict:
    """A command that is well."""
    done = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def written(path: Path, way: np.ndarray, force: np.ndarray) -> Path:
    """In mm, about a middle of its own, beside a spring and an offset."""
    columns = np.column_stack([1e3 * way, force + 0.2 * way + 0.7])
    np.savetxt(path, columns, delimiter=",", header="x [mm],F [N]", comments="")
    return path


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a log, its result, and a log of another run that begins full of memory."""
    folder = tmp_path_factory.mktemp("results")
    way = 0.3 + growing()
    written(folder / "one.csv", way, of_sliders(way - 0.3, SPRINGS, BOUNDS))
    other = 0.25 + 0.6 * np.sin(np.linspace(-6.0, 31.0, 2000))
    written(folder / "other.csv", other[400:], of_sliders(other, SPRINGS, BOUNDS)[400:])
    run("hysteresis", folder / "one.csv", "--laws", "MaxwellSlip-2,Dahl", "-o", folder / "fit.json")
    return folder


def test_a_saved_law_follows_another_log(results: Path) -> None:
    """Its own to rounding of samples; the other from its first far turn on, whatever it remembers there."""
    said = run("compare", results / "fit.json", results / "one.csv", results / "other.csv")
    own, other = (log["residuals"][0] for log in said["logs"])
    assert own["share"] < 1e-3 and not own["held_out"]
    assert other["share"] < 1e-3 and other["held_out"]
    assert len(said["logs"][1]["starts"]) == 2


def test_the_page_holds_sliders_and_cycles_beside_the_law(results: Path) -> None:
    run("report", results / "fit.json", results / "one.csv", "-o", results / "page.html")
    text = (results / "page.html").read_text("utf-8")
    assert "Sliders, cycles and laws" in text and "its sliding force" in text and "energy a cycle" in text
    assert "law=MaxwellSlip(k=[" in text


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_fmu_of_a_saved_law_gives_the_force_of_another_way(results: Path, version: str, kind: str) -> None:
    """By a foreign importer, from the way and its rate; to the error of its method of integration."""
    path = results / f"{version}.fmu"
    run("apply", results / "fit.json", "-o", path, "--fmi", version, "--overwrite")
    values = {
        one["name"]: one["value"] for one in json.loads((results / "fit.json").read_text())["laws"][0]["parameters"]
    }
    time = np.linspace(0.0, 10.0, 1001)
    way = (0.2 + 0.08 * time) * np.sin(2.5 * time)
    truth = of_sliders(way, SPRINGS, BOUNDS) + 0.2 * way + 0.7
    assert values["k_1"] == pytest.approx(3.0, rel=1e-3)
    twice, rate = np.repeat(time, 2)[1:-1], np.repeat(np.diff(way) / np.diff(time), 2)
    given = np.array(
        list(zip(twice, np.interp(twice, time, way), rate, np.ones(len(twice)), strict=True)),
        dtype=[(name, float) for name in ("time", "way", "way_rate", "load")],
    )
    done = simulate_fmu(
        str(path), fmi_type=kind, input=given, stop_time=10.0, output_interval=0.01, step_size=0.01, output=["force"]
    )
    assert np.interp(time, done["time"], done["force"]) == pytest.approx(truth, abs=1e-3)


def test_a_result_names_a_model_of_the_suite_which_needs_no_trust(results: Path) -> None:
    found = read_calibration(results / "fit.json")
    assert found.declaration == "identification.hysteresis.models:loop_maxwellslip_2"
    with command_line(["compare"]):
        assert calibrated_fmu(found).description.modelName == found.model


def test_the_text_of_a_law_is_the_law(results: Path) -> None:
    text = json.loads((results / "fit.json").read_text())["laws"][0]["declaration"]
    from fmu_models import Coordinate

    made = eval(text, {"Hysteresis": Hysteresis, "MaxwellSlip": MaxwellSlip, "x": Coordinate("x", "m", "way")})
    assert made.law.k == pytest.approx(SPRINGS, rel=1e-3)
    assert list(made.law.D) == pytest.approx(BOUNDS, rel=1e-3)


def test_a_way_without_time_runs_straight_from_turn_to_turn() -> None:
    """The force of a law does not depend on when the way goes: of sliders it is that of their recursion at all samples,
    those included at which the way stands."""
    way = np.repeat(growing(400), np.tile([1, 3], 200))
    force = of_sliders(way, SPRINGS, BOUNDS)
    log = loop_log(noisy(way, force, 1), rate=False, states=())
    signal = log.inputs["way"]
    assert isinstance(signal, Signal) and len(signal.time) < 20 < len(log.time) == len(way)
    values = {"k_1": 3.0, "D_1": 0.1, "k_2": 1.0, "D_2": 0.5}
    model = load_model("identification.hysteresis.models:loop_maxwellslip_2")
    again = simulate(model, log.time[-1], parameters=values, inputs=log.inputs, output_times=log.time)
    assert again["force"] == pytest.approx(force, abs=1e-6)


def test_a_log_whose_memory_nobody_knows_is_fitted_with_a_start_of_its_own() -> None:
    """It turns far after its first half only."""
    small = 0.4 * np.sin(np.linspace(1.0, 12.0, 600))
    way = np.concatenate([small, np.linspace(small[-1], 1.0, 100)[1:], np.linspace(1.0, -1.0, 200)[1:]])
    before = np.concatenate([np.linspace(0.0, -0.8, 200), np.linspace(-0.8, way[0], 200)[1:]])
    force = of_bouc_wen(np.concatenate([before, way]), 4.0, 3.0, 1.0, 1)[len(before) :]
    fit = identify_hysteresis(noisy(way, force, 3, of_force=1e-3), laws=["BoucWen-1"])
    assert not fit.logs[0].known
    law = fit.law()
    assert isinstance(law, BoucWen)
    assert [law.k, law.beta, law.gamma] == pytest.approx([4.0, 3.0, 1.0], rel=0.05)


@pytest.mark.nightly
def test_a_saved_decay_follows_another_start(results: Path) -> None:
    """Runs of the model from two angles: fitted to one, compared with the other."""
    model = load_model("identification.hysteresis.models:decaying_oscillator")
    values, time = {"w0": 5.0, "f": 0.3, "c": 0.05, "b": 0.0, "zero": 0.1}, np.arange(0.0, 40.0, 0.02)
    for name, angle in (("far", 1.1), ("near", 0.6)):
        motion = simulate(model, 40.0, parameters=values, start={"angle": angle}, output_times=time)["angle"]
        degrees = np.rad2deg(motion) + 0.01 * np.sin(1e4 * time)
        columns = np.column_stack([time, degrees])
        np.savetxt(results / f"{name}.csv", columns, delimiter=",", header="time [s],angle [deg]", comments="")
    run("decay", results / "far.csv", "-o", results / "decay.json")
    (log,) = run("compare", results / "decay.json", results / "near.csv")["logs"]
    assert log["residuals"][0]["share"] < 5e-3
    assert log["starts"]["angle(0)"] == pytest.approx(0.6, abs=1e-3)


def test_a_load_that_moves_is_followed_in_the_time_of_the_samples() -> None:
    way = growing(400)
    force, load = of_sliders(way, SPRINGS, BOUNDS), 2.0 + np.sin(np.linspace(0.0, 20.0, 400))
    log = loop_log(LoopLog("pressed", way, load * force, load=load), rate=False, states=())
    assert np.array_equal(log.time, np.arange(400.0))
    values = {"k_1": 3.0, "D_1": 0.1, "k_2": 1.0, "D_2": 0.5}
    model = load_model("identification.hysteresis.models:loop_maxwellslip_2")
    again = simulate(model, 399.0, parameters=values, inputs=log.inputs, output_times=log.time)
    assert again["force"] == pytest.approx(load * force, abs=1e-9)
