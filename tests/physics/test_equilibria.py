"""Branches of equilibria against closed forms, points of 40-digit arithmetic, and the cycles that are born there."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy

from fmu_models import Automaton, Fmu, Parameter, State, StickslipError, Switch, equilibria, load, simulate
from fmu_models.codegen.package import built_of
from fmu_models.continuation.branch import Branch
from fmu_models.lowering.lower import lower

POINTS = json.loads(Path(__file__).with_name("branches_reference.json").read_text())["points"]


@cache
def planar_hopf():
    return equilibria(load("planar_hopf"), "mu", (-1, 1), start={"x1": -1.5, "x2": 0.0})


@cache
def smooth():
    model = load("planar_multiple_crossing_smooth")
    return equilibria(model, "mu", (-0.01, 0.01), start={"x1": -0.05, "x2": 0.0})


def made(name, flows, switches=(), states=()):
    model = Automaton(name=name, title=name, source="here", states=states, flows=flows, switches=switches)
    return Fmu.open(built_of(lower(model)))


def cycles_of(special, **options):
    """The one branch of cycles that leaves at a special point."""
    (cycles,) = special.switch(**options)
    assert isinstance(cycles, Branch)
    return cycles


def test_a_discontinuous_hopf_point_and_its_cycle():
    (known,) = (one for one in POINTS if one["system"] == "planar_hopf")
    found = planar_hopf()
    (special,) = found.special
    assert special.kind == "discontinuous Hopf" and special.contact == "kink" and not special.turns
    assert special.value == pytest.approx(known["value"], abs=1e-14)
    axis, double = special.crossings["imaginary axis"], special.crossings["double"]
    assert axis == pytest.approx(known["set_valued"]["+-i"], abs=1e-13)
    assert double == pytest.approx(known["set_valued"]["double root -1"], abs=1e-13)
    assert special.frequency == pytest.approx(1.0, abs=1e-13)
    assert special.path(double)[0] == pytest.approx([-1.0, -1.0], abs=1e-7)
    assert found.points[:, 0] == pytest.approx(-1.5 * np.abs(found.values), abs=1e-12)
    # one point on either side lies close to the corner
    assert (np.diff(found.values) > 0.0).all() and (np.abs(found.values) < 1e-6).sum() == 2
    assert (found.stable == (found.values < 0.0)).all()
    cycles = cycles_of(special)
    assert cycles.values[-1] == 1.0 and cycles.stable.all()
    assert cycles.periods == pytest.approx(np.full(len(cycles.periods), known["cycle_period"]), rel=1e-10)
    assert cycles.multipliers[:, 1] == pytest.approx(np.full(len(cycles.periods), known["multiplier"]), rel=1e-8)


def test_a_multiple_crossing_where_a_focus_and_a_saddle_meet():
    """Equations (9) to (13)."""
    found = equilibria(load("planar_multiple_crossing"), "mu", (-1, 1), start={"x1": -2.0, "x2": -2.0})
    (special,) = found.special
    assert special.kind == "multiple crossing" and special.turns
    assert special.value == pytest.approx(0.0, abs=1e-14)
    assert special.crossings == {
        "zero": pytest.approx([0.25], abs=1e-13),
        "imaginary axis": pytest.approx([0.125], abs=1e-13),
        "double": pytest.approx([0.2285533906], abs=1e-10),
    }
    assert special.frequency == pytest.approx(0.5, abs=1e-13)
    assert sorted(special.path([0.25])[0].real) == pytest.approx([0.0, 0.5], abs=1e-13)
    left = found.points[:, 0] < 0.0
    assert found.points[left, 0] == pytest.approx(2.0 * found.values[left], abs=1e-12)
    assert found.points[~left, 0] == pytest.approx(-2.0 / 3.0 * found.values[~left], abs=1e-12)
    assert found.points[:, 1] == pytest.approx(2.0 * found.values, abs=1e-12)
    assert special.eigenvalues_after is not None and special.eigenvalues_after.real == pytest.approx(
        [1.75 + (73 / 16) ** 0.5, 1.75 - (73 / 16) ** 0.5], abs=1e-12
    )
    assert [kind for kind, _ in found.ends] == ["range", "range"]
    with pytest.raises(StickslipError, match="No branch was found"):
        special.switch()


def test_the_smoothed_system():
    hopf, fold = smooth().special
    assert (hopf.kind, hopf.criticality, fold.kind) == ("Hopf", "subcritical", "fold")
    assert hopf.value == pytest.approx(0.0025561976547262552, abs=1e-14)
    assert hopf.state["x1"] == pytest.approx(-0.0410676544604, abs=1e-12)
    assert hopf.frequency == pytest.approx(0.5, abs=1e-12)
    assert fold.value == pytest.approx(0.0051946258921224642, abs=1e-14)
    assert fold.state["x1"] == pytest.approx(-0.0220805395853, abs=1e-6)


def test_the_first_lyapunov_coefficient_tells_how_the_cycles_grow():
    """rho^2 = -alpha'(mu) (mu - mu_H)/(omega l1) for x = 2 rho Re(q exp(i omega t)), to first order."""
    found = smooth()
    hopf = found.special[0]
    cycles = cycles_of(hopf, points=40)
    # towards the homoclinic motion, whose saddle's rates add up to about 2 1/s
    assert "it grows with the period" in cycles.ends[1][1] and "a homoclinic motion is near" in cycles.ends[1][1]
    model, mu = load("planar_multiple_crossing_smooth"), float(cycles.values[0])
    begin = dict(zip(cycles.states, cycles.points[0].tolist(), strict=True))
    period = float(cycles.periods[0])
    j = np.array(hopf.node.seen.monodromy)
    q = np.linalg.eig(j).eigenvectors[:, 0]
    near = np.argsort(np.abs(found.points[:, 0] - hopf.state["x1"]))[:3]
    growth = np.polyfit(found.values[near], found.eigenvalues[near, 0].real, 1)[0]
    rho2 = growth * (hopf.value - mu) / (hopf.frequency * hopf.normal_form)
    run = simulate(model, period, start=begin, parameters={"mu": mu}, output_times=np.linspace(0, period, 400))
    assert np.ptp(run["x1"]) / 2 == pytest.approx(2.0 * rho2**0.5 * abs(q[0]), rel=0.05)
    # the branch of cycles goes through the one that is known at mu = 0
    assert np.interp(0.0, cycles.values[::-1], cycles.periods[::-1]) == pytest.approx(15.35753971563, rel=1e-3)
    growths = np.log(cycles.multipliers[::-1, 0].real)
    assert np.interp(0.0, cycles.values[::-1], growths) == pytest.approx(np.log(88.92905975), rel=1e-2)


