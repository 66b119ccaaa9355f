"""Packages of logs: what a faulty sidecar is answered with, and that a package is written whole or not at all."""

from __future__ import annotations

import contextlib
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kept_log import a_log, edit_sidecar

from fmu_models.base.errors import StickslipError, StickslipWarning
from rig_io.packages.datapackage import read_columns, read_log, read_package, write_package
from rig_io.readers import csv_log
from rig_io.sensors import laser_angle


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return write_package(tmp_path / "logs", [a_log()])


def test_units_are_converted_by_dimension(package: Path) -> None:
    plain = read_log(package / "a.csv")

    def other_units(content) -> None:
        for field in (0, 3):
            content["resources"][0]["schema"]["fields"][field]["unit"] = "min"
        content["rig"]["J"] = {"value": 548.0, "unit": "kg*cm^2", "standard_uncertainty": 3.0}

    edit_sidecar(package, other_units)
    assert read_columns(package / "a.csv").units["time"] == "min"
    log = read_log(package / "a.csv")
    np.testing.assert_allclose(log.time, 60 * plain.time, rtol=1e-14)
    np.testing.assert_array_equal(log.column("laser"), plain.column("laser"))
    assert log.rig.quantity("J").value == pytest.approx(0.0548)
    assert log.rig.quantity("J").standard_uncertainty == pytest.approx(3e-4)


@pytest.mark.parametrize(("unit", "per_metre", "at_rest"), [("V", 100.0, 5.0), ("mm", 1000.0, 0.0)])
def test_two_recordings_of_a_decay_are_joined_where_the_swings_are_of_one_size(
    unit: str, per_metre: float, at_rest: float, tmp_path: Path
) -> None:
    """The laser looks at the border of a disc of 0.125 m; one period later the same swing would be smaller."""
    time = np.arange(8000) / 1000
    swing = 0.15 * np.exp(-0.5 * time) * np.cos(6.9 * time)
    laser = at_rest + per_metre * 0.125 * np.sin(np.interp(time + 1.3, time, swing))
    csv_log.write(tmp_path / "a.csv", {"time": time, "encoder_count": np.floor(swing * 1000 / (2 * np.pi))})
    csv_log.write(tmp_path / "b.csv", {"time": time, "laser": laser})
    fields = [
        {"file": file, "name": name, "unit": stated}
        for file, name, stated in (
            *(("a.csv", "time", "s"), ("a.csv", "encoder_count", "1")),
            *(("b.csv", "time", "s"), ("b.csv", "laser", unit)),
        )
    ]
    calibration = {"encoder": {"pulses_per_revolution": 1000}} | (
        {"laser": {"gain": 0.01, "zero": 5.0}} if unit == "V" else {}
    )
    resource = {"path": ["a.csv", "b.csv"], "join": "clocks", "schema": {"fields": fields}, "calibration": calibration}
    rig = {"R": {"value": 0.125, "unit": "m"}}
    (tmp_path / "datapackage.json").write_text(json.dumps({"resources": [resource], "rig": rig}))
    with pytest.warns(
        StickslipWarning, match=r"put on one clock by 'encoder_count' against 'laser': offset 1\.(30|29)"
    ):
        log = read_log(tmp_path / "a.csv")
    np.testing.assert_allclose(log.column("encoder_count") * 2 * np.pi / 1000, laser_angle(log), atol=0.01)


SIDECARS = {
    "unit missing": (lambda c: c["resources"][0]["schema"]["fields"][1].pop("unit"), "'laser' has no unit"),
    "other dimension": (lambda c: c["resources"][0]["schema"]["fields"][0].update(unit="m"), "'time' is in 'm'"),
    "unknown unit": (lambda c: c["resources"][0]["schema"]["fields"][0].update(unit="blink"), "unknown unit 'blink'"),
    "ill-formed unit": (lambda c: c["resources"][0]["schema"]["fields"][0].update(unit="s*("), r"unit 's\*\('"),
    "no resources": (lambda c: c.pop("resources"), "lists no logs"),
    "other log": (lambda c: c["resources"][0].update(path="b.csv"), "says nothing of 'a.csv'"),
    "path leaves the folder": (lambda c: c["resources"][0].update(path="../a.csv"), "leaves the folder"),
    "wrong checksum": (lambda c: c["resources"][0].update(hash="sha256:0"), "checksum is sha256:"),
    "no laser calibration": (lambda c: c["resources"][0]["calibration"].pop("laser"), "no calibration for it"),
    "laser without gain": (lambda c: c["resources"][0]["calibration"]["laser"].pop("gain"), 'lacks "gain"'),
    "gain of zero": (lambda c: c["resources"][0]["calibration"]["laser"].update(gain=0), "measures nothing"),
    "unknown calibration": (lambda c: c["resources"][0]["calibration"]["laser"].update(gian=1), "Did you mean 'gain'"),
    "unknown instrument": (lambda c: c["resources"][0]["calibration"].update(lasr={}), "Did you mean 'laser'"),
    "half a pulse": (
        lambda c: c["resources"][0]["calibration"]["encoder"].update(pulses_per_revolution=0.5),
        "measures nothing",
    ),
    "unknown constant": (lambda c: c["rig"].update(Jo=c["rig"]["J"]), "'Jo' is unknown"),
    "constant without unit": (lambda c: c["rig"]["J"].pop("unit"), r"needs \"value\" and \"unit\""),
    "negative inertia": (lambda c: c["rig"]["J"].update(value=-1.0), "expected a positive value"),
    "constant in words": (lambda c: c["rig"]["J"].update(value="big"), "expected a finite number"),
    "constant not finite": (lambda c: c["rig"]["J"].update(value=float("nan")), "expected a finite number"),
    "quadrature in words": (
        lambda c: c["resources"][0]["calibration"]["encoder"].update(quadrature="no"),
        "expected true or false",
    ),
    "unknown kind": (lambda c: c["resources"][0]["experiment"].update(kind="slip"), "'slip' is unknown"),
    "no key of it": (lambda c: c["resources"][0]["experiment"].update(drive_speeds=[1]), "Did you mean 'drive_speed'"),
    "unknown contact": (lambda c: c["resources"][0]["experiment"].update(contacts=["disc7"]), "'disc7'"),
    "speeds without discs": (lambda c: c["resources"][0]["experiment"].update(drive_speed=[1, 2]), "2 drive speeds"),
    "experiment no object": (lambda c: c["resources"][0].update(experiment=[1]), "expected an object"),
}


