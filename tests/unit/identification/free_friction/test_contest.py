"""The contest of explanations, against a bench that shares no code with us: what was done to it is named, no more."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from foreign_bench import Faults, foreign_logs, with_drawn_constants
from oracle.bench import Bench

from fmu_models.base.errors import StickslipError
from identification.disturbances.term import DAMPING, DRIVE, FRICTION, SPRING
from identification.disturbances.terms import terms_of
from identification.estimators.shooting import slip_shooting
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.causes import causes_of
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.free_friction.contest import contest
from identification.free_friction.curve import begun, slips_of
from identification.free_friction.guess import MODES, STARTS, Guess
from identification.free_friction.responses import rows_of
from identification.free_friction.result import COEFFICIENTS
from identification.measurement.pooling import pool
from rig_io.bench.emulation import MicroSlip
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import EncoderCalibration, RigLog

TRUTH = np.array([0.65, 0.35, 15.0])
SPEEDS = (0.41, 0.83)
Bent = dict[str, float | Callable[..., float]]


def conti(speed: Any) -> Any:
    return 0.3 / (1 + 15 * speed) + 0.35


def logs(seed: int, faults: Faults | None = None, **bent: float | Callable[..., float]) -> list[RigLog]:
    bench = with_drawn_constants(replace(Bench(conti), **bent), np.random.default_rng(seed))
    return foreign_logs(bench, seed, SPEEDS, faults=faults)


def lesser(seed: int, without: str, **bent: Any) -> list[RigLog]:
    return logs(seed, Faults(without=without), **bent)


def off(fit: FrictionFit) -> np.ndarray:
    """Errors of the law's values over their stated deviations."""
    return (fit.law_values - TRUTH) / [parameter.total_deviation for parameter in fit.parameters]


CASES: dict[str, tuple[Bent, Faults, float]] = {
    "spring": ({"k3": 0.3}, Faults(), 0.3 * 0.2**2),
    "damping": ({"c2": 0.004}, Faults(), 0.0),
    "normal-force": ({"factor": lambda time, angle, log, turned: 1 + 0.01 * np.cos(turned)}, Faults(), 0.01),
    "drive-encoder": ({}, Faults(drive=lambda turned: 5e-3 * np.sin(turned)), 5e-3),
    "laser-bend": ({}, Faults(laser=lambda time, angle: 0.05 * angle**2), 0.0),
}


@pytest.mark.nightly_for("spring", "normal-force", "damping", "drive-encoder")
@pytest.mark.parametrize("name", CASES)
def test_a_disturbance_that_is_known_is_named_and_the_law_holds(name: str) -> None:
    bent, faults, size = CASES[name]
    fit = fit_friction(logs(4, faults, **bent), law_spread="none")
    (cause,) = fit.causes
    assert cause.name == name and cause.gain > 30
    if size:
        assert cause.size == pytest.approx(size, rel=0.25)
    assert np.all(np.abs(off(fit)) < 3)
    assert fit.free is not None and fit.free.explains


KNOWN: list[dict[str, Any]] = [{}, {"creep": 0.02, "creep_deviation": 0.003}, {"creep_deviation": 0.0}]


def on_motor(seed: int, **belt: Any) -> list[RigLog]:
    """The disc turns by two per cent less than an encoder shows that turns twice as often."""
    made = logs(seed, Faults(drive=lambda turned: 0.02 * turned))
    encoder = EncoderCalibration(500, ratio=2.0, **belt)
    return [replace(log, calibration=replace(log.calibration, drive0=encoder)) if log.contacts else log for log in made]


def test_creep_that_too_few_speeds_tell_is_said() -> None:
    said = [any("do not tell creep" in one for one in pool(on_motor(4, **belt)).warnings) for belt in KNOWN]
    assert said == [True, False, False]
    assert not any("do not tell creep" in one for one in pool(logs(4)).warnings)


def test_a_gear_does_not_creep() -> None:
    assert [term.cause for term in terms_of(pool(on_motor(4)), ["belt"])] == ["belt"]
    with pytest.raises(StickslipError, match=r"cannot show a disturbance 'belt': .* behind a gear"):
        terms_of(pool(on_motor(4, creep_deviation=0.0)), ["belt"])


@pytest.mark.nightly
def test_a_belt_that_creeps_is_named_where_nobody_knows_and_the_law_holds() -> None:
    fit = fit_friction(on_motor(4), law_spread="none")
    (cause,) = fit.causes
    assert cause.name == "belt" and cause.size == pytest.approx(0.02, rel=0.3) and "r" in cause.alike
    assert np.all(np.abs(off(fit)) < 3)
    known = fit_friction(on_motor(4, creep=0.02, creep_deviation=0.003), law_spread="none")
    assert known.causes == () and np.all(np.abs(off(known)) < 3)


