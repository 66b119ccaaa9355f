"""A coupled system packed as SSP: valid by the schemas, and the same system when it is read again."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy.ssp.ssd
import numpy as np
import pytest
from lxml import etree  # type: ignore[attr-defined]  # compiled, without types

from fmu_models.base.errors import StickslipError
from fmu_models.coupling import ssp_writer
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem
from fmu_models.coupling.toml_system import is_system, read_system

SCHEMAS = Path(fmpy.ssp.ssd.__file__).parent / "schema"
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


def test_a_packed_system_is_valid_and_runs_as_it_did(motors: CoupledSystem, tmp_path: Path) -> None:
    path = ssp_writer.write(tmp_path / "motors.ssp", motors, ssp_writer.parameter_sets(motors))
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        for name in names:
            if name.endswith((".ssd", ".ssv")):
                kind = "Description" if name.endswith(".ssd") else "ParameterValues"
                schema = etree.XMLSchema(etree.parse(SCHEMAS / f"SystemStructure{kind}.xsd"))
                schema.assertValid(etree.fromstring(archive.read(name)).getroottree())
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