@pytest.mark.parametrize(("change", "message"), SIDECARS.values(), ids=SIDECARS)
def test_a_faulty_sidecar_is_refused(package: Path, change, message: str) -> None:
    edit_sidecar(package, change)
    with pytest.raises(StickslipError, match=message):
        read_log(package / "a.csv")


def places(node, path=()):
    """Every place in a JSON value, as a path of keys."""
    yield path
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, child in items:
        yield from places(child, (*path, key))


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3) | st.sampled_from(["", "s", "disc0"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from(["value", "path", "J"]), inner),
    max_leaves=4,
)


@settings(max_examples=120, deadline=None)
@given(data=st.data())
def test_no_sidecar_breaks_the_reader(tmp_path_factory, data) -> None:
    folder = tmp_path_factory.getbasetemp() / "any-sidecar"
    write_package(folder, [a_log()], overwrite=True)
    sidecar = folder / "datapackage.json"
    content = json.loads(sidecar.read_text())
    *path, last = data.draw(st.sampled_from([place for place in places(content) if place]))
    node = content
    for key in path:
        node = node[key]
    node[last] = data.draw(JSON)
    sidecar.write_text(json.dumps(content))
    with contextlib.suppress(StickslipError), warnings.catch_warnings():
        warnings.simplefilter("ignore", StickslipWarning)
        assert len(read_package(folder)[0].time) == 50


def test_a_package_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch) -> None:
    folder = tmp_path / "p"
    write_package(folder, [a_log()])
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    with pytest.raises(StickslipError, match="exists already"):
        write_package(folder, [a_log(60)])
    write = csv_log.write

    def fails(path: Path, columns) -> None:
        write(path, columns)
        if path.name == "b.csv":
            raise OSError(28, "disk full")

    monkeypatch.setattr(csv_log, "write", fails)
    with pytest.raises(StickslipError, match="cannot be written: disk full"):
        write_package(folder, [a_log(60), a_log(name="b")], overwrite=True)
    with pytest.raises(StickslipError, match="cannot be written: disk full"):
        write_package(tmp_path / "new", [a_log(60), a_log(name="b")])
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before
    assert [file.name for file in tmp_path.iterdir()] == ["p"]
    monkeypatch.undo()
    write_package(folder, [a_log(60)], overwrite=True)
    assert len(read_package(folder)[0].time) == 60


def test_a_package_refuses_names_it_cannot_keep(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="at least one log"):
        write_package(tmp_path / "p", [])
    with pytest.raises(StickslipError, match="cannot be a file name"):
        write_package(tmp_path / "p", [a_log(name="../a")])
    with pytest.raises(StickslipError, match="one name"):
        write_package(tmp_path / "p", [a_log(), a_log()])
    (tmp_path / "file").write_text("")
    with pytest.raises(StickslipError, match=r"cannot be written|exists already"):
        write_package(tmp_path / "file" / "p", [a_log()])


@pytest.mark.parametrize(("title", "shown"), [("", "logs-of-may"), ("Paper on rubber", "Paper on rubber")])
def test_a_package_without_a_title_is_called_by_its_folder(tmp_path: Path, title: str, shown: str) -> None:
    folder = write_package(tmp_path / "Logs of May", [a_log()], title=title)
    content = json.loads((folder / "datapackage.json").read_text())
    assert (content["name"], content["title"]) == ("logs-of-may", shown)


def test_the_sidecar_is_a_valid_data_package(package: Path) -> None:
    frictionless = pytest.importorskip("frictionless", reason="the frictionless validator is not installed")
    report = frictionless.validate(str(package / "datapackage.json"))
    assert report.valid, report.flatten(["type", "message"])
