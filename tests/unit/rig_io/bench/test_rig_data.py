"""The logs in data/rigs: their checksums, and that the emulator still makes them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from asked import Asked
from checkout import ROOT
from made import formats

from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.columns import COLUMNS
from rig_io.logs.log import RIG_UNITS, RigLog
from rig_io.packages import described, sidecar
from rig_io.packages.datapackage import read_package
from rig_io.packages.sidecar import file_hash

DATA = ROOT / "data"
README = (DATA / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    return read_package(DATA / "rigs" / "paper_rubber")


def test_the_checksums_of_the_readme_are_those_of_the_files() -> None:
    stated = dict(re.findall(r"\| (\S+) \| `([0-9a-f]{64})` \|", README))
    files = {path.name: file_hash(path).removeprefix("sha256:") for path in (DATA / "rigs/paper_rubber").iterdir()}
    assert stated == files


def test_the_manual_lists_the_keys_that_the_reader_asks_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, set[str]] = {name: set() for name in ("package", "log", "field", "constant", "experiment")}
    load = sidecar.load_json

    def noting(path: Path) -> Asked:
        package = load(path)
        package["rig"] = {name: Asked(one, asked["constant"]) for name, one in package["rig"].items()}
        for log in package["resources"]:
            log["experiment"] = Asked(log["experiment"], asked["experiment"])
            log["schema"]["fields"] = [Asked(one, asked["field"]) for one in log["schema"]["fields"]]
            log["schema"]["fields"][0]["role"] = "time"
        package["resources"] = [Asked(one, asked["log"]) for one in package["resources"]]
        return Asked(package, asked["package"])

    monkeypatch.setattr(sidecar, "load_json", noting)
    read_package(DATA / "rigs" / "paper_rubber")
    told = {
        **{"package": sidecar.PACKAGE_KEYS, "log": sidecar.LOG_KEYS, "field": described.FIELD_KEYS},
        **{"constant": sidecar.QUANTITY_KEYS, "experiment": sidecar.EXPERIMENT_KEYS},
    }
    assert {name: set(keys) for name, keys in told.items()} == asked
    page = dict(formats.pages())["reference/sidecar.md"]
    assert {*COLUMNS, *RIG_UNITS, *(key for keys in told.values() for key in keys)} <= set(re.findall(r"`(\w+)`", page))


def test_the_set_holds_three_speeds_and_a_free_decay(logs: list[RigLog]) -> None:
    assert [log.kind for log in logs] == ["stick-slip"] * 3 + ["free-decay"]
    assert [log.experiment.drive_speed for log in logs] == [(0.41,), (0.83,), (1.4,), ()]
    assert all(log.duration == pytest.approx(20.0) and len(log.time) == 20001 for log in logs)


def test_the_emulator_makes_the_set_again(logs: list[RigLog]) -> None:
    for number, (settings, log) in enumerate(zip(standard_set("paper/rubber"), logs, strict=True)):
        made = emulate(settings, seed=1, number=number)
        assert (made.rig, made.calibration, made.experiment) == (log.rig, log.calibration, log.experiment)
        assert list(made.columns) == list(log.columns)
        for name, values in made.columns.items():
            # another processor or library may round otherwise: a cell in a thousand may fall on the next step
            differs = np.flatnonzero(values != log.column(name))
            assert len(differs) <= len(values) / 1000, name
            if name == "laser":
                np.testing.assert_allclose(values, log.column(name), atol=1.1e-3)
            elif name.endswith("_count"):
                np.testing.assert_allclose(values, log.column(name), atol=1.0)
