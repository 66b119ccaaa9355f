"""Maps: fixed and periodic points, eigenvalues, bifurcation values, exponents, against closed forms."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from fmu_models import maps
from fmu_models.analyses.bifurcation import Bifurcation, find_bifurcations
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.analyses.section import poincare_section
from fmu_models.sections.iteration import Iteration, find_iterate_crossings, iterate
from fmu_models.sections.periodic import PeriodicMotion, find_periodic

EXACT = 1e-12


def at(name: str, *, backward: bool = False, **values: float) -> Iteration:
    return Iteration.of(maps.load(name), values, backward=backward)


@cache
def motions(name: str, period: int = 1, *, backward: bool = False, **values: float) -> tuple[PeriodicMotion, ...]:
    return find_periodic(at(name, backward=backward, **values), period)


def met(name: str, parameter: str, begin: float, end: float, period: int = 1, **values: float) -> list[Bifurcation]:
    cycles = [
        motion.points for motion in find_periodic(at(name, backward=False, **{**values, parameter: begin}), period)
    ]
    return find_bifurcations(at(name, backward=False, **values), parameter, (begin, end), cycles)


def test_henon_fixed_points_and_eigenvalues():
    """x = (-(1-b) +- sqrt((1-b)^2 + 4a))/(2a);  lambda^2 + 2 a x lambda - b = 0."""
    left, right = motions("henon")
    assert right.points[0] == pytest.approx([0.63135447708950471, 0.3 * 0.63135447708950471], abs=EXACT)
    assert right.stability.eigenvalues == pytest.approx([-1.9237388581534071, 0.15594632230279393], abs=EXACT)
    assert right.stability.classes == ("oscillatory, unstable", "monotonic, stable")
    assert left.points[0, 0] == pytest.approx(-1.1313544770895047, abs=EXACT)
    assert left.stability.eigenvalues == pytest.approx([3.2598220978914524, -0.092029562040839196], abs=EXACT)
    assert left.stability.classes == ("monotonic, unstable", "oscillatory, stable")
    assert left.stability.saddle and right.stability.saddle


def test_henon_negative_map_has_the_same_points_and_the_inverse_eigenvalues():
    for forward, backward in zip(motions("henon"), motions("henon", backward=True), strict=True):
        assert backward.points == pytest.approx(forward.points, abs=EXACT)
        assert backward.stability.eigenvalues == pytest.approx(forward.stability.negative.eigenvalues, rel=EXACT)
        assert backward.stability.eigenvalues == pytest.approx(1 / forward.stability.eigenvalues[::-1], rel=EXACT)
    assert motions("henon", backward=True)[1].stability.classes == ("monotonic, unstable", "oscillatory, stable")


@pytest.mark.parametrize("name", [name for name in maps.names() if maps.load(name).inverse])
def test_the_negative_map_leads_back(name):
    forward, backward = at(name), at(name, backward=True)
    low, high = forward.box.T
    starts = np.random.default_rng(1).uniform(low, high, (50, len(low)))
    assert forward.difference(backward(forward(starts)) - starts) == pytest.approx(0.0, abs=1e-12)
    product = backward.jacobian(forward(starts)) @ forward.jacobian(starts)
    assert product == pytest.approx(np.broadcast_to(np.eye(len(low)), product.shape), abs=1e-11)


def test_henon_onsets():
    """Saddle-node -(1-b)^2/4, flip 3 (1-b)^2/4, flip of period two (1-b)^2 + (1+b)^2/4; at b = .3."""
    (born,) = met("henon", "a", 0.2, -1.0)
    assert (born.kind, born.value) == ("saddle-node", pytest.approx(-0.1225, abs=EXACT))
    (flip,) = met("henon", "a", 0.0, 1.0)
    assert (flip.kind, flip.value) == ("flip", pytest.approx(0.3675, abs=EXACT))
    assert flip.motion.stability.classes == ("flip", "monotonic, stable")
    assert not flip.motion.stability.hyperbolic
    (second,) = met("henon", "a", 0.5, 1.2, period=2)
    assert (second.kind, second.value) == ("flip", pytest.approx(0.9125, abs=EXACT))


@pytest.mark.nightly
def test_henon_has_as_many_motions_as_counted():
    """Biham and Wenzel, Physical Review Letters 63 (1989): cycles 1, 1, 0, 1, 0, 2, 4 of the attractor, period 1 to 7.

    Beside them there is the fixed point off the attractor. A cycle is one, to rounding that its slope enlarges.
    """
    counted = [len(motions("henon", period)) for period in range(1, 8)]
    assert counted == [2, 1, 0, 1, 0, 2, 4]
    for motion in motions("henon", 7):
        assert iterate(at("henon"), motion.points[0], 7)[-1] == pytest.approx(motion.points[0], abs=1e-12)


def test_henon_exponents():
    """0.41922(2); the two add up to ln b, because the determinant is -b everywhere."""
    found = lyapunov(at("henon"), periods=1_000_000, motions=1024)
    assert found.errors[0] < 4e-4
    assert found.values[0] == pytest.approx(0.41922, abs=3 * found.errors[0])
    assert found.values.sum() == pytest.approx(math.log(0.3), abs=1e-12)


def test_logistic_cascade():
    """1 (exchange of stability), 3, 1 + sqrt(6); then values known to seventeen digits; 1 + sqrt(8)."""
    exchange, flip = met("logistic", "r", 0.5, 3.3)
    assert (exchange.kind, exchange.value) == ("saddle-node", pytest.approx(1.0, abs=EXACT))
    assert (flip.kind, flip.value) == ("flip", pytest.approx(3.0, abs=EXACT))
    for period, begin, end, value in (
        (2, 3.2, 3.5, 1 + math.sqrt(6)),
        (4, 3.5, 3.56, 3.5440903595519229),
        (8, 3.55, 3.57, 3.5644072660954326),
    ):
        (flip,) = met("logistic", "r", begin, end, period)
        assert (flip.kind, flip.value) == ("flip", pytest.approx(value, abs=EXACT))
    (window,) = met("logistic", "r", 3.84, 3.8, 3)
    assert (window.kind, window.value) == ("saddle-node", pytest.approx(1 + math.sqrt(8), abs=EXACT))
    assert window.motion.stability.classes == ("saddle-node",)


def test_a_motion_followed_back_to_the_flip_that_it_comes_from_reports_nothing():
    assert not met("logistic", "r", 3.2, 2.9, 2)


@pytest.mark.parametrize("r", [0.5, 1.5, 2.0, 2.5, 3.3, 3.9])
def test_logistic_fixed_points(r):
    """0 of slope r, and 1 - 1/r of slope 2 - r; period two has slope 4 + 2r - r^2."""
    found = {motion.points[0, 0]: motion.stability.eigenvalues[0].real for motion in motions("logistic", r=r)}
    expected = sorted([(0.0, r), (1 - 1 / r, 2 - r)])
    assert list(found) == pytest.approx([x for x, _ in expected], abs=EXACT)
    assert list(found.values()) == pytest.approx([slope for _, slope in expected], abs=EXACT)
    twice = motions("logistic", 2, r=r)
    assert len(twice) == (r > 3)
    for motion in twice:
        assert motion.stability.eigenvalues[0] == pytest.approx(4 + 2 * r - r**2, abs=EXACT)


def test_a_section_of_one_point_is_the_next_step():
    assert poincare_section(at("logistic", r=3.0), {"x": 0.3}, points=1, transient=0).points[0, 0] == 3.0 * 0.3 * 0.7


def test_logistic_exponents():
    """ln 2 at r = 4; ln |slope| of the stable motions below; nothing left where the slope is 0."""
    chaos = lyapunov(at("logistic", r=4.0), periods=1_000_000, motions=1024)
    assert chaos.errors[0] < 5e-5
    assert chaos.values[0] == pytest.approx(math.log(2), abs=3 * chaos.errors[0])
    (calm,) = lyapunov(at("logistic", r=3.2), periods=20_000).values
    assert calm == pytest.approx(math.log(abs(4 + 2 * 3.2 - 3.2**2)) / 2, abs=EXACT)
    assert lyapunov(at("logistic", r=2.0), periods=20_000).values[0] == -math.inf


@pytest.mark.parametrize("s", [1.2, 1.7, 1.9, 2.0])
def test_tent(s):
    """Fixed points 0 and s/(1+s) of slopes s and -s; exponent ln s; period two has s/(1+s^2) and slope -s^2."""
    zero, other = motions("tent", s=s)
    assert (zero.points[0, 0], other.points[0, 0]) == pytest.approx((0.0, s / (1 + s)), abs=EXACT)
    assert (zero.stability.eigenvalues[0], other.stability.eigenvalues[0]) == pytest.approx((s, -s), abs=EXACT)
    (twice,) = motions("tent", 2, s=s)
    assert twice.points[0, 0] == pytest.approx(s / (1 + s**2), abs=EXACT)
    assert twice.stability.eigenvalues[0] == pytest.approx(-(s**2), abs=EXACT)
    assert lyapunov(at("tent", s=s), periods=20_000).values[0] == pytest.approx(math.log(s), abs=EXACT)


@pytest.mark.parametrize(("a", "r"), [(1.25, 1.0), (1.25, 0.3), (1.7, 1.9), (3.0, 0.01), (1.25, -0.5), (1.25, 2.5)])
def test_piecewise_linear_crossings(a, r):
    """(25): r/(1+a) for r > 0, r - 2 for r <= 2, a jump across the diagonal at 0 for 0 < r < 2."""
    found = find_iterate_crossings(at("piecewise_linear", a=a, r=r))
    expected = [(r - 2, 0.0)] * (r <= 2) + [(r / (1 + a), -a)] * (r > 0)
    assert [(p.x, p.slope) for p in found.fixed_points] == pytest.approx(np.array(expected), abs=EXACT)
    (jump,) = found.jumps
    assert (jump.x, jump.left, jump.right) == pytest.approx((0.0, r - 2, r), abs=1e-11)
    assert jump.crosses_diagonal == (0 < r < 2)


@pytest.mark.parametrize(("a", "r"), [(1.25, 1.0), (1.25, 0.3), (1.7, 1.9), (3.0, 0.1)])
def test_piecewise_linear_second_iterate(a, r):
    """(26), 0 < r < 2: the fixed points stay, the jump at 0 crosses no more, the single one at r/a does."""
    found = find_iterate_crossings(at("piecewise_linear", a=a, r=r), 2)
    assert [p.x for p in found.fixed_points] == pytest.approx([r - 2, r / (1 + a)], abs=EXACT)
    assert [p.slope for p in found.fixed_points] == pytest.approx([0.0, a**2], abs=EXACT)
    assert [jump.x for jump in found.jumps] == pytest.approx([0.0, r / a], abs=EXACT)
    assert [jump.crosses_diagonal for jump in found.jumps] == [False, True]
    assert (found.jumps[1].left, found.jumps[1].right) == pytest.approx((r, r - 2), abs=1e-11)
    assert not motions("piecewise_linear", 2, a=a, r=r)


def test_piecewise_linear_second_iterate_beyond_its_formula():
    """r > 2: the left piece leads to the right one, x(k+2) = 2a + (1-a) r, not r - 2 as (26) has it."""
    a, r = 1.25, 2.5
    for x in (-3.0, -0.1, 0.0):
        assert iterate(at("piecewise_linear", a=a, r=r), [x], 2)[-1, 0] == pytest.approx(2 * a + (1 - a) * r, abs=EXACT)


@pytest.mark.parametrize("gamma", [0.3, 0.9, 1.0])
def test_fermi_determinant_is_the_restitution_up_to_its_sign(gamma):
    iteration = at("fermi_simplified", gamma=gamma)
    states = np.random.default_rng(2).uniform([0.0, 1e-6], [2 * np.pi, 1.0], (200, 2))
    assert np.abs(iteration.determinant(states)) == pytest.approx(gamma, rel=EXACT)
    moderate = states[states[:, 1] > 0.1]
    assert np.linalg.det(iteration.jacobian(moderate)) == pytest.approx(iteration.determinant(moderate), rel=1e-9)
    assert lyapunov(iteration, periods=50_000, motions=256).values.sum() == pytest.approx(math.log(gamma), abs=1e-9)


def test_fermi_fixed_points():
    """v = 1/(k pi); sin(phi) = -(1-gamma) v/((1+gamma) eps) with determinant gamma, sin(phi) = v/eps with -gamma."""
    gamma, eps = 0.9, 0.05
    iteration = at("fermi_simplified")
    expected = []
    for k in range(1, 8):
        v = 1 / (k * math.pi)
        sines = [(-(1 - gamma) * v / ((1 + gamma) * eps), gamma), (v / eps, -gamma)]
        for sine, determinant in sines:
            if abs(sine) < 1 and v > 0.04:
                low = math.asin(sine) % (2 * math.pi)
                expected += [(low, v, determinant), ((math.pi - math.asin(sine)) % (2 * math.pi), v, determinant)]
    found = motions("fermi_simplified")
    points = [(*m.points[0], float(iteration.determinant(m.points[0]))) for m in found]
    assert np.array(points) == pytest.approx(np.array(sorted(expected)), abs=EXACT)
    for motion, (_, _, determinant) in zip(found, sorted(expected), strict=True):
        assert np.prod(motion.stability.eigenvalues).real == pytest.approx(determinant, rel=1e-11)


def test_high_bounce_period_one():
    """v = n pi, cos(phi) = n pi (1-e)/((1+e) Gamma); trace 1 + e - 2 (1+e) Gamma sin(phi), determinant e."""
    e, gamma = 0.5, 1.2
    phi = math.acos(math.pi * (1 - e) / ((1 + e) * gamma))
    assert phi == pytest.approx(0.51016360854330479, abs=EXACT)  # as of the ball itself
    found = [motion for motion in motions("high_bounce") if motion.points[0, 1] > 1.0]
    assert [tuple(m.points[0]) for m in found] == [
        pytest.approx((phi, math.pi), abs=EXACT),
        pytest.approx((2 * math.pi - phi, math.pi), abs=EXACT),
    ]
    for motion, sine in zip(found, (math.sin(phi), -math.sin(phi)), strict=True):
        assert motion.stability.eigenvalues.sum().real == pytest.approx(1 + e - 2 * (1 + e) * gamma * sine, abs=EXACT)
        assert motion.stability.eigenvalues.prod().real == pytest.approx(e, abs=EXACT)
    assert found[0].stability.classes == ("spiral, stable",) * 2
    assert found[1].stability.saddle


@pytest.mark.parametrize("n", [1, 2])
def test_high_bounce_saddle_node_and_flip(n):
    """Gamma_SN = n pi (1-e)/(1+e), flip at sqrt(Gamma_SN^2 + 1)."""
    e = 0.5
    born = n * math.pi * (1 - e) / (1 + e)
    down = [one for one in met("high_bounce", "Gamma", born + 0.1, born - 0.1, e=e) if one.motion.points[0, 1] > n * 3]
    assert [(one.kind, one.value) for one in down] == [("saddle-node", pytest.approx(born, abs=EXACT))]
    up = [one for one in met("high_bounce", "Gamma", born + 0.1, born + 0.6, e=e) if one.motion.points[0, 1] > n * 3]
    assert [(one.kind, one.value) for one in up] == [("flip", pytest.approx(math.hypot(born, 1), abs=EXACT))]


def test_angles_are_one_whatever_their_turns():
    iteration = at("high_bounce")
    start = np.array([0.7, 3.0])
    assert iteration(start + np.array([6 * np.pi, 0.0])) == pytest.approx(iteration(start), abs=1e-13)
    assert (iterate(iteration, start, 50)[1:, 0] < 2 * np.pi).all()


def test_period_two_of_henon_is_that_of_its_quadratic():
    """x of period two: a^2 x^2 - a (1-b) x + (1-b)^2 - a = 0, both roots."""
    a, b = 1.2, 0.3
    (motion,) = motions("henon", 2, a=a)
    disc = math.sqrt(4 * a - 3 * (1 - b) ** 2)
    assert motion.points[:, 0] == pytest.approx([((1 - b) - disc) / (2 * a), ((1 - b) + disc) / (2 * a)], abs=EXACT)


def test_lyapunov_exponent_of_a_stable_spiral_is_half_the_log_of_the_determinant():
    found = lyapunov(at("high_bounce"), periods=1_000_000, motions=1024)
    assert found.values == pytest.approx(math.log(0.5) / 2, abs=1e-3)
    assert found.values.sum() == pytest.approx(math.log(0.5), abs=EXACT)


def test_logistic_superstable_motion_is_degenerate():
    """Period two visits 1/2, where the slope is zero, at r = 1 + sqrt(5)."""
    (motion,) = motions("logistic", 2, r=1 + math.sqrt(5))
    assert motion.points[0, 0] == pytest.approx(0.5, abs=EXACT)
    assert abs(motion.stability.eigenvalues[0]) < EXACT
