"""The spread over laws in an interval: what it holds, whence it comes, and a law that had not converged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_fit import made_fit

from fmu_models.base.errors import StickslipError
from identification.estimators import shooting, weak_form
from identification.estimators.base import Options
from identification.fit.fit import fit_friction
from identification.fit.law_spread import Contest, with_spread
from identification.fit.result import FrictionFit
from identification.fit.rivals import fit_rivals, weak_fits
from identification.fit.samples import samples_by_disc
from identification.free_friction.evidence import SeenLaw
from identification.laws import find_law, slip_laws
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.report.friction_figure import friction_figure
from rig_io.bench.emulation import Disc, Emulation
from rig_io.bench.emulator import emulate
from rig_io.bench.materials import Material

EXPONENTIAL = Material("paper/rubber", {"mu_s": 0.65, "mu_k": 0.35, "v_s": 0.08}, "tustin")


@pytest.fixture(scope="module")
def exponential() -> Pool:
    """Logs of a contact whose friction falls exponentially."""
    runs = [Emulation(f"{w:g}", (Disc(EXPONENTIAL, w),), duration=6.0) for w in (0.41, 0.83, 1.4)]
    return pool([emulate(one, 7, number) for number, one in enumerate(runs)])


@pytest.mark.nightly
def test_the_interval_of_a_wrong_law_holds_the_truth_by_the_spread(exponential: Pool) -> None:
    fit = fit_friction(exponential, estimator="weak-form")
    low, high = fit.noise_interval("mu_s")
    assert not low < 0.65 < high
    low, high = fit.interval("mu_s")
    assert low < 0.65 < high
    assert any("Tustin fits these logs better than Conti" in said for said in fit.warnings)
    weights = {one.law: one.weight for one in fit.rivals}
    assert sum(weights.values()) == pytest.approx(1) and weights["Tustin"] + weights["Conti+viscous"] > 0.999
    assert fit["mu_s"].law_deviation is not None and fit["mu_s"].total_deviation > fit["mu_s"].law_deviation
    assert "Tustin" in fit.words_of_law and FrictionFit.from_json(fit.to_json()) == fit


def test_a_law_that_is_wrong_does_not_tell_whether_breakaway_ages(exponential: Pool) -> None:
    """Sticks let go elsewhere than at the mu(0) of a law of another form, by whatever shows that it is wrong."""
    fit = fit_friction(exponential, estimator="weak-form", disturbances="none")
    assert any("The law misses the data" in said for said in fit.warnings)
    assert fit.breakaway is not None and not fit.breakaway.ages
    assert "this law is wrong" in fit.breakaway.words and not any("ages" in said for said in fit.warnings)
    unseen = replace(fit.breakaway, of_wrong_law=False, excess=0.1, square_deviation=1e-3)
    assert unseen.ages and unseen.warnings
    seen = {name: SeenLaw(find_law(name), fit.law_values, 1e-6 * np.eye(3), 1.0, 1) for name in ("Conti", "Tustin")}
    found = Contest("Conti", seen, {"Conti": 20.0, "Tustin": 0.0})
    judged = with_spread(replace(fit, breakaway=unseen, warnings=unseen.warnings), found)
    assert judged.breakaway == replace(unseen, of_wrong_law=True) and len(judged.warnings) == 1
    assert "fits these logs better than Conti" in judged.warnings[0]


@pytest.mark.parametrize(
    "centre, width, weight", [(0.5, 0.4, 0.001), (0.3, 0.2, 0.06), (0.2, 0.1, 0.5), (-0.4, 0.3, 1)]
)
def test_the_interval_holds_its_share_of_the_average_over_laws(centre: float, width: float, weight: float) -> None:
    law, own, fit = find_law("Conti"), 0.05, made_fit()
    wide = (replace(q, standard_deviation=0.03, scale_deviation=0.04) for q in fit.parameters)
    fit = replace(fit, parameters=tuple(wide))
    seen = {
        name: SeenLaw(law, fit.law_values + at, np.eye(3) * deviation**2, 1.0, 1)
        for name, at, deviation in (("Conti", 0.0, 0.02), ("other", centre, np.hypot(width, 0.02)))
    }
    lead = 2 * np.log([max(weight, 1e-9), max(1 - weight, 1e-9)])
    judged = with_spread(fit, Contest("Conti", seen, dict(zip(seen, lead - lead.min(), strict=True))))
    rng, count = np.random.default_rng(1), 1_000_000
    other = rng.random(count) < weight
    draws = np.where(other, centre, 0.0) + rng.normal(size=count) * np.where(other, np.hypot(own, width), own)
    reach = 1.96 * judged["mu_k"].total_deviation
    assert np.mean(np.abs(draws) < reach) == pytest.approx(0.95, abs=1e-3)
    assert judged["mu_k"].law_deviation == pytest.approx(0.0, abs=0.01) or weight > 0.01


def test_what_is_not_asked_is_said(exponential: Pool) -> None:
    fit = fit_friction(exponential, estimator="weak-form", law="Tustin", law_spread="none")
    assert fit["mu_s"].law_deviation is None and "was not asked" in fit.words_of_law
    with pytest.raises(StickslipError, match="Did you mean 'auto'"):
        fit_friction(exponential, estimator="weak-form", law_spread="aut")


def test_a_law_that_fits_worse_than_one_nested_in_it_is_sought_from_there(exponential: Pool) -> None:
    made = weak_form.estimate(exponential, find_law("Conti+viscous"), Options())
    simple = weak_form.estimate(exponential, find_law("Conti"), Options()).solution.evaluation.residual
    stopped = made.solution.values + np.array([0.05, 0.05, 5.0, 0.0])
    short = replace(made, solution=replace(made.solution, values=stopped, evaluation=made.problem.evaluate(stopped)))
    assert np.sum(short.solution.evaluation.residual**2) > np.sum(simple**2)
    start = weak_fits(exponential, laws := {name: find_law(name) for name in ("Conti", "Conti+viscous")}, Options())
    found = fit_rivals(short, laws, lambda law: start[law.name].law_values).fitted
    assert found["Conti+viscous"].sum < found["Conti"].sum == pytest.approx(np.sum(simple**2), rel=1e-6)


def test_a_fall_below_all_slip_speeds_is_said() -> None:
    bump = Material("paper/rubber", {"mu_s": 0.65, "mu_k": 0.45, "v_s": 0.002, "mu_v": 0.1}, "stribeck")
    runs = [Emulation(f"{w:g}", (Disc(bump, w),), duration=5.0) for w in (0.1, 0.2)]
    fit = fit_friction([emulate(one, 7, number) for number, one in enumerate(runs)], estimator="weak-form")
    assert any("the smallest slip speed in the logs: mu_s is no measurement" in said for said in fit.warnings)


@pytest.mark.nightly
def test_contacts_that_age_are_shot_from_the_age_of_their_slip() -> None:
    ageing = Material("paper/rubber", {"mu_r": 0.5, "weakening": 0.06, "a": 0.01, "D_c": 1e-4}, "dieterich")
    runs = [Emulation(f"{w:g}", (Disc(ageing, w),), duration=5.0) for w in (0.41, 1.4)]
    fit = fit_friction([emulate(one, 7, number) for number, one in enumerate(runs)], law="Dieterich")
    assert fit.estimator == "shooting" and fit.whiteness is not None and not fit.whiteness.warnings
    assert fit["mu_r"].value == pytest.approx(0.5, abs=1e-3)
    assert fit["weakening"].value == pytest.approx(0.06, abs=1e-3)
    assert any("does not tell a and D_c" in said for said in fit.warnings)


@pytest.mark.nightly
def test_laws_are_shot_at_the_same_residuals(exponential: Pool) -> None:
    """Conti's law with no viscous friction is Conti's law, to the last residual."""
    first = shooting.estimate(exponential, find_law("Tustin"), Options())
    start = {"Conti": np.array([0.69, 0.27, 15.5]), "Conti+viscous": np.array([0.65, 0.25, 12.0, 0.1])}
    laws = {name: law for name, law in slip_laws().items() if name in ("Tustin", *start)}
    found = fit_rivals(first, laws, lambda law: start[law.name])
    assert not found.refused and found.nested == (("Conti", "Conti+viscous"),)
    sums = {name: one.sum for name, one in found.fitted.items()}
    assert sums["Tustin"] < sums["Conti+viscous"] < sums["Conti"]
    assert len({len(one.solution.evaluation.residual) for one in found.fitted.values()}) == 1


def test_a_law_that_begins_at_its_least_sum_is_not_searched(exponential: Pool) -> None:
    first, other = (weak_form.estimate(exponential, find_law(name), Options()) for name in ("Tustin", "Conti+viscous"))
    best, laws = other.solution.values, {one.name: one for one in (first.law, other.law)}
    off = best * (1 + 1e-3 * np.array([1, -1, 1, -1]))  # with half as much again for its sum
    stayed, searched = (fit_rivals(first, laws, lambda _, q=q: q).fitted["Conti+viscous"] for q in (best, off))
    assert stayed.solution.converged and np.array_equal(stayed.solution.values, best)
    assert not np.array_equal(searched.solution.values, off)
    # the search stops in a flat valley, above the least sum
    assert stayed.sum <= searched.sum < 1.01 * stayed.sum


def test_laws_that_were_judged_are_drawn_beside_the_curve(exponential: Pool) -> None:
    fit = fit_friction(exponential, estimator="weak-form", disturbances="none")
    others = [one for one in fit.rivals if one.law != fit.law]
    assert fit.free is not None and others
    axes = friction_figure(fit, samples_by_disc(fit, exponential)).axes[0]
    drawn = {line.get_label(): np.asarray(line.get_ydata()) for line in axes.get_lines()}
    inside = fit.free.speed >= fit.free.least
    for one in others:
        curve = drawn[f"{one.law}, weight {one.weight:.2g}"][inside]
        np.testing.assert_allclose(curve, fit.free.coefficient[inside], rtol=0.1)
    assert FrictionFit.from_json(fit.to_json()).rivals == fit.rivals
