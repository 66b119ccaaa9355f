"""Coupled systems: against closed forms, through loops and events, and co-simulated."""

from __future__ import annotations

from dataclasses import replace
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


def test_fixed_steps_of_a_co_simulation_converge_with_third_order(folder):
    """The first steps, which know a point and its slope alone, leave an error of that order; all others less."""
    fmu, errors = exported("mass", folder), []
    for step in (0.1, 0.05, 0.025):
        run = couple(masses(fmu, solver="co-simulation", step=step, stop_time=5.0))
        errors.append(abs(run["a.x"][-1] - place(5.0)))
        assert run.time == pytest.approx(np.linspace(0.0, 5.0, round(5.0 / step) + 1), abs=1e-12)
        assert "fixed step" in run.method
    assert errors[0] / errors[2] > 8.0**2 / 1.5


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("rollback", [None, False])
def test_a_co_simulation_keeps_its_tolerance_at_all_times(folder, version, rollback):
    fmu, times = exported("mass", folder, version), np.linspace(0.0, 10.0, 1001)
    expected = np.array([place(t) for t in times])
    for tolerance, calls in ((1e-3, 100), (1e-6, 300), (1e-8, 700)):
        system = masses(fmu, solver="co-simulation", rollback=rollback, tolerance=tolerance, stop_time=10.0)
        run = couple(system, output_times=times)
        assert np.max(np.abs(run["a.x"] - expected) / (1.0 + np.abs(expected))) <= 3.0 * tolerance
        assert run.steps + run.evaluations <= calls
        assert ("steps repeated where they miss" in run.method) == (rollback is None)


def test_outputs_between_steps_cost_no_steps(folder):
    system = masses(exported("mass", folder), solver="co-simulation", stop_time=5.0)
    few, many = (couple(system, output_times=np.linspace(0.0, 5.0, n)) for n in (2, 1001))
    assert many.steps == few.steps < 200
    assert many["a.x"][-1] == few["a.x"][-1]


def test_a_unit_that_can_do_nothing_still_keeps_the_tolerance(folder, model: Models):
    """Held inputs, no state to put back, no derivatives: the integral of a place that swings."""
    units = {"a": Unit(model("integers")), "b": Unit(exported("mass", folder), {"k": 4.0, "kc": 0.0}, {"x": 1.0})}
    system = CoupledSystem("integral", units, wires("b.place -> a.u"), tolerance=1e-6, stop_time=0.7)
    run = couple(system, output_times=np.linspace(0.0, 0.7, 71))
    assert "no step repeated" in run.method
    assert "a: held inputs;" in run.method
    assert run["a.x"] == pytest.approx(0.25 + np.sin(2.0 * run.time) / 2.0, abs=3e-6)
    assert run.steps < 100


def test_another_unit_of_time_changes_no_step(folder):
    fmu, steps = exported("mass", folder), []
    for scale in (1e-3, 1.0, 1e3):
        units = {name: Unit(fmu, {"m": scale**2}, {"x": x}) for name, x in (("a", 1.0), ("b", 0.0))}
        system = CoupledSystem("masses", units, wires("a.place -> b.other", "b.place -> a.other"))
        run = couple(system.changed(solver="co-simulation", stop_time=10.0 * scale), output_times=[10.0 * scale])
        steps.append((run.steps, run.evaluations))
        assert run["a.x"] == pytest.approx([place(10.0)], abs=3e-6)
    assert steps[0] == steps[1] == steps[2]


def test_a_rate_that_is_none_is_refused(folder):
    fmu = exported("mass", folder)
    connections = wires("a.place -> b.other", "a.place -> b.other_rate", "b.place -> a.other")
    units = {"a": Unit(fmu, start={"x": 1.0}), "b": Unit(fmu)}
    system = CoupledSystem("rate", units, [replace(c, factor=1.0) for c in connections], solver="co-simulation")
    with pytest.raises(
        StickslipError, match=r"'b.other_rate' is fed by 'a.place', which is 1 at the start, where 'b.other'"
    ):
        couple(system)


