"""Arrays, enumerations and texts of FMI 3: set and recorded by element, or refused with a word."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from build import build
from models import FOLDER

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.importer.experiment import FmuExperiment, perform
from fmu_models.importer.simulate import simulate_any
from fmu_models.report.run_summary import summary
from fmu_models.simulation.results import read_trajectory
from fmu_models.simulation.signal import Signal
from identification.calibration.calibrate import calibrate
from identification.calibration.systems import SystemFmu, subject_of

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="arrays" instantiationToken="arrays">
<ModelExchange modelIdentifier="arrays"/>
<CoSimulation modelIdentifier="arrays" canHandleVariableCommunicationStepSize="true" hasEventMode="true"/>
<TypeDefinitions><EnumerationType name="Level"><Item name="low" value="1"/><Item name="high" value="3"/>
</EnumerationType></TypeDefinitions>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="x" valueReference="1" causality="output" initial="exact" start="1 0" unit="m"><Dimension start="2"/>
</Float64>
<Float64 name="der(x)" valueReference="101" derivative="1"><Dimension start="2"/></Float64>
<Float64 name="A" valueReference="201" causality="parameter" variability="fixed" start="0 1 -4 0"
 description="matrix"><Dimension valueReference="500"/><Dimension start="2"/></Float64>
<Float64 name="u" valueReference="205" causality="input" start="0"><Dimension start="2"/></Float64>
<Int32 name="count" valueReference="401" causality="output" variability="discrete"><Dimension start="3"/></Int32>
<Enumeration name="level" valueReference="451" causality="output" variability="discrete" declaredType="Level"/>
<String name="word" valueReference="461" causality="output"><Start value="a"/></String>
<String name="said" valueReference="463" causality="input"><Start value="b"/></String>
<String name="label" valueReference="462" causality="parameter" variability="fixed"><Start value="b"/></String>
<UInt64 name="m" valueReference="500" causality="structuralParameter" variability="fixed" start="2"/>
</ModelVariables>
<ModelStructure>
<Output valueReference="1"/><Output valueReference="401"/><Output valueReference="451"/><Output valueReference="461"/>
<ContinuousStateDerivative valueReference="101"/>
<InitialUnknown valueReference="101"/><InitialUnknown valueReference="401"/><InitialUnknown valueReference="451"/>
</ModelStructure>
</fmiModelDescription>
"""
COUNTS = ("count[1]", "count[2]", "count[3]")
METHODS = ("dop853", "stiff", "co-simulation")
NOTE = "; not told by the FMU: 'word' (String)"


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    return made(tmp_path_factory.mktemp("arrays") / "arrays.fmu", DESCRIPTION)


def made(path: Path, description: str) -> Fmu:
    options = ("-DFMI=3", "-Wno-unused-function")
    return Fmu.open(build(path, FOLDER / "arrays.c", description, "arrays", options=options))


@pytest.mark.parametrize("method", METHODS)
def test_arrays_are_recorded_by_element(fmu: Fmu, method: str) -> None:
    run = simulate_any(fmu, 2.0, method=method, output_times=np.linspace(0, 2, 21))
    # x'' = -4 x
    assert run["x[1]"] == pytest.approx(np.cos(2 * run.time), abs=1e-6)
    assert run["x[2]"] == pytest.approx(-2 * np.sin(2 * run.time), abs=1e-6)
    assert run["der(x)[2]"] == pytest.approx(-4 * run["x[1]"], abs=1e-12)
    assert run["count[1]"].dtype == run["level"].dtype == np.int64
    assert run["count[3]"].tolist() == (3 * run["count[1]"]).tolist() == [3] * 21
    assert run["level"].tolist() == [1] * 21
    assert run.arrays == {"x": (2,), "der(x)": (2,), "u": (2,), "count": (3,)}
    assert (run.units["x[2]"], run.units["count[2]"]) == ("m", "1")
    assert run.method.endswith(NOTE)


@pytest.mark.parametrize("method", METHODS)
def test_arrays_are_set_by_element(fmu: Fmu, method: str) -> None:
    u = Signal([0.0, 1.0, 1.0, 2.0], [1.0, 1.0, 3.0, 3.0])
    with Driver(fmu, method=method, record=["A"]) as driver:
        run = driver.run(
            2.0, parameters={"A[2,1]": -9.0}, start={"x[2]": 6.0}, inputs={"u[1]": 0.0}, output_times=[0.0, 0.5, 2.0]
        )
        pushed = driver.run(2.0, parameters={"A[1,2]": 0.0, "A[2,1]": 0.0}, inputs={"u[2]": u}, output_times=[1.0, 2.0])
    assert [run[f"A[{i},{k}]"][0] for i in (1, 2) for k in (1, 2)] == [0.0, 1.0, -9.0, 0.0]
    assert run["x[1]"] == pytest.approx(np.cos(3 * run.time) + 2 * np.sin(3 * run.time), abs=1e-5)
    assert pushed["x[1]"] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert pushed["x[2]"] == pytest.approx([1.0, 4.0], abs=1e-9)


