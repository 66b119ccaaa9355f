"""Posteriors against closed forms, on problems where they are known, and on a short bench beside the fit."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from linear_problem import Curve, line, linear
from made_fit import made_fit
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import save_figure
from identification.fit.fit import fit_friction
from identification.fit.posterior import target_of
from identification.fit.result import FrictionFit
from identification.inference.adjustment import ConstantReading
from identification.inference.posterior import QUANTILES, Marginal, Posterior, Target, sample
from identification.inference.problem import FitProblem, Prior, Unknown, solve
from identification.measurement.pooling import pool
from identification.report.posterior_figure import posterior_figure
from rig_io.bench.emulator import emulate, standard_set


def posterior(problem: FitProblem, **how: object) -> np.ndarray:
    """Samples (n, m)."""
    found = sample(Target(problem, solve(problem), **how), seed=3)  # type: ignore[reportArgumentType]
    assert found.samples is not None and found.independent > 1000
    return found.samples


def test_a_linear_problem_has_the_normal_posterior():
    design, measured = line(1)
    samples = posterior(linear(design, measured))
    covariance = np.linalg.inv(design.T @ design)
    assert np.cov(samples.T) == pytest.approx(covariance, rel=0.12, abs=0.05 * covariance.max())
    mean = covariance @ design.T @ measured
    assert samples.mean(axis=0) == pytest.approx(mean, abs=0.08 * float(np.sqrt(covariance.max())))


def test_priors_readings_and_colour_are_in_it():
    """Normal throughout: precisions add up, and the unknown without a prior has the covariance that is given."""
    design, measured = line(2)
    prior = Prior("b", 3.0, "1", 0.05, "known")
    unknowns = (Unknown("a", "1", -10, 10), Unknown("b", "1", 0.1, 10, prior=prior))
    problem = linear(design, measured, unknowns=unknowns)
    asked, reading = 0.3, ConstantReading("b again", {"b": 1}, 3.0, 0.02)
    samples = posterior(problem, covariance=np.array([[asked**2]]), readings=[reading])
    curvature = design.T @ design
    # a stretched about its ridge: its deviation at a given b is the one asked for
    stretched = curvature[1, 1] - curvature[0, 1] ** 2 / curvature[0, 0]
    b = 1 / np.sqrt(stretched + 0.05**-2 + (0.02 * 3.0) ** -2)
    ridge = -curvature[0, 1] / curvature[0, 0]
    assert samples[:, 1].std() == pytest.approx(b, rel=0.06)
    assert samples[:, 0].std() == pytest.approx(np.hypot(asked, ridge * b), rel=0.06)


@pytest.mark.parametrize("seed", range(4))
def test_a_skewed_posterior_has_its_long_side(seed: int):
    """ln b seen with a deviation s, and b flat: log-normal, of which the normal distribution at the solution knows the
    near half."""
    s, z = 0.5, 1.959964
    rows = np.full(4, 0.5)  # of four readings, each half as well
    problem = Curve(
        value=lambda x: np.log(x) / s * rows,
        slope=lambda x: (rows / (s * x))[:, None],
        measured=np.zeros(4),
        unknowns=(Unknown("b", "1", 1e-3, 100.0),),
        begin=np.array([1.0]),
        cluster=np.arange(4),
        log=np.zeros(4, dtype=int),
    )
    found = sample(Target(problem, solve(problem)), seed=seed)
    (one,) = found.marginals
    assert found.steps < 400  # by draws of that distribution alone 500 to more than 1000
    exact = np.exp(s**2 + s * z * np.array([-1, 0, 1]))
    assert np.array(one.quantiles)[[0, 2, 4]] == pytest.approx(exact, rel=0.12)


def test_a_side_that_the_data_leave_open_is_told_and_has_its_shape():
    """exp(-p t) seen where it has died out: any larger p fits as well, and the density is flat up to the bound."""
    time = np.linspace(3.0, 6.0, 30)
    measured = np.zeros(30)
    problem = Curve(
        value=lambda x: 10 * np.exp(-x[0] * time),
        slope=lambda x: (-10 * time * np.exp(-x[0] * time))[:, None],
        measured=measured,
        unknowns=(Unknown("p", "1", 0.0, 5.0),),
        begin=np.array([1.0]),
        cluster=np.arange(30),
        log=np.zeros(30, dtype=int),
    )
    found = sample(Target(problem, solve(problem)), seed=1)
    (one,) = found.marginals
    assert (one.open_side, found.samples is not None) == ("above", True)
    grid = np.linspace(0.0, 5.0, 20001)
    density = np.exp(-0.5 * np.sum((10 * np.exp(-grid[:, None] * time)) ** 2, axis=1))
    share = np.cumsum(density) / density.sum()
    for level, value in zip((0.16, 0.5, 0.84), one.quantiles[1:4], strict=True):
        assert np.interp(value, grid, share) == pytest.approx(level, abs=0.04)


def test_chains_that_have_not_converged_are_refused():
    problem = linear(*line(1))
    with pytest.raises(StickslipError, match=r"have not converged: 25 steps .* Allow more .in Python, steps="):
        sample(Target(problem, solve(problem)), steps=25)


def test_an_interrupt_of_the_chains_prints_nothing(capsys):
    """What is printed would stand in the JSON of the command."""
    problem = linear(*line(1))
    found = solve(problem)
    seen = iter(range(300))

    def value(x: np.ndarray) -> np.ndarray:
        if next(seen, None) is None:
            raise KeyboardInterrupt
        return problem.value(x)

    with pytest.raises(KeyboardInterrupt):
        sample(Target(replace(problem, value=value), found))
    assert tuple(capsys.readouterr()) == ("", "")


def test_unknowns_that_are_held_have_no_posterior():
    problem = linear(*line(1))
    with pytest.raises(StickslipError, match=r"held \(a\)"):
        Target(problem, solve(problem, fixed={"a": 1.0}))


def test_an_estimator_without_a_likelihood_is_refused_before_the_work():
    done = CliRunner().invoke(app, ["fit", "data/rigs/paper_rubber", "--posterior", "--estimator", "weak-form"])
    assert isinstance(done.exception, StickslipError) and "shooting or whole-cycle" in str(done.exception)


@pytest.mark.parametrize(
    "asked", [("fit", "--corner"), ("fit", "--figure"), ("compare", "--figure"), ("describe", "--figure")]
)
def test_a_figure_of_no_known_format_is_refused_before_the_work(tmp_path: Path, asked: tuple[str, str]) -> None:
    command, option = asked
    logs = [str(tmp_path / name) for name in (("fit.json", "logs") if command == "compare" else ("logs",))]
    done = CliRunner().invoke(app, [command, *logs, option, str(tmp_path / "corner.jpeg2")])
    assert isinstance(done.exception, StickslipError) and "has no known format" in str(done.exception)


def sampled_fit() -> FrictionFit:
    """A made fit with samples about its parameters."""
    fit = made_fit()
    rng = np.random.default_rng(0)
    samples = np.stack([rng.normal(one.value, one.standard_deviation, 4000) for one in fit.parameters], axis=1)
    marginals = tuple(
        Marginal(one.name, one.unit, one.value, one.standard_deviation, tuple(np.quantile(column, QUANTILES)), 1.5)
        for one, column in zip(fit.parameters, samples.T, strict=True)
    )
    return replace(fit, posterior=Posterior(marginals, 40, 100, 0.7, 0, samples))


def test_a_fit_carries_its_posterior_but_for_the_samples():
    fit = sampled_fit()
    assert fit.posterior is not None
    assert FrictionFit.from_json(fit.to_json()).posterior == replace(fit.posterior, samples=None)
    assert "2667 independent samples of 4000" in fit.summary()


def test_a_corner_plot_shows_every_pair_and_where_the_fit_is(tmp_path: Path):
    fit = sampled_fit()
    values = {one.name: one.value for one in fit.parameters}
    figure = posterior_figure(fit.posterior, "Conti", values, list(values))
    figure.draw_without_rendering()  # which places the numbers
    shown = [axes for axes in figure.axes if axes.get_visible() and axes.axison]
    assert {axes.get_xlabel() for axes in shown} >= {"mu_s (1)", "mu_k (1)", "p (s/m)"}
    for axes, one in zip(figure.axes[::4], fit.parameters, strict=True):
        assert any(one.value in np.atleast_1d(line.get_xdata()) for line in axes.lines)
    numbers = [
        label.get_window_extent()
        for axes in shown
        for axis in (axes.xaxis, axes.yaxis)
        for tick in axis.get_major_ticks()
        if (label := tick.label1).get_visible() and label.get_text()
    ]
    assert len(numbers) > 10
    # of those turned by 45 degrees only the corners meet: a share of their height apart is apart
    for one, other in combinations(numbers, 2):
        assert np.hypot(one.x1 - other.x1, one.y1 - other.y1) > 0.4 * one.height
    with pytest.raises(StickslipError, match="no unknown 'J'; it has mu_s, mu_k, p"):
        posterior_figure(fit.posterior, "Conti", values, ["J"])
    with pytest.raises(StickslipError, match="holds no samples"):
        posterior_figure(made_fit().posterior, "Conti", values, list(values))
    save_figure(figure, tmp_path / "corner.png")


def test_the_posterior_of_a_fit_is_as_wide_as_its_interval():
    """Noise, constants and what the sensors leave open, by unknowns in one and to first order in the other; and ln p
    falls by a half at a deviation."""
    ready = pool([emulate(one, 5, n) for n, one in enumerate(standard_set(speeds=(0.83, 1.4), duration=4.0))])
    fit = fit_friction(ready, disturbances="none", law_spread="none")
    target = target_of(ready, fit)
    names = [unknown.name for unknown in target.problem.unknowns]
    assert {"J", "R", "r", "N", "k/J", "c/J", "gain", "delay"} <= set(names)
    peak = target.log_probability(target.at)
    for one in fit.parameters:
        place = names.index(one.name)
        deviation = float(np.sqrt(target.spread[place, place]))
        assert deviation == pytest.approx(one.total_deviation, rel=0.1)
        along = target.spread[place] / deviation  # the most probable others at a deviation of this one
        assert target.log_probability(target.at + along) - peak == pytest.approx(-0.5, rel=0.15)
