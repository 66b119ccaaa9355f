"""Manifolds of saddles and homoclinic points against closed forms, inverses, and a value of 40-digit arithmetic."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fmu_models import (
    Automaton,
    Fmu,
    Iteration,
    Parameter,
    State,
    StickslipError,
    Strobe,
    Switch,
    branch,
    homoclinic,
    load,
    manifolds,
)
from fmu_models.analyses.saddle import saddle_of
from fmu_models.codegen.package import built_of
from fmu_models.lowering.lower import lower
from fmu_models.maps.henon import MAP as HENON

HOMOCLINIC = -0.0013985188342794350
NEAR = {"x1": 0.003, "x2": -0.003}


@cache
def bent_well():
    """x'' = mu x' + 1 - |x - 1|: a saddle at 0, a centre at 2 for mu = 0, and v^2 = x^2 up to x = 1, 2 - (x - 2)^2
    beyond."""
    mu = Parameter("mu", 0.0, "1", "damping that drives")
    x, v = State("x", "1", "place"), State("v", "1", "speed")
    kink = Switch(name="kink", function=x - 1)
    flows = {x: v, v: mu * v + 1 - kink.abs}
    model = Automaton(name="bent_well", title="bent well", source="here", states=[x, v], flows=flows, switches=[kink])
    return Fmu.open(built_of(lower(model)))


def loop(x):
    """v^2 on the homoclinic motion of the bent well."""
    return np.where(x < 1.0, x**2, 2.0 - (x - 2.0) ** 2)


def test_the_homoclinic_point_of_the_smoothed_system():
    found = homoclinic(load("planar_multiple_crossing_smooth"), "mu", (-0.003, 0.0), start=NEAR)
    assert found.value == pytest.approx(HOMOCLINIC, rel=1e-12)
    assert found.saddle_quantity > 0.0  # the cycle that is born is unstable
    assert np.abs(found.points[[0, -1]] - found.saddle).max() < 0.02 < np.abs(found.points - found.saddle).max()


def test_only_mu_times_eps_matters():
    given = {"eps": 40.0}
    found = homoclinic(load("planar_multiple_crossing_smooth"), "mu", (-0.001, 0.0), start=NEAR, parameters=given)
    assert found.value == pytest.approx(HOMOCLINIC / 2.0, rel=1e-11)


def test_a_homoclinic_motion_through_a_kink():
    found = homoclinic(bent_well(), "mu", (-0.2, 0.3), start={"x": 0.01})
    assert found.value == pytest.approx(0.0, abs=1e-12)
    x, v = found.points.T
    assert v**2 == pytest.approx(loop(x), abs=1e-6)


def test_manifolds_of_an_equilibrium():
    """At mu = 0 one half of each is the loop, and the others are x = v and x = -v."""
    found = manifolds(bent_well(), {"x": 0.01}, length=5.0)
    assert sorted(found.eigenvalues.real) == pytest.approx([-1.0, 1.0], abs=1e-12)
    for one in found.curves:
        x, v = one.points.T
        assert len(x) > 20 and v**2 == pytest.approx(loop(x), abs=1e-5)
        loops = x.max() > 1.0
        assert loops == (x[1] > 0.0)
        assert np.sign(v[1]) == (np.sign(x[1]) if one.kind == "unstable" else -np.sign(x[1]))


def test_manifolds_of_a_map():
    """Points of the unstable one come from the saddle by the inverse, those of the stable one go there."""
    forward, back = Iteration.of(HENON), Iteration.of(HENON, backward=True)
    found = manifolds(forward, {"x": 0.63, "y": 0.19}, length=1.5, spacing=0.02)
    saddle = found.saddle[0]
    assert saddle[0] == pytest.approx((-0.7 + (0.49 + 5.6) ** 0.5) / 2.8, abs=1e-13)
    assert [one.kind for one in found.curves] == ["unstable", "unstable", "stable", "stable"]
    for one in found.curves:
        step = np.linalg.norm(np.diff(one.points, axis=0) / forward.sizes(), axis=1)
        assert step.max() <= 0.02 and step.sum() == pytest.approx(1.5, abs=0.03)
        apart, points = [], one.points
        for _ in range(24):
            points = (forward if one.kind == "stable" else back)(points)
            apart.append(np.abs(points - saddle).max(axis=1))
        # the inverse grows what a point is off the unstable one by 6.4 a step, while it comes nearer by 1.9
        assert np.nanmin(apart, axis=0).max() < (1e-5 if one.kind == "stable" else 5e-3)


def test_the_stable_manifold_of_a_motion_without_a_formula_of_its_inverse():
    """The support's unstable motion between its two stable ones: strobed, points of its stable manifold go there."""
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={"ks": 10, "omega": 0.8})
    followed = branch(system, "omega", (0.8, 1.4))
    i = int(np.flatnonzero(~followed.stable)[len(np.flatnonzero(~followed.stable)) // 2])
    there = system.at(omega=float(followed.values[i]))
    found = manifolds(there, followed.points[i], length=0.5, spacing=0.05)
    assert found.saddle[0] == pytest.approx(followed.points[i], abs=1e-9)
    assert found.eigenvalues == pytest.approx(followed.multipliers[i], abs=1e-8)
    for one in found.curves:
        if one.kind == "stable":
            points, apart = one.points[1:], []
            for _ in range(12):
                points = there.step(points, derivative=False).points
                apart.append(np.abs(points - found.saddle[0]).max())
            assert min(apart) < 0.05 * np.abs(one.points - found.saddle[0]).max()


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: manifolds(load("planar_hopf"), {"x1": -1.5, "x2": 0.0}), "is no saddle"),
        (lambda: manifolds(Iteration.of(HENON, {"a": 0.1}), {"x": 0.8, "y": 0.2}), "is no saddle"),
        (lambda: manifolds(Iteration.of(HENON), length=-1.0), "positive numbers"),
        (lambda: homoclinic(bent_well(), "mu", (0.1, 0.3), start={"x": 0.01}), "comes back to it for mu between"),
        (lambda: homoclinic(bent_well(), "nu", (0.1, 0.3)), "no parameter or input 'nu'"),
        (lambda: homoclinic(bent_well(), "mu", (0.1, 0.1)), "finite value to another"),
    ],
)
def test_what_has_no_manifolds_is_told(ask, said):
    with pytest.raises(StickslipError, match=said):
        ask()