@pytest.mark.parametrize(
    "given",
    [
        {"A[2,1]": -9.0, "x[2]": 6.0},
        {"x[2]": 6.0, "A[2,2]": 0.0, "A[2,1]": -9.0, "x[1]": 1.0, "A[1,1]": 0.0, "A[1,2]": 1.0},
    ],
)
def test_a_batch_sets_arrays_by_element(fmu: Fmu, given: dict[str, float]) -> None:
    """What stands behind a row in memory must not reach the FMU: elements that are not named are as it has them."""
    times, rows = np.array([0.0, 0.5, 2.0]), np.array([[*given.values()], [*given.values()]])
    rows[1, [*given].index("x[2]")] = -6.0
    with Driver(fmu, method="dop853", record=["A", "count"]) as driver:
        batch = driver.batch(2.0, tuple(given), output_times=times)
        table, failures = batch.runs(rows)
    assert batch.recorded == ("x[1]", "x[2]", *(f"A[{i},{k}]" for i in (1, 2) for k in (1, 2)), *COUNTS)
    assert not failures
    for run, side in zip(table, (1, -1), strict=True):
        assert run[:, 0] == pytest.approx(np.cos(3 * times) + side * 2 * np.sin(3 * times), abs=1e-5)
        assert run[:, 1] == pytest.approx(-3 * np.sin(3 * times) + side * 6 * np.cos(3 * times), abs=1e-5)
        assert run[:, 2:].tolist() == [[0.0, 1.0, -9.0, 0.0, 1.0, 2.0, 3.0]] * 3


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("A", "'A' is an array of 2 x 2. Set its elements"),
        ("A[3,1]", "'A[3,1]' is no number"),
        ("m", "'m' of 'arrays' is a structural parameter"),
        ("q", "no variable 'q' to start from"),
    ],
)
def test_what_a_batch_cannot_set(fmu: Fmu, name: str, said: str) -> None:
    with Driver(fmu) as driver, pytest.raises(StickslipError, match=re.escape(said)):
        driver.batch(1.0, (name,))


def test_inputs_of_more_elements_than_there_are_variables(tmp_path: Path) -> None:
    """Of which the library looks at the first two; the master keeps room for all."""
    many = 'name="u" valueReference="205" causality="input" start="0"><Dimension start="'
    wide = made(tmp_path / "wide.fmu", DESCRIPTION.replace(f'{many}2"', f'{many}40000"'))
    run = simulate_any(wide, 1.0, method="dop853", parameters={"A[2,1]": 0.0}, inputs={"u[2]": 3.0}, record=["count"])
    assert run["x[2]"][-1] == pytest.approx(3.0, abs=1e-9)


@pytest.mark.parametrize(("free", "array"), [("A[2,1]", "A[2,1]"), ("A", "A"), ("k", "x")])
def test_calibrations_of_arrays_are_refused(tmp_path: Path, free: str, array: str) -> None:
    k = '<Float64 name="k" valueReference="202" causality="parameter" variability="fixed" start="1"/><UInt64'
    other = made(tmp_path / "k.fmu", DESCRIPTION.replace("<UInt64", k))
    log = {"time": np.linspace(0.0, 1.0, 21), "x": np.linspace(0.0, 1.0, 21)}
    with pytest.raises(StickslipError, match=re.escape(f"'{array}' of 'arrays' is an array or an element of one")):
        calibrate(other, log, free=[free])


def test_neither_measured_arrays_nor_those_of_units_are_calibrated(fmu: Fmu) -> None:
    with pytest.raises(StickslipError, match=r"'der\(x\)' of 'arrays' is an array"):
        subject_of(fmu, [], ["der(x)"])
    system = CoupledSystem("one", {"a": Unit(fmu)}, stop_time=1.0)
    with pytest.raises(StickslipError, match=r"'a.x\[1\]' of 'one' is an array or an element of one"):
        subject_of(SystemFmu.coupled(system), [], ["a.level"])


