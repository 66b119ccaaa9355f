"""Pendulums of many links, whose mass matrix the generated code factors, against their closed form."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import sympy
from pendulums import acceleration, angles, energy, lengths, mass_matrix, pendulum
from quick_export import quick_export
from scipy.integrate import solve_ivp

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.friction import Friction
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.validation.methods.equations import Equations

UNTIL = 2.0


def built(mechanism: Mechanism, folder: Path) -> Fmu:
    return Fmu.open(quick_export(mechanism, folder / f"{mechanism.name}.fmu"))


def states(run, n: int) -> np.ndarray:
    """(2 n, n_times)"""
    return np.array([run[f"q{i}"] for i in range(n)] + [run[f"w{i}"] for i in range(n)])


def reference(start: np.ndarray, times: np.ndarray, torque: float = 0.0) -> np.ndarray:
    n = len(start) // 2

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return np.r_[y[n:], acceleration(y[:n], y[n:], torque)]

    return solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times).y


@pytest.mark.nightly_for("10")
@pytest.mark.parametrize("n", [3, 5, 10])
def test_a_pendulum_follows_its_closed_form_and_keeps_its_energy(n, tmp_path):
    q = angles(n)
    start = np.array([x.start for x in q] + [x.v.start for x in q])
    times = np.linspace(0.0, UNTIL, 21)
    run = simulate(built(pendulum(q), tmp_path), UNTIL, output_times=times)
    # rounding, spread by a motion that forgets its start at a rate of some 1/s
    assert np.abs(states(run, n) - reference(start, times)).max() < 1e-9
    whole = run["energy"]
    assert whole[0] == pytest.approx(energy(start[:n], start[n:]), rel=1e-14)
    assert np.ptp(whole) < 1e-12 * np.abs(whole).max()


def test_derivatives_pass_through_the_factored_mass_matrix(tmp_path):
    n, until, step = 4, 1.0, 1e-5
    q = angles(n)
    start = np.array([x.start for x in q] + [x.v.start for x in q])
    with SensitiveRun(built(pendulum(q), tmp_path), by=["q0", "w2"]) as run:
        found = run.run([until]).derivative[0]
    for column, i in enumerate((0, n + 2)):
        ends = [reference(start + sign * step * np.eye(2 * n)[i], np.array([until]))[:, -1] for sign in (1, -1)]
        assert found[:, column] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6, abs=1e-7)


def joint(q: list[Coordinate], capacity: float) -> Friction:
    """Friction in the second joint."""
    N = Parameter("N", 1.0, "N", "normal force")
    r = Parameter("r", 1.0, "m", "radius of the joint")
    return Friction(name="joint", slip=r * (q[1].v - q[0].v), law=Coulomb(N, sympy.Float(capacity)))


@pytest.mark.parametrize("sticks", [True, False])
def test_friction_in_a_joint_acts_through_the_factored_mass_matrix(sticks, tmp_path):
    n, times = 5, np.linspace(0.0, 0.2, 5)
    q = angles(n)
    lever = np.r_[-1.0, 1.0, np.zeros(n - 2)]
    start = np.array([x.start for x in q] + [0.5] * n)
    start[n + 1] += 0.0 if sticks else 2.0
    capacity = 1e3 if sticks else 0.3

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        at, w = y[:n], y[n:]
        force = -capacity
        if sticks:
            compliance = lever @ np.linalg.solve(mass_matrix(at), lever)
            force = -(lever @ acceleration(at, w)) / compliance
        return np.r_[w, acceleration(at, w, lever * force)]

    expected = solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times).y
    names = [x.name for x in q] + [x.v.name for x in q]
    fmu = built(pendulum(q, [joint(q, capacity)]), tmp_path)
    run = simulate(fmu, times[-1], start=dict(zip(names, start, strict=True)), output_times=times)
    assert set(run["joint_state"]) == {0 if sticks else 1}
    assert np.abs(states(run, n) - expected).max() < 1e-10


def test_an_impact_of_the_tip_throws_all_links(tmp_path):
    n, wall, restitution = 4, 1.35, 0.6
    q = angles(n)
    start = np.array([x.start for x in q] + [2.0] * n)
    times = np.array([0.5])

    def gap(_: float, y: np.ndarray) -> float:
        return float(wall - lengths(n) @ np.sin(y[:n]))

    gap.terminal = True  # type: ignore[attr-defined]

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return np.r_[y[n:], acceleration(y[:n], y[n:])]

    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-13}
    before = solve_ivp(rate, (0.0, times[-1]), start, events=gap, **options)
    hit, y = before.t[-1], before.y[:, -1]
    lever = -lengths(n) * np.cos(y[:n])
    thrown = np.linalg.solve(mass_matrix(y[:n]), lever)
    y[n:] -= (1 + restitution) * (lever @ y[n:]) / (lever @ thrown) * thrown
    expected = solve_ivp(rate, (hit, times[-1]), y, **options).y[:, -1]

    x = sum((length * sympy.sin(angle) for length, angle in zip(lengths(n), q, strict=True)), sympy.S.Zero)
    e = Parameter("e", restitution, "1", "restitution")
    stop = Impact(name="wall", gap=wall - x, restitution=Newton(e))
    names = [x.name for x in q] + [x.v.name for x in q]
    fmu = built(pendulum(q, [stop]), tmp_path)
    run = simulate(fmu, times[-1], start=dict(zip(names, start, strict=True)), output_times=times)
    assert [event.time for event in run.events] == pytest.approx([hit], abs=1e-11)
    assert np.abs(states(run, n)[:, -1] - expected).max() < 1e-9


def test_a_contact_between_a_chain_and_a_body_beside_it_throws_both(tmp_path):
    """A cart runs into the first of four coupled masses, of which the last two have a contact of their own."""
    q = [Coordinate(f"q{i}", "m", "place", velocity=f"w{i}", v_start=float(i == 0)) for i in range(5)]
    m = Parameter("m", 1.0, "kg", "mass", positive=True)
    v = [x.v for x in q]
    kinetic = m * (sum(a**2 for a in v) + sum(a * b for a, b in itertools.pairwise(v[1:]))) / 2
    room = Parameter("room", 1.0, "m", "between cart and chain")
    ahead = Impact(name="ahead", gap=room + q[1] - q[0], restitution=Newton(0.5))
    inside = Impact(name="inside", gap=room + q[4] - q[3], restitution=Newton(0.5))
    parts = {"coordinates": q, "kinetic_energy": kinetic, "contacts": [inside, ahead]}
    run = simulate(built(Mechanism(name="chain", title="t", source="s", **parts), tmp_path), 1.25)
    mass = np.eye(5) + np.diag([0.0, 0.5, 0.5, 0.5], 1) + np.diag([0.0, 0.5, 0.5, 0.5], -1)
    lever = np.array([-1.0, 1.0, 0.0, 0.0, 0.0])
    thrown = np.linalg.solve(mass, lever)
    expected = np.eye(5)[0] + 1.5 * thrown / (lever @ thrown)
    assert [event.contact for event in run.events] == ["ahead"]
    assert run.events[0].time == pytest.approx(1.0, abs=1e-14)
    assert states(run, 5)[5:, -1] == pytest.approx(expected, abs=1e-14)


def rod(n: int, coupling: float = 1.0) -> Mechanism:
    """A bar of n + 1 linear finite elements, clamped at both ends: mass and stiffness have three bands."""
    q = [Coordinate(f"q{i}", "m", f"displacement of node {i}", velocity=f"v{i}") for i in range(n)]
    m = Parameter("m", 1.0, "kg", "mass of an element", positive=True)
    k = Parameter("k", 100.0, "N/m", "stiffness of an element", positive=True)
    c = Parameter("c", coupling, "1", "coupling of neighbours")
    v = [sympy.S.Zero, *(x.v for x in q), sympy.S.Zero]
    x = [sympy.S.Zero, *q, sympy.S.Zero]
    return Mechanism(
        name=f"rod_of_{n}",
        title="rod",
        source="test",
        coordinates=q,
        kinetic_energy=sympy.Add(*(m * (a**2 + c * a * b + b**2) / 6 for a, b in itertools.pairwise(v))),
        potential_energy=sympy.Add(*(k * (b - a) ** 2 / 2 for a, b in itertools.pairwise(x))),
    )


def test_a_rod_of_bands_swings_in_its_mode(tmp_path):
    n, mode, until = 24, 3, 2.0
    system = lower(rod(n))
    assert len(system.inertia) == 3 * n - 2
    c = np.cos(mode * np.pi / (n + 1))
    shape = np.sin(mode * np.pi * np.arange(1, n + 1) / (n + 1))
    times = np.linspace(0.0, until, 9)
    start = {f"q{i}": value for i, value in enumerate(shape)}
    run = simulate(built(rod(n), tmp_path), until, start=start, output_times=times)
    expected = np.outer(shape, np.cos(np.sqrt(6 * 100.0 * (1 - c) / (2 + c)) * times))
    assert np.abs(np.array([run[f"q{i}"] for i in range(n)]) - expected).max() < 1e-12


def test_a_mass_matrix_that_loses_its_energy_ends_the_run(tmp_path):
    fmu = built(rod(5), tmp_path)
    with pytest.raises(StickslipError, match="mass matrix is not positive definite at t = 0"):
        simulate(fmu, 1.0, start={"q0": 0.1}, parameters={"c": 5.0})


def test_what_needs_accelerations_written_out_says_why_there_are_none():
    with pytest.raises(StickslipError, match="mass matrix of 4 coordinates is factored in the generated code"):
        Equations(lower(pendulum(angles(4))))
