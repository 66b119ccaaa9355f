"""Fitted values in other files: the right numbers in the right units, nothing else changed, nothing half written."""

from __future__ import annotations

import os
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import fmpy.ssp.ssd
import numpy as np
import pytest
from lxml import etree  # type: ignore[attr-defined]  # compiled, without types
from made_fit import made_fit

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.coupling.toml_system import read_system
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.start_values import copy_with_start_values, library_starts
from fmu_models.scene.read import read_scene
from fmu_models.simulation.run import simulate
from identification.fit.result import FrictionFit
from identification.fitted_model.model import fitted_model
from identification.transfer.scene import write_scene
from identification.transfer.ssp import write_parameter_set, write_ssp
from identification.transfer.values import HandedValue, check_targets, handed_values

SCHEMAS = Path(fmpy.ssp.ssd.__file__).parent / "schema"


@pytest.fixture(scope="module")
def fit() -> FrictionFit:
    return made_fit("liner/rubber", 3.5)


@pytest.fixture(scope="module")
def rig() -> Fmu:
    return Fmu.open(built("disc_rig", contacts=("disc0",)))


def check_schema(name: str, content: bytes) -> None:
    schema = etree.XMLSchema(etree.parse(str(SCHEMAS / name)))
    assert schema.validate(etree.fromstring(content)), schema.error_log


@pytest.mark.nightly_for("3.0")
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_copied_fmu_starts_from_the_fitted_values_and_runs_with_them(fit, tmp_path, version) -> None:
    of_another_machine = "binaries/darwin64/disc_rig.dylib"
    here = built("disc_rig", contacts=("disc0",), fmi_version=version)
    with zipfile.ZipFile(here) as old, zipfile.ZipFile(tmp_path / "source.fmu", "w") as new:
        for name in (of_another_machine, *old.namelist()):
            new.writestr(name, b"library" if name == of_another_machine else old.read(name))
    source = Fmu.open(tmp_path / "source.fmu")
    values = check_targets(handed_values(fit), source)
    path = copy_with_start_values(source, tmp_path / "fitted.fmu", values)
    starts = {v.name: str(v.start) for v in fmpy.read_model_description(path).modelVariables}
    assert {name: float(starts[name]) for name in values} == values
    fitted = Fmu.open(path)
    assert fitted.problems == []
    # what the library has in it without being told
    assert library_starts(str(path), list(values)) == values
    own, told = simulate(fitted, 4.0), simulate(source, 4.0, parameters=values)
    assert np.array_equal(own["theta"], told["theta"])
    assert not np.array_equal(own["theta"], simulate(source, 4.0)["theta"])
    # nothing but the start values differs, and what would still have the old ones is left out
    with zipfile.ZipFile(source.path) as old, zipfile.ZipFile(path) as new:
        assert set(old.namelist()) - {of_another_machine} == set(new.namelist())
        changed = {name for name in new.namelist() if old.read(name) != new.read(name)}
        before, after = (archive.read("modelDescription.xml").splitlines() for archive in (old, new))
    library = next(name for name in changed if name.startswith("binaries/"))
    assert changed == {"modelDescription.xml", "sources/model.c", "documentation/index.html", library}
    # J, k, c, R and r have their default values
    assert sum(one != two for one, two in zip(before, after, strict=True)) == 4


def test_a_deviation_that_lacks_a_constant_says_at_least_wherever_it_goes(fit, tmp_path) -> None:
    J, *rest = fit.constants
    unknown = replace(J, stated=False, sensitivity=dict.fromkeys(("mu_s", "mu_k", "p"), 1.0))
    open_ended = replace(fit, constants=(unknown, *rest))
    for known, said in ((fit, False), (open_ended, True)):
        values = handed_values(known, only=["mu_s0", "k"])
        assert {one.name: one.at_least for one in values} == {"mu_s0": said, "k": False}
        path = write_parameter_set(tmp_path / f"{said}.ssv", values, fitted_model(known, fmi_version="2.0").fmu)
        assert ("standard deviation at least" in path.read_text("utf-8")) == said