def test_a_file_keeps_the_shape(fmu: Fmu, tmp_path: Path) -> None:
    with Driver(fmu, record=["A", "level"]) as driver:
        run = driver.run(1.0, output_times=[0.0, 0.5, 1.0])
    recording = perform(fmu, FmuExperiment(1.0, output_times=[0.0, 0.5, 1.0]))
    recording.write(tmp_path / "run.csv")
    with (tmp_path / "run.csv").open() as file:
        head = next(csv.reader(file))
    assert head[:3] == ["time [s]", "x[1] [m]", "x[2] [m]"]
    assert head[-4:] == ["count[1] [1]", "count[2] [1]", "count[3] [1]", "level [1]"]
    assert list(summary(fmu, recording)["ranges"]) == ["x[1]", "x[2]", "count[1]", "count[2]", "count[3]", "level"]
    type(recording)(run, {"A": "matrix"}, None).write(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        stored: Any = file["values"]
        assert stored["A"][()].tolist() == [[[0.0, 1.0], [-4.0, 0.0]]] * 3
        assert stored["x"].shape == (3, 2)
        assert (stored["x"].attrs["unit"], stored["A"].attrs["description"]) == ("m", "matrix")
    again = read_trajectory(tmp_path / "run.h5").trajectory
    assert {name: data.tolist() for name, data in again.values.items()} == {
        n: d.tolist() for n, d in run.values.items()
    }
    assert again.arrays == run.arrays == {"x": (2,), "A": (2, 2)}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"parameters": {"A": 1.0}},
            "'A' is no number: 'A' is an array of 2 x 2. Set its elements: 'A[1,1]' to 'A[2,2]'",
        ),
        ({"parameters": {"A[3,1]": 1.0}}, "'A[3,1]' is no number: 'A' is an array of 2 x 2"),
        ({"parameters": {"B[1]": 1.0}}, "no parameter 'B[1]'"),
        ({"parameters": {"m": 3}}, "no function fmi3EnterConfigurationMode, which the standard requires"),
        ({"inputs": {"u": 1.0}}, "'u' is an array of 2. Set its elements: 'u[1]' to 'u[2]'"),
        ({"inputs": {"said": 1.0}}, "'said' cannot be set to 1.0: it is of type String"),
        ({"inputs": {"sad": 1.0}}, "no input 'sad'"),
        ({"parameters": {"label": 1.0}}, "'label' cannot be set to 1.0: it is of type String"),
    ],
)
def test_what_cannot_be_set(fmu: Fmu, options: dict[str, Any], said: str) -> None:
    with pytest.raises(StickslipError, match=re.sub(r"([\[\]()])", r"\\\1", said)):
        simulate_any(fmu, 1.0, **options)


def test_texts_that_cannot_be_read_or_written(fmu: Fmu) -> None:
    # its library has no function for texts
    assert simulate_any(fmu, 1.0, record=["word"]).method.endswith(NOTE)
    with pytest.raises(StickslipError, match="no function fmi3SetString"):
        simulate_any(fmu, 1.0, parameters={"label": "c"})


def test_units_take_single_numbers(fmu: Fmu) -> None:
    with pytest.raises(StickslipError, match=r"Unit 'a': 'A\[1,1\]' is an element of an array; units take single"):
        CoupledSystem("one", {"a": Unit(fmu, parameters={"A[1,1]": 1.0})}, stop_time=1.0)


def test_sizes_that_disagree(fmu: Fmu, tmp_path: Path) -> None:
    other = made(tmp_path / "a.fmu", DESCRIPTION.replace('start="0 1 -4 0"', 'start="0 1 -4"'))
    with pytest.raises(StickslipError, match="'A' has 4 elements and 3 start values; give all of its elements"):
        simulate_any(other, 1.0, parameters={"A[1,1]": 0.0})
    given = {"A[1,1]": 0.0, "A[1,2]": 1.0, "A[2,1]": -1.0, "A[2,2]": 0.0}
    assert simulate_any(other, 1.0, parameters=given)["x[1]"][-1] == pytest.approx(np.cos(1.0), abs=1e-7)
    larger = made(
        tmp_path / "b.fmu", DESCRIPTION.replace('variability="fixed" start="2"', 'variability="fixed" start="3"')
    )
    assert larger.variables["A"].shape == (3, 2)


@pytest.mark.parametrize(
    ("name", "variables", "whose"),
    [
        ("A[2,1]", ["A"], "A"),
        ("A[1]", ["A", "A[1]"], "A[1]"),  # FMI 2 has no arrays, and names with brackets
        ("B[1]", ["A"], "B[1]"),
        ("A[1", ["A"], "A[1"),
    ],
)
def test_elements_are_told_from_variables_that_are_called_alike(name: str, variables: list[str], whose: str) -> None:
    assert owner(name, variables) == whose


def test_a_run_without_numbers_is_refused(tmp_path: Path) -> None:
    text = re.sub(r' causality="output"(?! initial)(?!><Start)', "", DESCRIPTION)
    text = re.sub(r'<ContinuousState.*?/>|<InitialUnknown .*?/>|<Output valueReference="(?!461).*?/>', "", text)
    text = re.sub(r'<Float64 name="(x|der.x.|u)".*?</Float64>', "", text, flags=re.DOTALL)
    other = made(tmp_path / "a.fmu", text)
    with pytest.raises(StickslipError, match=r"no number that a run would record: its outputs are 'word' \(String\)"):
        simulate_any(other, 1.0, method="co-simulation")
