"""Diagrams of maps that jump, by closed forms, and by direct bisection of the toy's return map."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import sympy

from fmu_models import MAPS, Iteration, Map, Parameter, ReturnMap, Section, State, crossing_diagram, load, read_scene
from fmu_models.base.errors import StickslipError
from fmu_models.scene.kinds.kind import section_of

DATA = Path(__file__).parents[2] / "data"
a, x = Parameter("a", 0.5, "1", "slope on the left"), State("x", "1", "state", start=0.0)
r = Parameter("r", 0.1, "1", "shift")
# x' = r + a x, and r - sqrt(x) beyond 0: fixed points r/(1 - a) and the square of (sqrt(1 + 4 r) - 1)/2
root = Map(
    name="root",
    title="root",
    source="Nordmark, Journal of Sound and Vibration 145 (1991) 279-297, in one dimension",
    states=[x],
    rule={x: r + sympy.Piecewise((a * x, x <= 0), (-sympy.sqrt(sympy.Abs(x)), True))},
    box={x: (-1.0, 0.5)},
)


def special(diagram, kind, period=1):
    return [(point.value, point.x) for point in diagram.special if (point.kind, point.period) == (kind, period)]


def test_folds_and_flips_of_the_logistic_map():
    """Period 1 flips at r = 3, 2 at 1 + sqrt(6); three pairs of period 3 are born at 1 + sqrt(8)."""
    logistic, box = Iteration.of(MAPS.load("logistic")), {"x": (0.1, 1.0)}
    diagram = crossing_diagram(logistic, "r", (2.8, 3.86), iterates=3, box=box, scans=5)
    assert special(diagram, "flip") == [pytest.approx((3.0, 2 / 3), abs=1e-9)]
    assert [p for p, _ in special(diagram, "flip", 2)] == pytest.approx([1 + math.sqrt(6)] * 2, abs=1e-8)
    assert [p for p, _ in special(diagram, "fold", 3)] == pytest.approx([1 + math.sqrt(8)] * 3, abs=1e-9)
    for curve in diagram.curves:
        of = {1: lambda p, x: 1 - 1 / p - x, 2: lambda p, x: p**2 * x**2 - p * (p + 1) * x + p + 1}.get(curve.period)
        if of:
            away = np.abs(curve.values - 3.0) > 1e-3  # where it is born, three fixed points are one
            assert np.abs(of(curve.values, curve.points))[away].max() < 1e-11
    assert [row[1] for row in diagram.at(3.85)] == [1, 2, 2, 3, 3, 3, 3, 3, 3]


@pytest.mark.parametrize(("slope", "form"), [(0.5, "persistence"), (1.5, "fold")])
def test_a_square_root_has_its_exponent(slope, form):
    diagram = crossing_diagram(Iteration.of(root, {"a": slope}), "r", (-0.2, 0.2))
    (collision,) = [point for point in diagram.special if point.kind == "border collision"]
    assert (collision.form, collision.normal_form) == (form, "square root")
    assert (collision.value, collision.x) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert collision.exponents == pytest.approx((1.0, 0.5), abs=1e-4)
    assert collision.slopes[0] == pytest.approx(slope)
    for curve in diagram.curves:
        above = ((np.sqrt(1 + 4 * np.maximum(curve.values, 0.0)) - 1) / 2) ** 2
        known = np.where(curve.points > 0.0, above, curve.values / (1 - slope))
        assert curve.points == pytest.approx(known, abs=1e-12)


def test_the_jumps_of_the_piecewise_linear_map_have_slopes_and_limits():
    diagram = crossing_diagram(Iteration.of(MAPS.load("piecewise_linear")), "r", (-0.5, 2.5))
    first, second = diagram.special
    assert (first.form, second.form, first.normal_form) == ("fold", "fold", "piecewise linear")
    assert first.slopes == pytest.approx((0.0, -1.25)) and first.exponents[1] == pytest.approx(1.0, abs=1e-6)
    assert first.limits == pytest.approx((-2.0, 0.0), abs=1e-7) and second.limits == pytest.approx((0.0, 2.0), abs=1e-7)
    assert {curve.kind for curve in diagram.curves} == {"fixed points", "jump crossings"}


def test_an_island_is_closed():
    """x' = x + .04 - (r - .5)^2 - (x - .5)^2: a circle of fixed points."""
    circle = Map(
        name="circle", title="circle", source="here", states=[x], box={x: (0.0, 1.0)},
        rule={x: x + sympy.Rational(1, 25) - (r - sympy.Rational(1, 2)) ** 2 - (x - sympy.Rational(1, 2)) ** 2},
    )  # fmt: skip
    diagram = crossing_diagram(Iteration.of(circle), "r", (0.0, 1.0))
    (curve,) = diagram.curves
    assert np.hypot(curve.values - 0.5, curve.points - 0.5) == pytest.approx(np.full(len(curve.values), 0.2), abs=1e-12)
    assert (curve.values[0], curve.points[0]) == (curve.values[-1], curve.points[-1])
    assert special(diagram, "fold") == [pytest.approx((value, 0.5), abs=1e-8) for value in (0.3, 0.7)]


