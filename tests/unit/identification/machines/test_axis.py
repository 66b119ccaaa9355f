"""The machine that a recipe's terms declare: its columns in closed form, and what its friction holds at rest."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import sympy
from checkout import ROOT
from lmfit import Parameters
from machine_log import LINEAR, MEASURED, log_of, motion, recipe_of, slide
from recipe_fit import inverse_dynamics
from sympy.parsing.sympy_parser import implicit_multiplication, parse_expr, standard_transformations
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from identification.fitted_model.machine import machine_with
from identification.inference.problem import identifier
from identification.machines.axis import KINDS, Term, declared_axis
from identification.machines.by_recipe import recipe_machine
from identification.machines.inverse import identify_machine
from identification.machines.machine_fit import read_machine_fit
from identification.machines.regressor import regressor_of
from identification.measurement.recipe import Speed, read_recipe
from identification.model_check.machine_runs import machine_runs
from rig_io.readers.csv_log import write

AXIS = ROOT / "data" / "machines" / "axis.csv"
TRUTH = {"M": 20.0, "Fv": 60.0, "Fc": 12.0, "offset": -1.5}  # data/README.md

OVER = 0.3  # rad/s
CLOSED = {
    "inertia": lambda q, v, a: a,
    "viscous": lambda q, v, a: v,
    "viscous+": lambda q, v, a: np.maximum(v, 0),
    "viscous-": lambda q, v, a: np.minimum(v, 0),
    "quadratic": lambda q, v, a: v * np.abs(v),
    "coulomb": lambda q, v, a: np.sign(v),
    "coulomb+": lambda q, v, a: np.maximum(np.sign(v), 0),
    "coulomb-": lambda q, v, a: np.minimum(np.sign(v), 0),
    "coulomb-arctan": lambda q, v, a: np.arctan(v / OVER),
    "coulomb-tanh": lambda q, v, a: np.tanh(v / OVER),
    "offset": lambda q, v, a: np.ones_like(v),
    "gravity": lambda q, v, a: 9.81 * np.sin(q),
    "stiffness": lambda q, v, a: q,
}


def term(kind: str) -> Term:
    return Term(f"p {kind}", kind, Speed(OVER) if KINDS[kind].smoothed else None)


# inertia last, and a machine without: what stands in the declaration first need not be the first column
@pytest.mark.parametrize("kinds", [[*KINDS][::-1], ["offset", "coulomb"]], ids=["all", "no inertia"])
def test_columns_of_the_declared_machine_are_those_of_the_terms(kinds):
    assert KINDS.keys() == CLOSED.keys()
    rng = np.random.default_rng(3)
    q, v, a = rng.normal(size=(3, 200))
    v[:5] = 0.0
    regressor = regressor_of(declared_axis(tuple(map(term, kinds)), True))
    found = regressor(q[:, None], v[:, None], a[:, None])[:, 0]
    for kind in kinds:
        column = found[:, regressor.names.index(identifier(f"p {kind}"))]
        assert column == pytest.approx(CLOSED[kind](q, v, a), rel=1e-14, abs=1e-15), kind


def test_the_manual_says_the_columns_of_the_terms():
    rules = (*standard_transformations, implicit_multiplication)
    names = {"sgn": sympy.sign, "g": 9.81, "speed": OVER}
    q, v, a = np.random.default_rng(3).normal(size=(3, 200))
    for kind, one in KINDS.items():
        said = parse_expr(one.column.replace("q''", "a").replace("q'", "v"), names, rules)
        column = np.broadcast_to(sympy.lambdify(sympy.symbols("q v a"), said)(q, v, a), q.shape)
        assert column == pytest.approx(CLOSED[kind](q, v, a), rel=1e-14), kind


def test_friction_at_rest_holds_what_the_terms_of_each_direction_say():
    """A push forwards is held by friction of positive slip."""
    axis = declared_axis(tuple(map(term, ("inertia", "coulomb", "coulomb+", "coulomb-", "viscous+"))), False)
    (contact,) = axis.frictions
    by_name = {p.name: p for p in axis.parameters}
    both, plus, minus = (by_name[name] for name in ("p_coulomb", "p_coulomb_plus", "p_coulomb_minus"))
    assert contact.law.capacity_minus == both + plus
    assert contact.law.capacity == both + minus


def test_the_machine_of_a_recipe_is_identified_by_instruments_as_any_other():
    asked = ["inverse", "axis", str(AXIS), "--held-out", str(AXIS), "--parallel-cutoff", "30", "--json"]
    fit = json.loads(CliRunner().invoke(app, asked).stdout)
    assert fit["method"] == "instruments"
    assert [one["name"] for one in fit["parameters"]] == [*TRUTH]
    for one, value in zip(fit["parameters"], TRUTH.values(), strict=True):
        assert abs(one["value"] - value) < 3 * one["standard_deviation"] < 0.15 * abs(value)
    (joint,) = fit["joints"]
    assert joint["held_out"]["axis.csv"] == pytest.approx(joint["seen"], rel=1e-9) and joint["free_run"] < 0.03
    assert all(
        said.startswith(("Friction laws of 'position': Coulomb+viscous before", "Conti is put aside"))
        for said in fit["verdicts"]
    )
    refused = CliRunner().invoke(app, [*asked, "--column", "position=x"])
    assert refused.exit_code != 0 and "which says its columns, units and gravity itself" in f"{refused.exception}"


def test_columns_units_and_gains_are_the_recipe_s_and_its_filters_are_left_out(tmp_path):
    text = MEASURED.replace('unit = "m"', 'unit = "mm"\nfilter = { cutoff = "3 Hz" }')
    text = text.replace('unit = "N"', 'unit = "V"\ngain = 2\ngain_unit = "N/V"')
    log, columns = log_of(tmp_path), motion()
    axis = recipe_machine(read_recipe(recipe_of(tmp_path, text + LINEAR)))
    (read,) = axis.logs([log])
    assert [p.name for p in axis.mechanism.parameters] == ["M", "Fv", "Fc", "offset"]
    assert read.position[:, 0] == pytest.approx(1e-3 * columns["x"])
    assert read.effort[:, 0] == pytest.approx(2 * slide(columns["x"], columns["v"], columns["a"]))


def test_a_recipe_of_no_machine_is_refused(tmp_path):
    with pytest.raises(StickslipError, match=r"no \[terms\]"):
        recipe_machine(read_recipe("slider"))
    text = MEASURED.replace("signals.position", "signals.travel") + LINEAR
    axis = recipe_machine(read_recipe(recipe_of(tmp_path, text)))
    with pytest.raises(StickslipError, match=r"has no positions.* Add \[signals.position\]"):
        identify_machine(axis.mechanism, axis.logs([log_of(tmp_path)]))


def test_what_is_known_of_an_axis_need_not_be_found():
    """With some terms at the values that were found, the others come out as before."""
    axis = recipe_machine(read_recipe("axis"))
    logs = axis.logs([AXIS])
    how = {"cutoff": None, "method": "least squares"}
    free = identify_machine(axis.mechanism, logs, **how)
    known = {name: free[name].value for name in ("M", "Fc")}
    found = identify_machine(axis.mechanism, logs, known=known, **how)
    assert [one.name for one in found.parameters] == ["Fv", "offset"]
    for one in found.parameters:
        assert one.value == pytest.approx(free[one.name].value, rel=1e-11)
    assert found.joints[0].seen.relative_error == pytest.approx(free.joints[0].seen.relative_error, rel=1e-11)
    assert found.joints[0].free_run == pytest.approx(free.joints[0].free_run, rel=1e-9)
    q, v, a = np.random.default_rng(1).normal(size=(3, 20, 1))
    handed = [regressor_of(machine_with(axis.mechanism, fit)) for fit in (found, free)]
    efforts, same = (one(q, v, a) @ one.declared for one in handed)
    assert efforts == pytest.approx(same, rel=1e-10)
    told = axis.compared(found, logs).verdicts
    assert any("not compared, for Fc is taken as known" in said for said in told)


@pytest.mark.nightly
def test_several_logs_of_a_recipe_are_pooled(tmp_path):
    """Half of the axis's log in each of two files: nearly the values of the whole, each half predicted by the other."""
    lines = AXIS.read_text().splitlines(keepends=True)
    half = len(lines) // 2
    (tmp_path / "a.csv").write_text("".join(lines[:half]))
    (tmp_path / "b.csv").write_text("".join([lines[0], *lines[half:]]))
    found = inverse_dynamics(read_recipe("axis"), [tmp_path / "a.csv", tmp_path / "b.csv"])
    assert found.logs == ("a.csv", "b.csv")
    for name, value in TRUTH.items():
        assert abs(found[name].value - value) < 3 * found[name].standard_deviation
    assert found.joints[0].seen.relative_error < found.joints[0].left_out.relative_error < 0.02