@pytest.mark.parametrize("known", [one for one in POINTS if one.get("kind", "").startswith("Hopf")])
def test_the_disc_rig_loses_its_equilibrium(known):
    """Where the fall of the friction eats up the damping; the third derivative of the law says what is born."""
    values = known["other_parameters"]
    rig = load("disc_rig", contacts=["disc0"])
    found = equilibria(rig, "w0", (0.3, 3.0), parameters={**values, "w0": 2.0}, start={"theta": 0.2})
    (hopf,) = found.special
    assert hopf.value == pytest.approx(float(known["value_independent"]), abs=1e-12)
    assert (hopf.kind, hopf.criticality) == ("Hopf", "subcritical")
    assert hopf.frequency == pytest.approx((2.62 / 0.0548) ** 0.5, abs=1e-11)
    cycles = cycles_of(hopf, points=30)
    assert cycles.values[0] > hopf.value and not cycles.stable[0]
    assert cycles.periods[0] == pytest.approx(2 * np.pi / hopf.frequency, rel=1e-3)


def sliding():
    mu = Parameter("mu", 0.5, "1", "parameter")
    x, y = State("x", "1", "across"), State("y", "1", "along", start=0.5)
    wall = Switch(name="wall", function=x)
    return made("slides", {x: -wall.sign + y / 5 - x / 2, y: mu - y}, [wall], [x, y])


@pytest.mark.parametrize("mu", [0.5, 8.0])
def test_an_equilibrium_that_slides_leaves_its_surface(mu):
    """x = 0 while |mu|/5 < 1, else x = 2 (mu/5 -+ 1); from either."""
    found = equilibria(sliding(), "mu", (-10, 10), parameters={"mu": mu}, start={"x": max(0.0, 0.4 * mu - 2), "y": mu})
    assert [one.kind for one in found.special] == ["boundary equilibrium"] * 2
    assert [one.value for one in found.special] == pytest.approx([-5.0, 5.0], abs=1e-12)
    expected = 0.4 * found.values - 2.0 * np.clip(found.values / 5.0, -1.0, 1.0)
    assert found.points[:, 0] == pytest.approx(expected, abs=1e-12)
    last = found.special[1]
    assert list(last.eigenvalues) == [pytest.approx(-1.0), -np.inf]
    assert last.eigenvalues_after is not None and last.eigenvalues_after.real == pytest.approx([-0.5, -1.0], abs=1e-12)
    assert found.stable.all()


