"""Branches of maps over the borders of their rules, by closed forms.

Sources: Nusse, Yorke, Physica D 57 (1992) 39-57 (the piecewise linear normal form); Nordmark, Journal of Sound and
Vibration 145 (1991) 279-297 (the square root).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy

from fmu_models import Iteration, Map, Parameter, State, branch
from fmu_models.families.execution import Execution
from fmu_models.maps.piecewise_linear import MAP as WITH_JUMP

pytestmark = pytest.mark.digits

x, y = State("x", "1", "state", start=0.0), State("y", "1", "state", start=0.0)
a, b = Parameter("a", 0.5, "1", "slope on the left"), Parameter("b", -1.5, "1", "slope on the right")
mu = Parameter("mu", 0.1, "1", "parameter")
BORDER = sympy.Rational(3, 10)


def declared(name: str, rule: dict) -> Map:
    return Map(name=name, title=name, source="here", states=list(rule), rule=rule, box=dict.fromkeys(rule, (-2.0, 2.0)))


# x' = .3 + slope (x - .3) + (mu - .3): its fixed points come to the border at mu = .3
bent = declared("bent", {x: mu + sympy.Piecewise((a * (x - BORDER), x <= BORDER), (b * (x - BORDER), True))})
lozi = declared("lozi", {x: mu - a * sympy.Abs(x) + y, y: b * x})


def nordmark() -> Map:
    rho, gamma, tau2 = (
        Parameter("rho", 0.1, "1", "shift"),
        Parameter("gamma", 0.05, "1", ""),
        Parameter("t2", 0.3, "1", ""),
    )
    rule = {
        x: sympy.Piecewise((a * x + y + rho, x <= 0), (-sympy.sqrt(x) + y + rho, True)),
        y: -gamma * x * sympy.Piecewise((1, x <= 0), (tau2, True)),
    }
    return declared("nordmark", rule)


@pytest.mark.parametrize(
    ("left", "right", "form"),
    [
        (0.5, -1.5, "persistence"),
        (0.5, -0.9, "persistence"),
        (0.5, 1.5, "nonsmooth fold"),
        (-2.0, 2.0, "nonsmooth fold"),
    ],
)
def test_a_fixed_point_at_the_border_of_a_bent_line(left, right, form):
    """It persists where 1 - a and 1 - b have one sign; two of them meet and are gone otherwise."""
    system = Iteration.of(bent, {"a": left, "b": right, "mu": 0.1})
    found = branch(system, "mu", (0.05, 0.55), start={"x": 0.3 - 0.2 / (1 - left)})
    (collision,) = found.special
    assert (collision.kind, collision.contact, collision.criticality) == ("border collision", "x - 3/10", form)
    assert collision.value == pytest.approx(0.3, abs=1e-15)
    assert collision.state["x"] == pytest.approx(0.3, abs=1e-11)
    assert collision.multipliers == pytest.approx([left])
    assert collision.multipliers_with_event == pytest.approx([right])
    assert ("+1" in collision.crossings) == (form == "nonsmooth fold")
    ends = [0.05, 0.55] if form == "persistence" else [0.05, 0.05]
    assert sorted(found.values[[0, -1]]) == pytest.approx(ends, abs=1e-15)
    offsets = found.points[:, 0] - 0.3
    slopes = np.where(offsets > 0.0, right, left)
    assert offsets == pytest.approx((found.values - 0.3) / (1.0 - slopes), abs=1e-13)


@pytest.mark.parametrize(("left", "right"), [(0.5, -1.5), (0.5, -3.0), (0.2, -6.0), (-0.5, -4.0), (0.4, -12.0)])
def test_cycles_that_are_born_at_the_border(left, right):
    """RL is there above where (1 + a)/(1 - a b) > 0 > (1 + b)/(1 - a b), stable where abs(a b) < 1; RLL where its
    three points lie so."""
    start = {"x": 0.3 - 0.2 / (1 - left)}
    found = branch(Iteration.of(bent, {"a": left, "b": right, "mu": 0.1}), "mu", (0.05, 0.55), start=start)
    above = found.special[0].cycles["above"]
    assert ("RL" in above) == ((1 + left) / (1 - left * right) > 0.0 > (1 + right) / (1 - left * right))
    if "RL" in above:
        assert above["RL"] == ("stable" if abs(left * right) < 1.0 else "unstable")
    first = (1 + left + left**2) / (1 - left**2 * right)
    points = [first, right * first + 1.0, left * (right * first + 1.0) + 1.0]
    assert ("RLL" in above) == (points[0] > 0.0 > max(points[1:]))
    if "RLL" in above:
        assert above["RLL"] == ("stable" if abs(left**2 * right) < 1.0 else "unstable")


def test_a_cycle_of_two_that_is_born_there_is_switched_to():
    found = branch(Iteration.of(bent, {"mu": 0.1}), "mu", (0.05, 0.55), start={"x": -0.1})
    (two,) = found.special[0].switch()
    assert two.every == 2 and two.stable.all() and two.values.max() == 0.55
    right = np.maximum(*two.images[:, :, 0]) - 0.3
    assert right == pytest.approx((two.values - 0.3) * (1 + 0.5) / (1 + 0.5 * 1.5), abs=1e-13)


def test_a_collision_is_kept_and_has_a_curve(tmp_path):
    system, store = Iteration.of(bent, {"mu": 0.1}), tmp_path / "bent.zarr"
    branch(system, "mu", (0.05, 0.55), start={"x": -0.1}, execution=Execution(store=store))
    kept = branch(system, "mu", (0.05, 0.55), start={"x": -0.1}, execution=Execution(store=store, resume=True))
    (collision,) = kept.special
    assert collision.criticality == "persistence" and collision.cycles["above"]["RL"] == "stable"
    assert collision.border_form == "piecewise linear"
    curve = collision.curve("a", (0.2, 0.8))
    assert curve.points[:, 0] == pytest.approx(np.full(len(curve.points), 0.3), abs=1e-12)
    assert [kind for kind, _ in curve.ends] == ["range", "range"]


@pytest.mark.parametrize("begin", [-0.1, 0.1])
def test_the_border_of_a_square_root(begin):
    """Nordmark's map: from either side, though it has no derivative on the right; x + gamma tau^2 x = rho - sqrt(x)."""
    states = (begin / 0.55, -0.05 * begin / 0.55) if begin < 0.0 else (0.01, 0.0)
    found = branch(
        Iteration.of(nordmark(), {"rho": begin}), "rho", (-0.2, 0.2), start=dict(zip("xy", states, strict=True))
    )
    (collision,) = found.special
    assert (collision.kind, collision.criticality) == ("border collision", "persistence")
    assert collision.value == pytest.approx(0.0, abs=1e-12) and not collision.cycles
    assert collision.border_form == "square root"
    assert collision.collision is not None and collision.collision.exponent == pytest.approx(0.5, abs=1e-3)
    assert sum(collision.multipliers).real == pytest.approx(0.5) and collision.multipliers_with_event is None
    assert [kind for kind, _ in found.ends] == ["range", "range"]
    root = (np.sqrt(1.0 + 4.0 * 1.015 * np.maximum(found.values, 0.0)) - 1.0) / (2.0 * 1.015)
    known = np.where(found.values > 0.0, root**2, found.values / 0.55)
    assert found.points[:, 0] == pytest.approx(known, abs=1e-13)
    assert np.abs(found.multipliers[found.values > 0.0]).max() > 1e3


def test_the_fold_of_the_lozi_map():
    """An absolute value: mu/(1 + a - b) and mu/(1 - a - b) meet at 0."""
    system = Iteration.of(lozi, {"a": 1.4, "b": 0.3, "mu": 0.3})
    found = branch(system, "mu", (-0.5, 0.5), start={"x": 0.2, "y": 0.06})
    (collision,) = found.special
    assert collision.criticality == "nonsmooth fold" and collision.value == pytest.approx(0.0, abs=1e-15)
    slopes = np.where(found.points[:, 0] > 0.0, 1.4, -1.4)
    assert found.points[:, 0] == pytest.approx(found.values / (0.7 + slopes), abs=1e-13)
    assert math.isclose(found.values[0], 0.5) and math.isclose(found.values[-1], 0.5)


def test_a_rule_that_jumps_ends_the_branch():
    found = branch(Iteration.of(WITH_JUMP), "r", (-1.0, 1.5), start={"x": 0.45})
    (collision,) = found.special
    assert (collision.criticality, collision.contact, collision.border_form) == ("jump", "x", "")
    assert collision.value == pytest.approx(0.0, abs=1e-15)
    assert "the rule jumps there" in found.ends[0][1] and found.ends[0][0] == "jump"
