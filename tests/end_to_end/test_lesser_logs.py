"""Logs of rigs that have less, or more, through the command line."""

from __future__ import annotations

import json
from pathlib import Path

from rig_io.packages.datapackage import write_package
from tests.helpers.weighed_logs import weighed_logs


def test_an_encoder_alone_and_a_nominal_speed_from_files(stickslip, tmp_path: Path) -> None:
    folder, fit = tmp_path / "logs", tmp_path / "fit.json"
    made = ("--no-laser", "--no-drive-encoder", "--speeds", "0.83,1.4", "--duration", "8", "--seed", "4")
    assert stickslip("emulate", folder, *made).code == 0
    assert not any("laser" in path.read_text().splitlines()[0] for path in folder.glob("*.csv"))
    found = stickslip("fit", folder, "--uncertainty", "w=0.4%", "--result", fit, "--json")
    assert found.code == 0
    names = {one["name"] for one in found.json["nuisance"]}
    assert names == {"zero", "w_1", "w_2"}
    for one, truth in zip(found.json["parameters"], (0.65, 0.35, 15.0), strict=True):
        assert one["low"] <= truth <= one["high"]
    assert stickslip("compare", fit, folder, "--no-uncertainty").code == 0
    stated = json.loads((folder / "datapackage.json").read_text())["resources"][0]["experiment"]
    assert stated["drive_speed_uncertainty"] == [0.83 * 0.005]
    refused = stickslip("fit", folder, "--set", "w=0.8")
    assert refused.code != 0 and "One speed is said, 0.8 rad/s, and 2 logs do not record theirs" in refused.err


def test_a_load_cell_from_files(stickslip, tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    made = ("--load-cell", "--speeds", "0.83,1.4", "--duration", "8", "--disturbance", "once=5%")
    assert stickslip("emulate", folder, *made).code == 0
    found = stickslip("fit", folder, "--estimator", "weak-form", "--json")
    assert found.code == 0
    (force,) = (one for one in found.json["constants"] if one["name"] == "N")
    assert force["from"] == "load cell" and abs(force["sd"] / force["value"] - 0.005) < 1e-4
    for one, truth in zip(found.json["parameters"], (0.65, 0.35, 15.0), strict=True):
        assert abs(one["value"] - truth) < 0.08 * truth


def test_a_normal_force_and_a_temperature_from_files(stickslip, tmp_path: Path) -> None:
    folder, fit = tmp_path / "logs", tmp_path / "fit.json"
    write_package(folder, weighed_logs(["ramps", "sine"], 0.004, speeds=(0.83, 1.4)))
    found = stickslip("fit", folder, "--estimator", "weak-form", "--result", fit)
    assert found.code == 0
    told = " ".join(found.out.split())
    assert "Assumed: " in told and "the normal force of the load cell, 3.4" in told
    (rise,) = (one for one in json.loads(fit.read_text())["nuisance"] if one["name"] == "a_T")
    assert abs(rise["value"] - 0.004) < 3 * rise["sd_noise"] < 0.0012
    notes = stickslip("apply", fit, "-o", tmp_path / "rig.ssv", "--json").json["notes"]
    assert [note[:33] for note in notes[:2]] == [
        "Assumed: friction is in proportio",
        "Assumed: the law is that at 295 K",
    ]
    compared = stickslip("compare", fit, folder, "--no-uncertainty")
    reported = stickslip("report", fit, folder, "--no-uncertainty", "-o", tmp_path / "page.html")
    assert reported.code == 0, reported.err
    page = (tmp_path / "page.html").read_text()
    assert "friction is in proportion to the normal force of the load cell" in page
    told = " ".join((compared.out + compared.err).split())
    assert "'paper-rubber-0.83' is left out" in told and "goes from 3.93 to 5.88 N, the model runs at its mean" in told


def test_a_velocity_sensor_from_files(stickslip, tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    made = ("--velocity", "tachometer", "--speeds", "0.83,1.4", "--duration", "8")
    assert stickslip("emulate", folder, *made).code == 0
    found = stickslip("fit", folder, "--estimator", "weak-form", "--json")
    assert found.code == 0 and abs(found.json["sensors"]["velocity_delay"] - 1e-3) < 2e-4
    unknown = stickslip("emulate", tmp_path / "none", "--velocity", "tachometr")
    assert unknown.code != 0 and "Did you mean 'tachometer'?" in unknown.err
    log = next(folder.glob("paper*.csv"))
    lines = log.read_text().splitlines()
    keep = [place for place, name in enumerate(lines[0].split(",")) if not name.startswith(("laser", "encoder"))]
    log.write_text("\n".join(",".join(line.split(",")[place] for place in keep) for line in lines) + "\n")
    package = json.loads((folder / "datapackage.json").read_text())
    for resource in package["resources"]:
        resource.pop("hash", None)
        resource["schema"]["fields"] = [
            one for one in resource["schema"]["fields"] if not one["name"].startswith(("laser", "encoder"))
        ]
    (folder / "datapackage.json").write_text(json.dumps(package))
    refused = stickslip("fit", log)
    assert refused.code != 0 and "one source of the disc's angle" in refused.err