@cache
def three_rates():
    """x' = x + y, y' = -2 y, z' = -3 z + x: eigenvalues 1, -2, -3 with vectors by hand."""
    rate = Parameter("rate", 1.0, "1/s", "unit of rates", positive=True)
    x, y, z = (State(name, "1", name, nominal=2.0) for name in "xyz")
    flows = {x: rate * (x + y), y: -2 * rate * y, z: rate * (x - 3 * z)}
    model = Automaton(name="three_rates", title="three rates", source="here", states=[x, y, z], flows=flows)
    return Fmu.open(built_of(lower(model)))


def test_the_directions_of_a_saddle():
    saddle = saddle_of(three_rates(), {})
    assert saddle.values == pytest.approx([1.0, -2.0, -3.0], abs=1e-12)
    assert (saddle.unstable, saddle.stable) == ([0], [1, 2])
    vectors = np.array([[4.0, 0.0, 1.0], [1.0, -3.0, 1.0], [0.0, 0.0, 1.0]])
    for i, vector in enumerate(vectors):
        along = vector * np.sign(vector[np.abs(vector).argmax()])
        assert saddle.direction(i) == pytest.approx(along / np.linalg.norm(along), abs=1e-12)
        # parts of a difference of states along the three vectors, in sizes of the states
        parts = [saddle.left(k) @ (saddle.direction(i) * saddle.sizes) for k in range(3)]
        assert parts == pytest.approx(np.eye(3)[i], abs=1e-12)


def test_a_node_is_no_saddle():
    with pytest.raises(StickslipError, match="no saddle with real eigenvalues"):
        saddle_of(bent_well(), {"x": 2.1, "v": 0.1}, {"mu": -0.5})
