"""Design of the next experiment: its prediction against a fit that has made the experiment; refusals; sliding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np
import pytest
from oracle.bench import Bench, Drive, slips_and_sticks

from fmu_models.base.errors import StickslipError
from identification.fit.fit import fit_friction
from identification.fit.parts import Cause
from identification.fit.result import FrictionFit
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.next_step.design import Candidate, design
from identification.next_step.simulated_logs import Knowledge, SeenLog
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import RigLog


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    """Paper/rubber at 0.41, 0.83 and 1.4 rad/s."""
    bench = standard_set("paper/rubber")[:3]
    return [emulate(replace(one, duration=12.0), 8, number) for number, one in enumerate(bench)]


def fitted(ready: Pool) -> FrictionFit:
    return fit_friction(ready, disturbances="none", law_spread="none")


@pytest.fixture(scope="module")
def fit(logs: list[RigLog]) -> FrictionFit:
    """Of the slower two."""
    return fitted(pool(logs[:2]))


@pytest.fixture(scope="module")
def exact(fit: FrictionFit) -> FrictionFit:
    """As if gain and delay of the laser were known."""
    return replace(fit, sensors={}, nuisance=())


def only(fit: FrictionFit, speed: float, load: float = 4.905) -> Candidate:
    return _one(design(fit, speeds=[speed], loads=[load]).candidates)


def test_the_predicted_deviations_are_those_of_the_fit_with_that_log(logs: list[RigLog], fit: FrictionFit) -> None:
    """By the bound of the sensors, which no chance of residuals enters; and as the fit states them."""
    after, found = fitted(pool(logs)), design(fit, speeds=[1.4], duration=12.0)
    for name, sd in _one(found.candidates).deviations.items():
        assert found.deviations[name] == pytest.approx(fit[name].bound, rel=0.03)
        assert sd == pytest.approx(after[name].bound, rel=0.08)
        assert sd == pytest.approx(after[name].standard_deviation, rel=0.2)


def test_deviations_fall_with_the_root_of_the_duration(exact: FrictionFit) -> None:
    short, long, longer = (design(exact, speeds=[0.83], duration=duration) for duration in (1e-3, 1e6, 4e6))
    assert _one(short.candidates).deviations == pytest.approx(short.deviations)
    for name, sd in _one(longer.candidates).deviations.items():
        assert sd == pytest.approx(_one(long.candidates).deviations[name] / 2, rel=5e-3)


def test_what_all_logs_share_is_known_no_better_for_another() -> None:
    """Readings y = x t + g + noise, g one for all, by the whole matrix of x and g; and lines of an encoder that another
    range of angles adds. Left out, g would pass for noise, and another log seem to tell less than it does."""
    noise, of_gain = 0.02, 0.03
    slow, fast = (np.column_stack([time, np.ones(20)]) for time in (np.linspace(0, 0.1, 20), np.linspace(-1, 1, 20)))
    alone = np.linalg.inv(slow.T @ slow / noise**2 + np.diag([0, of_gain**-2]))[0, 0]
    first, second = ((SeenLog(row.T @ row, 0.0, angles=(0.1, 0.2)), 1.0, 1.0) for row in (slow, fast))
    known = Knowledge({"gain": of_gain}, True, [first], float(np.log(alone)) / 2)
    assert known.precision == pytest.approx(noise**-2)
    for sign, lines in ((1.0, 1.0), (-1.0, 2.0)):  # the same range, or as much beside
        both = np.linalg.inv((slow.T @ slow + fast.T @ fast) / noise**2 + np.diag([0, lines * of_gain**-2]))[0, 0]
        assert known.with_logs([(second[0], 1.0, sign)]) == pytest.approx(1 / both)
    of_law = [(replace(one, information=one.information[:1, :1]), 1.0, 1.0) for one, _, _ in (first, second)]
    # without an encoder the fit states what the slips too have left of the gain
    matrix = (slow.T @ slow) / noise**2 + np.diag([0, of_gain**-2])
    left = float(np.sqrt(np.linalg.inv(matrix)[1, 1]))
    other = Knowledge({"gain": left}, False, [first], float(np.log(alone)) / 2)
    both = np.linalg.inv(matrix + fast.T @ fast / noise**2)[0, 0]
    assert other.precision == pytest.approx(noise**-2)
    assert other.with_logs([(second[0], 1.0, -1.0)]) == pytest.approx(1 / both)
    without = Knowledge({}, True, of_law[:1], float(np.log(alone)) / 2)
    assert without.with_logs(of_law[1:])[0, 0] < 0.5 * known.with_logs([second])[0, 0]


def test_colour_beyond_chance_is_kept(fit: FrictionFit) -> None:
    """The jackknife over 40 slips says that residuals are white, or that they triple the deviations."""
    for ratio, kept in ((1.05, 1.0), (3.0, 3.0)):
        parameters = [replace(q, standard_deviation=ratio * q.plain_deviation) for q in fit.parameters]
        now = design(replace(fit, parameters=tuple(parameters)), speeds=[0.83]).deviations
        mean = np.mean([np.log(now[q.name] / q.plain_deviation) for q in fit.parameters])
        assert np.exp(mean) == pytest.approx(kept, rel=0.05)


def test_a_parameter_that_is_held_is_known(exact: FrictionFit) -> None:
    """A design is of the others: a log of next to no time leaves their deviations, a long one lowers them."""
    value = exact["p"].value
    known = replace(exact["p"], minimum=value, maximum=value, standard_deviation=0.0)
    holding = replace(exact, parameters=(*exact.parameters[:2], known))
    short, long = (design(holding, speeds=[0.83], duration=duration) for duration in (1e-3, 1e6))
    assert _one(short.candidates).deviations == pytest.approx(short.deviations) and [*short.deviations] == [
        "mu_s",
        "mu_k",
    ]
    assert _one(long.candidates).deviations["mu_s"] < 0.1 * short.deviations["mu_s"]


def _one(candidates: Sequence[Candidate]) -> Candidate:
    (one,) = candidates
    return one


def test_experiments_without_stick_slip_are_refused_with_the_reason(fit: FrictionFit) -> None:
    assert only(fit, 3.0, 2.0).refused == "slides without sticking"
    assert only(fit, 0.05, 1.5).refused == "no slip above 0.01 m/s"
    found = design(fit, speeds=[3.0, 0.6], loads=[2.0, 4.905])
    assert found.candidates[-1].refused and not found.candidates[0].refused
    ranked = [one.gain for one in found.candidates if one.refused is None]
    assert ranked == sorted(ranked, reverse=True)
    assert "would help most" in found.advice and found.advice.count("->") == 4


def test_what_cannot_be_designed(fit: FrictionFit) -> None:
    with pytest.raises(StickslipError, match="Every drive speed of a design"):
        design(fit, speeds=[-1.0])
    with pytest.raises(StickslipError, match="Every load of a design"):
        design(fit, loads=[0.0])
    for logs in (0, -1, 51, 1.5, True):
        with pytest.raises(StickslipError, match="plans 1 to 50 logs"):
            design(fit, logs=logs)  # type: ignore[reportArgumentType]
    with pytest.raises(StickslipError, match="law of slip speed alone"):
        design(replace(fit, law="LuGre"))
    calm = replace(fit, parameters=tuple(replace(q, value=0.36) if q.name == "mu_s" else q for q in fit.parameters))
    with pytest.raises(StickslipError, match="does not stick and slip"):
        design(calm)
    lost = replace(fit, correlation=((1.0, 1.0, 1.0),) * 3)
    with pytest.raises(StickslipError, match="nothing to build a design on"):
        design(lost)


def test_a_speed_at_which_a_body_may_slide_on_says_how_to_begin(fit: FrictionFit) -> None:
    """On a bench that knows nothing of ours: brought up from rest, or let go as is said, it sticks and slips; let go
    where that is not needed, or where it slides, it does as is foretold."""
    mu_s, mu_k, p = fit.law_values
    bench = Bench(lambda v: (mu_s - mu_k) / (1 + p * v) + mu_k)
    found = design(fit, speeds=[0.83, 1.8, 2.1])
    places = {one.drive_speed: one for one in found.candidates}
    assert places[0.83].start == "as you like" and places[0.83].start_angle == 0 and not places[0.83].both
    assert places[2.1].both and "bring the drive up from rest" in places[2.1].start
    assert places[2.1].start in found.advice
    fastest = places[2.1]
    angle, at_rest = fastest.start_angle, float(bench.R * bench.N / bench.k * bench.mu(bench.r * 2.1))
    assert angle is not None and angle < 0
    begun = {None: True, angle: True, 0.0: False, at_rest: False}
    for let_go, cycles in begun.items():
        drive = Drive(bench, 2.1, 4.0, np.random.default_rng(1))
        time, turned = slips_and_sticks(bench, drive, 4.0, 0, let_go)
        slip = bench.r * np.interp(time, drive.time, drive.speed) - bench.R * np.gradient(turned, time)
        assert bool(np.any(np.abs(slip) < 1e-3)) == cycles, let_go


def test_a_plan_is_the_best_of_all_that_could_be_made(fit: FrictionFit) -> None:
    """Each pair of three drives, one after the other: none leaves smaller deviations, and more logs leave less."""
    speeds = [0.3, 0.83, 2.1]
    found = design(fit, speeds=speeds, logs=2)
    (first, second), gains = found.plan.logs, {}
    for pair in combinations_with_replacement(speeds, 2):
        gains[pair] = design(fit, speeds=sorted(set(pair)), logs=2).plan.logs[-1].gain
    assert second.gain == pytest.approx(max(gains.values()))
    assert first.deviations == pytest.approx(found.candidates[0].deviations)
    assert second.gain > first.gain and all(sd < found.plan.repeated[name] for name, sd in second.deviations.items())
    # both ways, since there is no free decay, and the logs were made in one
    assert (first.drive_speed < 0) != (second.drive_speed < 0) and first.drive_speed < 0
    for one in found.plan.logs:
        assert one.start_angle is not None and one.start_angle * one.drive_speed <= 0
    frame = found.plan.frame
    assert list(frame["start"])[-1] == "as the logs were made" and len(frame) == 3
    assert found.to_dict()["plan"]["logs"][0]["start"] == first.start
    assert "2 logs of 20 s as planned leave deviations" in found.advice


def test_a_repetition_is_what_logs_of_the_same_speeds_leave(exact: FrictionFit) -> None:
    """As many as were made, as long: half the variance."""
    found = design(exact, speeds=[0.83], logs=2, duration=exact.logs[0].duration)
    for name, sd in found.deviations.items():
        assert found.plan.repeated[name] == pytest.approx(sd / np.sqrt(2), rel=1e-3)


def test_what_no_log_lowers_is_said_with_the_constant_to_measure(fit: FrictionFit) -> None:
    constants = tuple(
        replace(c, standard_uncertainty=(0.01 if c.name == "r" else 1e-5) * c.value) for c in fit.constants
    )
    parameters = tuple(replace(q, scale_deviation=0.02 if q.name == "mu_k" else 0.0) for q in fit.parameters)
    doubted = replace(fit, constants=constants, parameters=parameters)
    advice = design(doubted, speeds=[0.83]).advice
    assert "the constants of the rig leave mu_k 0.020, which no log lowers: measure r better" in advice
    named = replace(doubted, causes=(Cause("wear", "it wears", 0.01, "1", 50.0, 1e-6),))
    assert "Foretold as if wear were known" in design(named, speeds=[0.83]).advice
    assert "were known" not in advice
    known = replace(fit, parameters=tuple(replace(q, scale_deviation=0.0) for q in fit.parameters))
    assert "no log lowers" not in design(known, speeds=[0.83]).advice


def test_holds_are_planned_where_breakaway_ages_untold(fit: FrictionFit) -> None:
    assert fit.breakaway is not None
    ageing = replace(fit, breakaway=replace(fit.breakaway, growth=None, excess=0.1, of_wrong_law=False))
    plan = design(ageing, speeds=[0.3, 0.83], logs=3).plan
    assert sorted(len(one.holds) for one in plan.logs) == [0, 0, 3]
    slowest = min(abs(one.drive_speed) for one in plan.logs)
    assert all(
        "holds of 0.3, 3, 30 s" in one.start and abs(one.drive_speed) == slowest for one in plan.logs if one.holds
    )
