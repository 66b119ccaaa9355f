"""Bifurcation speeds: predicted against reference values of independent codes, and read from motions of a model."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from made_fit import MATERIALS, RIG, made_fit

from identification.fitted_model.model import FittedModel, arrangement_of, fitted_model, fmu_parameters, rig_constants
from identification.model_check import bifurcations
from identification.model_check.bifurcations import (
    MeasuredBifurcation,
    Transition,
    extrapolated,
    hopf_speed,
    transitions,
)
from identification.model_check.families import agreement
from identification.model_check.portraits import Portrait, Rest
from identification.model_check.processing import Processing


@pytest.mark.parametrize(
    ("material", "hopf", "fold"),
    [("paper/paper", 0.511, 0.590), ("liner/rubber", 0.998, 1.352), ("paper/rubber", 1.698, 2.430)],
)
def test_hopf_and_fold_of_one_disc(material: str, hopf: float, fold: float) -> None:
    model = fitted_model(made_fit(material))
    (found,) = transitions(model, "disc0", {}, 0.3 * fold, 0.8 * fold, beyond=True)
    assert found.speed == pytest.approx(fold, abs=6e-4)  # the reference has three decimals
    assert (found.before, found.after) == (("disc0",), ())
    assert found.words == "stick on disc0 disappears"
    # c + R^2 N mu'(r w) = 0
    mu_s, mu_k, p = MATERIALS[material]
    exact = (np.sqrt(0.125**2 * 5.0 * (mu_s - mu_k) * p / 0.055) - 1) / p / 0.06
    assert exact == pytest.approx(hopf, abs=6e-4)
    assert hopf_speed(model, "disc0", {}, 0.1 * fold, 1.1 * fold) == pytest.approx(exact, rel=1e-7)


def test_stick_on_two_discs_that_both_touch() -> None:
    # disc_rig, w1 = -0.5 rad/s, N = 3 N: stick on disc 0 disappears at 0.8565 rad/s
    model = fitted_model(made_fit(N=3.0, discs=2))
    found = transitions(model, "disc0", {"disc1": -0.5}, 0.8, 0.9)
    assert [one.speed for one in found] == [pytest.approx(0.8565, abs=6e-5)]
    assert (found[0].before, found[0].after) == (("disc0", "disc1"), ("disc1",))


def test_sticks_exchange_where_both_discs_turn_alike() -> None:
    model = fitted_model(made_fit(N=4.905, discs=2))
    (found,) = transitions(model, "disc0", {"disc1": 0.83}, 0.8, 0.86)
    assert found.speed == pytest.approx(0.83, abs=1e-9)
    assert (found.before, found.after) == (("disc0",), ("disc1",))


def test_sequence_of_two_discs_that_touch_in_turn() -> None:
    # the paper's {0} -> {0, 1} -> {1}: liner/rubber, c = 0.0055 N m s/rad, N = 3.0621 N, w1 = 1.15 rad/s
    fit = made_fit("liner/rubber", 3.0621, 2, theta_s=0.0, c=0.0055)
    assert arrangement_of(fit) == "sequential"
    model = fitted_model(fit)
    held = {"disc1": 1.15}
    found = [*transitions(model, "disc0", held, 0.57, 0.61), *transitions(model, "disc0", held, 1.08, 1.12)]
    assert [one.speed for one in found] == [pytest.approx(0.5951, abs=6e-5), pytest.approx(1.100, abs=6e-4)]
    assert [one.before for one in found] == [("disc0",), ("disc0", "disc1")]
    assert found[-1].after == ("disc1",)


def test_uncertainty_of_a_fold_is_that_of_its_parameters() -> None:
    fit = made_fit()
    fit = replace(
        fit, parameters=tuple(q if q.name == "p" else replace(q, standard_deviation=0.0) for q in fit.parameters)
    )
    model = fitted_model(fit)
    found = Transition("disc0", 2.430235821, ("disc0",), ())
    constants = tuple(replace(c, standard_uncertainty=0.02) if c.name == "N" else c for c in fit.constants)
    known = replace(fit, constants=constants)
    told = bifurcations.with_uncertainty(known, model, found, {})

    def moved(**by: float) -> float:
        values = tuple(replace(q, value=q.value + by.get(q.name, 0.0)) for q in fit.parameters)
        moved_constants = tuple(replace(q, value=q.value + by.get(q.name, 0.0)) for q in fit.constants)
        other = replace(fit, parameters=values, constants=moved_constants)
        return transitions(model.with_parameters(fmu_parameters(other)), "disc0", {}, 2.40, 2.46)[0].speed

    assert told.noise_deviation == pytest.approx(abs(moved(p=0.015) - moved(p=-0.015)) / 2, rel=0.02)
    assert told.scale_deviation == pytest.approx(abs(moved(N=0.02) - moved(N=-0.02)) / 2, rel=0.02)


def processing(model: FittedModel) -> Processing:
    p = model.parameters
    return Processing(p["r"], p["R"], model.natural_period, arrangement=model.arrangement, changeover=model.changeover)


def motion(model: FittedModel, speeds: dict[str, float], seed: int = 0) -> Portrait | Rest:
    """The model's motion of 12 s as a laser of 20 um noise shows it."""
    run = model.run(speeds, 12.0, 1e-3)
    angle = run.angle + np.random.default_rng(seed).normal(0, 20e-6 / model.parameters["R"], len(run.time))
    drives = {contact: np.full(len(run.time), speed) for contact, speed in speeds.items()}
    return processing(model).motion(run.time, angle, drives, states=run.states)


