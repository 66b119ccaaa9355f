"""Inverse dynamics of one degree of freedom on logs whose truth is known."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from machine_log import LINEAR, MEASURED, RATE, coloured, log_of, motion, recipe_of, slide, table_of
from recipe_fit import inverse_dynamics

from fmu_models.base.errors import StickslipError
from identification.inference.choice import coloured_covariance
from identification.inference.problem import solve
from identification.inference.uncertainty import plain_covariance
from identification.machines.by_recipe import motions_of, recipe_machine
from identification.machines.machine_fit import MachineFit
from identification.machines.problem import machine_problem
from identification.machines.regressor import base_parameters, regressor_of
from identification.machines.rows import rows_of
from identification.measurement.recipe import Filter, Recipe, read_recipe
from identification.measurement.signals import filtered, prepare
from rig_io.logs.table import Table
from rig_io.readers.csv_log import write

pytestmark = pytest.mark.digits

TRUTH = {"M": 5.0, "Fv": 12.0, "Fc": 3.0, "offset": -0.5}


def fitted(folder: Path, recipe: str = MEASURED + LINEAR, **log: object) -> MachineFit:
    return inverse_dynamics(read_recipe(recipe_of(folder, recipe)), log_of(folder, **log))  # type: ignore[arg-type]


def solved(recipe: Recipe, table: Table):
    """A problem and its solution."""
    regressor = regressor_of(recipe_machine(recipe).mechanism)
    problem = machine_problem(
        rows_of(regressor, base_parameters(regressor), motions_of(recipe, prepare(recipe, table)))
    )
    return problem, solve(problem)


def said(result: MachineFit) -> str:
    return " ".join(result.verdicts)


sizes = st.floats(-100, 100)


@given(M=st.floats(0.1, 100), Fv=sizes, Fc=sizes, offset=sizes, decimate=st.sampled_from([1, 7]))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_without_noise_the_values_are_exact_with_and_without_decimation(tmp_path, M, Fv, Fc, offset, decimate):
    """Every regressor passes the same filter as the effort, so nothing is lost."""
    recipe = MEASURED + f"[sampling]\ndecimate = {decimate}\n" + LINEAR
    read = read_recipe(recipe_of(tmp_path, recipe))
    log = table_of(lambda x, v, a: M * a + Fv * v + Fc * np.sign(v) + offset)
    found = solved(read, log)[1].values
    assert found == pytest.approx([M, Fv, Fc, offset], abs=1e-9 * max(M, abs(Fv), abs(Fc), abs(offset)))


@pytest.mark.nightly_for("differences")
@pytest.mark.parametrize(
    "derivatives",
    ["", '[signals.velocity]\nderivative_of = "position"\nsavitzky_golay = { order = 5, window = "25 ms" }\n'],
    ids=["differences", "savitzky-golay"],
)
def test_derivatives_of_the_position_give_the_same_values(tmp_path, derivatives):
    """Central differences err by (w h)^2/6: 1e-4 at 2 Hz and 1 kHz; a polynomial of order 5 by less."""
    lines = MEASURED.split("[signals.velocity]")
    recipe = lines[0] + derivatives + "[signals.effort]" + MEASURED.split("[signals.effort]")[1]
    found = fitted(tmp_path, recipe + "[sampling]\nrate = 1000\ndrop = 5\n" + LINEAR)
    for name, value in TRUTH.items():
        assert found[name].value == pytest.approx(value, rel=3e-3 if name == "offset" else 1e-3)


@pytest.mark.nightly
def test_a_second_derivative_by_one_polynomial(tmp_path):
    text = MEASURED.replace(
        'column = "a"\nunit = "m/s2"',
        'derivative_of = "position"\nderivative = 2\nsavitzky_golay = { order = 6, window = "30 ms" }',
    )
    assert fitted(tmp_path, text + LINEAR)["M"].value == pytest.approx(5.0, rel=1e-4)


def test_units_and_gains_are_converted(tmp_path):
    columns = motion()
    force = slide(columns["x"], columns["v"], columns["a"])
    write(tmp_path / "log.csv", {**columns, "x": 1e3 * columns["x"], "a": columns["a"] / 10, "F": force / 35.0})
    text = MEASURED.replace('"m"', '"mm"').replace('"m/s2"', '"dam/s^2"')
    text = text.replace('unit = "N"', 'unit = "mV"\ngain = 35\ngain_unit = "kN/V"')
    found = inverse_dynamics(read_recipe(recipe_of(tmp_path, text + LINEAR)), tmp_path / "log.csv")
    assert found["M"].value == pytest.approx(5.0)


@pytest.mark.nightly
def test_a_gain_is_read_from_the_log(tmp_path):
    from scipy.io import savemat

    columns = motion()
    force = slide(columns["x"], columns["v"], columns["a"])
    savemat(tmp_path / "log.mat", {**columns, "F": force / 35.0, "newton_per_volt": 35.0})
    text = MEASURED.replace('unit = "N"', 'unit = "V"\ngain = "newton_per_volt"\ngain_unit = "N/V"') + LINEAR
    found = inverse_dynamics(read_recipe(recipe_of(tmp_path, text)), tmp_path / "log.mat")
    assert found["Fc"].value == pytest.approx(3.0)
    wrong = recipe_of(tmp_path, text.replace('"newton_per_volt"', '"gtau"'), "wrong")
    with pytest.raises(StickslipError, match=r"'gtau' is not a single number.*Its single numbers: newton_per_volt"):
        inverse_dynamics(read_recipe(wrong), tmp_path / "log.mat")


def test_a_filter_delays_nothing_and_stops_what_it_should():
    time = np.arange(4000) / RATE
    slow, fast = np.sin(2 * np.pi * 2 * time), np.sin(2 * np.pi * 300 * time)
    passed = filtered(slow + fast, Filter(4, 40.0, False, 12), 1 / RATE)
    assert np.max(np.abs(passed - slow)[200:-200]) < 1e-4
    relative = filtered(slow + fast, Filter(4, 0.08, True, 12), 1 / RATE)
    assert np.allclose(relative, passed)


def test_decimation_keeps_the_size_and_the_last_sample(tmp_path):
    """What is slow passes unchanged; the loss by the filter's ripple is made good."""
    recipe = read_recipe(recipe_of(tmp_path, MEASURED + "[sampling]\ndecimate = 9\n" + LINEAR))
    (piece,) = motions_of(recipe, prepare(recipe, table_of(lambda x, v, a: 1 + x)))
    columns, time = motion(), piece.time[piece.indices]
    assert time == pytest.approx(columns["time"][9_999 % 9 :: 9])
    assert time[-1] == columns["time"][-1]
    inside = slice(100, -100)
    assert piece.thinned(piece.effort)[inside, 0] == pytest.approx(1 + columns["x"][9_999 % 9 :: 9][inside], rel=2e-3)