def test_the_order_of_units_and_connections_changes_no_bit(folder):
    fmu = exported("link", folder)
    units = {name: Unit(fmu, {"n": 0.3}, {"x": x}) for name, x in (("a", 1.0), ("b", 0.5), ("c", -0.7))}
    ring = wires("a.y -> b.u", "b.y -> c.u", "c.y -> a.u")
    runs = []
    for names, order in (("abc", (0, 1, 2)), ("cab", (2, 1, 0)), ("bca", (1, 0, 2))):
        system = CoupledSystem("ring", {n: units[n] for n in names}, [ring[i] for i in order], solver="co-simulation")
        runs.append(couple(system.changed(stop_time=2.0)))
    for run in runs[1:]:
        for name, values in runs[0].values.items():
            assert np.array_equal(run[name], values), name


def test_units_without_state_repeat_no_step_and_it_is_said(model: Models):
    units = {"a": Unit(model("integers")), "b": Unit(model("integers"), inputs={"u": 2.0})}
    run = couple(CoupledSystem("fixed", units, wires("b.x -> a.u"), step=0.01, stop_time=1.0))
    assert "fixed step" in run.method
    assert "a: held inputs;" in run.method
    assert run.time == pytest.approx(np.linspace(0.0, 1.0, 101), abs=1e-12)
    # b = 0.25 + 2 t; a is its integral from 0.25 on
    assert run["a.x"][-1] == pytest.approx(0.25 + 0.25 + 1.0, abs=2e-3)
    with pytest.raises(StickslipError, match="unit 'a' cannot be put back"):
        couple(CoupledSystem("fixed", units, wires("b.x -> a.u"), rollback=True, stop_time=1.0))


def test_a_unit_that_fails_in_a_co_simulation_is_named_with_what_it_says(folder):
    # a spring that drives: beyond all numbers after a few steps
    fmu = exported("mass", folder)
    units = {"a": Unit(fmu), "b": Unit(fmu, {"k": -1e6}, {"x": 1e200})}
    system = CoupledSystem("far", units, wires("a.place -> b.other"), solver="co-simulation", step=0.1, stop_time=1.0)
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


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_rig_is_the_same_co_simulated(version):
    """One disc: 18 changes of the contact in 10 s, which FMI 2 tells by its variables alone."""
    units = {
        "rig": Unit(Fmu.open(built("disc_rig", contacts=["disc0"], fmi_version=version))),
        "motor": Unit(
            Fmu.open(built("drive_motor", fmi_version=version)), {"K": 2.0, "T": 0.02}, {"w": 0.41}, {"w_set": 0.41}
        ),
    }
    connections = wires("motor.speed -> rig.w0", "motor.acceleration -> rig.w0_rate", "rig.F0 -> motor.F")
    system = CoupledSystem("rig", units, connections, stop_time=10.0)
    times = np.linspace(0.0, 10.0, 1001)
    exact = couple(system.changed(solver="dop853", tolerance=1e-12), output_times=times)
    assert len(exact.events) == 18
    run = couple(system.changed(solver="co-simulation", tolerance=1e-6), output_times=times)
    for name in ("rig.theta", "rig.omega", "motor.w"):
        assert run[name] == pytest.approx(exact[name], abs=3e-6)
    # without early return events are found by shorter steps, until what is left does the states no harm
    near = 2e-5 if version == "2.0" else 1e-5
    assert [event.time for event in run.events] == pytest.approx([event.time for event in exact.events], abs=near)


@pytest.mark.parametrize("solver", ["auto", "co-simulation"])
def test_a_driven_disc_whose_speed_s_rate_is_not_fed_is_refused_with_the_cure(solver):
    system = read_system(SCENE)
    connections = [one for one in system.connections if not one.target.endswith("_rate")]
    with pytest.raises(
        MotionError, match=r"\(chattering\).* from motor0.speed's rate of change to rig.w0_rate"
    ) as caught:
        couple(system.changed(connections=connections, solver=solver))
    assert "F_rate" not in str(caught.value) and caught.value.so_far


def test_the_rig_with_two_motors_is_the_same_co_simulated():
    system = read_system(SCENE)
    exact = couple(system.changed(stop_time=5.0, tolerance=1e-11), output_times=[5.0])
    stepped = couple(system.changed(stop_time=5.0, solver="co-simulation"), output_times=[5.0])
    assert stepped["rig.theta"][-1] == pytest.approx(exact["rig.theta"][-1], abs=3e-6)
    assert 0 in couple(system.changed(stop_time=5.0))["rig.disc0_state"]
