"""The commands that take the FMU of anybody."""

from __future__ import annotations

import re
import shutil
import zipfile
from pathlib import Path

import pytest

from fmu_models.codegen.package import built
from fmu_models.simulation.results import read_trajectory

RUN = ("simulate", "block.fmu", "--until", 5)


@pytest.fixture(params=["2.0", "3.0"])
def block(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """block_on_belt beside the user, as if it came from elsewhere."""
    path = tmp_path / "block.fmu"
    shutil.copy(built("block_on_belt", fmi_version=request.param), path)
    return path


def altered(path: Path, *changes: tuple[str, str]) -> None:
    """The same FMU with other text in its description."""
    with zipfile.ZipFile(path) as source:
        files = {name: source.read(name) for name in source.namelist()}
    xml = files["modelDescription.xml"].decode()
    for pattern, replacement in changes:
        xml, count = re.subn(pattern, replacement, xml)
        assert count, pattern
    files["modelDescription.xml"] = xml.encode()
    with zipfile.ZipFile(path, "w") as target:
        for name, data in files.items():
            target.writestr(name, data)


def test_every_method_gives_the_motion_of_its_own_engine(stickslip, block):
    own = stickslip(*RUN, "--json").json
    assert own["method"] == "taylor"
    assert own["contacts"]["belt"]["events"] == 11
    for method in ("auto", "dopri5", "dop853", "stiff"):
        told = stickslip(*RUN, "--method", method, "--json")
        assert told.code == 0, told.err
        content = told.json
        assert sum(content["events"].values()) == 11
        for name, row in own["ranges"].items():
            assert content["ranges"][name]["end"] == pytest.approx(row["end"], abs=1e-5)
    stepped = stickslip(*RUN, "--step", 0.01, "--json").json
    assert stepped["method"] == "co-simulation"
    assert stepped["ranges"]["x"]["end"] == pytest.approx(own["ranges"]["x"]["end"], abs=1e-9)


def test_the_fmu_of_somebody_else_goes_to_the_master_and_into_files(stickslip, block, tmp_path):
    altered(
        block, ('generationTool="stickslip [^"]*"', 'generationTool="Elsewhere"'), ('stopTime="10"', 'stopTime="3"')
    )
    settings = ("--set", "m=2", "--start", "x=0.1", "--input", "v_belt=0.2", "--samples", 301)
    done = stickslip("simulate", block, *settings, "-o", "run.h5", "--isolate", "--json")
    assert done.code == 0, done.err
    assert (done.json["until"], done.json["contacts"]) == (3.0, {})
    read = read_trajectory(tmp_path / "run.h5")
    origin = read.provenance
    assert origin
    assert (origin.fmu, origin.generation_tool, origin.stop_time) == ("block.fmu", "Elsewhere", 3.0)
    assert (origin.method, origin.tolerance) == ("auto", 1e-8)
    assert (origin.parameters, origin.start, origin.inputs) == ({"m": 2.0}, {"x": 0.1}, {"v_belt": 0.2})
    assert read.trajectory.time.shape == (301,)
    assert read.trajectory.units["x"] == "m"
    assert "displacement" in read.descriptions["x"]
    assert {event.kind for event in read.trajectory.events} == {"state"}
    assert len(read.trajectory.events[0].states_before) == 2
    assert stickslip("simulate", block, *settings, "-o", "run.csv").code == 0
    lines = (tmp_path / "run.csv").read_text().splitlines()
    assert lines[0].startswith("time [s],x [m],v [m/s]")
    assert len(lines) == 302


def test_departures_are_warned_of_and_listed(stickslip, block):
    altered(block, ('<Unit name="N/m"', '<Unit name="N/ell"'))
    done = stickslip(*RUN, "--method", "auto", "--json")
    assert done.code == 0
    assert "departs from the standard (1 problems); stickslip inspect" in done.err
    assert done.json["steps"]
    assert any('unit "N/m"' in problem for problem in stickslip("inspect", block, "--json").json["problems"])
    assert "departs from the standard" in stickslip("inspect", block).out


def test_inspect(stickslip, block):
    content = stickslip("inspect", block, "--json").json
    assert content["runs_here"]
    assert content["problems"] == []
    assert [i["kind"] for i in content["interfaces"]] == ["Model Exchange", "Co-Simulation"]
    assert "coefficient" in stickslip("inspect", block).out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((*RUN, "--method", "rk4"), "There is no method 'rk4'"),
        ((*RUN, "--method", "auto", "--step", "0.1"), "belongs to the method 'co-simulation'"),
        ((*RUN, "--step", "-1"), "must be a positive number"),
        ((*RUN, "--tolerance", "0"), "tolerance must"),
        ((*RUN, "--method", "auto", "--tolerance", "2"), "tolerance must"),
        ((*RUN, "--method", "auto", "--set", "mm=1"), "has no parameter 'mm'"),
        ((*RUN, "--method", "auto", "--set", "m=-1"), "must be at least"),
        ((*RUN, "--method", "auto", "--input", "x=1"), "has no input 'x'"),
        ((*RUN, "--contacts", "belt"), "contacts are chosen when a model is exported"),
        ((*RUN, "--on-zeno", "hold"), "runs by its own engine"),
        ((*RUN, "--method", "auto", "--on-zeno", "rest"), "can stop, hold, continue; found 'rest'"),
        ((*RUN, "--time-limit", "3"), "Add --isolate"),
        ((*RUN, "--isolate", "--time-limit", "0"), "must be a positive number of s"),
        ((*RUN, "--isolate", "--memory-limit", "nan"), "must be a positive number of MB"),
        ((*RUN, "--isolate", "--set", "mm=1"), "has no parameter 'mm'"),
        ((*RUN, "--isolate", "--time-limit", "1e-4"), "did not end within 0.0001 s"),
        ((*RUN, "-o", "run.mat"), "must end in one of .csv"),
        (("simulate", "block.fmu", "--until", "-1", "--method", "auto"), "must end after it starts"),
        (("inspect", "blok.fmu"), "There is no file 'blok.fmu'. Did you mean 'block.fmu'?"),
        (("show", "block.fmu"), "What it holds: stickslip inspect block.fmu"),
        (("export", "block.fmu"), "is an FMU, where a declared model is needed"),
        (("inspect", "text.fmu"), "not an FMU, or damaged"),
        (("simulate", "text.fmu"), "not an FMU, or damaged"),
    ],
)
def test_bad_input_is_refused_with_a_reason_and_leaves_nothing(stickslip, tmp_path, arguments, said):
    shutil.copy(built("block_on_belt"), tmp_path / "block.fmu")
    (tmp_path / "text.fmu").write_text("hello")
    answer = stickslip(*arguments)
    assert answer.code == 2
    assert said in answer.err
    assert "Traceback" not in answer.err
    assert answer.out == ""
    assert {path.name for path in tmp_path.iterdir()} == {"block.fmu", "text.fmu"}