def test_no_filter_runs_across_a_gap(tmp_path):
    """Two stretches at different places: a filter or a difference across the gap would see a jump of the position."""
    columns = motion()
    later = {name: np.delete(values, np.arange(4000, 6000)) for name, values in columns.items()}
    later["F"] = slide(later["x"], later["v"], later["a"])
    write(tmp_path / "log.csv", later)
    text = (
        MEASURED.replace('column = "v"\nunit = "m/s"', 'derivative_of = "position"') + "[sampling]\ndrop = 3\n" + LINEAR
    )
    result = inverse_dynamics(read_recipe(recipe_of(tmp_path, text)), tmp_path / "log.csv")
    assert "1 gaps; no filter runs across" in said(result)
    assert result.joints[0].seen.relative_error < 1e-3


def test_a_stretch_between_gaps_too_short_to_filter_is_left_out_and_counted(tmp_path):
    table = table_of()
    kept = np.delete(np.arange(10_000), np.r_[4000:6000, 6015:8000])
    left = replace(table, columns={name: values[kept] for name, values in table.columns.items()})
    prepared = prepare(read_recipe(recipe_of(tmp_path)), left)
    assert [len(piece.values["time"]) for piece in prepared.pieces] == [4000, 2000]
    assert prepared.notes == ("The clock has 2 gaps; no filter runs across them (15 samples left out).",)


