"""Logs with faults through the commands: what is refused names the repair, what is mended is said."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

RIGS = Path(__file__).parents[2] / "data" / "rigs" / "paper_rubber"
LOG = "paper-rubber-0.83.csv"


@pytest.fixture
def damaged(tmp_path: Path) -> Path:
    """A copy of the logs, one of which has a doubled row, a row out of order, and a cell without a number."""
    folder = tmp_path / "rig"
    shutil.copytree(RIGS, folder)
    folder.chmod(0o755)
    lines = (folder / LOG).read_text().splitlines()
    lines[5000:5002] = [lines[5001], lines[5000]]
    lines.insert(9000, lines[8999])
    cells = lines[12000].split(",")
    cells[1] = "OVER"
    lines[12000] = ",".join(cells)
    sidecar = json.loads((folder / "datapackage.json").read_text())
    for resource in sidecar["resources"]:
        resource.pop("hash")
    for name, text in ((LOG, "\n".join(lines) + "\n"), ("datapackage.json", json.dumps(sidecar))):
        (folder / name).chmod(0o644)
        (folder / name).write_text(text)
    return folder


@pytest.mark.nightly
def test_a_fit_names_the_repair_and_takes_it(stickslip, damaged: Path) -> None:
    refused = stickslip("fit", damaged)
    assert refused.code == 2 and "--repair sort" in refused.err
    refused = stickslip("fit", damaged, "--repair", "sort")
    assert refused.code == 2 and "--repair duplicates" in refused.err
    wrong = stickslip("fit", damaged, "--repair", "sorted")
    assert wrong.code == 2 and "Did you mean 'sort'" in wrong.err
    done = stickslip("fit", damaged, "--repair", "sort,duplicates", "--estimator", "weak-form", "--json")
    assert done.code == 0
    said = "'laser' has 1 cells without a number"
    assert said in done.err and "warning: " in done.err
    assert any(said in warning for warning in done.json["warnings"])
    assert any("2 rows were moved to sort them by time" in warning for warning in done.json["warnings"])
    values = {parameter["name"]: parameter["value"] for parameter in done.json["parameters"]}
    whole = stickslip("fit", RIGS, "--estimator", "weak-form", "--json").json
    for parameter in whole["parameters"]:
        # one slip of many is left out
        assert values[parameter["name"]] == pytest.approx(parameter["value"], abs=parameter["sd_noise"])