def test_a_pitchfork_of_equilibria():
    mu, x = Parameter("mu", -0.5, "1", "parameter"), State("x", "1", "state")
    found = equilibria(made("bends", {x: mu * x - x**3}, (), [x]), "mu", (-1, 1))
    (special,) = found.special
    assert special.kind == "pitchfork" and special.value == pytest.approx(0.0, abs=1e-9)
    for branch in special.switch():
        assert branch.values[-1] == 1.0 and branch.stable.all()
        assert np.abs(branch.points[:, 0]) == pytest.approx(np.sqrt(branch.values), abs=1e-12)


@pytest.mark.nightly_for("True")
@pytest.mark.parametrize("switches", [False, True])
def test_closed_loops_of_equilibria(switches):
    """mu^2 + x^2 = 1, with folds; mu^2 + |x| = 1, whose corners lie on a surface."""
    mu, x = Parameter("mu", 0.0, "1", "parameter"), State("x", "1", "state", start=1.0)
    kink = Switch(name="kink", function=x)
    rate = x * kink.sign if switches else x**2
    found = equilibria(made("loop", {x: 1 - mu**2 - rate}, [kink] if switches else (), [x]), "mu", (-2, 2))
    assert [kind for kind, _ in found.ends] == ["closed", "closed"]
    assert [one.kind for one in found.special] == ["discontinuous fold" if switches else "fold"] * 2
    assert [one.value for one in found.special] == pytest.approx([1.0, -1.0], abs=1e-12)
    height = np.abs(found.points[:, 0])
    assert found.values**2 + (height if switches else height**2) == pytest.approx(np.ones(len(height)), abs=1e-12)
    assert (found.stable == (found.points[:, 0] > 0.0)).all()


@pytest.mark.nightly
def test_folds_and_hopf_points_meet_at_a_bogdanov_takens_point():
    """x' = y, y' = b1 + b2 x + x^2 + x y: folds at b1 = b2^2/4, Hopf points at b1 = 0, b2 < 0 with omega^2 = -b2."""
    b1, b2 = Parameter("b1", -0.1, "1", "first"), Parameter("b2", -1.0, "1", "second")
    x, y = State("x", "1", "place", start=-0.1), State("y", "1", "rate")
    found = equilibria(made("takens", {x: y, y: b1 + b2 * x + x**2 + x * y}, (), [x, y]), "b1", (-0.5, 0.4))
    hopf, fold = found.curves("b2", (-2.0, 1.0))
    assert hopf.values == pytest.approx(np.zeros(len(hopf.values)), abs=1e-10)
    assert hopf.periods[:-1] == pytest.approx(2 * np.pi / np.sqrt(-hopf.seconds[:-1]), rel=1e-8)
    assert fold.values == pytest.approx(fold.seconds**2 / 4, abs=1e-10)
    for curve in (hopf, fold):
        (meeting,) = curve.meetings
        assert meeting.kind == "Bogdanov-Takens"
        assert list(meeting.parameters.values()) == pytest.approx([0.0, 0.0], abs=1e-9)
        assert np.abs(meeting.multipliers).max() < 1e-6


@pytest.mark.nightly_for("0.001", "100000.0")
@pytest.mark.parametrize("unit", [1e-6, 1e-3, 1e5])
def test_the_lyapunov_coefficient_is_told_of_states_in_any_unit(unit):
    """x = unit X, y = Y of the motion below: q of length one is along Y, so that l1 becomes 2 nu 2/(1 + unit^2)."""
    mu = Parameter("mu", -0.1, "1", "first")
    x, y = State("x", "1", "first", nominal=unit), State("y", "1", "second")
    growth = mu - 0.7 * (sympy.sin(x / unit) ** 2 + y**2)  # differences wider than that unit would meet other waves
    flows = {x: growth * x - unit * y, y: x / unit + growth * y}
    (hopf,) = equilibria(made("scaled", flows, (), [x, y]), "mu", (-1, 1)).special
    assert hopf.normal_form == pytest.approx(-1.4 * 2 / (1 + unit**2), rel=1e-6)
    assert hopf.criticality == "supercritical"