@pytest.mark.parametrize("command", ["inspect", "simulate"])
def test_an_fmu_4_is_told_which_versions_are_read(stickslip, tmp_path, command):
    shutil.copy(built("block_on_belt", fmi_version="2.0"), tmp_path / "new.fmu")
    altered(tmp_path / "new.fmu", ('fmiVersion="2.0"', 'fmiVersion="4.0"'))
    answer = stickslip(command, "new.fmu")
    assert (answer.code, "FMI 1.0, 2.0 and 3.0 are read" in answer.err) == (2, True)


def test_an_existing_file_stays(stickslip, block, tmp_path):
    (tmp_path / "run.h5").write_text("mine")
    assert stickslip(*RUN, "-o", "run.h5").code == 2
    assert (tmp_path / "run.h5").read_text() == "mine"
    assert stickslip(*RUN, "-o", "run.h5", "--overwrite").code == 0
    assert read_trajectory(tmp_path / "run.h5").provenance


def test_families_of_motions_of_an_fmu_of_somebody_else(stickslip, tmp_path):
    shutil.copy(built("discontinuous_support"), tmp_path / "support.fmu")
    altered(tmp_path / "support.fmu", ('generationTool="stickslip [^"]*"', 'generationTool="Elsewhere"'))
    forced = ("support.fmu", "--forcing", "omega")
    found = stickslip("diagram", *forced, "--over", "omega=0.9:1.1:2", "--start", "x=0", "--json")
    assert found.code == 0 and found.json["periods"] == [[1, 1]], found.err
    assert "its directional derivatives" in found.json["how"]
    assert "directional" in stickslip("lyapunov", *forced, "--steps", 40, "--transient", 5).out
    starts = ("--set", "omega=1.18", "--over", "x=-8:8:2", "--over", "v=-8:8:2")
    here = stickslip("basins", *forced, *starts, "--json").json
    assert here["labels"] == stickslip("basins", "discontinuous_support", *forced[1:], *starts, "--json").json["labels"]
    section = stickslip("section", *forced, "--level", "v=0", "--down", "--points", 1, "--json").json
    assert section["points"][0][0] == pytest.approx(4.334229130298108, abs=1e-9)
    lines = stickslip("spectrum", *forced, "--lines", 2, "--json").json
    assert lines["period"] == 1 and "importer" in lines["how"]
    refused = stickslip("section", *forced, "--impacts", "support")
    assert refused.code == 2 and "not of this suite" in refused.err
