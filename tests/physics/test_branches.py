"""Branches against points that independent codes found: closed-form flows with 30 digits, impact equations, DOP853."""

from __future__ import annotations

import json
import math
from pathlib import Path

import hinge_flows
import numpy as np
import pytest
import sympy
from mechanisms import opened
from scipy.integrate import solve_ivp
from scipy.optimize import root

from fmu_models import (
    Automaton,
    Iteration,
    Map,
    Parameter,
    State,
    StickslipError,
    Strobe,
    Switch,
    branch,
    branches,
    load,
    simulate,
)
from fmu_models.continuation.special.discontinuous import shrinking
from fmu_models.continuation.special.growing_multiplier import why_huge
from fmu_models.maps.logistic import MAP as LOGISTIC

pytestmark = pytest.mark.digits

POINTS = [
    one
    for one in json.loads(Path(__file__).with_name("branches_reference.json").read_text())["points"]
    if "branch" in one
]
# as the file calls them, and as a branch does
KINDS = {
    "grazing-sliding corner: stick appears": "grazing-sliding corner",
    "stick on disc 0 disappears": "grazing-sliding corner",
    "symmetry-breaking pitchfork": "pitchfork",
    "Hopf (cycle shrinks to the equilibrium)": "Hopf",
    "end of the doubled branch at the flip IV/III": "flip of the parent",
}
# of the parameter, as the points are known: smooth ones, those where the word changes
SMOOTH, DISCONTINUOUS = 1e-11, 1e-10


def of(branch_name):
    return [one for one in POINTS if one["branch"] == branch_name]


def cyclic(word):
    word = [tuple(one) for one in word]
    return min((tuple(word[i:] + word[:i]) for i in range(len(word))), default=())


def as_complex(pairs):
    return sorted((complex(re, im) for re, im in pairs), key=lambda m: (abs(m), m.imag))


def near(found, known, within):
    return all(abs(a - b) <= within * max(1.0, abs(b)) for a, b in zip(found, known, strict=True))


def counted(special, multipliers):
    """In order; those that are known leave out the 1 of a motion that nothing forces."""
    return sorted(special.node.problem.own(multipliers), key=lambda m: (abs(m), m.imag))


def apart(special, known):
    """How far a special is from the state of a known point, whose phase may be another period of the forcing."""
    if not known["state"] or special.node.problem.autonomous:
        return 0.0
    turns = known["strobe_phase"] / (2 * math.pi)
    images = [special.at(turns + k) for k in range(known["forcing_periods"])]
    return min(np.abs(x - known["state"]).max() for x in images)


def check(known, specials, smooth=SMOOTH, discontinuous=DISCONTINUOUS):
    """The one of the specials that a known point is, judged."""
    kind = KINDS.get(known["kind"], known["kind"])
    value = float(known.get("value_independent") or known.get("value_by_bordered_newton") or known["value"])
    changes = "words" in known
    within = (discontinuous if changes else smooth) * max(1.0, abs(value))
    found = [one for one in specials if one.kind == kind and abs(one.value - value) <= within]
    assert found, f"{kind} at {value}: {[(one.kind, one.value) for one in specials]}"
    one = min(found, key=lambda special: apart(special, known))
    own = counted(one, one.multipliers)
    without = known.get("multipliers", known.get("multipliers_without_event"))
    if without is not None and one.kind != "Hopf":
        assert near(own, as_complex(without), 1e-7)
    if known["state"] and one.node.problem.autonomous:
        assert one.period == pytest.approx(known["state"][-1], abs=1e-9)
    if changes:
        # an empty one says that none was known beyond: from where the pair touches both walls at once, motions go on
        # that touch one of them, and come together at the pitchfork
        words = {cyclic(w) for w in known["words"] if w}
        assert words <= {cyclic(w) for w in one.words} and (
            words == {cyclic(w) for w in one.words} or [] in known["words"]
        )
        with_event = known["multipliers_with_event"]
        if isinstance(with_event, list):
            assert near(counted(one, one.multipliers_with_event), as_complex(with_event), 1e-6)
            crossings = known["set_valued_crossings (share of the event side)"]
            assert set(one.crossings) == set(crossings)
            for name, shares in crossings.items():
                assert one.crossings[name] == pytest.approx(shares, abs=1e-8)
    assert apart(one, known) < 2e-6
    return one


@pytest.fixture(scope="module")
def support():
    return load("discontinuous_support")


