"""A coupled system packed as SSP: valid by the schemas, and the same system when it is read again."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import fmpy.ssp.ssd
import numpy as np
import pytest
from coupled import exported, masses
from fmpy.ssp.simulation import simulate_ssp
from lxml import etree  # type: ignore[attr-defined]  # compiled, without types
from structures import FROM_FILE, INLINE, MAPPING, packed, structure

from fmu_models.base.errors import StickslipError
from fmu_models.coupling import ssp_writer
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.toml_system import is_system, read_system
from fmu_models.fmu.fmu import Fmu

PACKAGE = find_spec("pyssp_standard")
assert PACKAGE is not None and PACKAGE.origin is not None
# of SSP 1.0, and of SSP 2.0, which takes what is 1.0 too
SCHEMAS = [Path(PACKAGE.origin).parent / "resources" / folder for folder in (".", "ssp2")]
FITTED = """<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0"
 name="fitted"><ssv:Parameters>{}</ssv:Parameters></ssv:ParameterSet>"""
VALUE = '<ssv:Parameter name="{}"><ssv:Real value="{}" unit="{}"/></ssv:Parameter>'


@pytest.fixture(scope="module")
def motors() -> CoupledSystem:
    return read_system("disc_rig_motors", fmi_version="2.0").changed(stop_time=0.5)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fit") / "fitted.ssv"
    path.write_text(FITTED.format(VALUE.format("p0", 2.5, "s/dm") + VALUE.format("motor1.K", 1.5, "N m s/rad")))
    return path


def check_schemas(archive: zipfile.ZipFile) -> None:
    documents = [name for name in archive.namelist() if name.endswith((".ssd", ".ssv"))]
    assert len(documents) > 1
    for name in documents:
        kind = "Description" if name.endswith(".ssd") else "ParameterValues"
        for folder in SCHEMAS:
            schema = etree.XMLSchema(etree.parse(folder / f"SystemStructure{kind}.xsd"))
            schema.assertValid(etree.fromstring(archive.read(name)).getroottree())


def test_a_packed_system_is_valid_and_runs_as_it_did(motors: CoupledSystem, tmp_path: Path) -> None:
    path = ssp_writer.write(tmp_path / "motors.ssp", motors, ssp_writer.parameter_sets(motors))
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        check_schemas(archive)
        # both motors are of one FMU, of the version that more tools take
        assert sorted(n for n in names if n.endswith(".fmu")) == ["resources/disc_rig.fmu", "resources/drive_motor.fmu"]
    structure = fmpy.ssp.ssd.read_ssd(str(path)).system
    assert structure is not None
    names = [f"{c.parent.name}.{c.name}" for c in fmpy.ssp.ssd.find_connectors(structure)]
    assert {"rig.F0", "rig.theta", "motor0.w_set"} & {c.name for c in structure.connectors} == set()
    assert len(set(names)) == len(names) > 20
    assert is_system(str(path)) and is_system("disc_rig_motors") and not is_system("disc_rig")
    again = read_system(path)
    assert list(again.connections) == list(motors.connections) and again.stop_time == 0.5
    assert {unit.fmu.fmi for unit in again.units.values()} == {2}
    times = np.linspace(0.0, 0.5, 6)
    one, other = (
        couple(system.changed(outputs=("rig.theta", "motor1.w")), output_times=times) for system in (motors, again)
    )
    for name in ("rig.theta", "motor1.w"):
        np.testing.assert_array_equal(one.values[name], other.values[name])
    assert np.ptp(one.values["rig.theta"]) > 0.0


def test_fitted_values_take_the_place_of_those_before(motors: CoupledSystem, fitted: Path, tmp_path: Path) -> None:
    sets = ssp_writer.parameter_sets(motors, fitted)
    again = read_system(ssp_writer.write(tmp_path / "fitted.ssp", motors, sets))
    assert again.units["rig"].parameters["p0"] == pytest.approx(25.0)  # s/m
    assert again.units["rig"].parameters["p1"] == 15.0
    assert (again.units["motor0"].parameters["K"], again.units["motor1"].parameters["K"]) == (2.0, 1.5)
    assert {name: list(found) for name, found in sets.items()} == {
        "rig": ["default", "fitted"],
        "motor0": ["default"],
        "motor1": ["default", "fitted"],
    }


def test_fmpy_runs_it_to_the_same_end(tmp_path: Path) -> None:
    """fmpy holds inputs over a step, and passes them from the second one on: errors halve with the step."""
    system = masses(exported("mass", tmp_path, "2.0"), stop_time=1.0)
    driven = {"a": Unit(system.units["a"].fmu, {"k": 3.0}, {"x": 1.0}), "b": Unit(system.units["b"].fmu)}
    driven["c"] = Unit(driven["b"].fmu, inputs={"other": 0.5})
    system = system.changed(units=driven, outputs=("a.place", "c.speed"), tolerance=1e-10)
    sets = ssp_writer.parameter_sets(system)
    path = ssp_writer.write(tmp_path / "masses.ssp", system, sets)
    ours = couple(system, output_times=[0.0, 1.0])
    entries = [(f"{unit}.{e.name}", e.value) for unit, kinds in sets.items() for e in kinds["default"]]
    given = fmpy.ssp.ssd.ParameterSet(parameters=[fmpy.ssp.ssd.Parameter(name=n, value=v) for n, v in entries])
    errors = []
    for step in (1 / 64, 1 / 128):
        rows = simulate_ssp(
            str(path), stop_time=1.0, step_size=step, parameter_set=given, input={"c_other": lambda time: 0.5}
        )
        # a row has the values at the end of the step that begins at its time
        assert rows["time"][-1] + step == 1.0
        errors.append([rows[name.replace(".", "_")][-1] - ours[name][-1] for name in system.outputs])
    assert np.abs(errors[1]).max() < 1e-2
    np.testing.assert_allclose(np.divide(*errors), 2.0, atol=0.1)


def test_what_was_read_is_written_as_it_was(tmp_path: Path) -> None:
    """Nested systems, geometry, annotations, comments and other files stay; fitted values go before all others."""
    extras = (
        '<ssd:Annotations><ssc:Annotation type="org.example"><x:solver xmlns:x="urn:x" step="3"/></ssc:Annotation>'
        "</ssd:Annotations><!-- drawn by hand -->"
    )
    geometry = '<ssd:ElementGeometry x1="1" y1="2" x2="3" y2="4"/>'
    text = structure(INLINE, FROM_FILE % MAPPING).replace("</ssd:System>", f"{extras}</ssd:System>", 1)
    text = text.replace("<ssd:ParameterBindings>", f"{geometry}<ssd:ParameterBindings>", 1)
    source = packed(tmp_path, tmp_path / "old.ssp", text, **{"doc/note.txt": "kept"})
    fitted = tmp_path / "fitted.ssv"
    fitted.write_text(FITTED.format(VALUE.format("b.k", 7.0, "N/m") + VALUE.format("a.m", 3.0, "kg")))
    system = read_system(source).changed(stop_time=4.0)
    path = ssp_writer.write(tmp_path / "new.ssp", system, ssp_writer.parameter_sets(system, fitted))
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(source) as old:
        assert {*archive.namelist()} == {*old.namelist(), "fitted.ssv"}
        assert archive.read("doc/note.txt") == b"kept"
        description = archive.read("SystemStructure.ssd").decode()
        check_schemas(archive)
    for part in ('step="3"', "<!-- drawn by hand -->", 'x1="1" y1="2" x2="3" y2="4"', 'stopTime="4.0"'):
        assert part in description
    again = read_system(path)
    assert again.units["b"].parameters == {"k": 7.0} and again.units["a"].parameters == {"m": 3.0}
    assert (again.connections, again.stop_time) == (system.connections, 4.0)
    # another system than was read is written anew
    other = system.changed(units={**system.units, "a": replace(system.units["a"], start={"x": 2.0})})
    anew = read_system(ssp_writer.write(tmp_path / "anew.ssp", other, ssp_writer.parameter_sets(other)))
    assert anew.units["a"].start == {"x": 2.0}
    assert [(w.factor, w.offset) for w in anew.wires] == [(1.0, 0.0), (0.5, 0.25)]


TWO_OUTPUTS = """<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="two" instantiationToken="t">
<CoSimulation modelIdentifier="two"/><ModelVariables><Float64 name="b_c" valueReference="1" causality="output"/>
<Float64 name="c" valueReference="2" causality="output"/></ModelVariables><ModelStructure><Output valueReference="1"/>
<Output valueReference="2"/></ModelStructure></fmiModelDescription>"""


def test_names_of_the_system_never_collide(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "two.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", TWO_OUTPUTS)
    unit = Unit(Fmu.open(tmp_path / "two.fmu"))
    system = CoupledSystem("s", {"a": unit, "a_b": unit, "a.b": unit}, outputs=("a.b_c", "a_b.c", "a.b.c"))
    again = read_system(ssp_writer.write(tmp_path / "s.ssp", system, {}))
    assert (again.outputs, [*again.units]) == (system.outputs, [*system.units])
    assert sorted(again.connectors) == ["a.b_c", "a_b_c", "a_b_c_1"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FITTED.format(VALUE.format("mu_s00", 0.5, "1")), "no unit has one. Did you mean 'mu_s0'"),
        (FITTED.format(VALUE.format("K", 0.5, "N m s/rad")), "several units have one: motor0, motor1. Name it UNIT.K"),
        (FITTED.format(VALUE.format("p0", 2.0, "kg")), "'p0' is given in kg, but is in s/m"),
        (FITTED.format(VALUE.format("N0", -1.0, "N")), "N0"),
        ("{}", "cannot be read"),
        ("<a/>", "is no parameter set"),
    ],
)
def test_parameter_sets_that_do_not_fit(motors: CoupledSystem, tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "fitted.ssv"
    path.write_text(text)
    with pytest.raises(StickslipError) as error:
        ssp_writer.parameter_sets(motors, path)
    assert said in str(error.value)