def test_the_lyapunov_coefficient_vanishes_at_a_bautin_point():
    """r' = mu r + nu r^3 - r^5 and l1 = 2 nu for a vector of length one."""
    mu, nu = Parameter("mu", -0.1, "1", "first"), Parameter("nu", -0.7, "1", "second")
    x, y = State("x", "1", "first"), State("y", "1", "second")
    growth = mu + nu * (x**2 + y**2) - (x**2 + y**2) ** 2
    (hopf,) = equilibria(made("bautin", {x: growth * x - y, y: x + growth * y}, (), [x, y]), "mu", (-1, 1)).special
    assert hopf.normal_form == pytest.approx(-1.4, rel=1e-9) and hopf.criticality == "supercritical"
    (meeting,) = hopf.curve("nu", (-1, 1)).meetings
    assert meeting.kind == "Bautin"
    assert list(meeting.parameters.values()) == pytest.approx([0.0, 0.0], abs=1e-8)


def test_a_centre_is_neither_super_nor_subcritical():
    """Van der Pol's x'' = mu (1 - x^2) x' - x: at mu = 0 all motions are cycles, whatever multiplies the cubic term."""
    mu, b = Parameter("mu", -0.1, "1", "damping"), Parameter("b", 1.0, "1", "of the cubic term")
    x, y = State("x", "1", "place"), State("y", "1", "speed")
    model = made("van_der_pol", {x: y, y: mu * (1 - b * x**2) * y - x}, (), [x, y])
    (hopf,) = equilibria(model, "mu", (-1, 1)).special
    assert (hopf.kind, hopf.criticality) == ("Hopf", "degenerate or undecided")
    assert hopf.normal_form == pytest.approx(0.0, abs=1e-12)
    assert not hopf.curve("b", (-1, 2)).meetings


def test_a_point_at_a_surface_has_no_curve():
    with pytest.raises(StickslipError, match="discontinuous Hopf has no curve"):
        planar_hopf().special[0].curve("mu")


@pytest.mark.parametrize(
    ("model", "over", "between", "given", "said"),
    [
        ("forced_stick_slip", "omega", (1, 2), {}, "is forced"),
        ("block_on_belt", "v_belt", (-1, 1), {"parameters": {"v_belt": 0}}, "does not stand alone: belt sticks"),
        ("planar_multiple_crossing", "mu", (-1, 1), {"parameters": {"mu": 0.5}}, "No equilibrium"),
        ("planar_hopf", "nu", (-1, 1), {}, "no parameter or input 'nu'"),
        ("planar_hopf", "mu", (2, 3), {}, "not between 2 and 3"),
        ("planar_hopf", "mu", (1, 1), {}, "needs a range"),
        ("planar_hopf", "mu", (-1, 1), {"of": "x3"}, "no state 'x3'"),
    ],
)  # fmt: skip
def test_what_has_no_branch_of_equilibria_is_told(model, over, between, given, said):
    with pytest.raises(StickslipError, match=said):
        equilibria(load(model), over, between, **given)


def test_the_woodpecker_rests_where_its_sleeve_jams():
    """T = (m_M + m_S) g is held by the lower edge, on which N = ((l_M + l_G) m_S - r_M (m_M + m_S)) g / h_M presses: it
    jams for mu2 >= T/N; phi_S = phi_M - m_S g l_G / c_phi, and nothing depends on the height."""
    toy = load("woodpecker")
    m_M, m_S, g, l_M, l_G, r_M, h_M = 0.0003, 0.0045, 9.81, 0.010, 0.015, 0.0031, 0.0058
    jams = (m_M + m_S) * h_M / ((l_M + l_G) * m_S - r_M * (m_M + m_S))
    for start in (-0.2217, -0.21):
        found = equilibria(toy, "mu2", (0.25, 0.5), start={"phi_S": start})
        assert [kind for kind, _ in found.ends] == ["surface", "range"]
        assert found.special[0].value == pytest.approx(jams, abs=2e-9)
        assert found.values[0] == pytest.approx(jams, abs=1e-6) and found.values[-1] == 0.5
        assert "lower_friction" in found.ends[0][1]
    found = equilibria(toy, "c_phi", (0.005, 0.006), start={"phi_S": -0.2217})
    assert [kind for kind, _ in found.ends] == ["range", "range"] and not found.special
    phi_M = -0.0006 / 0.0058
    place = found.states.index("phi_S")
    assert found.points[:, place] == pytest.approx(phi_M - m_S * g * l_G / found.values, abs=1e-12)
    # the bird swings, undamped; any height is as good; what leaves the wall comes back at once
    swing = np.sqrt(found.values / (7.0e-7 + m_S * l_G**2))
    assert np.sort(found.eigenvalues.imag, axis=1)[:, -1] == pytest.approx(swing, rel=1e-12)
    assert (np.isneginf(found.eigenvalues.real).sum(axis=1) == 3).all()
    assert (np.abs(found.eigenvalues).min(axis=1) < 1e-12).all()
