"""What `datapackage.json` says of sensors: it takes the place of options, in the units of the file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from known_deviation import deviation
from noisy_belt import NOISE, noisy

from fmu_models.base.errors import StickslipError
from identification.calibration.calibrate import calibrate
from identification.calibration.log import model_log
from identification.calibration.pose import Settings, with_instruments
from identification.calibration.segments import Sensor


def described(folder: Path, columns: dict[str, Any], fields: list[dict[str, Any]]) -> Path:
    """A log with its sidecar."""
    path = folder / "log.csv"
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    package = {"resources": [{"path": "log.csv", "schema": {"fields": fields}}]}
    (folder / "datapackage.json").write_text(json.dumps(package), encoding="utf-8")
    return path


FIELD = {"name": "Place", "unit": "mm", "variable": "x", "role": "measured"}


def test_a_described_log_needs_no_options(belt, tmp_path):
    """A sensor in mm with offset, clip and a gain known to 1 %, beside a column that is not to be read."""
    log = noisy(belt, 6, 30.0, 301)
    place = 1e3 * np.minimum(1.02 * log["x"] + 0.2, 2.0)
    field = {**FIELD, "noise": 1e3 * NOISE, "gain": "1 +- 0.05", "offset": "free", "clip": [-5000, 2000]}
    fields = [field, {"name": "battery", "role": None}]
    path = described(tmp_path, {"time": log["time"], "Place": place, "battery": place}, fields)
    found = calibrate(belt, path, free=["k", "f0"], parameters={"k": 0.9, "f0": 0.12}, guesses=4, attempts=1)
    assert found.sensors["x"].clip == (-5.0, 2.0)
    assert [one.name for one in found.parameters] == ["k", "f0", "x gain", "x offset"]
    for name, value in (("k", 1.0), ("x gain", 1.02), ("x offset", 0.2)):
        assert abs(found[name].value - value) < 4 * deviation(found[name])
    assert deviation(found["x gain"]) < 0.02
    assert found.solved is not None and found.solved.problem.noise_known


def test_what_is_set_goes_before_what_is_described(belt, tmp_path):
    log = noisy(belt, 6, 15.0, 151)
    field = {**FIELD, "noise": 1.0, "offset": 200.0, "delay": 0.5}
    path = described(tmp_path, {"time": log["time"], "Place": 1e3 * log["x"] + 200}, [field])
    read = model_log(path, belt)
    assert read.instruments["x"].noise == pytest.approx(1e-3)
    settings = with_instruments(Settings(sensors={"x": Sensor(delay=0.1)}), [read])
    assert settings.sensors["x"] == Sensor(offset=0.2, delay=0.1) and settings.sensed == ()


def test_a_role_names_event_times_and_inputs(belt, tmp_path):
    log = noisy(belt, 6, 15.0, 151)
    times = np.append(np.arange(1.0, 6.0), np.full(146, np.nan))
    columns = {"time": log["time"], "Place": 1e3 * log["x"], "w": np.ones(151), "sound": 1e3 * times}
    fields = [
        FIELD,
        {"name": "w", "variable": "v_dr", "role": "input", "hold": True},
        {"name": "sound", "unit": "ms", "variable": "belt", "role": "event"},
    ]
    read = model_log(described(tmp_path, columns, fields), belt)
    assert read.events["belt"] == pytest.approx([1, 2, 3, 4, 5])
    # beside event times the unit of the other columns stays
    assert read.measured["x"] == pytest.approx(log["x"]) and set(read.inputs) == {"v_dr"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gain": "much"}, '"gain" of column \'Place\' is \'much\'; expected a number, "value .- sd" or "free"'),
        ({"offset": "1 +- -2"}, '"offset" of column'),
        ({"delay": True}, '"delay" of column'),
        ({"noise": 0}, '"noise" of column .* expected a number above 0'),
        ({"clip": [2, 1]}, '"clip" of column .* two ascending numbers'),
        ({"role": "output"}, "'Place' has the unknown role 'output'"),
        ({"role": "input"}, "'Place' has the role 'input' .* 'x' is none of 'forced_stick_slip'"),
    ],
)
def test_an_entry_that_does_not_do_names_file_and_column(belt, tmp_path, change, words):
    path = described(tmp_path, {"time": np.arange(9.0), "Place": np.arange(9.0)}, [{**FIELD, **change}])
    with pytest.raises(StickslipError, match=words) as caught:
        model_log(path, belt)
    assert "datapackage.json" in str(caught.value)
