"""Points of codimension 2 on curves, and curves where branches cross: normal forms as maps, and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy
from mechanisms import MASS, opened

from fmu_models import Iteration, StickslipError, Strobe, branch, branches, load
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.maps import Map
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter, State
from fmu_models.language.stops import Stop

pytestmark = pytest.mark.digits

X, Y = State("x", "1", "first"), State("y", "1", "second")
A, B, H = (Parameter(name, 0.0, "1", "unfolds") for name in "abh")
R = X**2 + Y**2
COS, SIN, GROWS = sympy.cos(1 + H), sympy.sin(1 + H), 1 + A + B * R - R**2
TURN = {X: GROWS * (COS * X - SIN * Y), Y: GROWS * (SIN * X + COS * Y)}


def iterated(rule, start, **values):
    """A map with that rule, and where a motion of it begins."""
    box = dict.fromkeys(rule, (-1.0, 1.0))
    declared = Map(name="normal_form", title="normal form", source="test", states=list(rule), rule=rule, box=box)
    return Iteration.of(declared, values), {x.name: one for x, one in zip(rule, start, strict=False)}


def special(rule, kind, between, start=(0.0, 0.0), **values):
    """The special of a kind on the branch over a."""
    system, begin = iterated(rule, start, **values)
    return next(one for one in branch(system, "a", between, start=begin).special if one.kind == kind)


def test_a_cusp():
    """x -> x + a + b x - x^3 has its folds at b = 3 x^2, a = -2 x^3."""
    fold = special({X: X + A + B * X - X**3}, "fold", (-1.0, 1.0), start=(-0.9,), b=0.3)
    curve = fold.curve("b", (-0.5, 0.5))
    assert np.abs(curve.values) == pytest.approx(2.0 * (np.clip(curve.seconds, 0.0, None) / 3.0) ** 1.5, abs=1e-10)
    assert {np.sign(curve.values[0]), np.sign(curve.values[-1])} == {-1.0, 1.0}
    (met,) = curve.meetings
    assert met.kind == "cusp" and met.parameters == pytest.approx({"a": 0.0, "b": 0.0}, abs=1e-9)


@pytest.mark.nightly_for("Neimark-Sacker-rule2-Chenciner")
@pytest.mark.parametrize(
    ("kind", "rule", "name"),
    [
        ("flip", {X: -(1 + A) * X + B * X**3 - X**5}, "generalized flip"),
        ("pitchfork", {X: (1 + A) * X + B * X**3 - X**5}, "degenerate pitchfork"),
        ("Neimark-Sacker", TURN, "Chenciner"),
    ],
)
def test_where_a_cubic_term_vanishes(kind, rule, name):
    """At b = 0."""
    met = special(rule, kind, (-0.2, 0.2), a=-0.1, b=0.3).curve("b", (-0.5, 0.5)).meetings
    assert [one.kind for one in met] == [name]
    assert met[0].parameters == pytest.approx({"a": 0.0, "b": 0.0}, abs=1e-8)


def test_a_bent_curve_ends_at_its_range():
    """The flips at a = 4 b^2: near a = 0.1 the curve leaves the range where its tangent does not."""
    curve = special({X: -(1 + A - 4 * B**2) * X + X**3}, "flip", (-0.3, 0.1), a=-0.1).curve("b", (-0.5, 0.5))
    assert curve.values == pytest.approx(4 * curve.seconds**2, abs=1e-12) and curve.values.max() <= 0.1 + 1e-15
    assert [kind for kind, _ in curve.ends] == ["range", "range"]
    assert (np.diff(curve.seconds) > 0.0).all() or (np.diff(curve.seconds) < 0.0).all()


def test_strong_resonances():
    """The angle of the pair is 1 + h."""
    curve = special(TURN, "Neimark-Sacker", (-0.2, 0.2), a=-0.1, b=-1.0).curve("h", (-0.8, 2.0))
    met = {one.kind: one.parameters["h"] for one in curve.meetings}
    assert met == pytest.approx({"1:4 resonance": math.pi / 2 - 1, "1:3 resonance": 2 * math.pi / 3 - 1}, abs=1e-8)


def test_a_fold_meets_a_flip():
    """A fold in one direction at a = 0, a flip in the other at h = 0.5."""
    rule = {X: X + A - X**2, Y: -(0.5 + H) * Y - Y**3}
    (met,) = special(rule, "fold", (-0.5, 0.5), start=(0.3, 0.0), a=0.1).curve("h", (-0.4, 0.9)).meetings
    assert met.kind == "fold-flip" and met.parameters == pytest.approx({"a": 0.0, "h": 0.5}, abs=1e-10)


def test_a_pitchfork_over_what_leaves_its_symmetry_alone_and_over_what_does_not():
    rule = {X: (1 + A + B**2) * X + H - X**3}
    pitchfork = special(rule, "pitchfork", (-0.5, 0.5), a=-0.1)
    curve = pitchfork.curve("b", (-0.6, 0.6))
    assert curve.values == pytest.approx(-(curve.seconds**2), abs=1e-11) and np.ptp(curve.seconds) > 1.1
    with pytest.raises(StickslipError, match="takes the crossing of two branches apart"):
        pitchfork.curve("h", (-0.1, 0.1))


def test_what_could_not_be_followed_is_told_by_the_others():
    """Of a pitchfork and the flips of what leaves it, h takes the pitchfork apart."""
    system, begin = iterated({X: (1 + A) * X + H - X**3}, (0.0,), a=-0.1)
    found = branches(system, "a", (-0.2, 1.5), start=begin, longest=1).curves("h", (-0.05, 0.05))
    assert {one.kind for one in found.curves} == {"flip"}
    assert [why.partition(" at ")[0] for why in found.failures] == ["pitchfork"]
    assert "not followed: pitchfork at a = " in found.summary()


def test_the_broken_symmetry_of_the_impact_pair():
    """The pitchfork of the symmetric motion of two impacts over the restitution, in closed form."""
    system = Strobe(load("impact_pair"), forcing="omega", parameters={"D": 4.0})
    found = branch(system, "D", (1.0, 7.0), start={"x": -1.5, "v": -2.0}, settle=True).special
    curve = next(one for one in found if one.kind == "pitchfork").curve("e", (0.5, 0.7))
    kappa = (1 + curve.seconds) / (1 - curve.seconds)
    breaks = kappa * (math.pi**2 - 4) / np.sqrt(math.pi**2 + 4 * kappa**2)
    assert curve.values == pytest.approx(breaks, abs=1e-10)
    assert np.ptp(curve.seconds) == pytest.approx(0.2)


def test_degenerate_grazing_of_the_support():
    """Over the damper of the support, of which the free motion knows nothing: with the event the matrix is that of the
    free motion, by the saltation [[1, 0], [-cs, 1]], and has a multiplier 1 where 1 - trace + determinant vanishes."""
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={"ks": 10, "omega": 0.8})
    grazing = [one for one in branch(system, "omega", (0.8, 1.4)).special if one.kind == "grazing, compliant"][-1]
    (met,) = grazing.curve("cs", (0.01, 2.0)).meetings
    assert met.kind == "grazing, compliant and fold with its event"
    length, damped = 2 * math.pi / grazing.value, math.sqrt(1 - 0.025**2)
    decay = math.exp(-0.025 * length)
    trace, corner = 2 * decay * math.cos(damped * length), decay * math.sin(damped * length) / damped
    assert met.parameters["cs"] == pytest.approx((trace - 1 - decay**2) / corner, abs=1e-8)


@pytest.mark.nightly
def test_two_stops_are_touched_at_once():
    """An oscillator between stops at g1 and g2: both curves of grazing end where the amplitude is the gap of either."""
    one, c, f0, omega = (
        Parameter(name, value, unit, "of the oscillator")
        for name, value, unit in (("k", 1.0, "N/m"), ("c", 0.1, "N s/m"), ("f0", 0.5, "N"), ("omega", 2.0, "rad/s"))
    )
    g1, g2, ks = Parameter("g1", 2.0, "m", "gap"), Parameter("g2", 3.0, "m", "gap"), Parameter("ks", 5.0, "N/m", "stop")
    x = Coordinate("x", "m", "displacement")
    stops = [
        Stop(name=name, gap=gap, law=KelvinVoigt(ks, c), release="gap")
        for name, gap in (("right", g1 - x), ("left", g2 + x))
    ]
    declared = Mechanism(
        name="between_stops", title="oscillator between stops", source="test", coordinates=[x],
        kinetic_energy=MASS * x.v**2 / 2, potential_energy=one * x**2 / 2, dissipation=c * x.v**2 / 2,
        applied={x: f0 * sympy.cos(omega * TIME)}, contacts=stops,
    )  # fmt: skip
    system = Strobe(opened(declared), forcing="omega")
    grazing = next(one for one in branch(system, "omega", (1.0, 2.0)).special if not one.node.word)
    curve = grazing.curve("g1", (1.0, 4.0))
    (met,) = curve.meetings
    assert met.kind == "double grazing, compliant" and met.kind in [kind for kind, _ in curve.ends]
    assert met.parameters["g1"] == pytest.approx(3.0, abs=1e-10)
    at = met.parameters["omega"]
    assert 0.5 / math.hypot(1 - at**2, 0.1 * at) == pytest.approx(3.0, abs=1e-10)