@pytest.mark.nightly_for("10-1.4-4")
@pytest.mark.parametrize(("ks", "up_to", "many"), [(10, 1.4, 4), (50, 1.4, 4), (300, 1.5, 6)])
def test_the_support_of_table_1(support, ks, up_to, many):
    found = branch(Strobe(support, forcing="omega", parameters={"ks": ks, "omega": 0.8}), "omega", (0.8, up_to))
    assert len(found.special) == many
    for known in of(f"support_T1_ks{ks}"):
        check(known, found.special)
    assert [kind for kind, _ in found.ends] == ["range", "range"]


def test_the_support_of_table_2(support):
    system = Strobe(support, forcing="omega", parameters={"ks": 300, "cs": 0.6, "g": 1.6, "omega": 0.98})
    found = branch(system, "omega", (0.8, 1.0), settle=True)
    for known in of("support_T2_P1_down"):
        check(known, found.special)
    # beside it, at 3e-6, the doubled branch loses its contact already; it ends at the other flip of its parent
    (lower, upper) = [one for one in found.special if one.kind == "flip"]
    (doubled,) = lower.switch()
    assert len(doubled.special[0].words[0]) == 6 and doubled.special[0].value == pytest.approx(lower.value, abs=2e-6)
    assert doubled.ends[1][0] == "flip" and doubled.special[-1].value == pytest.approx(upper.value, abs=1e-11)


@pytest.fixture(scope="module")
def stick_slip():
    system = Strobe(load("forced_stick_slip"), forcing="omega", every=2)
    return branches(system, "omega", (1.4, 2.0), longest=8).branches


def test_stick_slip_is_a_closed_loop(stick_slip):
    loop = stick_slip[0]
    assert [kind for kind, _ in loop.ends] == ["closed", "closed"]
    kinds = sorted(one.kind for one in loop.special)
    assert kinds == ["Neimark-Sacker", "flip", "fold", "fold", "grazing-sliding corner", "grazing-sliding corner"]
    for known in [one for one in of("stick_slip_n2") if "strobe_phase" in one]:
        check(known, loop.special)
    (corner,) = [one for one in loop.special if abs(one.value - 1.514070716793103703) < 1e-10]
    assert corner.crossings["+1"] == pytest.approx([0.6964328953], abs=1e-9)


def test_normal_forms_of_stick_slip(stick_slip):
    """Of an independent program, from the same states at phase 0."""
    loop = stick_slip[0]
    (torus,) = [one for one in loop.special if one.kind == "Neimark-Sacker"]
    assert torus.normal_form == pytest.approx(5.39991, abs=5e-6) and torus.criticality == "subcritical"
    (flip,) = [one for one in loop.special if one.kind == "flip"]
    assert flip.normal_form == pytest.approx(1.166537, abs=5e-7) and flip.criticality == "supercritical"
    fold = next(one for one in loop.special if one.kind == "fold")
    assert math.isnan(fold.normal_form) and not fold.criticality
    with pytest.raises(StickslipError, match="leaves at the fold"):
        fold.switch()


def test_the_normal_form_of_a_map():
    """Logistic, r = 3: A = -1, B = -6, C = 0, so c = B^2 / 4."""
    found = branch(Iteration.of(LOGISTIC, {"r": 2.8}), "r", (2.5, 3.2), start={"x": 0.64})
    (flip,) = found.special
    assert flip.normal_form == pytest.approx(9.0, rel=1e-9)


def test_a_closed_loop_of_a_map():
    """x -> x + (1 - (mu/2)^2 - x^2)/4: fixed points on an ellipse, of slope 1 - x/2."""
    mu, x = Parameter("mu", 0.0, "1", "parameter"), State("x", "1", "state", start=0.9)
    rule = {x: x + (1 - mu**2 / 4 - x**2) / 4}
    ellipse = Map(name="ellipse", title="ellipse", source="here", states=[x], rule=rule, box={x: (-2.0, 2.0)})
    found = branch(Iteration.of(ellipse), "mu", (-3.0, 3.0))
    assert [kind for kind, _ in found.ends] == ["closed", "closed"]
    assert [(one.kind, one.value) for one in found.special] == [("fold", pytest.approx(v, abs=1e-11)) for v in (2, -2)]
    assert found.values**2 / 4 + found.points[:, 0] ** 2 == pytest.approx(np.ones(len(found.values)), abs=1e-11)
    assert found.multipliers[:, 0].real == pytest.approx(1 - found.points[:, 0] / 2, abs=1e-11)


