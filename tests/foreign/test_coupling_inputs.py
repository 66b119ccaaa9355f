"""Systems as users write them: TOML, SSP, the command; and everything that is wrong in them."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from coupled import exported, wires
from models import Models
from structures import FROM_FILE, INLINE, packed, structure
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.run import couple
from fmu_models.coupling.ssp_writer import parameter_sets
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.toml_system import read_system
from fmu_models.coupling.wiring import Connection, conversion

LINKS = 'connections = [{ from = "a.place", to = "b.other" }, { from = "b.place", to = "a.other" }]\n'
UNITS = '[units.a]\nfmu = "mass3.0.fmu"\nstart = { x = 1.0 }\n[units.b]\nfmu = "mass3.0.fmu"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("systems")
    exported("mass", made)
    exported("mass", made, "2.0")
    return made


def scene(folder: Path, text: str) -> Path:
    path = folder / "system.toml"
    path.write_text(text, "utf-8")
    return path


def test_a_scene_is_read(folder):
    system = read_system(scene(folder, LINKS + "stop_time = 2.0\ntolerance = 1e-10\n" + UNITS))
    assert [str(c) for c in system.connections] == ["a.place -> b.other", "b.place -> a.other"]
    assert couple(system).time[-1] == 2.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stop_time = ", "is not TOML"),
        ("solvr = 'auto'\n" + UNITS, "line 1: 'solvr' is not a key at the top of the file.*'solver'"),
        ("solver = 'rk4'\n" + UNITS, "line 1: There is no solver 'rk4'"),
        ("stop_time = 'soon'\n" + UNITS, "line 1: 'stop_time' must be a number"),
        ("stop_time = -1.0\n" + UNITS, "line 1: The run must end after it starts"),
        ("step = 0.0\n" + UNITS, "line 1: The step must be a positive"),
        ("tolerance = 2.0\n" + UNITS, "line 1: .* between 1e-14 and 0.1"),
        ("", "has no units"),
        ("units = 3", "line 1: 'units' must be a table"),
        ("[units]\na = 3", "line 2: 'a' must be a table"),
        ("[units.a]\nparameters = {}", "line 1: unit 'a' needs one of fmu"),
        ("[units.a]\nfmu = 'nothing.fmu'", "line 2: unit 'a': There is no file"),
        ("[units.a]\nfmu = 'mass3.0.fmu'\ncontacts = ['b']", "line 3: .* an FMU is as it is"),
        ("[units.a]\nmodel = 'disc_rg'", "line 2: .*disc_rig"),
        ("[units.a]\nfmu = 'mass3.0.fmu'\nparameters = { kk = 1.0 }", "line 1: Unit 'a'.*no parameter 'kk'"),
        ("[units.a]\nfmu = 'mass3.0.fmu'\nparameters = { k = 'stiff' }", "line 3: 'k' must be a finite number"),
        ("[units.a]\nfmu = 'mass3.0.fmu'\nstart = { y = 1.0 }", "line 1: Unit 'a'.*no variable 'y'"),
        ("connections = [3]\n" + UNITS, r"line 1: 'connections' must be tables, .* number 1 is 3"),
        (
            "connections = [{ from = 'a.place', to = 'b.other', via = 'c' }]\n" + UNITS,
            r"line 1: 'via' is not a key in \[connections\]",
        ),
        (
            "connections = [\n{ from = 'a.place', to = 'b.other' },\n{ from = 'b.place' }]\n" + UNITS,
            r"line 3: 'to' is missing",
        ),
        (LINKS.replace("}, {", "},\n{").replace("b.place", "b.plce") + UNITS, "line 2: .* no variable 'plce'"),
        (LINKS.replace('to = "a', 'factor = "x", to = "a') + UNITS, "line 1: 'factor' must be a number"),
        ("outputs = ['a.plce']\n" + UNITS, "line 1: .*no variable 'plce'.*'place'"),
        ("outputs = [1]\n" + UNITS, "line 1: 'outputs' must be a list of names"),
        ("[units.a]\nfmu = 'mass3.0.fmu'\ninputs = { other = 'fast' }", "line 3: A column of a log is LOG:COLUMN"),
        ("[units.a]\nfmu = 'mass3.0.fmu'\ninputs = { other = 'w.csv:x' }", "line 1: .*There is no log"),
        (LINKS + UNITS + "inputs = { other = 1.0 }", "line 7: .*'other' is given a value, but is fed"),
    ],
)
def test_what_is_wrong_in_a_scene_is_named(folder, text, said):
    with pytest.raises(StickslipError, match=said):
        read_system(scene(folder, text))


@pytest.mark.parametrize(
    ("connection", "said"),
    [
        ("c.place -> b.other", "Connection 'c.place -> b.other': there is no unit 'c'"),
        ("place -> b.other", "'place' names no variable of a unit"),
        ("a.plce -> b.other", "unit 'a' has no variable 'plce'.*Did you mean 'place'"),
        ("a.der(v) -> b.other", r"'a.der\(v\)' is a local of its unit, but an output is needed"),
        ("a.place -> b.k", "'b.k' is a parameter of its unit, but an input is needed"),
        ("a.speed -> b.other", "'a.speed' is in m/s, 'b.other' in m: these measure different quantities"),
    ],
)
def test_what_is_wrong_in_a_connection_is_named(folder, connection, said):
    fmu = exported("mass", folder)
    with pytest.raises(StickslipError, match=said):
        CoupledSystem("bad", {"a": Unit(fmu), "b": Unit(fmu)}, wires(connection))


def test_an_input_has_one_source(folder):
    fmu = exported("mass", folder)
    with pytest.raises(StickslipError, match=r"'b.other' is fed by 'a.place' already"):
        CoupledSystem("bad", {"a": Unit(fmu), "b": Unit(fmu)}, wires("a.place -> b.other", "b.place -> b.other"))


def test_types_must_fit(folder, model: Models):
    units = {"a": Unit(exported("mass", folder)), "clock": Unit(model("clock")), "driven": Unit(model("driven"))}
    assert CoupledSystem("good", units, wires("clock.ticks -> driven.u")).wires[0].factor == 1.0
    with pytest.raises(StickslipError, match="is an output of its unit, but an input"):
        CoupledSystem("bad", units, wires("a.place -> clock.ticks"))


def test_solvers_need_their_interface(folder, model: Models):
    only_steps = {"a": Unit(model("integers"))}
    with pytest.raises(StickslipError, match="unit 'a' has no Model Exchange, which 'dop853' needs"):
        couple(CoupledSystem("bad", only_steps, solver="dop853", stop_time=1.0))
    only_rates = {"a": Unit(model("relay"))}
    with pytest.raises(StickslipError, match="unit 'a' has no Co-Simulation, which 'co-simulation' needs"):
        couple(CoupledSystem("bad", only_rates, solver="co-simulation", stop_time=1.0))
    with pytest.raises(StickslipError, match="communication step and 'rollback' belong to 'co-simulation'"):
        couple(CoupledSystem("bad", only_rates, step=0.1, stop_time=1.0))


@pytest.mark.parametrize(
    ("one", "two", "factor", "offset"),
    [
        ("mm", "m", 1e-3, 0.0),
        ("kN.m", "N m", 1e3, 0.0),
        ("deg", "rad", 0.017453292519943295, 0.0),
        ("m/s2", "mm/s^2", 1e3, 0.0),
        ("degC", "K", 1.0, 273.15),
        ("rpm", "rad/s", 0.10471975511965977, 0.0),
        ("N m s/rad", "N*m*s/rad", 1.0, 0.0),
    ],
)
def test_units_of_measure_are_converted(one, two, factor, offset):
    assert conversion(one, two) == pytest.approx((factor, offset), rel=1e-12)


def test_a_connection_may_have_its_own_factor(folder):
    fmu = exported("mass", folder)
    joined = [Connection("a.speed", "b.other", 2.0, 1.0)]
    system = CoupledSystem("scaled", {"a": Unit(fmu), "b": Unit(fmu)}, joined, outputs=("b.other",), stop_time=1.0)
    assert couple(system)["b.other"][0] == 1.0


def test_ssp_is_read_with_parameters_inline_and_from_files(folder, tmp_path):
    system = read_system(packed(folder, tmp_path / "masses.ssp", structure()))
    assert system.units["a"].start == {"x": 1.0}
    assert system.units["b"].parameters == {"k": 6.0}
    assert [(w.factor, w.offset) for w in system.wires] == [(1.0, 0.0), (0.5, 0.25)]
    assert (system.stop_time, system.outputs) == (1.5, ("b.speed",))
    run = couple(system.changed(outputs=("a.x", "a.other", "b.x")))
    assert run["a.other"] == pytest.approx(0.5 * run["b.x"] + 0.25, abs=1e-14)


def test_ssd_beside_its_fmus_is_read(folder, tmp_path):
    with zipfile.ZipFile(packed(folder, tmp_path / "masses.ssp", structure())) as archive:
        archive.extractall(tmp_path)
    assert read_system(tmp_path / "SystemStructure.ssd").units["b"].parameters == {"k": 6.0}


@pytest.mark.parametrize(
    ("description", "said"),
    [
        (structure(source="../mass.fmu"), "component 'a' refers to '../mass.fmu', which is no file beside"),
        (structure(source="resources/none.fmu"), "component 'a': There is no file"),
        (structure(begin='<!DOCTYPE a [<!ENTITY b "c">]>'), "document type"),
        ("<nothing/>", "is no System Structure Description"),
        ("<", "cannot be read"),
        (structure(first=INLINE.replace("mm", "kg")), "'x' is given in kg, but is in m"),
        (structure(first=INLINE.replace("1000", "long")), "line 4, is not valid SSP 1.0: .* 'long'"),
        (structure(first=INLINE.replace("1000", "INF")), "'x' is 'INF', not a finite number"),
        (structure().replace('startConnector="place"', 'startConnector="plce"'), "no variable 'plce'"),
        (structure(second=FROM_FILE.replace("b.ssv", "c.ssv") % ""), "'c.ssv' cannot be read"),
    ],
)
def test_what_is_wrong_in_ssp_is_named(folder, tmp_path, description, said):
    with pytest.raises(StickslipError, match=said):
        read_system(packed(folder, tmp_path / "bad.ssp", description))


def test_an_ssp_that_leaves_its_folder_is_refused(folder, tmp_path):
    with pytest.raises(StickslipError, match="outside its folder"):
        read_system(packed(folder, tmp_path / "bad.ssp", structure(), **{"../evil.ssv": ""}))


def test_the_command_tells_and_writes(folder, tmp_path):
    path, target = scene(folder, LINKS + UNITS), tmp_path / "run.csv"
    done = CliRunner().invoke(app, ["couple", str(path), "--until", "1", "--json", "-o", str(target)])
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout)
    assert content["units"] == {"a": "mass3.0.fmu", "b": "mass3.0.fmu"}
    assert content["end_time"] == 1.0
    assert target.read_text("utf-8").startswith("time [s],a.x [m]")
    done = CliRunner().invoke(app, ["couple", str(path), "--until", "1", "--solver", "co-simulation", "--step", "0.1"])
    assert "co-simulation of 2 units, fixed step" in done.stdout
    assert ": 10 steps to t = 1 s" in done.stdout


@pytest.mark.parametrize("solver", ["auto", "co-simulation"])
def test_an_input_from_a_log_moves_the_unit(tmp_path, solver):
    """A motor's set speed rises and jumps: a critically damped answer, whatever solves it."""
    (tmp_path / "speed.csv").write_text("time [ms],w [rpm]\n0,0\n500,9.549296585513721\n500,0\n1000,0\n")
    path = scene(
        tmp_path,
        f'solver = "{solver}"\nstop_time = 1.0\ntolerance = 1e-9\n[units.motor]\nmodel = "drive_motor"\n'
        'parameters = { T = 0.1 }\nstart = { w = 0.0 }\ninputs = { w_set = "speed.csv:w", F = 0.0 }\n',
    )
    times = np.linspace(0.0, 1.0, 41)
    found = couple(read_system(path), output_times=times)["motor.w"]
    rate, lag = 2.0, 0.1  # rad/s2, s

    def ramp(t):
        return np.where(t > 0, rate * (t - 2 * lag + (t + 2 * lag) * np.exp(-t / lag)), 0.0)

    def step(t):
        return np.where(t > 0, 0.5 * rate * (1 - (1 + t / lag) * np.exp(-t / lag)), 0.0)

    expected = ramp(times) - ramp(times - 0.5) - step(times - 0.5)
    assert found == pytest.approx(expected, abs=2e-6)


def test_an_input_is_given_on_the_command_line(tmp_path):
    (tmp_path / "speed.csv").write_text("time [s],w [rad/s]\n0,0.41\n1,0.6\n")
    arguments = ["couple", "disc_rig_motors", "--until", "1", "--json"]
    ends = {}
    for name, value in {"constant": "0.41", "log": f"{tmp_path / 'speed.csv'}:w"}.items():
        result = CliRunner().invoke(app, [*arguments, "--input", f"motor0.w_set={value}"], catch_exceptions=False)
        ends[name] = json.loads(result.stdout)["variables"]["motor0.w"]["last"]
    assert ends["log"] > ends["constant"] + 0.1


def test_a_parameter_set_holds_no_moving_input(tmp_path):
    system = read_system("disc_rig_motors").with_inputs({"motor0.w_set": lambda t: 0.41 + 0.01 * t})
    with pytest.raises(StickslipError, match="input 'w_set' changes with time"):
        parameter_sets(system)