@pytest.mark.parametrize(
    ("speeds", "most"), [((1.8, 2.0, 2.2), 0.01), ((1.4, 1.8, 2.2), 0.01), ((0.41, 0.83, 1.4), 0.05)]
)
def test_stick_carried_on_to_zero_finds_the_fold(speeds: tuple[float, ...], most: float) -> None:
    model = fitted_model(made_fit())
    portraits = [motion(model, {"disc0": speed}) for speed in speeds]
    rows = [
        (speed, *bifurcations.stick_angle(one.sticks["disc0"], speed))
        for speed, one in zip(speeds, portraits, strict=True)
        if isinstance(one, Portrait)
    ]
    found = extrapolated(*zip(*rows, strict=True))
    assert found is not None
    estimate, deviation = found
    assert estimate == pytest.approx(2.430235821, rel=most)
    assert abs(estimate - 2.430235821) < 2 * deviation < 0.25


def test_extrapolation_of_the_curve_itself_and_of_none() -> None:
    w = np.array([1.0, 1.5, 2.0])
    found = extrapolated(w, 0.01 * w * (2.5 - w), [0.0, 0.0, 0.0])
    assert found is not None and found[0] == pytest.approx(2.5, rel=1e-9)
    assert extrapolated(w, 0.01 * w, [0.0, 0.0, 0.0]) is None  # does not fall
    assert extrapolated(w, 0.01 * w * (2.5 - w), [0.0, 0.0, 0.004]) is None  # as well known as not at all
    assert extrapolated(w[:2], [0.02, 0.01], [0.0, 0.0]) is None
    assert extrapolated(w, [0.02, float("nan"), 0.01], [0.0, 0.0, 0.0]) is None


def test_stick_by_slip_speed_is_the_models_own() -> None:
    """Class a, paper/rubber at 0.83 rad/s and N = 4.905 N: 0.21297 of the period in stick."""
    model = fitted_model(made_fit(N=4.905))
    one = motion(model, {"disc0": 0.83})
    assert isinstance(one, Portrait)
    stick = one.sticks["disc0"]
    assert stick.real and stick.held is not None
    assert float(np.mean(stick.held)) == pytest.approx(0.212966229350, abs=2e-3)
    assert stick.fraction > 0.3  # below the threshold for longer
    assert np.sqrt(np.median(stick.squares)) / one.period == pytest.approx(0.212966229350, rel=0.05)


