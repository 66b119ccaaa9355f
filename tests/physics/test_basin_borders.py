"""Uncertainty exponents and integrity of basins against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy

from fmu_models import Automaton, Execution, Map, Parameter, State, basins, edge_state, load
from fmu_models.analyses.uncertainty import uncertainty_exponent

ALONE = Execution(workers=1)


def cantor() -> Map:
    """Of the fifths of [0, 1] the second one leads to x = -1, the fourth one to x = 2; the others are stretched over
    all of it. The border has the dimension ln 3/ln 5."""
    x, y = State("x", "1", "x", start=0.3), State("y", "1", "y")
    fifth = sympy.Rational(1, 5)
    pieces = [(-1, x < 0), (5 * x, x <= fifth), (-1, x < 2 * fifth), (5 * x - 2, x <= 3 * fifth), (2, x < 4 * fifth)]
    rule: Any = {x: sympy.Piecewise(*pieces, (5 * x - 4, x <= 1), (2, True)), y: y / 2}
    return Map(name="fifths", title="fifths", source="here", states=[x, y], rule=rule, box={x: (-2, 3), y: (-1, 1)})


def test_a_border_like_cantors_has_the_exponent_of_its_dimension():
    found = basins(cantor(), execution=ALONE, x=np.linspace(-0.13, 1.09, 1001), y=np.linspace(-1, 1, 17))
    exponent, error = found.uncertainty
    assert len(found.attractors) == 2 and found.undecided == 0
    assert abs(exponent - (1.0 - math.log(3) / math.log(5))) < 2.0 * error < 0.2


def test_exponents_of_rough_and_smooth_borders_are_held_by_their_errors():
    """z over the graph of Weierstrass' function, whose dimension is 2 - ln a/ln 2, and a disc."""
    rng, held = np.random.default_rng(3), []
    for count in (101, 201):
        for a in (1.3, 1.5, 1.7):
            for shift in rng.uniform(size=5):
                angle = np.linspace(shift, shift + 1.0, count)
                j = np.arange(50)[:, None]
                graph = -(a ** (-j - 1.0) * np.cos(2 * np.pi * (2.0**j * angle % 1))).sum(axis=0)
                exponent, error = uncertainty_exponent((np.linspace(-3.1, 3, count) > graph[:, None]).astype(int))
                held.append(abs(exponent - math.log2(a)) < 2.0 * error < 0.3)
        for shift, radius in rng.uniform(0.2, 0.5, size=(10, 2)):
            x = np.linspace(-1, 1, count) - shift
            exponent, error = uncertainty_exponent((x[:, None] ** 2 + x**2 < radius**2).astype(int))
            held.append(abs(exponent - 1.0) < 2.0 * error < 0.1)
    assert np.mean(held) >= 0.9


def test_a_grid_that_is_too_coarse_says_nothing():
    assert math.isnan(uncertainty_exponent(np.zeros((50, 50), int))[0])
    assert math.isnan(uncertainty_exponent(np.eye(9, dtype=int))[0])


def test_the_integrity_of_a_half_plane_is_that_of_the_largest_disc_in_it():
    """x -> x (3 - x^2)/2 comes to 1 from 0 < x < sqrt(3); y shrinks. Of the box -1 < x < 3/2 the basin of 1 has 3/5 of
    the width, that of -1 has 2/5: discs of half of that where each axis is 1 long."""
    x, y = State("x", "1", "x", start=0.3), State("y", "1", "y")
    rule: Any = {x: x * (3 - x**2) / 2, y: y / 2}
    box: Any = {x: (-2, 2), y: (-1, 1)}
    cubic = Map(name="two_sides", title="two sides", source="here", states=[x, y], rule=rule, box=box)
    found = basins(cubic, execution=ALONE, x=np.linspace(-1, 1.5, 200), y=np.linspace(-1, 1, 201))
    by_place = dict(zip((float(a.points[0, 0]) for a in found.attractors), found.integrity, strict=True))
    assert by_place[1.0] == pytest.approx(0.3, abs=0.005) and by_place[-1.0] == pytest.approx(0.2, abs=0.005)
    assert found.uncertainty[0] == pytest.approx(1.0, abs=0.05)


def test_what_goes_to_infinity_in_finite_time_is_said_to():
    """x' = x^2 - 1, unstable at 1: the edge between rest and infinity."""
    rate, x = Parameter("rate", 1.0, "1/s", "rate", positive=True), State("x", "1", "place")
    flows: Any = {x: rate * (x**2 - 1)}
    runaway = load(Automaton(name="runaway", title="runaway", source="here", states=[x], flows=flows))
    found = basins(runaway, execution=ALONE, x=[-5.0, 0.9, 1.1, 7.0])
    assert found.labels.tolist() == [0, 0, -2, -2]
    edge = edge_state(runaway, {"x": 0.0}, other={"x": 4.0})
    assert edge.points[0, 0] == pytest.approx(1.0, abs=1e-12) and edge.between == ("equilibrium", "to infinity")
