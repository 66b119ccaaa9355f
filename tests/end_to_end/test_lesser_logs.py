"""Logs of rigs that have less, or more, through the command line."""

from __future__ import annotations

import json
from pathlib import Path


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