def test_a_near_miss_is_no_stick_and_a_stick_cut_short_is_one() -> None:
    """Below 0.5951 rad/s the body comes near the speed of disc 1 without sticking to it; on disc 0, where the
    changeover ends the stick after 3 % of the period, it sticks."""
    model = fitted_model(made_fit("liner/rubber", 3.0621, 2, theta_s=0.0, c=0.0055))
    words = [motion(model, {"disc0": speed, "disc1": 1.15}).words for speed in (0.45, 0.9, 1.2)]
    assert words == ["stick on disc0", "stick on disc0, disc1", "stick on disc1"]


@pytest.mark.parametrize("bristles", [{}, {"sigma0": 2e5, "sigma1": 100.0}])
def test_steady_sliding_has_an_angle_and_a_damping(bristles: dict[str, float]) -> None:
    """Bristles in front of the law change neither."""
    fit = made_fit()
    more = tuple(replace(fit["mu_s"], name=name, value=value) for name, value in bristles.items())
    fit = replace(fit, law="LuGre" if bristles else "Conti", parameters=(*fit.parameters, *more))
    model = fitted_model(fit)
    found = model.sliding({"disc0": 3.0})
    assert found is not None
    law = (0.65 - 0.35) / (1 + 15 * 0.06 * 3.0) + 0.35
    slope = -(0.65 - 0.35) * 15 / (1 + 15 * 0.06 * 3.0) ** 2
    assert found.angle == pytest.approx(0.125 * 5.0 * law / 2.62, rel=1e-9)
    assert found.damping == pytest.approx(0.055 + 0.125**2 * 5.0 * slope, rel=1e-6)
    assert bristles or isinstance(motion(model, {"disc0": 3.0}), Rest)


def test_parameters_of_the_fmu_from_a_fit() -> None:
    one = made_fit("liner/rubber", 4.0)
    assert fmu_parameters(one) == {
        **{name: value for name, (value, _) in RIG.items()},
        **{"N0": 4.0, "mu_s0": 0.5, "mu_k0": 0.33, "p0": 20.0},
    }
    decay = replace(
        one,
        constants=tuple(dataclasses.replace(c, name="k/J", value=50.0) if c.name == "k" else c for c in one.constants),
    )
    assert rig_constants(decay)["k"] == pytest.approx(50.0 * 0.0548)
    coulomb = replace(one, law="Coulomb", parameters=(replace(one.parameters[0], name="mu", value=0.4),))
    found = fmu_parameters(coulomb)
    assert found["mu0"] == 0.4 and "mu_s0" not in found


@pytest.mark.parametrize(
    ("low", "high", "estimate", "deviation", "predicted", "told"),
    [
        (0.8, 1.0, None, None, 0.02, True),
        (0.8, 1.0, None, None, 3.6, None),  # a prediction of 0.9 +- 7 rad/s agrees with all
        (0.2, 2.0, None, None, 0.02, None),
        (0.8, np.inf, None, None, 0.02, None),
        (0.8, np.inf, 0.95, 0.05, 0.02, True),
        (0.8, 1.0, 0.95, 0.3, 0.02, True),  # the bracket tells what the estimate does not
        (0.2, 2.0, 0.95, 0.3, 0.02, None),
        (0.2, 2.0, 1.8, 0.3, 0.02, False),  # apart by more than is open
        (1.2, 2.0, None, None, 0.02, False),
    ],
)
def test_what_is_known_too_vaguely_does_not_agree(
    low: float, high: float, estimate: float | None, deviation: float | None, predicted: float, told: bool | None
) -> None:
    seen = MeasuredBifurcation("disc0", low, high, ("disc0",), (), estimate, deviation)
    model = Transition("disc0", 0.9, ("disc0",), (), predicted, 0.0)
    assert agreement(seen, model, None, None) is told