def test_a_loop_that_goes_once_round_an_angle_is_closed():
    """x -> x + Omega - K/(2 pi) sin(2 pi x) mod 1: fixed points at Omega = K/(2 pi) sin(2 pi x)."""
    omega, x = Parameter("omega", 0.0, "1", "turns"), State("x", "1", "angle", start=0.1)
    rule = {x: x + omega - sympy.Rational(2, 5) / sympy.pi * sympy.sin(2 * sympy.pi * x)}
    circle = Map(name="circle", title="c", source="here", states=[x], rule=rule, modulus={x: sympy.Integer(1)})
    found = branch(Iteration.of(circle), "omega", (-0.2, 0.2), settle=True)
    assert [kind for kind, _ in found.ends] == ["closed", "closed"]
    edge = 0.4 / np.pi
    assert [one.value for one in found.special] == pytest.approx([edge, -edge], rel=1e-12)


def test_what_branches_off_stick_slip(stick_slip):
    (six_seven,) = [one for one in stick_slip if one.every == 4]
    assert [kind for kind, _ in six_seven.ends] == ["start", "flip"]
    for known in of("stick_slip_n4_VI_down"):
        check(known, six_seven.special)
    (eight,) = [one for one in stick_slip if one.every == 8]
    assert eight.ends[1][0] == "parent" and not eight.stable.any()


@pytest.fixture(scope="module")
def ball():
    parameters = {"g": 1.0, "omega": 1.0, "e": 0.5, "A": 1.2}
    system = Strobe(load("bouncing_ball"), forcing="omega", parameters=parameters)
    phase = 0.51016360854330479
    flight, speed = 2 * math.pi - phase, math.pi
    start = {"x": 1.2 * math.sin(phase) + speed * flight - flight**2 / 2, "v": speed - flight}
    return branch(system, "A", (0.9, 2.6), start=start)


@pytest.mark.nightly
def test_the_ball_to_four_impacts(ball):
    for known in [*of("ball_e0.5_up"), *of("ball_e0.5_down")]:
        check(known, ball.special)
    assert "chatter" in [kind for kind, _ in ball.ends]


def test_a_multiplier_that_grows_towards_a_grazing_is_told(ball):
    """It is as the inverse of the speed of the impact that is about to be lost."""
    place = max(one for one, met in zip(ball.places, ball.special, strict=True) if met.kind == "grazing, rigid")
    node = max(ball.nodes[place - 1 : place + 1], key=lambda one: len(one.word))
    event = min(node.seen.events, key=lambda one: one.value)
    weaker = list(shrinking(node, event, 4, 1e-5))
    said = why_huge([one for _, one in weaker])
    assert f"as an event of 'table' weakens, to {weaker[-1][0].value:.2g}: a grazing is near" in said
    assert why_huge([weaker[0][1], weaker[-1][1]]) == said  # however few there are between the two
    assert why_huge(ball.nodes[:1]) == ""


def symmetric_pair(speed):
    """D of the symmetric motion that hits each wall twice, the second time at a speed: its impact equations."""
    e = 0.6

    def equations(unknown):
        first, second, u, d = unknown  # times at one wall, velocity between them
        towards = np.cos(second) - e * speed
        return [
            u - np.cos(second) - speed,
            d / 2 + np.sin(first) + u * (second - first) - d / 2 - np.sin(second),
            d / 2 + np.sin(second) + towards * (first + np.pi - second) + d / 2 + np.sin(first),
            np.cos(first) - u + e * (towards + np.cos(first)),
        ]

    return root(equations, [1.77, 3.81, -0.78, 0.5], tol=1e-13).x[3]