@pytest.mark.nightly
def test_settling_friction_is_named_and_its_mean_is_the_law() -> None:
    def warming(time: float, angle: float, log: int, turned: float) -> float:
        return 1 - 0.03 * float(np.exp(-max(time, 0.0) / 10))

    fit = fit_friction(logs(5, factor=warming), law_spread="none")
    assert [cause.name for cause in fit.causes] == ["warm-up"]
    mean = 1 - 0.03 * (1 - np.exp(-1))
    errors = (fit.law_values - TRUTH * [mean, mean, 1]) / [q.total_deviation for q in fit.parameters]
    assert np.all(np.abs(errors) < 3)


@pytest.mark.nightly
def test_wear_that_settling_friction_would_be_too_is_named_beside_it() -> None:
    """What is assumed of their sizes alone prefers one, and the other is right."""
    ready = pool(logs(5, factor=lambda time, angle, log, turned: 1 + 5e-4 * time))
    verdict = contest(ready, *slip_shooting(ready))
    assert verdict is not None
    (cause,) = causes_of(verdict, ready)
    assert {cause.name, *cause.alike} == {"wear", "warm-up"}
    assert cause.sentence.startswith(f"{cause.name} or {cause.alike[0]}: ")
    assert "These logs do not tell which; this would: " in cause.sentence


@pytest.mark.nightly_for("6")
@pytest.mark.parametrize("seed", [6, 7])
def test_a_clean_bench_has_nothing_named(seed: int) -> None:
    fit = fit_friction(logs(seed), law_spread="none")
    assert fit.causes == () and np.all(np.abs(off(fit)) < 3)


def test_a_wrong_radius_is_told_with_both_that_it_may_be() -> None:
    wrong = [replace(log, rig=replace(log.rig, r=replace(log.rig.quantity("r"), value=0.0625))) for log in logs(8)]
    with pytest.raises(
        StickslipError, match=r"R = 0\.1[23]\d+ m instead of 0\.125 or r = 0\.0(?:59|60)\d* m instead of 0\.0625"
    ):
        fit_friction(wrong, law_spread="none")


def test_what_nobody_knows_has_no_name_and_widens_the_law() -> None:
    """The torque of a draft."""
    gusts = np.cumsum(np.random.default_rng(1).standard_normal(200)) * 4e-4
    time = 0.1 * np.arange(200) - 7

    fit = fit_friction(logs(9, torque=lambda t, angle: float(np.interp(t, time, gusts))))
    assert fit.free is not None and fit.free.unexplained > 0 and fit.causes == ()
    assert all(parameter.law_deviation for parameter in fit.parameters)
    assert np.all(np.abs(off(fit)) < 4)


def test_a_laser_that_walks_is_told_by_the_encoder_and_taken_off() -> None:
    walk = np.cumsum(np.random.default_rng(1).standard_normal(10_001)) * 2e-4 / 0.125 / 100
    said, still = (pool(logs(9, Faults(laser=lambda t, angle, size=size: size * walk[: len(t)]))) for size in (1, 0))
    assert sum("drifts against" in one for one in said.sensors.warnings) == 2 and not still.sensors.warnings
    for walked, whole in zip(said.motions, still.motions, strict=True):
        assert np.std(walk) > 3e-4 and np.std(walked.angle - whole.angle) < 1e-4


def walking(seed: int, size: float, **bent: Any) -> list[RigLog]:
    """A laser alone that walks by ``size`` m in ten seconds."""
    walk = np.cumsum(np.random.default_rng(seed).standard_normal(10_001)) * size / 0.125 / 100
    return logs(seed, Faults(laser=lambda t, angle: walk[: len(t)], without="encoder"), **bent)


def test_sticks_tell_a_laser_that_walks_from_one_that_stays_and_from_a_contact_that_rings() -> None:
    for size in (1e-4, 2e-4):
        rates = [pool(walking(seed, size)).motions[0].wander * 0.125 * np.pi / np.sqrt(0.03) for seed in (9, 10)]
        assert rates == pytest.approx(2 * [size], rel=0.4)
    assert all(motion.wander == 0 for motion in pool(walking(9, 0.0)).motions)
    ringing = [replace(one, encoder=None, micro_slip=MicroSlip()) for one in standard_set(speeds=(0.83, 1.4))]
    assert all(m.wander == 0 for m in pool([emulate(one, 3, n) for n, one in enumerate(ringing)]).motions)


