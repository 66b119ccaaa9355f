"""Sizes of arrays that are set in configuration mode, by a state space whose solution is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from build import build
from models import FOLDER
from scipy.linalg import expm

from fmu_models.base.child_process import Limits
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.importer.experiment import FmuExperiment, perform
from fmu_models.importer.simulate import simulate_any
from fmu_models.simulation.results import read_trajectory

ARRAYS = {"A": "nn", "B": "nm", "C": "rn", "D": "rm", "x0": "n", "u": "m", "y": "r", "x": "n", "der(x)": "n"}
REFERENCES = {"m": 1, "n": 2, "r": 3} | {name: 4 + i for i, name in enumerate(ARRAYS)}
KINDS = {"u": 'causality="input" start="0 0 0"', "y": 'causality="output"', "x": 'causality="local"'}
METHODS = ("dop853", "stiff", "co-simulation")


def described(sizes: dict[str, str]) -> str:
    lines = [
        f'<UInt64 name="{n}" valueReference="{REFERENCES[n]}" causality="structuralParameter" start="3"/>'
        for n in "mnr"
    ]
    starts = {"x0": "1 2 3"} | dict.fromkeys("ABCD", "1 0 0 0 1 0 0 0 1")
    for name, axes in sizes.items():
        kind = KINDS.get(
            name, 'derivative="11"' if name == "der(x)" else f'causality="parameter" start="{starts.get(name)}"'
        )
        dimensions = "".join(f'<Dimension valueReference="{REFERENCES[axis]}"/>' for axis in axes)
        lines.append(f'<Float64 name="{name}" valueReference="{REFERENCES[name]}" {kind}>{dimensions}</Float64>')
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="state_space" instantiationToken="state_space">
<ModelExchange modelIdentifier="state_space"/>
<CoSimulation modelIdentifier="state_space" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
{chr(10).join(lines)}
</ModelVariables>
<ModelStructure><Output valueReference="10"/><ContinuousStateDerivative valueReference="12"/>
<InitialUnknown valueReference="10"/><InitialUnknown valueReference="12"/></ModelStructure>
</fmiModelDescription>
"""


def made(path: Path, sizes: dict[str, str]) -> Fmu:
    return Fmu.open(build(path, FOLDER / "state_space.c", described(sizes), "state_space"))


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    return made(tmp_path_factory.mktemp("sizes") / "state_space.fmu", ARRAYS)


A = np.array([[0.0, 1.0], [-4.0, -0.5]])
GIVEN = {"A[1,1]": 0.0, "A[1,2]": 1.0, "A[2,1]": -4.0, "A[2,2]": -0.5, "B[1,1]": 0.0, "B[2,1]": 2.0}


@pytest.mark.parametrize("method", METHODS)
def test_two_states_and_one_input_in_an_fmu_of_three(fmu: Fmu, method: str) -> None:
    structure = {"n": 2, "m": 1, "r": 1}
    with Driver(fmu, method=method, structural_parameters=structure, record=["y", "A", "n"]) as driver:
        times = np.linspace(0.0, 2.0, 5)
        starts = {"x0[1]": 1.0, "x0[2]": 0.5, "C[1,1]": 3.0, "C[1,2]": 0.0, "D[1,1]": 10.0}
        asked = {"parameters": GIVEN | starts, "inputs": {"u[1]": 1.5}, "output_times": times}
        # the second run comes after a reset, which puts the sizes back
        _, run = (driver.run(2.0, **asked) for _ in range(2))
    rest = np.linalg.solve(A, [0.0, -3.0])
    exact = np.array([expm(A * t) @ (np.array([1.0, 0.5]) - rest) + rest for t in times])
    assert run["y[1]"] == pytest.approx(3.0 * exact[:, 0] + 15.0, abs=1e-5)
    assert (run["A[2,1]"][0], run["n"][0], run.arrays["A"]) == (-4.0, 2, (2, 2))


def test_the_command_and_its_files(fmu: Fmu, tmp_path: Path) -> None:
    asked = FmuExperiment(1.0, parameters={"n": 1, "r": 2, "C[1,1]": 2.0, "C[2,1]": 5.0}, output_times=[0.0, 1.0])
    here, apart = perform(fmu, asked), perform(fmu, asked, limits=Limits())
    for recording in (here, apart):
        recording.write(tmp_path / "run.h5", overwrite=True)
        again = read_trajectory(tmp_path / "run.h5").trajectory
        assert again.arrays["y"] == (2,)
        # x' = -x from x0 = 1, the FMU's own for these sizes
        assert [again["y[1]"][-1], again["y[2]"][-1]] == pytest.approx(np.exp(-1.0) * np.array([2.0, 5.0]), abs=1e-8)
    here.write(tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().splitlines()[0].split(",")[-2:] == ["y[1] [1]", "y[2] [1]"]


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"n": 6}, "refuses the sizes n = 6: a size is 5 at most"),
        ({"n": 2.5}, "'n' of 'state_space' is a structural parameter.* whole number.* found 2.5"),
        ({"n": 2, "A[1,1]": 1.0}, "'A' has 4 elements and 9 start values; give all of its elements"),
        ({"n": 2, "A[3,1]": 1.0}, "'A' is an array of 2 x 2. Set its elements: 'A.1,1.' to 'A.2,2.'"),
    ],
)
def test_sizes_that_do_not_fit(fmu: Fmu, parameters: dict[str, float], said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        simulate_any(fmu, 1.0, parameters=parameters)


@pytest.mark.parametrize("values", [({"n": 2}, {}), ({}, {"n": 2})], ids=["parameters", "start"])
def test_sizes_are_not_set_for_a_single_run(fmu: Fmu, values: tuple[dict[str, float], dict[str, float]]) -> None:
    with Driver(fmu) as driver, pytest.raises(StickslipError, match=r"'n' .* set when the FMU is loaded"):
        driver.run(1.0, parameters=values[0], start=values[1])
    with pytest.raises(StickslipError, match="no structural parameter 'k'"):
        Driver(fmu, structural_parameters={"k": 2})


def test_a_description_whose_sizes_disagree(tmp_path: Path) -> None:
    other = made(tmp_path / "other.fmu", ARRAYS | {"x": "m"})
    with pytest.raises(StickslipError, match="has 3 continuous states, its description lists 2"):
        simulate_any(other, 1.0, parameters={"m": 2})