def test_the_impact_pair():
    system = Strobe(load("impact_pair"), forcing="omega", parameters={"D": 6.0})
    found = branch(system, "D", (0.4, 13.0), start={"x": -3.0, "v": -2.0}, settle=True, points=60)
    for known in [*of("pair_e0.6_up"), *of("pair_e0.6_down")]:
        check(known, found.special)
    (known,) = [one for one in of("pair_e0.6_down") if "pitchfork" in one["kind"]]
    pitchfork = min(found.special, key=lambda one: abs(one.value - known["value"]))
    twins = pitchfork.switch(points=80)
    assert pitchfork.breaks_symmetry and "symmetry-breaking pitchfork" in found.summary()
    assert pitchfork.criticality == "supercritical" and all(twin.stable[:6].all() for twin in twins)
    for known in [*of("pair_e0.6_asymmetric_0"), *of("pair_e0.6_asymmetric_1")]:
        check(known, [special for twin in twins for special in twin.special])
    # both come to where the symmetric motion touches both walls at once: it is found from motions that touch one
    assert [twin.ends[1][0] for twin in twins] == ["parent", "parent"]
    # it goes on with an impact more at each; two motions leave that touch one of them
    (both,) = [one for one in found.special if abs(one.value - 0.5008950514411158) < 1e-9]
    beyond = next(node for node in found.nodes if len(node.word) == 4)
    speed = min(event.value for event in beyond.seen.events)
    assert speed < 0.01 and beyond.value == pytest.approx(symmetric_pair(speed), abs=1e-9)
    assert both.value == pytest.approx(symmetric_pair(0.0), abs=1e-10)
    assert all(twin.special[-1].value == pytest.approx(both.value, abs=1e-10) for twin in twins)
    one, other = both.switch(points=2)
    touched = [[wall for wall, *_ in leaving.words[0]] for leaving in (one, other)]
    assert sorted(map(sorted, touched)) == [["left", "left", "right"], ["left", "right", "right"]]
    for leaving in (one, other):
        speed = min(event.value for event in leaving.nodes[0].seen.events)
        assert (leaving.values[0] - both.value) / speed == pytest.approx(1.3972, abs=5e-4)
    assert one.values[0] == pytest.approx(other.values[0], abs=1e-8)
    # the twins come there too, their weakest impact ever weaker, with the same slope
    for twin in twins:
        near = twin.nodes[np.abs(twin.values - both.value - 0.002).argmin()]
        speed = min(event.value for event in near.seen.events)
        assert len(near.word) == 3 and (near.value - both.value) / speed == pytest.approx(1.3972, abs=2e-3)


PAPER = {"N0": 5.0, "mu_s0": 0.65, "mu_k0": 0.35, "p0": 15.0}
LINER = {"N0": 5.0, "mu_s0": 0.5, "mu_k0": 0.33, "p0": 20.0}


@pytest.mark.parametrize(
    ("name", "law", "speed", "between"),
    [("disc_a_paper/rubber_N5.0", PAPER, 2.0, (1.5, 2.6)), ("disc_a_liner/rubber_N5.0", LINER, 1.2, (0.8, 1.5))],
)
def test_the_disc_rig_loses_its_stick(name, law, speed, between):
    system = Strobe(load("disc_rig", contacts=["disc0"]), period=0.91, autonomous=True, parameters={**law, "w0": speed})
    found = branch(system, "w0", between, settle=True)
    stick, hopf = of(name)
    check(stick, found.special)
    check(hopf, found.special)


def test_the_hinge():
    fmu = load("hinge_clearance")
    upper = branch(Strobe(fmu, forcing="f"), "f", (0.35, 0.45), start={"x": -5.19128647e-6, "v": 0.03296490834399})
    check(of("hinge_111")[0], upper.special)
    (jump,) = [one for one in upper.special if one.kind == "jump"]
    assert jump.value == pytest.approx(0.37260874, abs=5e-9)
    assert upper.ends[0][0] == "jump"
    (flip,) = [one for one in upper.special if one.kind == "flip"]
    (doubled,) = flip.switch()
    check(of("hinge_222")[0], doubled.special)


def two_discs(normal_force, w1, w0, period):
    law = {"mu_s0": 0.65, "mu_k0": 0.35, "p0": 15.0, "mu_s1": 0.65, "mu_k1": 0.35, "p1": 15.0}
    parameters = {**law, "N0": normal_force, "N1": normal_force, "w1": w1, "w0": w0}
    return Strobe(load("disc_rig"), period=period, autonomous=True, parameters=parameters)


def test_one_of_two_discs_loses_its_stick():
    found = branch(two_discs(4.8693068, -0.5, 1.1, 1.26), "w0", (0.9, 1.5), settle=True)
    check(of("disc_b_paper/rubber_w1-.5_N4.8693068")[0], found.special)


def test_two_discs_exchange_their_stick():
    found = branch(two_discs(4.905, 0.83, 0.6, 1.1), "w0", (0.3, 1.2), settle=True)
    (exchange,) = found.special
    assert exchange.value == pytest.approx(0.83, abs=1e-12) and exchange.kind == "sliding exchange"
    assert {word[0][0] for word in exchange.words} == {"disc0", "disc1"}
    assert [kind for kind, _ in found.ends] == ["range", "range"]


