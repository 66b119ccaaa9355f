"""FMUs of FMI 1.0, Model Exchange and Co-Simulation, beside closed forms and fmpy. The library of
``models/model_fmi1.h`` has its states the other way round and refuses to be read before it is initialized. The other
tests of this folder run on it nightly."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
import pytest
from build import build
from models import FOLDER, MODELS, _one, foreign
from test_hostile import stickslip

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import Connection
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.start_values import copy_with_start_values
from fmu_models.importer.driver import Driver
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any

Changed = Callable[..., Fmu]


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Changed:
    """A model, with parts of its description replaced."""

    def get(name: str, *replaced: tuple[str, str], options: tuple[str, ...] = ()) -> Fmu:
        folder = tmp_path_factory.mktemp("fmi1")
        if not (replaced or options):
            return Fmu.open(foreign(name, folder, 1))
        description = _one(name, MODELS[name])
        for old, new in replaced:
            assert old in description
            description = description.replace(old, new)
        flags = ("-DFMI=1", f"-DPREFIX={name}_", "-Wno-unused-function", *options)
        return Fmu.open(build(folder / f"{name}.fmu", FOLDER / f"{name}.c", description, name, options=flags))

    return get


def variable(name: str, reference: int, value: str, kind: str = 'causality="output"') -> tuple[str, str]:
    line = f'<ScalarVariable name="{name}" valueReference="{reference}" {kind}>{value}</ScalarVariable>'
    return "</ModelVariables>", f"{line}</ModelVariables>"


def test_bounces_are_those_of_the_closed_form(changed: Changed) -> None:
    fmu = changed("ball")
    assert (fmu.fmi, fmu.adapted, fmu.states, fmu.problems) == (2, True, ["h", "v"], [])
    run = simulate_any(fmu, 2.0, parameters={"e": 0.8}, start={"h": 2.0}, output_times=[0.0, 0.5, 2.0], tolerance=1e-10)
    first = np.sqrt(2 * 2.0 / 9.81)
    bounces = first * (1 + np.array([0.0, 2 * 0.8, 2 * (0.8 + 0.64)]))
    assert [e.time for e in run.events] == pytest.approx(bounces[bounces < 2.0], abs=1e-9)
    assert run["h"][:2] == pytest.approx([2.0, 2.0 - 9.81 / 8], abs=1e-9)
    assert run["der(h)"] == pytest.approx(run["v"], abs=1e-12)


@pytest.mark.parametrize("name", ["van_der_pol", "forced", "ball", "relay"])
def test_a_run_is_that_of_fmpy(changed: Changed, name: str) -> None:
    fmu = changed(name)
    stop = 0.9 if name == "relay" else 2.0  # it slides from 1 s on
    theirs = fmpy.simulate_fmu(
        str(fmu.path), stop_time=stop, relative_tolerance=1e-10, output_interval=0.1, record_events=False
    )
    ours = simulate_any(fmu, stop, tolerance=1e-10, output_times=np.minimum(theirs["time"], stop))
    for state in fmu.states:
        assert ours[state] == pytest.approx(theirs[state], abs=2e-6)


def test_co_simulation_is_that_of_fmpy(changed: Changed) -> None:
    fmu = changed("integers")
    theirs = fmpy.simulate_fmu(str(fmu.path), stop_time=5.0, output_interval=0.5, output=["x", "count", "steps"])
    ours = simulate_any(fmu, 5.0, communication_step=0.5)
    for name in ("x", "count", "steps"):
        assert ours[name].tolist() == theirs[name].tolist()
    assert ours["x"] == pytest.approx(0.25 + ours.time, abs=1e-12)


def test_many_runs_of_one_driver(changed: Changed) -> None:
    with Driver(changed("dahlquist")) as driver:
        for k in (1.0, 2.0, 1.0):
            assert driver.run(1.0, parameters={"k": k})["x"][-1] == pytest.approx(np.exp(-k), rel=1e-7)


def test_negated_aliases(changed: Changed) -> None:
    negated = 'alias="negatedAlias"'
    fmu = changed(
        "ball",
        variable("depth", 1, "<Real/>", f'causality="output" {negated}'),
        variable("lift", 201, '<Real start="-9.81"/>', f'variability="parameter" {negated}'),
        variable("minus", 401, "<Integer/>", f'causality="output" {negated}'),
        variable("odd", 401, "<Boolean/>"),
        variable("even", 401, "<Boolean/>", f'causality="output" {negated}'),
        variable("same", 2, "<Real/>", 'causality="output" alias="alias"'),
    )
    run = simulate_any(fmu, 1.5, parameters={"lift": -5.0}, tolerance=1e-10)
    assert run.events[0].time == pytest.approx(np.sqrt(2 / 5.0), abs=1e-9)
    assert (run["depth"] + run["h"]).tolist() == [0.0] * run.time.size
    assert (run["minus"] + run["bounces"]).tolist() == [0] * run.time.size
    assert run["odd"].tolist() == (run["bounces"] % 2).tolist() == (1 - run["even"]).tolist()
    assert run["same"] == pytest.approx(run["v"], abs=1e-12)


def test_states_that_the_description_does_not_tell(changed: Changed) -> None:
    """The one it tells is the second one of the library."""
    fmu = changed("forced", ('name="der(v)"', 'name="acceleration"'))
    assert fmu.states == ["x", "state_2"]
    plain = simulate_any(changed("forced"), 3.0, record=["x"])
    run = simulate_any(fmu, 3.0, record=["der(state_2)", "acceleration", "v"])
    assert run["state_2"].tolist() == run["v"].tolist() == plain["v"].tolist()
    assert run["x"].tolist() == plain["x"].tolist()
    assert run["der(state_2)"] == pytest.approx(run["acceleration"], abs=1e-12)


def test_more_derivatives_than_states_name_none(changed: Changed) -> None:
    fmu = changed("forced", variable("der(d)", 101, "<Real/>", ""), variable("der(f)", 102, "<Real/>", ""))
    assert fmu.states == ["x", "v"]  # those are of parameters
    more = variable("w", 7, "<Real/>", ""), variable("der(w)", 8, "<Real/>", "")
    assert changed("forced", *more).states == ["state_1", "state_2"]


def test_states_of_the_library_that_are_others(changed: Changed) -> None:
    other = ('name="v" valueReference="2"', 'name="v" valueReference="9"')
    with pytest.raises(MotionError, match=r"fmiInitialize fails.*other variables than those whose der"):
        simulate_any(changed("forced", other), 1.0, record=["x"])


def test_a_library_that_does_not_tell_its_states(changed: Changed) -> None:
    """As the FMUs 1.0 of the Reference-FMUs; it says so as an error, which is none of the run's."""
    silent = changed("forced", options=("-DTELLS_NO_STATES=1",))
    assert simulate_any(silent, 3.0)["v"].tolist() == simulate_any(changed("forced"), 3.0)["v"].tolist()
    gone = ("-DGetStateValueReferences=Gone", "-DCompletedIntegratorStep=None", "-DTELLS_NO_STATES=1")
    assert simulate_any(changed("forced", options=gone), 3.0)["v"].tolist() == simulate_any(silent, 3.0)["v"].tolist()
    nameless = [('name="der(v)"', 'name="a"'), ('name="der(x)"', 'name="b"')]
    run = simulate_any(changed("forced", *nameless, options=("-DTELLS_NO_STATES=1",)), 3.0)
    assert run["state_1"].tolist() == run["x"].tolist() and run["state_2"].tolist() == run["v"].tolist()
    with pytest.raises(MotionError, match="other variables than those whose der"):
        simulate_any(changed("forced", options=("-DTELLS_NO_STATES=2",)), 3.0)