@pytest.mark.nightly
def test_the_fit_of_a_recipe_goes_on_as_that_of_any_machine(tmp_path):
    """Compared, reported and handed on: the engine's run is the fit's, by the recipe's own filters."""

    def command(*arguments: object) -> dict:
        done = CliRunner().invoke(app, [*map(str, arguments), "--json"])
        assert done.exit_code == 0, f"{done.exception} {done.output}"
        return json.loads(done.stdout)

    fit = tmp_path / "axis.json"
    found = command("inverse", "axis", AXIS, "-o", fit)
    assert read_machine_fit(fit).laws["position"].best.law == "Coulomb+viscous"
    (run,) = command("compare", fit, AXIS)["logs"]
    assert run["joints"][0]["relative"] == pytest.approx(found["joints"][0]["free_run"], rel=0.1)
    command("report", fit, AXIS, "-o", tmp_path / "axis.html")
    page = (tmp_path / "axis.html").read_text()
    assert (
        "Coulomb friction" in page
        and "position: Friction laws" in page
        and "filters of the recipe" in page
        and page.count("<svg") == 4
    )
    handed = command("apply", fit, "-o", tmp_path / "axis.ssp")["values"]
    assert {name: handed[name]["value"] for name in TRUTH} == {one["name"]: one["value"] for one in found["parameters"]}