@pytest.mark.nightly
def test_a_walk_of_a_laser_alone_is_named_and_the_law_holds() -> None:
    fit = fit_friction(walking(9, 2e-4))
    assert [cause.name for cause in fit.causes] == ["laser-walk"] and not any("walk" in q.name for q in fit.nuisance)
    assert np.all(np.abs(off(fit)) < 3) and fit["mu_s"].total_deviation < 0.02 * fit["mu_s"].value
    assert fit.free is not None and fit.free.explains and not fit.free.departures(conti)


def test_a_direction_and_a_vibration_are_named() -> None:
    bench = with_drawn_constants(Bench(conti, sided=0.02), np.random.default_rng(4))
    sided = fit_friction(foreign_logs(bench, 4, (0.41, -0.83)), law_spread="none")
    shaking = Faults(laser=lambda time, angle: 2e-3 * np.sin(2 * np.pi * 37.3 * time))
    shaken = fit_friction(logs(4, shaking), law_spread="none")
    for fit, name, size in ((sided, "direction", 0.02), (shaken, "laser-vibration", 2e-3 * 0.125)):
        (cause,) = fit.causes
        assert cause.name == name and cause.size == pytest.approx(size, rel=0.1)
        assert np.all(np.abs(off(fit)) < 3)
    assert "it has 37.3 Hz" in shaken.causes[0].words


def test_an_encoder_alone_tells_friction_without_a_law_and_what_is_beside() -> None:
    plain, bent = fit_friction(lesser(4, "laser")), fit_friction(lesser(4, "laser", k3=0.3), law_spread="none")
    (cause,) = bent.causes
    assert plain.causes == () and cause.name == "spring" and cause.size == pytest.approx(0.3 * 0.2**2, rel=0.25)
    for fit in (plain, bent):
        assert fit.free is not None and fit.free.explains and not fit.free.departures(conti)
        assert np.all(np.abs(off(fit)) < 3)


@pytest.mark.nightly
def test_drives_that_nobody_recorded_are_uneven_or_not() -> None:
    even = fit_friction(lesser(5, "drive", ripple=(0.0, 0.0), hunting=0.0))
    uneven = fit_friction(lesser(5, "drive"))
    assert even.causes == () and [cause.name for cause in uneven.causes] == ["drive-uneven"]
    assert uneven.causes[0].size == pytest.approx(4e-3, rel=0.5)
    for fit in (even, uneven):
        seen = fit.free is not None and fit.free.speed >= fit.free.least
        assert fit.free is not None and fit.free.explains and not fit.free.departures(conti)
        assert np.all(np.abs(fit.free.coefficient - conti(fit.free.speed))[seen] < 3 * fit.free.deviation[seen])
        assert np.all(np.abs(off(fit)) < 3)


@pytest.mark.nightly
def test_derivatives_by_what_lesser_instruments_leave_open_are_those_of_the_residuals() -> None:
    ready = pool(lesser(6, "laser drive"))
    slips = slips_of(ready, slip_shooting(ready)[0])
    guess, nothing = begun(slips), np.zeros((len(slips.segments), STARTS + MODES))
    names = {"w_1": 1e-4, "zero": 1e-4, next(name for name in slips.names if name.startswith("line_")): 1e-4}
    for name, size in names.items():
        place = COEFFICIENTS + slips.names.index(name)
        step = size * np.eye(COEFFICIENTS + len(slips.names))[place]
        ahead, behind = (rows_of(slips, guess.moved(sign * step, nothing, slips.names)) for sign in (1, -1))
        expected = np.concatenate([a.residual - b.residual for a, b in zip(ahead, behind, strict=True)]) / (2 * size)
        column = np.concatenate([row.shared[:, place] for row in rows_of(slips, guess)])
        assert np.ptp(expected) > 0 or name == "zero"
        np.testing.assert_allclose(column, expected, atol=1e-2 * np.abs(expected).max(), err_msg=name)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "without", "shown"),
    [
        ("laser_beam=arc", "", lambda time, angle: angle - np.sin(angle)),
        ("laser-bend", "encoder", lambda time, angle: angle - np.sin(angle)),
        ("laser-gain", "encoder", lambda time, angle: 3e-3 * np.sin(angle) * np.exp(-time / 6)),
    ],
    ids=["arc", "arc-alone", "warm"],
)
def test_a_laser_on_an_arc_or_that_grows_warm_is_named(
    name: str, without: str, shown: Callable[..., np.ndarray]
) -> None:
    """Beside an encoder an arc is taken as what it is, with a warning, and is no cause."""
    fit = fit_friction(logs(4, Faults(laser=shown, without=without)), law_spread="none")
    described = [name for warning in fit.warnings if name in warning]
    assert [*described, *(cause.name for cause in fit.causes)] == [name] and np.all(np.abs(off(fit)) < 3)


