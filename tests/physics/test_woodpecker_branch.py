"""The woodpecker toy's periodic motion over the restitution of its beak, against 25 digits of its linear modes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import woodpecker_flows as flows
from crossed import crossings
from mpmath import mpf

from fmu_models import Strobe, branch, last_cycle, load
from fmu_models.sections.return_map import ReturnMap
from fmu_models.simulation.sections import Section

LISTED = [
    one
    for one in json.loads(Path(__file__).with_name("branches_reference.json").read_text())["points"]
    if one.get("system") == "woodpecker"
]
# restitution and the bird's angle farthest back where the lower edge lands without force, and where it does so without
# speed too; about how long each mode lasts, s
FORCELESS = mpf("0.527227492494648683517825525"), mpf("-0.5261205779050061003452748233128")
AT_REST = mpf("0.4423271807996077273236538625"), mpf("-0.5395475931385042162977878")
LASTS = {
    FORCELESS: (0.0284215, 0.0058917, 0.0111245, 0.0030231, 0.0005146, 0.0017957, 0.0341949, 0.0450877, 0.0115034),
    AT_REST: (0.0283803, 0.0056336, 0.0103888, 0.0031863, 0.0006759, 0.0020513, 0.0414193, 0.0536995, 0.0105852),
}


def test_the_reference_is_a_periodic_motion_that_lands_without_force():
    times = iter(LASTS[FORCELESS])
    restitution, lowest = FORCELESS
    landed = flows.impact(flows.to_the_landing(lowest, restitution, times, flat=False), "lower", 0)
    assert abs(flows.force(("lower", -1), landed)) < 1e-22
    assert abs(flows.to_the_jam(landed, times) - lowest) < 1e-22


def test_the_reference_is_a_periodic_motion_that_lands_without_force_and_speed():
    """From a release, where force, gap and its rate are zero, the sleeve swings like s - sin(s): it rests once more."""
    times = iter(LASTS[AT_REST])
    restitution, lowest = AT_REST
    arrived = flows.to_the_landing(lowest, restitution, times, flat=True)
    assert abs(flows.gap("lower", arrived)) < 1e-22 and abs(flows.gap_rate("lower", arrived)) < 1e-22
    assert abs(flows.force(("lower", -1), arrived)) < 1e-22
    assert abs(flows.to_the_jam(arrived, times) - lowest) < 1e-20


@pytest.fixture(scope="module")
def toy():
    return load("woodpecker")


def strobe(toy, restitution, period):
    return Strobe(toy, period=period, autonomous=True, parameters={"eN1": restitution})


@pytest.fixture(scope="module")
def found(toy):
    """From the default start, which is on the motion at 0.5, where the sleeve is jammed."""
    return branch(strobe(toy, 0.5, 0.146), "eN1", (0.36, 0.9))


def cyclic(word):
    word = [tuple(one) for one in word]
    return min(tuple(word[i:] + word[:i]) for i in range(len(word)))


@pytest.mark.parametrize(("listed", "known"), list(zip(LISTED, (FORCELESS, AT_REST), strict=True)))
def test_where_the_lower_edge_begins_to_hold_or_to_leave(found, listed, known):
    """The listed values are where a word changes, which at one of them is 1.3e-10 from where the force does."""
    value = float(known[0])
    (one,) = [one for one in found.special if abs(one.value - value) < 1e-6]
    assert (one.kind, one.contact) == ("detachment", "lower")
    assert one.value == pytest.approx(value, abs=1e-12) and one.value_with_event == pytest.approx(value, abs=1e-12)
    assert one.value == pytest.approx(listed["value"], abs=2e-10)
    assert one.period == pytest.approx(listed["period"], abs=1e-6)
    assert {cyclic(word) for word in one.words} == {cyclic(word) for word in listed["words"]}
    sides = [one.node.problem.own(side)[0].real for side in (one.multipliers, one.multipliers_with_event)]
    assert sides[0] == pytest.approx(sides[1], abs=1e-7)
    # at a third root of 4e-13, the half of the bracket, the listed ones are still on their way to each other
    assert sides == pytest.approx(listed["slopes"], abs=1e-7 if known is FORCELESS else 2e-4)


def lowest(toy, z):
    """The bird's angle farthest back on a motion, unknowns z."""
    start = dict(zip(toy.states, z[:6].tolist(), strict=True))
    turns = crossings(toy, "w_S", stop_time=float(z[6]), start=start, parameters={"eN1": float(z[7])})
    return float(turns.states["phi_S"].min())


def returns(toy, restitution):
    """From one jam to the next, as in the diagrams."""
    section, jams = Section("w_S"), lambda point: point.contacts["lower_friction"] == 0
    return ReturnMap(toy, "phi_S", section=section, accept=jams, cap=4.0, parameters={"eN1": restitution})


def test_a_flip_hides_beside_a_landing_without_speed(found, toy):
    kinds = [one.kind for one in found.special]
    place = kinds.index("flip")
    flip, before = found.special[place], found.special[place - 1]
    assert before.kind == "detachment" and 0.0 < flip.value - before.value < 3e-7
    assert returns(toy, flip.value).slope(lowest(toy, flip.node.z)) == pytest.approx(-1.0, abs=1e-6)


def test_twice_the_period_leaves_at_the_flip(found, toy):
    (flip,) = [one for one in found.special if one.kind == "flip"]
    (doubled,) = flip.switch(points=70)
    assert doubled.ends[0][0] == "start" and doubled.periods[0] == pytest.approx(2 * flip.period, rel=1e-6)
    node = doubled.nodes[-1]
    at, angle = returns(toy, node.value), lowest(toy, node.z)
    assert at(at(angle)) == pytest.approx(angle, abs=1e-11) and abs(at(angle) - angle) > 1e-4
    slope = at.slope(angle) * at.slope(at(angle))
    assert slope == pytest.approx(node.problem.own(node.multipliers)[0].real, rel=1e-6)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7])
def test_it_is_the_motion_of_the_return_map(found, toy, share):
    node = found.nodes[int(share * len(found.nodes))]
    at, angle = returns(toy, node.value), lowest(toy, node.z)
    assert at(angle) == pytest.approx(angle, abs=1e-12)
    back = at.crossing(angle)
    assert back is not None and back.time == pytest.approx(node.seen.length, abs=1e-12)
    assert at.slope(angle) == pytest.approx(node.problem.own(node.multipliers)[0].real, abs=1e-8)
    if share == 0.0:  # as the diagram has it
        assert node.value == 0.36 and angle == pytest.approx(-0.5601940214474878, abs=1e-9)


def test_where_two_impacts_come_at_once_it_jumps(found, toy):
    """What follows beak and upper edge depends on which is first: there the return map jumps off its fixed point."""
    jump = found.special[-1]
    assert found.ends[1][0] == "jump" and jump.kind == "tie"
    at, angle = returns(toy, jump.value), lowest(toy, jump.touch.z)
    before, after = at(angle - 1e-8), at(angle + 1e-8)
    assert before == pytest.approx(angle, abs=1e-7) and after - before > 1e-3


def test_the_height_is_left_out(toy, found):
    assert toy.cyclic == ["y"] and not load("bouncing_ball").cyclic
    cycle = last_cycle(toy, 4.0)
    assert cycle is not None and cycle.period == pytest.approx(0.145976065144, abs=1e-11)
    assert np.ptp(found.points[:, 0]) < 1e-12