@pytest.mark.nightly
def test_slow_samples_can_be_left_out(tmp_path):
    """The machine's friction is not Coulomb's below 0.05 m/s; what is faster gives the exact values."""
    odd = fitted(tmp_path, effort=lambda x, v, a: slide(x, v, a) * (np.abs(v) > 0.05))
    assert abs(odd["Fc"].value - 3.0) > 0.03
    text = MEASURED + '[sampling]\nleast_speed = "50 mm/s"\n' + LINEAR
    kept = fitted(tmp_path, text, effort=lambda x, v, a: slide(x, v, a) * (np.abs(v) > 0.05))
    assert kept["Fc"].value == pytest.approx(3.0)
    assert kept.samples < odd.samples


def test_weights_count(tmp_path):
    """A stretch that is wrong and has weight zero changes nothing."""
    columns = motion()
    force = slide(columns["x"], columns["v"], columns["a"])
    trusted = (columns["time"] < 6).astype(float)
    write(tmp_path / "log.csv", {**columns, "F": force + 50 * (1 - trusted), "trust": trusted})
    text = MEASURED + '[signals.weight]\ncolumn = "trust"\nunit = "1"\n' + LINEAR
    result = inverse_dynamics(read_recipe(recipe_of(tmp_path, text)), tmp_path / "log.csv")
    assert result["offset"].value == pytest.approx(-0.5)


@pytest.mark.nightly
def test_standard_deviations_hold_for_coloured_noise(tmp_path):
    """AR(1) noise of correlation 0.95: 60 fits spread as Newey and West say, not as white noise would."""
    recipe, rng = read_recipe(recipe_of(tmp_path)), np.random.default_rng(5)
    fits = [solved(recipe, table_of(noise=coloured(10_000, 0.95, rng))) for _ in range(60)]
    spread = np.std([found.values for _, found in fits], axis=0)
    here = [found.evaluation for _, found in fits]
    hac = [np.sqrt(np.diag(coloured_covariance(*fit, "hac"))) for fit in fits]
    plain = [np.sqrt(np.diag(plain_covariance(one.gradient, one.residual))) for one in here]
    stated, white = np.mean(hac, axis=0) / spread, np.mean(plain, axis=0) / spread
    assert np.all((stated > 0.7) & (stated < 1.4)), stated
    assert np.all(white < 0.5), white


@pytest.mark.nightly
def test_coloured_noise_is_called_coloured(tmp_path):
    assert "coloured" in said(fitted(tmp_path, noise=coloured(10_000, 0.95, np.random.default_rng(5))))


def test_white_noise_is_called_white(tmp_path):
    result = fitted(tmp_path, noise=np.random.default_rng(2).normal(size=10_000))
    assert "coloured" not in said(result)
    # lags of a twentieth of the samples: widened by 1.076 for their own scatter, which is 0.13
    assert [e.factor for e in result.parameters] == pytest.approx([1.076] * 4, rel=0.3)
    assert 0.6 * result.samples < result.effective_samples <= result.samples


@pytest.mark.nightly
def test_samples_of_an_autoregression_count_as_independent_ones(tmp_path):
    """A constant effort is the mean of n values: worth n (1 - a)/(1 + a), fewer by the widening, 1.16."""
    text = MEASURED + '[terms]\noffset = "offset"\n'
    found = [
        fitted(tmp_path, text, effort=lambda x, v, a: 0 * x + 3, noise=coloured(10_000, 0.8, np.random.default_rng(n)))
        for n in range(20)
    ]
    assert np.mean([one.neighbour_correlation for one in found]) == pytest.approx(0.8, abs=0.01)
    assert np.median([one.effective_samples for one in found]) == pytest.approx(10_000 / 9 / 1.16, rel=0.25)