def test_what_does_not_match_is_refused_and_leaves_nothing(fit, rig, tmp_path) -> None:
    (value,) = handed_values(fit, only=["p0"])
    assert value.description == fitted_model(fit).fmu.variables["p0"].description
    for changed, said in (
        (replace(value, target="p_0"), "has no parameter 'p_0'. Did you mean 'p0'"),
        (replace(value, target="theta", unit="rad"), "is a (local|output) of"),
        (replace(value, target="J"), "cannot be converted"),
        (replace(value, value=-1.0), "must be at least 0"),
    ):
        with pytest.raises(StickslipError, match=said):
            check_targets([changed], rig)
    with pytest.raises(StickslipError, match="must be at least 0"):
        copy_with_start_values(rig, tmp_path / "x.fmu", {"p0": -1.0})
    with pytest.raises(StickslipError, match=r"must end in \.fmu"):
        copy_with_start_values(rig, tmp_path / "x.zip", {"p0": 1.0})
    (tmp_path / "mine.fmu").write_text("mine")
    with pytest.raises(StickslipError, match="exists already"):
        copy_with_start_values(rig, tmp_path / "mine.fmu", {"p0": 1.0})
    assert [path.name for path in tmp_path.iterdir()] == ["mine.fmu"]
    with pytest.raises(StickslipError, match=r"hands on no 'mu_s'\. Did you mean 'mu_s0'"):
        handed_values(fit, only=["mu_s"])
    with pytest.raises(StickslipError, match="Two values would go to 'p0'"):
        handed_values(fit, renamed={"mu_s0": "p0"})


def test_values_are_converted_where_units_measure_the_same() -> None:
    one = HandedValue("k", "k", 2.62, "N m/rad", None, "stiffness")
    assert one.in_unit("N m/deg", "here") == pytest.approx(2.62 * np.pi / 180)
    assert replace(one, unit="1").in_unit(None, "here") == 2.62
    with pytest.raises(StickslipError, match="has no unit there"):
        one.in_unit(None, "here")
    with pytest.raises(StickslipError, match="cannot be converted"):
        one.in_unit("kg", "here")


SCENE = """# my bench
title = "One disc"
model = "disc_rig"
contacts = ["disc0"]   # disc 1 is off
stop_time = "5 s"

[parameters]
mu_s0 = 0.65     # guessed
N0 = "350 cN"
w0 = "0.83 rad/s"

[free]
p0 = "1.5 s/dm"

[start]
theta = 0.1
"""


def test_a_scene_keeps_its_layout_comments_and_units(fit, tmp_path) -> None:
    source = tmp_path / "bench.toml"
    source.write_text(SCENE, "utf-8")
    target = write_scene(source, tmp_path / "fitted.toml", handed_values(fit, only=["mu_s0", "mu_k0", "p0", "N0"]))
    expected = SCENE.replace("0.65     # guessed", "0.5     # guessed").replace("1.5 s/dm", "2.0 s/dm")
    lines = target.read_text("utf-8").splitlines()
    # mu_k0 stood nowhere, N0 was right
    assert [line for line in lines if line not in expected.splitlines()] == ["mu_k0 = 0.33"]
    assert [line for line in expected.splitlines() if line not in lines] == []
    read = read_scene(target)
    assert read.parameters["p0"] == pytest.approx(20.0) and read.parameters["N0"] == pytest.approx(3.5)
    assert read.fixed["mu_k0"] == 0.33 and "p0" in read.free


def test_a_scene_without_the_parameter_is_refused(fit, tmp_path) -> None:
    source = tmp_path / "free.toml"
    source.write_text('title = "Free"\nmodel = "disc_rig"\ncontacts = []\nstop_time = 5\n', "utf-8")
    with pytest.raises(StickslipError, match="has no parameter 'N0'"):
        write_scene(source, tmp_path / "out.toml", handed_values(fit, only=["N0"]))
    assert not (tmp_path / "out.toml").exists()


