"""Special points as curves in two parameters, against closed forms and rows that DOP853 and mpmath found."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fmu_models import Iteration, StickslipError, Strobe, branch, load
from fmu_models.maps.henon import MAP as HENON

ROWS = {
    one["curve"]: one["rows"]
    for one in json.loads(Path(__file__).with_name("branches_reference.json").read_text())["points"]
    if "curve" in one
}


def check(curve, rows, second, within):
    """At the values of the rows: the first parameter and the state at phase 0."""
    for row in rows:
        (found,) = curve.at(row[second])
        assert found.parameters[second] == pytest.approx(row[second], abs=1e-14)
        assert found.parameters["omega"] == pytest.approx(row["omega"], abs=within)
        assert list(found.state.values()) == pytest.approx(row["state"], abs=within)


@pytest.fixture(scope="module")
def support():
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={"ks": 10, "omega": 0.8})
    return branch(system, "omega", (0.8, 1.4)).special


@pytest.fixture(scope="module")
def henon():
    return branch(Iteration.of(HENON, {"a": 0.1, "b": 0.3}), "a", (-2, 4), start={"x": 0.8, "y": 0.24}).special


@pytest.fixture(scope="module")
def stick_slip():
    return branch(Strobe(load("forced_stick_slip"), forcing="omega", every=2), "omega", (1.4, 2.0)).special


def test_a_corner_over_the_force(stick_slip):
    corner = min(stick_slip, key=lambda one: one.value)
    curve = corner.curve(second="f0")
    assert (curve.seconds.min(), curve.seconds.max()) == pytest.approx((0.05, 0.2))
    check(curve, ROWS["corner A in (omega, f0)"], "f0", 1e-11)
    assert [kind for kind, _ in curve.ends] == ["range", "range"]


def test_a_fold_over_the_stiffness_of_the_support(support):
    fold = max((one for one in support if one.kind == "fold"), key=lambda one: one.value)
    check(fold.curve("ks", (5, 60)), ROWS["fold in (omega, ks), Table 1"], "ks", 1e-11)


def test_grazing_of_the_support(support):
    """Where the amplitude of the free motion is the gap."""
    grazing = support[0]
    assert grazing.kind == "grazing, compliant"
    curve = grazing.curve("g", (3.0, 8.0))
    free = 0.5 / np.hypot(1.0 - curve.values**2, 0.05 * curve.values)
    assert curve.seconds == pytest.approx(free, abs=1e-11)
    assert np.ptp(curve.seconds) == pytest.approx(5.0)


def test_resonances_of_the_henon_map(henon):
    """Folds at a = -(1 - b)^2/4, flips at a = 3 (1 - b)^2/4; the other multiplier is b or its negative."""
    fold = next(one for one in henon if one.kind == "fold").curve("b", (-1.5, 0.9))
    assert fold.values == pytest.approx(-((1 - fold.seconds) ** 2) / 4, abs=1e-11)
    (met,) = fold.meetings
    assert met.kind == "1:1 resonance" and met.parameters == pytest.approx({"a": -1.0, "b": -1.0}, abs=1e-10)
    flip = next(one for one in henon if one.kind == "flip").curve("b", (-1.1, 0.9))
    assert flip.values == pytest.approx(3 * (1 - flip.seconds) ** 2 / 4, abs=1e-11)
    (met,) = flip.meetings
    assert met.kind == "1:2 resonance" and met.parameters == pytest.approx({"a": 3.0, "b": -1.0}, abs=1e-10)


def test_curves_meet(stick_slip):
    """Where two curves meet, each says so by functions of its own: the fold and the Neimark-Sacker point, the corner
    and the flip."""
    (torus,) = [one for one in stick_slip if one.kind == "Neimark-Sacker"]
    fold = max((one for one in stick_slip if one.kind == "fold"), key=lambda one: one.value)
    (met,) = fold.curve("f0", (0.08, 0.12)).meetings
    assert met.kind == "1:1 resonance"
    torus = torus.curve("f0", (0.08, 0.12))
    assert [kind for kind, _ in torus.ends] == ["1:1 resonance", "range"]
    assert (torus.seconds[0], torus.values[0]) == pytest.approx(
        (met.parameters["f0"], met.parameters["omega"]), abs=1e-7
    )
    corner, flip = (next(one for one in stick_slip if abs(one.value - value) < 1e-3) for value in (1.66769, 1.71298))
    (met,) = corner.curve("f0", (0.08, 0.12)).meetings
    assert met.kind == "grazing-sliding corner and flip"
    flip = flip.curve("f0", (0.08, 0.12))
    assert [kind for kind, _ in flip.ends] == [met.kind, "range"]
    assert flip.meetings[0].parameters == pytest.approx(dict(met.parameters), abs=2e-9)


def test_the_stick_of_a_disc_lost_over_its_load():
    """An autonomous motion: as the branch of another load has it."""
    law = {"mu_s0": 0.65, "mu_k0": 0.35, "p0": 15.0}
    lost = []
    for load_, speed in ((5.0, 2.0), (4.0, 1.6)):
        parameters = {**law, "N0": load_, "w0": speed}
        system = Strobe(load("disc_rig", contacts=["disc0"]), period=0.91, autonomous=True, parameters=parameters)
        lost.append({one.kind: one for one in branch(system, "w0", (1.5, 2.6), settle=True).special})
    (found,) = lost[0]["grazing-sliding corner"].curve("N0", (4.0, 5.0)).at(4.0)
    assert found.parameters["w0"] == pytest.approx(lost[1]["grazing-sliding corner"].value, abs=1e-10)
    assert found.period == pytest.approx(lost[1]["grazing-sliding corner"].period, abs=1e-9)
    # where friction falls as fast as the damper brakes; the stiffness is free, and the share of a period that an
    # equilibrium is looked at over is no resonance
    hopf = lost[0]["Hopf"].curve("N0", (4.5, 5.5))
    falls = hopf.seconds * 0.125**2 * law["p0"] * 0.3 / 0.055
    assert hopf.values == pytest.approx((np.sqrt(falls) - 1.0) / (0.06 * law["p0"]), abs=1e-11)
    assert lost[0]["Hopf"].curve("k", (1.5, 4.0)).meetings == ()


def test_discs_of_one_speed_exchange_their_stick():
    """Whatever the speed, and the load of one of them."""
    law = {"mu_s0": 0.65, "mu_k0": 0.35, "p0": 15.0, "mu_s1": 0.65, "mu_k1": 0.35, "p1": 15.0}
    parameters = {**law, "N0": 4.905, "N1": 4.905, "w1": 0.83, "w0": 0.78}
    system = Strobe(load("disc_rig"), period=1.1, autonomous=True, parameters=parameters)
    (exchange,) = branch(system, "w0", (0.75, 0.9), settle=True).special
    speeds = exchange.curve("w1", (0.8, 0.87))
    assert speeds.values == pytest.approx(speeds.seconds, abs=1e-12) and np.ptp(speeds.seconds) == pytest.approx(0.07)
    loads = exchange.curve("N0", (4.7, 5.1))
    assert loads.values == pytest.approx(np.full(len(loads.values), 0.83), abs=1e-12)


def test_what_has_no_curve(henon):
    fold = next(one for one in henon if one.kind == "fold")
    with pytest.raises(StickslipError, match="has no parameter 'c'"):
        fold.curve("c", (0.0, 1.0))
    with pytest.raises(StickslipError, match="give a range that holds it"):
        fold.curve("b", (0.5, 1.0))
    with pytest.raises(StickslipError, match="name another parameter"):
        fold.curve("a", (0.0, 1.0))
