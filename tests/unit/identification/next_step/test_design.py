"""Design of the next experiment: its prediction against a fit that has made the experiment; refusals; sliding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.next_step.design import Candidate, design
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import RigLog


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    """Paper/rubber at 0.41, 0.83 and 1.4 rad/s."""
    return [emulate(one, 7, number) for number, one in enumerate(standard_set("paper/rubber")[:3])]


@pytest.fixture(scope="module")
def fit(logs: list[RigLog]) -> FrictionFit:
    """Of the slower two."""
    return fit_friction(pool(logs[:2]), estimator="weak-form")


def only(fit: FrictionFit, speed: float, load: float = 4.905) -> Candidate:
    return _one(design(fit, speeds=[speed], loads=[load]).candidates)


def test_the_predicted_deviations_are_those_of_the_fit_with_that_log(logs: list[RigLog], fit: FrictionFit) -> None:
    # without what the instruments add to both, which no log improves
    ready = pool(logs)
    exact = replace(ready, sensors=replace(ready.sensors, covariance=np.zeros((2, 2))))
    before = fit_friction(
        replace(exact, motions=exact.motions[:2], segments=exact.segments[: _slower(exact)]), estimator="weak-form"
    )
    after = fit_friction(exact, estimator="weak-form")
    said = only(before, 1.4)
    for name in ("mu_s", "mu_k", "p"):
        ratio = after[name].standard_deviation / before[name].standard_deviation
        # jackknives of 40 and 60 slips: 15 % of chance
        assert said.deviations[name] / before[name].standard_deviation == pytest.approx(ratio, rel=0.4)
    assert said.gain > 0.3


def _slower(ready: Pool) -> int:
    return sum(segment.motion is not ready.motions[2] for segment in ready.segments)


def test_deviations_fall_with_the_root_of_the_duration(fit: FrictionFit) -> None:
    short, long, longer = (
        design(fit, speeds=[0.83], loads=[4.905], duration=duration).candidates for duration in (1e-3, 1e6, 4e6)
    )
    now = {q.name: q.standard_deviation for q in fit.parameters}
    for name in now:
        assert _one(short).deviations[name] == pytest.approx(now[name], rel=1e-3)
        assert _one(longer).deviations[name] == pytest.approx(_one(long).deviations[name] / 2, rel=5e-3)


def test_a_parameter_that_is_held_is_known(fit: FrictionFit) -> None:
    """A design is of the others: a log of next to no time leaves their deviations, a long one lowers them."""
    held = {"p": {"minimum": fit["p"].value, "maximum": fit["p"].value, "standard_deviation": 0.0}}
    parameters = tuple(replace(q, **held.get(q.name, {})) for q in fit.parameters)
    told = _one(design(replace(fit, parameters=parameters), speeds=[0.83], loads=[4.905], duration=1e-3).candidates)
    assert told.deviations == pytest.approx({q.name: q.standard_deviation for q in fit.parameters[:2]}, rel=1e-2)
    longer = _one(design(replace(fit, parameters=parameters), speeds=[0.83], loads=[4.905], duration=1e6).candidates)
    assert longer.deviations["mu_s"] < 0.1 * fit["mu_s"].standard_deviation


def _one(candidates: Sequence[Candidate]) -> Candidate:
    (one,) = [candidate for candidate in candidates if candidate.kind == "stick-slip"]
    return one


def test_experiments_without_stick_slip_are_refused_with_the_reason(fit: FrictionFit) -> None:
    assert only(fit, 3.0, 2.0).refused == "slides without sticking"
    assert only(fit, 0.05, 1.5).refused == "no slip above 0.01 m/s"
    found = design(fit, speeds=[3.0, 0.6], loads=[2.0, 4.905])
    assert found.candidates[-1].refused and not found.candidates[0].refused
    ranked = [one.gain for one in found.candidates if one.refused is None]
    assert ranked == sorted(ranked, reverse=True)
    assert "would help most" in found.advice and found.advice.count("->") == 4


def test_steady_sliding_is_offered_where_it_is_stable(fit: FrictionFit) -> None:
    found = design(fit, speeds=[0.83])
    sliding = [one for one in found.candidates if one.kind == "steady sliding"]
    assert sliding
    for one in sliding:
        v = fit.constant("r").value * one.drive_speed
        assert one.greatest_slip == pytest.approx(v)
        # c + R^2 N mu'(v) > 0 with Conti's mu' = -(mu_s - mu_k) p/(1 + p v)^2
        mu_s, mu_k, p = fit.law_values
        assert 0.125**2 * 4.905 * (mu_s - mu_k) * p / (1 + p * v) ** 2 * 0.999 < 0.055


def test_what_cannot_be_designed(fit: FrictionFit) -> None:
    with pytest.raises(StickslipError, match="Every drive speed of a design"):
        design(fit, speeds=[-1.0])
    with pytest.raises(StickslipError, match="Every load of a design"):
        design(fit, loads=[0.0])
    with pytest.raises(StickslipError, match="law of slip speed alone"):
        design(replace(fit, law="LuGre"))
    calm = replace(fit, parameters=tuple(replace(q, value=0.36) if q.name == "mu_s" else q for q in fit.parameters))
    with pytest.raises(StickslipError, match="does not stick and slip"):
        design(calm)
    lost = replace(fit, correlation=((1.0, 1.0, 1.0),) * 3)
    with pytest.raises(StickslipError, match="nothing to build a design on"):
        design(lost)


def test_a_speed_at_which_a_body_may_slide_on_says_how_to_begin(fit: FrictionFit) -> None:
    """At the truth: carried along from rest it sticks and slips, let down where it would slide it slides on."""
    mu_s, mu_k, p = 0.65, 0.35, 15.0
    found = design(fit, speeds=np.linspace(1.0, 2.4, 15).tolist(), loads=[4.905])
    both = [one for one in found.candidates if one.both and one.refused is None]
    (pair, *_), w = standard_set("paper/rubber"), min(one.drive_speed for one in both) + 0.1
    v = 0.06 * w
    slides_at = 0.125 * 4.905 * ((mu_s - mu_k) / (1 + p * v) + mu_k) / 2.62
    begun = {"carried": {}, "let down": {"at_rest": True, "start_angle": slides_at}}
    swing = {}
    for way, start in begun.items():
        one = replace(pair, discs=(replace(pair.discs[0], drive_speed=w),), ripple=None, transient=0.0, **start)
        laser = emulate(one, 1).column("laser")
        swing[way] = float(np.ptp(laser[len(laser) // 2 :]))
    assert swing["carried"] > 20 * swing["let down"]
    advice = design(fit, speeds=[w], loads=[4.905]).advice
    assert "bring the drive up from rest" in advice
    assert "bring the drive up" not in design(fit, speeds=[0.6], loads=[4.905]).advice