def test_what_a_library_says_goes_with_its_error(changed: Changed) -> None:
    with pytest.raises(MotionError, match="no rates beyond t = 1"):
        simulate_any(changed("grumble"), 3.0)


def test_a_library_without_a_function(changed: Changed) -> None:
    with pytest.raises(StickslipError, match="its library has no function fmiInitialize, which the standard requires"):
        simulate_any(changed("dahlquist", options=("-DInitialize=Gone",)), 1.0)


@pytest.mark.parametrize("name", ["integers", "driven"])
def test_a_unit_of_a_coupled_system(changed: Changed, name: str, tmp_path: Path) -> None:
    """x' = u of both, the first of FMI 3; u = 1 of the first."""
    inputs = {"u": 1.0} if name == "driven" else {}
    units = {"one": Unit(Fmu.open(foreign(name, tmp_path, 3)), inputs=inputs), "two": Unit(changed(name))}
    run = couple(CoupledSystem("pair", units, [Connection("one.x", "two.u")], stop_time=2.0, tolerance=1e-6))
    t, start = run.time, 0.25 if name == "integers" else 0.0
    assert run["one.x"] == pytest.approx(start + t, abs=1e-6)
    assert run["two.x"] == pytest.approx(start + start * t + t**2 / 2, abs=1e-5)


def test_a_copy_with_other_start_values_is_refused(changed: Changed, tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match=r"keeps its own start value 9\.81 of 'g' whatever the description says"):
        copy_with_start_values(changed("ball"), tmp_path / "moon.fmu", {"g": 1.6})


def test_the_commands(changed: Changed) -> None:
    path = changed("ball").path
    told = json.loads(stickslip("inspect", path, "--json").stdout)
    assert (told["states"], told["runs_here"], told["fmi_version"]) == (["h", "v"], True, "1.0")
    assert told["interfaces"] == [{"kind": "Model Exchange", "identifier": "ball", "capabilities": []}]
    assert changed("integers").interfaces["CoSimulation"]["canHandleVariableCommunicationStepSize"] == "true"
    run = json.loads(stickslip("simulate", path, "--until", 1, "--json").stdout)
    assert run["ranges"]["h"]["max"] == 1.0