def test_what_is_no_map_of_one_number_is_refused():
    with pytest.raises(StickslipError, match="returns"):
        crossing_diagram(Iteration.of(MAPS.load("henon")), "a", (0.0, 1.0))
    with pytest.raises(StickslipError, match="ascending"):
        crossing_diagram(Iteration.of(MAPS.load("logistic")), "r", (3.0, 2.0))


@pytest.mark.parametrize(
    ("changed", "error"),
    [
        ("level = { w_S = 0 }", "a return map needs 'level'"),
        ('returns = "phi_S"', "a return map needs 'level'"),
        ("lower_friction", "has no contact 'sideways'"),
    ],
)
def test_a_scene_that_says_half_of_a_return_map_is_refused(tmp_path, changed, error):
    text, path = (DATA / "scenes" / "woodpecker_figure_16.toml").read_text("utf-8"), tmp_path / "half.toml"
    path.write_text(text.replace(changed, "sideways" if changed == "lower_friction" else ""), "utf-8")
    with pytest.raises(StickslipError, match=error):
        scene = read_scene(path)
        section_of(scene, load("woodpecker"), scene.free, {})


def test_points_a_b_and_c_of_the_toy_by_bisection():
    """A: the limit of the map above the jump at -.8848 comes to the diagonal; B: that below the one at -.7578;
    C, of the second iterate: what ends at -.8563544749834 comes to -.7578 at the next return."""
    jammed = {"section": Section("w_S"), "accept": {"lower_friction": 0}, "cap": 4.0}
    P = ReturnMap(load("woodpecker"), "phi_S", **jammed)
    how = {"scans": 3, "noise": 1e-11, "accuracy": 1e-10}
    A = special(crossing_diagram(P, "eN1", (0.035, 0.05), box={"phi_S": (-0.89, -0.85)}, **how), "border collision")
    B = special(crossing_diagram(P, "eN1", (0.18, 0.19), box={"phi_S": (-0.77, -0.745)}, **how), "border collision")

    found = crossing_diagram(P, "eN1", (0.0555, 0.0565), iterates=2, box={"phi_S": (-0.77, -0.75)}, **how)
    C = special(found, "border collision", 2)

    def bisected(low, high, jump, start):
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if P.at(eN1=middle)(start) < jump else (low, middle)
        return low

    for (found,), value, jump in (
        (A, bisected(0.04, 0.045, -0.8847733440, -0.8847733437), -0.8847733440),
        (B, bisected(0.18, 0.19, -0.7577872573, -0.757787257), -0.7577872573),
        (C, bisected(0.054, 0.058, -0.7577872573, -0.8563544749834), -0.7577872573),
    ):
        assert found == pytest.approx((value, jump), abs=1e-9)
