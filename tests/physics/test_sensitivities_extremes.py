"""Derivatives of motions where they are hard to carry: far from time zero, very large, and at corners."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from lazy_fmu import LazyFmu
from quick_export import quick_export
from sympy import Integer, Rational

from fmu_models import Stop, load
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.impacts import Impact, Newton, Poisson
from fmu_models.language.laws.lankarani_nikravesh import LankaraniNikravesh
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter
from fmu_models.sections.orbits import orbit_at
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun, flow_derivative

HINGE = LazyFmu("hinge_clearance")


@given(x=st.floats(-0.009, 0.009), v=st.floats(-0.3, 0.3))
@settings(max_examples=40, deadline=None)
def test_a_stop_is_left_at_any_time(x: float, v: float) -> None:
    """Near the end of a contact after Hertz the steps are shorter than a digit of the time; 0.429 * 5e7 are whole
    periods of the force."""
    start = {"x": x, "v": v}
    with SensitiveRun(HINGE, by=["x", "v"]) as kept:
        late = kept.run([5e7 + 3.0], start_time=5e7, start=start)
        early = kept.run([3.0], start=start)
    # the phase of the force is rounded to 3e-8 there
    assert late.values == pytest.approx(early.values, abs=1e-4)


def mass(name: str, stiffness: float) -> Mechanism:
    m, k = Parameter("m", 1.0, "kg", "mass"), Parameter("k", stiffness, "N/m", "stiffness")
    q = Coordinate("q", "m", "position", velocity="w")
    return Mechanism(
        name=name,
        title="A mass",
        source="textbook",
        coordinates=[q],
        kinetic_energy=m * q.v**2 / 2,
        potential_energy=k * q**2 / 2,
    )


def test_derivatives_are_right_or_said_to_be_too_large(tmp_path: Path) -> None:
    """A pendulum on its head: dq/dq0 = cosh t, 7.4e77 at 180 s and beyond 1e80 after 185 s."""
    fmu = Fmu.open(quick_export(mass("unstable_mass", -1.0), tmp_path / "unstable_mass.fmu"))
    found = flow_derivative(fmu, 180.0, start={"q": 0.0, "w": 0.0})
    expected = [[math.cosh(180.0), math.sinh(180.0)], [math.sinh(180.0), math.cosh(180.0)]]
    assert found.by_start.tolist() == [pytest.approx(row, rel=1e-11) for row in expected]
    with pytest.raises(StickslipError, match=r"derivatives of the motion grow beyond 1e\+80 at t = 18\d\."):
        flow_derivative(fmu, 300.0, start={"q": 0.0, "w": 0.0})


def test_derivatives_of_chaos_end_in_words() -> None:
    """A motion between stops whose neighbours leave it by a factor e every 4 s."""
    with SensitiveRun(HINGE, by=["x", "v"]) as kept:
        run: dict[str, Any] = {"start": {"x": 0.0, "v": 0.03}, "parameters": {"f": 0.37}}
        found = kept.run([200.0, 400.0, 600.0], **run)
        assert np.isfinite(found.derivative).all() and np.isfinite(found.event_derivative).all()
        assert np.abs(found.derivative[-1]).max() > 1e50
        with pytest.raises(StickslipError, match=r"derivatives of the motion grow beyond 1e\+80 at t = \d\d\d\."):
            kept.run([1500.0], **run)


def test_derivatives_that_die_out_are_zero() -> None:
    """A stable motion between stops forgets its start, below the least number there is, through 4 000 events."""
    with SensitiveRun(HINGE, by=["x", "v", "k0"]) as kept:
        found = kept.run([500.0, 3000.0], start={"x": 0.0, "v": 0.03}, parameters={"f": 0.3557})
    assert 0.0 < np.abs(found.derivative[0, :, :2]).max() < 1e-60
    assert np.abs(found.derivative[1, :, :2]).max() == 0.0
    # what it has come to depends on the stiffness
    assert 0.0 < np.abs(found.derivative[1, :, 2]).max() < 1.0


@pytest.mark.parametrize("k", [1e4, 1e6, 1e9])
def test_a_hertz_contact_keeps_its_energy_and_its_tangents(k: float, tmp_path: Path) -> None:
    """Along the motion of what nothing forces, a difference grows as the rates do: by the states alone, to rounding."""
    x = Coordinate("x", "1", "height", velocity="v")
    m, stiffness = Parameter("m", 1.0, "1", "mass"), Parameter("k", 1e4, "1", "stiffness")
    floor = Stop(
        name="floor",
        gap=x,
        law=LankaraniNikravesh(k=stiffness, n=Rational(3, 2), restitution=Integer(1)),
        release="gap",
    )
    mechanism = Mechanism(
        name="hertz_ball",
        title="Ball on a floor",
        source="Hertz",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=m * x,
        contacts=[floor],
    )
    fmu = Fmu.open(quick_export(mechanism, tmp_path / "hertz_ball.fmu"))
    run: dict[str, Any] = {"start": {"x": 0.5, "v": 0.0}, "parameters": {"k": k}}
    entry = simulate(fmu, 1.01, **run).events[0].time
    length = 3.0 * k**-0.4
    times = entry + length * np.array([1e-3, 1e-2, 0.1, 0.3, 0.5, 0.7])
    motion = simulate(fmu, times[-1], output_times=times, **run)
    depth = np.maximum(-motion["x"], 0.0)
    energy = motion["v"] ** 2 / 2 + motion["x"] + 0.4 * k * depth**2.5
    np.testing.assert_allclose(energy, 0.5, rtol=2e-13)
    with SensitiveRun(fmu, by=["v"], recorded=["x", "v"]) as kept:
        along = kept.run(times, **run).derivative[:, :, 0]
    rates = np.column_stack((motion["v"], k * depth**1.5 - 1.0))
    np.testing.assert_allclose(along, -rates, rtol=1e-9, atol=1e-12 * np.abs(rates).max())


@pytest.mark.parametrize("n", [3, 4, 5, 7])
def test_sparse_series_keep_their_energy(n: int, tmp_path: Path) -> None:
    """From x = 0 a spring like x^4 leaves every fifth power of time: the last two terms may vanish."""
    x, m = Coordinate("x", "1", "deflection", velocity="v"), Parameter("m", 1.0, "1", "mass")
    spring = Mechanism(
        name="spring",
        title="Spring",
        source="textbook",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=x ** (n + 1) / (n + 1),
        contacts=[],
    )
    fmu = Fmu.open(quick_export(spring, tmp_path / "spring.fmu"))
    motion = simulate(fmu, 1.2, start={"x": 0.0, "v": 1.0}, output_times=np.linspace(0.0, 1.2, 25))
    energy = motion["v"] ** 2 / 2 + motion["x"] ** (n + 1) / (n + 1)
    np.testing.assert_allclose(energy, 0.5, rtol=4e-14)


def test_multipliers_at_a_corner_are_one_sided(tmp_path: Path) -> None:
    """Two balls that land at once, and in turn."""
    m, g = Parameter("m", 1.0, "kg", "mass"), Parameter("g", 10.0, "m/s2", "gravity")
    balls = [Coordinate(name, "m", "height", velocity=f"v_{name}") for name in ("a", "b")]
    mechanism = Mechanism(
        name="two_balls",
        title="Two balls",
        source="textbook",
        coordinates=balls,
        kinetic_energy=m * sum(q.v**2 for q in balls) / 2,
        potential_energy=m * g * sum(balls),
        contacts=[Impact(name=f"floor_{q.name}", gap=q, restitution=Newton(1.0)) for q in balls],
    )
    fmu = Fmu.open(quick_export(mechanism, tmp_path / "two_balls.fmu"))
    period = 2.0 * math.sqrt(1.0**2 + 2 * 10.0 * 0.1) / 10.0
    together = orbit_at(fmu, period, {"a": 0.1, "v_a": 1.0, "b": 0.1, "v_b": 1.0}, autonomous=True)
    assert together.one_sided and together.residual < 1e-12
    in_turn = orbit_at(fmu, period, {"a": 0.1, "v_a": 1.0, "b": 0.1, "v_b": -1.0}, autonomous=True)
    assert not in_turn.one_sided and in_turn.residual < 1e-12


def test_friction_along_the_normal_of_its_contact_shifts_nothing() -> None:
    """While the contact is closed the slip is zero, and what rounding makes of it is no event: a derivative by a time
    that it comes later would be rounding over rounding."""
    x, y = Coordinate("q0", "1", "place", velocity="v0"), Coordinate("q1", "1", "place", velocity="v1")
    values = {"m0": 0.640625, "k0": 1.265625, "m1": 0.890625, "k1": 1.609375, "c0": 0.078125}
    m0, k0, m1, k1, c0 = (Parameter(name, value, "1", name) for name, value in values.items())
    c1, f1 = Parameter("c1", 0.265625, "1", "c1"), Parameter("f1", 2.421875, "1", "f1")
    pulse = 0.578125 * sympy.exp(-(((TIME - 1.390625) / 0.125) ** 2)) + 0.0625
    wall = Impact(
        name="on1", gap=0.5 - y + y**2 / 8, restitution=Poisson(sympy.S.Zero), slip=y.v, mu=sympy.Float(0.046875)
    )
    rubbing = Mechanism(
        name="rubbing",
        title="Rubbing",
        source="test",
        coordinates=[x, y],
        kinetic_energy=m0 * x.v**2 / 2 + m1 * y.v**2 / 2,
        potential_energy=k0 * x**2 / 2 + f1 * (1 - sympy.cos(x)) + k1 * y**2 / 2,
        dissipation=c0 * y.v**2 / 2 + c1 * (y.v - x.v) ** 2 / 2,
        applied={x: pulse, y: 1.078125 * sympy.sin(1.453125 * TIME)},
        contacts=[wall],
    )
    fmu, start, step = load(rubbing), {"q0": -0.125, "q1": -0.140625, "v0": -0.328125, "v1": 0.28125}, 1e-6
    names, ends = list(start), np.linspace(1.6, 2.5, 7)
    up, down = (simulate(fmu, 2.5, start=start | {"q0": start["q0"] + h}, output_times=ends) for h in (step, -step))
    with SensitiveRun(fmu, by=[*names, *values], recorded=names) as sensitive:
        for k, end in enumerate(ends):
            slopes = sensitive.run([end], start=start).derivative[-1, :, 0]
            differences = [(up[name][k] - down[name][k]) / (2 * step) for name in names]
            assert slopes == pytest.approx(differences, abs=1e-6)