def simulate_to_zero(system, start):
    """The state at phase 0, from the one where the points of the hinge are told."""
    late = 3.2781872347608427 / (2 * math.pi)
    run = simulate(
        system.fmu,
        1 / 0.36554,
        start_time=late / 0.36554,
        start=start,
        parameters=system.values,
        output_times=[1 / 0.36554],
    )
    return {name: float(run[name][0]) for name in system.states}


@pytest.mark.nightly
def test_the_hinge_breaks_its_symmetry():
    system = Strobe(load("hinge_clearance"), forcing="f", parameters={"f": 0.36554})
    start = {"x": 0.009062681990670852, "v": 0.0201728380673976}
    start = simulate_to_zero(system, start)
    found = branch(system, "f", (0.36, 0.38), start=start)
    grazing, turn = of("hinge_low_down")
    check(grazing, found.special, discontinuous=1e-9)
    # called a fold there: the parameter turns, where the motion becomes its own mirror twin
    (pitchfork,) = [one for one in found.special if one.kind == "pitchfork"]
    assert pitchfork.value == pytest.approx(turn["value"], abs=1e-10) and pitchfork.breaks_symmetry
    # of the symmetric motion itself, by 24 digits: its half map has a derivative with the eigenvalue 1 there, where the
    # listed value, of the motion without symmetry, misses that by 4e-9
    x, v, f = 0.0066220869368431714785, 0.016372785895150997606, 0.3638571561798623223915
    begin = 0.4597949357630635 / f
    entries = [(1, begin + 0.13376678), (-1, begin + 0.54680646)]
    assert np.abs(hinge_flows.broken(x, v, 2 * math.pi * f, begin, entries)).max() < 1e-11
    assert pitchfork.value == pytest.approx(f, abs=1e-12)
    assert near(counted(pitchfork, pitchfork.multipliers), as_complex(turn["multipliers"]), 1e-7)
    # over a range that ends soon beyond it a step is as long as from there to the symmetric motions
    short = branch(system, "f", (0.3635, 0.3665), start=start)
    (again,) = [one for one in short.special if one.kind == "pitchfork"]
    assert again.value == pytest.approx(pitchfork.value, abs=1e-11) and short.ends[0] == short.ends[1]


def test_cycles_of_an_unforced_flow_say_their_turns():
    """Roessler's flow at a = b = .2: one turn, two from c = 2.83 on, four from 3.84 on."""
    x, y, z = (State(name, "1", "state") for name in "xyz")
    a, b, c = (Parameter(name, value, "1", name) for name, value in (("a", 0.2), ("b", 0.2), ("c", 2.6)))
    unit = Parameter("unit", 1.0, "s", "unit of time")
    flows = {x: -(y + z) / unit, y: (x + a * y) / unit, z: (b + z * (x - c)) / unit}
    half = Switch(name="half", function=x, unit="1", description="half space")
    flow = Automaton(name="roessler", title="Roessler", source="1976", states=[x, y, z], flows=flows, switches=[half])
    system = Strobe(opened(flow), period=5.8, autonomous=True)
    found = branches(system, "c", (2.5, 4.0), settle=True, longest=4, start=[2.0, -3.0, 0.1])
    assert [member.every for member in found.branches] == [1, 2, 4]
    flips = [special for special in found.special if special.kind == "flip"]
    for flip in flips:  # by another integrator, along one turn and along two

        def rates(t, u, c=flip.value):
            f = [-(u[1] + u[2]), u[0] + 0.2 * u[1], 0.2 + u[2] * (u[0] - c)]
            J = np.array([[0, -1, -1], [1, 0.2, 0], [u[2], 0, u[0] - c]])
            return np.concatenate([f, (J @ u[3:].reshape(3, 3)).ravel()])

        begin = [*flip.state.values(), *np.eye(3).ravel()]
        end = solve_ivp(rates, (0.0, flip.period), begin, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        assert end[:3] == pytest.approx(begin[:3], abs=1e-9)
        assert np.linalg.eigvals(end[3:].reshape(3, 3)).real.min() == pytest.approx(-1.0, abs=1e-7)
    assert found.branches[1].periods[0] == pytest.approx(2 * flips[0].period, rel=1e-3)
    assert "turns 2" in found.branches[1].summary()
