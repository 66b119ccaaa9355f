"""Maps: lessons of their declaration and of wrong questions, classes of eigenvalues."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from fmu_models import maps
from fmu_models.analyses.bifurcation import find_bifurcations
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.maps import Map
from fmu_models.language.quantities import TIME, Input, Parameter, State
from fmu_models.sections.diagonal import find_crossings
from fmu_models.sections.iteration import Iteration, find_iterate_crossings
from fmu_models.sections.periodic import find_periodic
from fmu_models.sections.stability import Stability, eigenvalue_class

x = State("x", "1", "first state", start=0.1)
y = State("y", "1", "second state")
length = State("l", "m", "a length")
c = Parameter("c", 0.5, "1", "constant")
u = Input("u", 0.0, "1", "from outside")


def declare(**changes: Any) -> Map:
    """A linear map of two states with its inverse."""
    declaration: dict[str, Any] = {
        "name": "linear",
        "title": "linear",
        "source": "test",
        "states": [x, y],
        "rule": {x: y, y: c * x},
        "inverse": {x: y / c, y: x},
        "box": {x: (-1.0, 1.0), y: (-2.0, 2.0)},
    }
    return Map(**declaration | changes)


def alone(rule: Any, **changes: Any) -> Map:
    """A map of one state."""
    return declare(**{"states": [x], "rule": {x: rule}, "inverse": None, "box": {x: (-1.0, 1.0)}} | changes)


WRONG = {
    "no state": (lambda: declare(states=[]), "linear has no state. A map needs at least one"),
    "no rule": (lambda: declare(rule={x: y}), "state 'y' has no rule"),
    "foreign rule": (lambda: declare(rule={x: y, y: x, length: x}), "'l' has a rule but is not a state"),
    "half an inverse": (lambda: declare(inverse={x: y / c}), "state 'y' has no inverse"),
    "wrong inverse": (lambda: declare(inverse={x: y * c, y: x}), "the inverse does not undo the rule: from x = "),
    "one of two": (lambda: alone(x**2, inverse={x: sympy.sqrt(x)}), "the inverse does not undo"),
    "complex inverse": (lambda: alone(-(x**2) - 1, inverse={x: sympy.sqrt(x)}), "the inverse does not undo"),
    "time": (lambda: alone(x + TIME), "'time' is not a quantity of it. A map is made of its states"),
    "input": (lambda: alone(x + u), "knows neither time nor inputs"),
    "foreign state": (lambda: alone(x + y), "'y' is not a quantity of it"),
    "no box": (lambda: declare(box={x: (-1.0, 1.0)}), "state 'y' has no box"),
    "foreign box": (lambda: alone(x, box={x: (0.0, 1.0), y: (0.0, 1.0)}), "'y' has a box but is not"),
    "empty box": (lambda: alone(x, box={x: (1.0, 1.0)}), "the box of 'x' goes from 1.0 to 1.0"),
    "endless box": (lambda: alone(x, box={x: (0.0, math.inf)}), "the box of 'x' goes from 0.0 to inf"),
    "modulus": (lambda: alone(x, modulus={x: -1}), "the modulus of 'x' is -1"),
    "foreign modulus": (lambda: alone(x, modulus={y: 1}), "the modulus of 'y' is 1"),
    "name twice": (lambda: alone(x + Parameter("x", 1.0, "1", "again")), "'x' names both"),
    "no name": (lambda: declare(name="2d map"), "'2d map' is not a name"),
    "requirement": (lambda: alone(c * x, requirements=[Requirement(x - c, "x is large")]), "may use parameters only"),
    "units": (
        lambda: declare(states=[length], rule={length: length**2}, inverse=None, box={length: (0.0, 1.0)}),
        "units do not match: the rule of l is in m",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_declaration_is_answered_with_a_lesson(case):
    wrong, lesson = WRONG[case]
    with pytest.raises(StickslipError) as refused:
        wrong()
    assert lesson in str(refused.value)


def test_every_map_of_the_suite_bears_the_name_of_its_file():
    assert maps.names() == ["fermi_simplified", "henon", "high_bounce", "logistic", "piecewise_linear", "tent"]
    assert [maps.load(name).name for name in maps.names()] == maps.names()
    with pytest.raises(StickslipError, match="Did you mean 'henon'"):
        maps.load("henn")


def test_wrong_questions_are_answered_with_a_lesson():
    logistic, henon = maps.load("logistic"), maps.load("henon")
    for wrong, lesson in (
        (lambda: Iteration.of(logistic, {"q": 1.0}), "no parameter 'q'"),
        (lambda: Iteration.of(maps.load("piecewise_linear"), {"a": 1.0}), "must exceed 1"),
        (lambda: Iteration.of(logistic, backward=True), "logistic has no inverse"),
        (lambda: find_periodic(Iteration.of(logistic), 0), "shortest has period 1"),
        (lambda: find_iterate_crossings(Iteration.of(henon)), "crossings with the diagonal are those of a map of one"),
        (lambda: find_bifurcations(Iteration.of(logistic), "q", (1.0, 2.0), ()), "no parameter 'q'"),
        (lambda: find_bifurcations(Iteration.of(logistic), "r", (2.0, 2.0), ()), "Nothing changes"),
        (lambda: lyapunov(Iteration.of(logistic, {"r": 5.0})), "leaves every bound"),
        (lambda: lyapunov(Iteration.of(logistic), motions=1), "at least 2 motions"),
        (lambda: find_crossings(lambda x: x, 1.0, 0.0), "the smaller one first"),
    ):
        with pytest.raises(StickslipError, match=lesson):
            wrong()


@pytest.mark.parametrize(
    ("eigenvalue", "name"),
    [
        (0.3, "monotonic, stable"),
        (-0.3, "oscillatory, stable"),
        (1.7, "monotonic, unstable"),
        (-1.7, "oscillatory, unstable"),
        (0.0, "degenerate"),
        (1.0, "saddle-node"),
        (-1.0, "flip"),
        (0.6 + 0.7j, "spiral, stable"),
        (0.6 - 0.9j, "spiral, unstable"),
        (0.6 + 0.8j, "Neimark"),
    ],
)
def test_classes_of_eigenvalues(eigenvalue, name):
    assert eigenvalue_class(eigenvalue) == name


def test_stability_of_several_eigenvalues():
    saddle = Stability.of(np.diag([0.5, -2.0]))
    assert (saddle.saddle, saddle.stable, saddle.hyperbolic) == (True, False, True)
    rotation = Stability.of([[0.6, -0.8], [0.8, 0.6]])
    assert (rotation.saddle, rotation.stable, rotation.hyperbolic) == (False, False, False)
    assert rotation.classes == ("Neimark", "Neimark")
    assert Stability.of(np.diag([0.5, 0.0])).negative.eigenvalues[0] == math.inf
    assert saddle.negative.classes == ("monotonic, unstable", "oscillatory, stable")


@given(st.lists(st.floats(-5, 5).filter(lambda e: abs(e) > 1e-3 and abs(abs(e) - 1) > 1e-3), min_size=1, max_size=4))
def test_the_negative_map_swaps_stable_and_unstable(eigenvalues):
    there = Stability.of(np.diag(eigenvalues))
    swapped = {"stable": "unstable", "unstable": "stable"}
    expected = [f"{kind}, {swapped[verdict]}" for kind, verdict in (one.split(", ") for one in there.classes)]
    assert list(there.negative.classes) == expected[::-1]
