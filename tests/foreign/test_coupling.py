"""Coupled systems: against closed forms, through loops and events, and co-simulated."""

from __future__ import annotations

from math import cos, exp
from pathlib import Path

import numpy as np
import pytest
from coupled import exported, masses, wires
from models import Models

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.toml_system import read_system
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any

SCENE = Path(__file__).parents[2] / "data" / "systems" / "disc_rig_motors.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("coupled")


def place(t: float) -> float:
    """Of the first mass: the two modes are in phase (only k works) and against each other (k + 2 kc)."""
    return (cos(2.0 * t) + cos(3.0 * t)) / 2


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("solver", ["dopri5", "dop853", "stiff"])
def test_two_masses_follow_the_closed_form(folder, version, solver):
    run = couple(masses(exported("mass", folder, version), solver=solver, tolerance=1e-12, stop_time=10.0))
    expected = [place(t) for t in run.time]
    assert run["a.x"] == pytest.approx(expected, abs=1e-9)
    assert run.units["b.place"] == "m"


def test_the_tolerance_of_a_system_decides_the_steps(folder):
    """By the fifth root of it, as of the fifth order."""
    fmu, connections = exported("mass", folder), wires("a.place -> b.other", "b.place -> a.other")
    units = {name: Unit(fmu, {"k": 4e4}, {"x": 1.0}) for name in "ab"}
    steps = [
        couple(CoupledSystem("fast", units, connections, solver="dopri5", tolerance=t, stop_time=1.0)).steps
        for t in (1e-7, 1e-9)
    ]
    assert steps[1] / steps[0] == pytest.approx(100.0**0.2, rel=0.05)


def test_versions_of_fmi_mix(folder):
    units = {"a": Unit(exported("mass", folder, "2.0"), start={"x": 1.0}), "b": Unit(exported("mass", folder))}
    connections = wires("a.place -> b.other", "b.place -> a.other")
    run = couple(CoupledSystem("mixed", units, connections, tolerance=1e-12, stop_time=5.0))
    assert run["a.x"][-1] == pytest.approx(place(5.0), abs=1e-10)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_linear_loop_is_solved(folder, version):
    # a' = -a + b'/2 and b' = -b + a'/2: the sum falls with the rate 2, the difference with 2/3
    fmu = exported("link", folder, version)
    units = {"a": Unit(fmu), "b": Unit(fmu, start={"x": 0.5})}
    run = couple(CoupledSystem("loop", units, wires("a.y -> b.u", "b.y -> a.u"), tolerance=1e-12, stop_time=2.0))
    total, rest = 1.5 * exp(-4.0), 0.5 * exp(-4.0 / 3.0)
    assert run["a.x"][-1] == pytest.approx((total + rest) / 2, abs=1e-11)
    assert run["b.x"][-1] == pytest.approx((total - rest) / 2, abs=1e-11)
    assert "1 algebraic loop by Newton's method" in run.method


def test_a_loop_that_is_not_linear_is_solved_at_every_time(folder):
    fmu = exported("link", folder)
    values = {"g": 0.0, "n": 0.9}
    units = {"a": Unit(fmu, values), "b": Unit(fmu, values, {"x": -2.0})}
    run = couple(CoupledSystem("loop", units, wires("a.y -> b.u", "b.y -> a.u"), tolerance=1e-10, stop_time=3.0))
    assert run["a.y"] == pytest.approx(-run["a.x"] + 0.9 * np.sin(run["b.y"]), abs=1e-12)
    assert run["b.y"] == pytest.approx(-run["b.x"] + 0.9 * np.sin(run["a.y"]), abs=1e-12)


def test_a_loop_without_solution_is_told(folder):
    fmu = exported("link", folder)
    units = {"a": Unit(fmu, {"g": 1.0}), "b": Unit(fmu, {"g": 1.0})}
    with pytest.raises(MotionError, match=r"algebraic loop .*a.y -> b.u.* has no solution"):
        couple(CoupledSystem("loop", units, wires("a.y -> b.u", "b.y -> a.u"), stop_time=1.0))


def test_an_event_in_one_unit_changes_the_input_of_another(model: Models):
    # the clock ticks every 0.1 s; x grows with the number of ticks
    units = {"clock": Unit(model("clock")), "driven": Unit(model("driven"))}
    system = CoupledSystem("ticks", units, wires("clock.ticks -> driven.u"), stop_time=0.35)
    run = couple(system, output_times=[0.05, 0.15, 0.35])
    assert run["driven.x"] == pytest.approx([0.0, 0.05, 0.45], abs=1e-12)
    assert [event.kind for event in run.events] == ["time"] * 3
    assert run["clock.late"][-1] == 0


def test_steps_of_a_co_simulation_converge_with_second_order(folder):
    fmu = exported("mass", folder)
    for solver in ("jacobi", "gauss-seidel"):
        errors = []
        for step in (0.02, 0.01, 0.005):
            run = couple(masses(fmu, solver=solver, step=step, stop_time=2.0))
            errors.append(abs(run["a.x"][-1] - place(2.0)))
            assert "fixed step" in run.method
        assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25)
        assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("solver", ["jacobi", "gauss-seidel"])