@pytest.mark.nightly
def test_a_cable_that_pulls_is_named_or_said_to_be_alike() -> None:
    """Friction at some angles is much the same, where the body is there while it slips one way."""

    def cable(time: float, angle: float) -> float:
        return -0.03 * max(angle - 0.08, 0.0)

    fit = fit_friction(logs(4, torque=cable), law_spread="none")
    (cause,) = fit.causes
    assert "pull" in (cause.name, *cause.alike) and np.all(np.abs(off(fit)) < 3)
    assert "this would: logs at another load" in cause.sentence


@pytest.mark.nightly
def test_what_a_free_decay_shows_too_is_no_friction_at_an_angle() -> None:
    """A magnet beside the body, narrow."""

    def magnet(time: float, angle: float) -> float:
        return -5e-3 * (angle - 0.04) / 0.013 * float(np.exp(0.5 - 0.5 * ((angle - 0.04) / 0.013) ** 2))

    pulled = logs(5, torque=magnet)
    ready = pool(pulled)
    assert any("a magnet, a cable" in one for one in ready.warnings)
    fit = fit_friction(pulled)
    # what the terms of a pull leave of one so narrow goes with the angle cubed, as a laser's bend does
    assert [cause.name for cause in fit.causes] in (["pull"], ["pull", "laser-bend"])
    assert np.all(np.abs(off(fit)) < 4)


@pytest.mark.nightly
def test_what_explains_but_half_has_no_name() -> None:
    """A load that rocks at 3.3 Hz goes best with a bend of the laser, and leaves residuals that are no noise."""

    def rocking(time: float, angle: float, log: int, turned: float) -> float:
        return 1 + 0.008 * float(np.sin(2 * np.pi * 3.3 * time))

    fit = fit_friction(logs(0, factor=rocking))
    assert fit.causes == () and fit.free is not None and fit.free.unexplained > 0
    assert np.all(np.abs(off(fit)) < 3)


@pytest.mark.nightly
def test_derivatives_by_every_kind_of_effect_are_those_of_the_residuals() -> None:
    fit = fit_friction(logs(6), law_spread="none", disturbances="none")
    solved = fit.solved
    assert solved is not None and isinstance(solved.problem, ShootingProblem)
    problem = solved.problem
    named = ["spring", "damping", "drive-encoder", "warm-up", "laser-bend", "angle"]
    terms = terms_of(pool(logs(6)), named)
    assert {term.effect.acts for term in terms} >= {SPRING, DAMPING, DRIVE, FRICTION}
    bare = slips_of(problem.ready, problem.segments)
    slips = bare.under(terms, tuple(term.name for term in terms))
    start = begun(bare)
    values = {term.name: 0.02 * term.effect.width(term.order) for term in terms}
    guess = Guess(start.coefficients, start.starts, start.unexplained, values)
    rows = rows_of(slips, guess)
    nothing = np.zeros((len(slips.segments), STARTS + MODES))
    for place, term in enumerate(terms, COEFFICIENTS):
        step = np.zeros(COEFFICIENTS + len(terms))
        step[place] = 1e-3 * term.effect.width(term.order)
        ahead, behind = (rows_of(slips, guess.moved(sign * step, nothing, slips.names)) for sign in (1, -1))
        expected = [(a.residual - b.residual) / (2 * step[place]) for a, b in zip(ahead, behind, strict=True)]
        scale = max(float(np.max(np.abs(one))) for one in expected)
        for row, one in zip(rows, expected, strict=True):
            np.testing.assert_allclose(row.shared[:, place] / scale, one / scale, atol=2e-2, err_msg=term.name)


@pytest.mark.nightly
def test_names_are_taken_for_granted_where_they_are_given() -> None:
    fit = fit_friction(logs(6), law_spread="none", disturbances=["spring"])
    (cause,) = fit.causes
    (k3,) = (parameter for parameter in fit.nuisance if parameter.name == "k3")
    assert cause.name == "spring" and abs(k3.value) < 4 * k3.standard_deviation
    solved = fit.solved
    assert solved is not None and isinstance(solved.problem, ShootingProblem)
    again = contest(solved.problem.ready, solved.problem.segments, True)
    assert again is not None and again.explanations == ()
