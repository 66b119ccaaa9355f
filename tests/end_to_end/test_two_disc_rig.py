"""Two driving discs by the command line: emulated, fitted without a guess, compared."""

from __future__ import annotations

import json
import re

import pytest

from fmu_models.scene.read import find

TRUTH = {"mu_s0": 0.50, "mu_k0": 0.33, "p0": 20.0, "mu_s1": 0.65, "mu_k1": 0.35, "p1": 15.0, "theta_s": 0.07}


def test_one_disc_at_a_time_from_emulation_to_comparison(stickslip, tmp_path) -> None:
    made = stickslip(
        *("emulate", "rig", "--material", "liner/rubber", "--second-material", "paper/rubber", "--json"),
        *("--speeds", "0.6,0.9,0.5", "--second-disc", "0.9,1.15,1.15", "--duration", "8", "--seed", "3"),
        *("--arrangement", "sequential", "--changeover", "0.07"),
    )
    assert made.code == 0, made.err
    assert [log["drive_speeds"] for log in made.json["logs"]] == [[0.6, 0.9], [0.9, 1.15], [0.5, 1.15], []]
    fitted = stickslip("fit", "rig", "--result", "fit.json", "--figure", "friction.png", "--json")
    assert fitted.code == 0, fitted.err
    content = fitted.json
    assert content["contacts"] == ["disc0", "disc1"]
    assert content["materials"] == ["liner/rubber", "paper/rubber"]
    assert any("disc 0 below the angle theta_s" in one for one in content["structure"])
    assert {bin["contact"] for bin in content["bins"]} == {"disc0", "disc1"}
    assert {"N0", "N1"} <= {one["name"] for one in content["constants"]}
    for one in content["parameters"]:
        # 4 standard deviations of noise, and what the constants are stated to within
        spread = (16 * one["sd_noise"] ** 2 + 9 * one["sd_rig_constants"] ** 2) ** 0.5
        assert one["value"] == pytest.approx(TRUTH[one["name"]], abs=spread), one["name"]
    assert content["parameters"][-1]["sd_noise"] < 5e-4  # of the changeover, rad
    assert (tmp_path / "friction.png").stat().st_size > 10_000
    told = stickslip("fit", "rig", "--estimator", "weak-form")
    assert "disc0 and disc1, liner/rubber and paper/rubber" in told.out and "theta_s" in told.out
    compared = stickslip("compare", "fit.json", "rig", "--json")
    assert compared.code == 0, compared.err
    assert json.loads((tmp_path / "fit.json").read_text())["contacts"] == ["disc0", "disc1"]


def test_the_command_says_what_two_discs_need(stickslip) -> None:
    answer = stickslip("emulate", "rig", "--arrangement", "sequential")
    assert answer.code == 2 and "'sequential' are two, not 1" in answer.err
    answer = stickslip("emulate", "rig", "--second-material", "paper/paper")
    assert answer.code == 2 and "--second-disc" in answer.err
    answer = stickslip("emulate", "rig", "--speeds", "0.4,0.8,1", "--second-disc", "0.3,0.2")
    assert answer.code == 2 and "3 speeds of disc 0 and 2 of the second disc" in answer.err
    stickslip("emulate", "same", "--speeds", "0.41,0.83", "--second-disc", "0.83,0.41", "--duration", "4")
    answer = stickslip("fit", "same")
    assert answer.code == 2 and "turn against one another" in answer.err


def test_the_bench_of_a_scene_lies_on_its_curves(stickslip, tmp_path) -> None:
    """Figure 9: the sensors' noise and the drives' ripple keep the points within 1 % of where the model is."""
    scene = find("disc_rig_figure_9").read_text("utf-8")
    short = re.sub(r"\nvalues = .*", "\nvalues = [0.41, 1.4]", scene).partition("\n[[reference]]")[0]
    (tmp_path / "short.toml").write_text(short.replace("transient =", 'duration = "8 s"\ntransient ='), "utf-8")
    assert stickslip("emulate", "short.toml", "bench").code == 0
    found = stickslip("compare", "short.toml", "bench", "--figure", "figure_9.png", "--json")
    assert found.code == 0, found.err
    assert [(one["at"], one["log"]) for one in found.json["points"]] == [(0.41, "short-0.41"), (1.4, "short-1.4")]
    assert all(1e-4 < one["distance"] < 0.01 for one in found.json["points"])
    assert (tmp_path / "figure_9.png").stat().st_size > 10_000
    (tmp_path / "other.toml").write_text(short.replace("mu_k0 = 0.35", "mu_k0 = 0.45"), "utf-8")
    off = stickslip("compare", "other.toml", "bench", "--json")
    assert all(one["distance"] > 0.03 for one in off.json["points"])
    (tmp_path / "slow.toml").write_text(short.replace("[0.41, 1.4]", "[0.2, 0.3]"), "utf-8")
    refused = stickslip("compare", "slow.toml", "bench")
    assert refused.code == 2 and "No log is of a speed of slow, w0 = 0.2, 0.3" in refused.err