@pytest.mark.nightly
def test_what_a_method_or_a_log_does_not_have_is_said(tmp_path):
    axis = recipe_machine(read_recipe("axis"))
    logs = axis.logs([AXIS])
    wanted = Parameters()
    wanted.add("M", value=19.0, max=19.5)
    with pytest.raises(StickslipError, match="Instruments need a cutoff and have no bounds"):
        identify_machine(axis.mechanism, logs, parameters=wanted)
    with pytest.raises(StickslipError, match="Instruments need a cutoff"):
        identify_machine(axis.mechanism, logs, cutoff=None)
    bounded = identify_machine(axis.mechanism, logs, method="least squares", parameters=wanted)
    assert bounded["M"].value == pytest.approx(19.5) and any("lies on a bound" in said for said in bounded.verdicts)
    with pytest.raises(StickslipError, match="lmfit minimises squares"):
        identify_machine(axis.mechanism, logs).to_lmfit()
    with pytest.raises(StickslipError, match="read without a recipe"):
        identify_machine(axis.mechanism, [replace(logs[0], ready=())], cutoff=None, method="least squares")
    without = MEASURED.split("[signals.position]")[0] + "[signals.velocity]" + MEASURED.split("[signals.velocity]")[1]
    blind = recipe_machine(read_recipe(recipe_of(tmp_path, without + LINEAR)))
    log = log_of(tmp_path)
    found = inverse_dynamics(blind.recipe, log)
    assert found["M"].value == pytest.approx(5.0) and found.joints[0].free_run is None
    assert not any("Simulated" in said for said in found.verdicts)
    with pytest.raises(StickslipError, match="hold no positions beside which"):
        machine_runs(blind.mechanism, found, blind.logs([log]))


def test_beside_a_log_of_a_joint_that_does_not_move_there_is_no_share_of_its_motion(tmp_path):
    machine = recipe_machine(read_recipe(recipe_of(tmp_path)))
    found = inverse_dynamics(machine.recipe, log_of(tmp_path))
    columns = {name: np.full_like(values, 0.1 if name == "x" else 0.0) for name, values in motion().items()}
    write(tmp_path / "still.csv", {**columns, "time": motion()["time"], "F": columns["a"] - 0.5})
    (run,) = machine_runs(machine.mechanism, found, machine.logs([tmp_path / "still.csv"]))
    assert run.joints[0].relative is None and run.joints[0].error == pytest.approx(0.0, abs=1e-12)


@pytest.mark.nightly
def test_noise_that_biases_the_recipe_s_least_squares_is_told_with_the_values_by_instruments(tmp_path):
    """0.2 mm on the positions: at the recipe's 30 Hz a fifth of the mass is lost, and found again."""
    rows = np.loadtxt(AXIS, delimiter=",", skiprows=1)
    rows[:, 1] += 0.2 * np.random.default_rng(1).normal(size=len(rows))
    noisy = tmp_path / "noisy.csv"
    np.savetxt(noisy, rows, delimiter=",", header=AXIS.read_text().partition("\n")[0], comments="")
    found = inverse_dynamics(read_recipe("axis"), noisy)
    assert found["M"].value < 0.85 * TRUTH["M"]
    (said,) = (one for one in found.verdicts if one.startswith("Instruments at a cutoff of 10 Hz give M = "))
    assert float(said.split("M = ")[1].split()[0]) == pytest.approx(TRUTH["M"], rel=5e-3)
    assert not any("Instruments" in one for one in inverse_dynamics(read_recipe("axis"), AXIS).verdicts)


@pytest.mark.nightly
def test_the_end_of_a_log_in_motion_is_dropped_as_its_begin_is(tmp_path):
    """Filters run both ways and have an edge at either end. Noise-free, so that the edges are all that is left: without
    them the error of the effort is that of the differences, (2 pi 2 Hz/1 kHz)^2/3 = 5e-5."""
    position, _, rest = MEASURED.partition("\n[signals.velocity]")
    filtered = f'{position}filter = {{ order = 4, cutoff = "30 Hz", padding = 200 }}\n'
    recipe = f"{filtered}\n[signals.effort]{rest.partition('[signals.effort]')[2]}\n[sampling]\ndrop = 200\n"

    def smooth(x, v, a):
        return 5 * a + 12 * v - 0.5

    log, terms = log_of(tmp_path, effort=smooth), LINEAR.replace('Fc = "coulomb"\n', "")
    error = {}
    for ends in (0, 200):
        read = read_recipe(recipe_of(tmp_path, f"{recipe}drop_end = {ends}\n{terms}"))
        (joint,) = inverse_dynamics(read, log).joints
        error[ends] = joint.seen.relative_error
    assert error[200] < 1e-4 < 0.02 * error[0]