@pytest.mark.nightly
def test_a_poor_fit_is_called_poor_and_a_good_one_is_not(tmp_path):
    good = fitted(tmp_path, noise=0.1 * np.random.default_rng(0).normal(size=10_000))
    assert "Poor" not in said(good)
    poor = fitted(tmp_path, noise=20 * np.random.default_rng(0).normal(size=10_000))
    assert "Poor fit" in said(poor)
    assert f"the model fits {100 * (1 - poor.joints[0].seen.relative_error):.0f} % of it" in said(poor)


@pytest.mark.nightly
def test_values_without_meaning_are_named(tmp_path):
    backwards = fitted(tmp_path, effort=lambda x, v, a: -5 * a + 12 * v + 3 * np.sign(v))
    assert "M = -5 kg is below zero, which inertia cannot be: check the signs" in said(backwards)
    assert "offset cannot be told from zero" in said(
        fitted(
            tmp_path, effort=lambda x, v, a: slide(x, v, a) + 0.5, noise=np.random.default_rng(0).normal(size=10_000)
        )
    )


def test_an_effort_that_never_changes_is_refused(tmp_path):
    with pytest.raises(StickslipError, match="an effort is 2 throughout"):
        fitted(tmp_path, effort=lambda x, v, a: np.full_like(x, 2.0))


@pytest.mark.nightly
def test_a_log_of_another_machine_scores_worse(tmp_path):
    recipe = read_recipe(recipe_of(tmp_path))
    noise = np.random.default_rng(0).normal(size=10_000)
    same = log_of(tmp_path, noise=noise[::-1], name="same")
    other = log_of(tmp_path, effort=lambda x, v, a: slide(x, v, a) + 2 * np.sign(v), noise=noise, name="other")
    result = inverse_dynamics(recipe, log_of(tmp_path, noise=noise), [same, other])
    assert result.joints[0].held_out["same.csv"].relative_error == pytest.approx(
        result.joints[0].seen.relative_error, rel=0.05
    )
    assert "Worse on what the fit has not seen" in said(result)
    assert "other.csv" in said(result) and "same.csv" not in said(result)


@pytest.mark.nightly
def test_errors_below_a_per_cent_are_told_apart(tmp_path):
    noise = 0.03 * np.random.default_rng(0).normal(size=10_000)
    other = log_of(tmp_path, effort=lambda x, v, a: slide(x, v, a) + 0.08 * np.sign(v), noise=noise, name="other")
    result = inverse_dynamics(read_recipe(recipe_of(tmp_path)), log_of(tmp_path, noise=noise), [other])
    seen, unseen = result.joints[0].seen, result.joints[0].held_out["other.csv"]
    assert 0.0 < seen.relative_error < unseen.relative_error / 1.5 < 0.01
    told = re.search(r"other.csv, error (\S+) % against (\S+) %", said(result))
    assert told is not None
    errors = [100 * unseen.relative_error, 100 * seen.relative_error]
    assert [float(one) for one in told.groups()] == pytest.approx(errors, rel=5e-3)


def test_terms_that_cannot_be_told_apart_are_named(tmp_path):
    text = MEASURED + '[terms]\nM = "inertia"\nFc = "coulomb"\nforth = "coulomb+"\nback = "coulomb-"\n'
    with pytest.raises(StickslipError, match="cannot tell the terms Fc, forth, back apart"):
        fitted(tmp_path, text)