def test_a_parameter_set_follows_the_schema_and_says_units(fit, tmp_path) -> None:
    path = write_parameter_set(tmp_path / "fitted.ssv", handed_values(fit), fitted_model(fit, fmi_version="2.0").fmu)
    content = path.read_bytes()
    check_schema("SystemStructureParameterValues.xsd", content)
    space = {"v": "http://ssp-standard.org/SSP1/SystemStructureParameterValues"}
    root = etree.fromstring(content)
    parameters = root.findall("v:Parameters/v:Parameter", space)
    found = {p.get("name"): (float(str(p[0].get("value"))), p[0].get("unit")) for p in parameters}
    assert found["p0"] == (20.0, "s/m") and found["k"] == (2.62, "N m/rad") and found["N0"] == (3.5, "N")
    described = root.find("v:Parameters/v:Parameter[@name='mu_s0']", space)
    assert described is not None and "standard deviation 0.0005" in described.get("description", "")


def test_a_whole_ssp_runs_as_the_fmu_with_these_values(fit, tmp_path) -> None:
    model = fitted_model(fit, fmi_version="2.0")
    path = write_ssp(tmp_path / "rig.ssp", handed_values(fit), model.fmu)
    with zipfile.ZipFile(path) as archive:
        check_schema("SystemStructureDescription.xsd", archive.read("SystemStructure.ssd"))
        check_schema("SystemStructureParameterValues.xsd", archive.read("fitted.ssv"))
    unit = read_system(path).units["rig"]
    assert unit.parameters == model.parameters
    assert unit.fmu.sha256 == model.fmu.sha256


def test_a_parameter_set_beside_a_description_is_read(fit, tmp_path) -> None:
    """An .ssd of the user's own that refers to the .ssv."""
    write_parameter_set(tmp_path / "fitted.ssv", handed_values(fit, only=["mu_s0"]), fitted_model(fit).fmu)
    (tmp_path / "rig.fmu").write_bytes(built("disc_rig", contacts=("disc0",)).read_bytes())
    (tmp_path / "mine.ssd").write_text(
        '<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
        'version="1.0" name="mine"><ssd:System name="mine"><ssd:Elements><ssd:Component name="rig" source="rig.fmu">'
        '<ssd:ParameterBindings><ssd:ParameterBinding source="fitted.ssv"/></ssd:ParameterBindings>'
        "</ssd:Component></ssd:Elements></ssd:System></ssd:SystemStructureDescription>",
        "utf-8",
    )
    assert read_system(tmp_path / "mine.ssd").units["rig"].parameters == {"mu_s0": 0.5}


def test_two_discs_hand_on_both_laws_and_the_changeover(tmp_path) -> None:
    two = made_fit("liner/rubber", 3.0621, 2, theta_s=0.02)
    values = {one.name: one for one in handed_values(two)}
    assert values["theta_s"].value == 0.02 and values["theta_s"].unit == "rad"
    assert values["mu_s1"].value == 0.5 and values["mu_s1"].deviation == pytest.approx(5e-4)
    assert values["N1"].value == 3.0621


def test_a_foreign_library_that_keeps_its_own_start_values_is_refused(rig, tmp_path) -> None:
    """Our own FMU under another name of its maker: then it is not compiled anew, and its library knows nothing of the
    description."""
    stranger = tmp_path / "stranger.fmu"
    with zipfile.ZipFile(rig.path) as old, zipfile.ZipFile(stranger, "w") as new:
        for entry in old.infolist():
            content = old.read(entry)
            if entry.filename == "modelDescription.xml":
                content = content.replace(b'generationTool="stickslip', b'generationTool="somebody')
            new.writestr(entry, content)
    with pytest.raises(StickslipError, match=r"keeps its own start value 0\.65 of 'mu_s0'"):
        copy_with_start_values(Fmu.open(stranger), tmp_path / "copy.fmu", {"mu_s0": 0.6})
    assert sorted(os.listdir(tmp_path)) == ["stranger.fmu"]
    # the value that it has is no change, and is kept
    copy_with_start_values(Fmu.open(stranger), tmp_path / "copy.fmu", {"mu_s0": 0.65})