def test_controlled_steps_keep_their_tolerance_and_are_put_back(folder, version, solver):
    fmu = exported("mass", folder, version)
    errors = []
    for tolerance in (1e-4, 1e-6):
        run = couple(masses(fmu, solver=solver, tolerance=tolerance, stop_time=5.0))
        assert "steps controlled" in run.method
        errors.append(np.max(np.abs(run["a.x"] - [place(t) for t in run.time])))
        assert np.all(np.diff(run.time) > 0)
    assert errors[0] < 1e-1
    assert errors[1] < errors[0] / 10


def test_a_first_step_far_too_long_is_taken_back(folder):
    run = couple(
        masses(exported("mass", folder), solver="jacobi", step=2.0, adaptive=True, tolerance=1e-6, stop_time=4.0)
    )
    assert run.evaluations > 0
    assert run["a.x"][-1] == pytest.approx(place(4.0), abs=1e-3)


def test_an_output_between_two_steps_does_not_shorten_those_after(folder):
    """A step that is cut for an output is as short as it may be: the next is as long as that before."""
    fmu = exported("mass", folder)
    run, cut = (
        couple(masses(fmu, solver="jacobi", tolerance=1e-6, stop_time=5.0), output_times=times)
        for times in ([0.0, 5.0], [0.0, 1.0, 1.0 + 1e-7, 2.0, 2.0 + 1e-7, 5.0])
    )
    # two halves and the whole of each of four steps more, of two that are parted, and what the places of all change
    assert cut.steps <= run.steps + 3 * 6 + 3
    assert cut["a.x"][-1] == pytest.approx(place(5.0), abs=1e-3)


def test_units_without_state_take_fixed_steps_and_it_is_said(model: Models):
    units = {"a": Unit(model("integers")), "b": Unit(model("integers"), inputs={"u": 2.0})}
    run = couple(CoupledSystem("fixed", units, wires("b.x -> a.u"), step=0.01, stop_time=1.0))
    assert "because a, b cannot be put back" in run.method
    assert run.time == pytest.approx(np.linspace(0.0, 1.0, 101), abs=1e-12)
    # b = 0.25 + 2 t; a is its integral from 0.25 on
    assert run["a.x"][-1] == pytest.approx(0.25 + 0.25 + 1.0, abs=1e-3)
    with pytest.raises(StickslipError, match="unit 'a' cannot be put back"):
        couple(CoupledSystem("fixed", units, wires("b.x -> a.u"), adaptive=True, stop_time=1.0))


def test_a_unit_that_fails_in_a_co_simulation_is_named_with_what_it_says(folder):
    # a spring that drives: beyond all numbers after a few steps
    fmu = exported("mass", folder)
    units = {"a": Unit(fmu), "b": Unit(fmu, {"k": -1e6}, {"x": 1e200})}
    system = CoupledSystem("far", units, wires("a.place -> b.other"), solver="jacobi", step=0.1, stop_time=1.0)
    with pytest.raises(MotionError, match=r"unit 'b': doStep fails at t = 0\.\d s\. The FMU says: ."):
        couple(system)
    units = {"a": Unit(fmu, start={"x": 1e308, "v": 1e308}), "b": Unit(fmu)}
    with pytest.raises(MotionError, match=r"reading values fails at t = 0 s: unit 'a': .*derivative .* is not finite"):
        couple(system.changed(units=units))


def rig_at(stiffness: float, **settings: object) -> float:
    """Angle of the disc rig with motors after a second; the first stick has begun."""
    system = read_system(SCENE)
    units = {
        name: Unit(
            unit.fmu,
            {**unit.parameters, **({"K": stiffness, "T": 1e-3} if name != "rig" else {})},
            unit.start,
            unit.inputs,
        )
        for name, unit in system.units.items()
    }
    run = couple(system.changed(units=units, stop_time=1.0, **settings))
    return float(run["rig.theta"][-1])


def test_the_rig_tends_to_constant_speeds_as_its_motors_stiffen():
    rig = Fmu.open(built("disc_rig"))
    ideal = simulate_any(rig, 1.0, inputs={"w0": 0.41, "w1": 0.83}, tolerance=1e-11)["theta"][-1]
    errors = [abs(rig_at(stiffness, tolerance=1e-10) - ideal) for stiffness in (20.0, 200.0, 2000.0)]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize("solver", ["jacobi", "gauss-seidel"])
def test_the_rig_is_the_same_co_simulated(solver):
    system = read_system(SCENE)
    exact = couple(system.changed(stop_time=5.0, tolerance=1e-11), output_times=[5.0])
    stepped = couple(system.changed(stop_time=5.0, solver=solver), output_times=[5.0])
    assert stepped["rig.theta"][-1] == pytest.approx(exact["rig.theta"][-1], abs=1e-3)
    assert 0 in couple(system.changed(stop_time=5.0))["rig.disc0_state"]