def test_turning_bodies_have_gravity_and_other_units(tmp_path):
    columns = motion()
    torque = 0.3 * columns["a"] + 0.7 * 9.81 * np.sin(columns["x"]) + 0.2 * np.arctan(columns["v"] / 0.05)
    write(tmp_path / "log.csv", {**columns, "F": torque})
    turning = MEASURED.replace('"m', '"rad').replace('"N"', '"N m"')
    terms = '[terms]\nJ = "inertia"\nml = "gravity"\nFc = { term = "coulomb-arctan", speed = "0.05 rad/s" }\n'
    result = inverse_dynamics(read_recipe(recipe_of(tmp_path, turning + terms)), tmp_path / "log.csv")
    assert [(e.name, e.unit) for e in result.parameters] == [("J", "kg m2"), ("ml", "kg m"), ("Fc", "N m")]
    assert [e.value for e in result.parameters] == pytest.approx([0.3, 0.7, 0.2])
    with pytest.raises(StickslipError, match="one of a body that turns; this one slides"):
        fitted(tmp_path, MEASURED + '[terms]\nml = "gravity"\n')


LAWS = '[friction]\ncompare = ["Coulomb", "Coulomb+viscous", "Conti"]\n'


@pytest.mark.nightly
def test_friction_that_rises_with_speed_is_not_taken_for_contis(tmp_path):
    """Concave: Conti with mu_s < mu_k fits it better than a straight line, and is put aside."""

    def concave(x, v, a):
        return 5 * a + np.sign(v) * (2 + 4 * np.abs(v) / (0.5 + np.abs(v)))

    noise = 0.05 * np.random.default_rng(1).normal(size=10_000)
    result = fitted(tmp_path, MEASURED + LINEAR + LAWS, effort=concave, noise=noise)
    assert result.laws
    assert min(result.laws["position"].scores, key=lambda one: one.bic).law == "Conti"
    assert result.laws["position"].preferred == result.laws["position"].best.law == "Coulomb+viscous"
    assert "Conti is put aside on 'position': F_s = " in said(result)
    assert "friction rises with slip speed" in said(result)


def test_friction_of_each_direction_takes_the_place_of_the_offset(tmp_path):
    """3 N and an offset of -0.5 N are 2.5 N forwards and 3.5 N backwards: one parameter more than Coulomb+viscous."""
    text = MEASURED + LINEAR + '[friction]\ncompare = ["Coulomb+viscous by direction", "Coulomb+viscous"]\n'
    laws = fitted(tmp_path, text, noise=0.1 * np.random.default_rng(1).normal(size=10_000)).laws["position"]
    assert laws.preferred == "Coulomb+viscous"
    found = next(one for one in laws.scores if one.law == "Coulomb+viscous by direction")
    assert found.values == pytest.approx({"M": 5.0, "F_c+": 2.5, "F_c-": 3.5, "F_v+": 12.0, "F_v-": 12.0}, rel=0.01)
    assert all(0 < deviation < 0.05 for deviation in found.deviations.values())
    # the variance of the residuals is the sixth
    assert found.bic - found.aic == pytest.approx(6 * (np.log(laws.effective) - 2))


@pytest.mark.nightly
def test_contis_friction_is_found_where_it_is(tmp_path):
    def conti(x, v, a):
        return 5 * a + np.sign(v) * 10.0 * ((0.65 - 0.35) / (1 + 15 * np.abs(v)) + 0.35)

    noise = 0.02 * np.random.default_rng(1).normal(size=10_000)
    text = MEASURED + LINEAR + LAWS + 'normal_force = "10 N"\n'
    result = fitted(tmp_path, text, effort=conti, noise=noise)
    assert result.laws["position"].preferred == "Conti"
    best = result.laws["position"].best
    law = {name: best.values[name] for name in ("F_s", "F_k", "p")}
    assert law == pytest.approx({"F_s": 6.5, "F_k": 3.5, "p": 15.0}, rel=0.01)
    assert best.units == {"M": "kg", "offset": "N", "F_s": "N", "F_k": "N", "p": "s/m"}
    for name, truth in {"F_s": 6.5, "F_k": 3.5, "p": 15.0}.items():
        assert 0 < best.deviations[name] < 0.01 * truth
        assert abs(best.values[name] - truth) < 4 * best.deviations[name]
    assert best.held_out == pytest.approx(1.0, rel=0.05)
