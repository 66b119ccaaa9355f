"""Mechanisms of textbooks: their energy, the laws of their contacts, and motions against an independent integration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np
import pytest
from dry_friction import Bodies, integrate
from mechanisms import cart_pole, grid, pendulum, slider_crank, three_masses
from numpy.typing import NDArray

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Trajectory

G = 9.81


def check_energy_and_friction(
    fmu: Fmu,
    start: Mapping[str, float],
    stop: float,
    energy: Callable[[Trajectory], NDArray[np.float64]],
    slips: Callable[[Trajectory], NDArray[np.float64]],
    capacities: Mapping[str, float],
    piece: float,
    damping: Callable[[Trajectory], NDArray[np.float64]] = lambda run: np.zeros(len(run.time)),
) -> Trajectory:
    """Energy and what friction takes from it, by quadrature between events; complementarity wherever that looks.

    Args:
        energy: J, of a run's times.
        slips: (n_contacts, n) in the order of ``capacities``, N.
        piece: s, longest interval of a quadrature.
        damping: W, what dashpots take.
    """
    changes = [e.time for e in simulate(fmu, stop, start=start).events if 0.0 < e.time < stop]
    assert changes
    ends = np.unique([0.0, *changes, stop])
    ends = np.concatenate([np.linspace(a, b, int((b - a) // piece) + 2)[:-1] for a, b in pairwise(ends)] + [[stop]])
    nodes, weights = np.polynomial.legendre.leggauss(10)
    middle, half = (ends[1:] + ends[:-1]) / 2, (ends[1:] - ends[:-1]) / 2
    long = half > 1e-9
    inside = (middle[long, None] + half[long, None] * nodes).ravel()
    run = simulate(fmu, stop, start=start, output_times=inside)
    capacity = np.array(list(capacities.values()))[:, None]
    slip, force = slips(run), np.array([run[f"{name}_force"] for name in capacities])
    power = (capacity * np.abs(slip)).sum(axis=0) + damping(run)
    lost = np.zeros(len(half))
    lost[long] = half[long] * (power.reshape(-1, len(nodes)) @ weights)
    at_ends = simulate(fmu, stop, start=start, output_times=ends)
    balance = energy(at_ends) + np.concatenate([[0.0], np.cumsum(lost)])
    assert np.abs(balance - balance[0]).max() <= 1e-9 * np.ptp(energy(at_ends))
    # stick: no slip and no more than the capacity; slip: all of it, against the slip
    assert np.all(np.abs(force) <= capacity * (1 + 1e-12))
    size = np.abs(slip).max()
    assert np.abs(np.minimum(np.abs(slip) / size, 1.0 - np.sign(slip) * force / capacity)).max() <= 1e-12
    return run


def double_pendulum_bodies(capacity: list[float]) -> Bodies:
    def inertia(q):
        c = np.cos(q[0] - q[1])
        return np.array([[2.0, c], [c, 1.0]])

    def forces(q, v):
        s = np.sin(q[0] - q[1])
        return np.array([-s * v[1] ** 2 - 2 * G * np.sin(q[0]), s * v[0] ** 2 - G * np.sin(q[1])])

    return Bodies(inertia, forces, np.array([[1.0, 0.0], [-1.0, 1.0]]), np.array(capacity))


def pendulum_energy(links: int) -> Callable[[Trajectory], NDArray[np.float64]]:
    """Of points of 1 kg, from their places and velocities."""

    def energy(run: Trajectory) -> NDArray[np.float64]:
        q, w = (np.array([run[f"{letter}{i}"] for i in range(links)]) for letter in "qw")
        vx, vy = np.cumsum(w * np.cos(q), axis=0), np.cumsum(w * np.sin(q), axis=0)
        return ((vx**2 + vy**2) / 2 - G * np.cumsum(np.cos(q), axis=0)).sum(axis=0)

    return energy


def relative_rates(links: int) -> Callable[[Trajectory], NDArray[np.float64]]:
    return lambda run: np.diff(np.array([run[f"w{i}"] for i in range(links)]), axis=0, prepend=0.0)


DOUBLE = (1.5, 0.8)


@pytest.mark.parametrize("start", [(0.9, 0.4, 0.0, 0.0), (0.3, -0.5, 1.0, -2.0)])
def test_a_double_pendulum_with_friction_in_its_joints(start: tuple[float, ...]) -> None:
    names: dict[str, float] = dict(zip(["q0", "q1", "w0", "w1"], start, strict=True))
    capacities = {f"joint{i}": c for i, c in enumerate(DOUBLE)}
    fmu = pendulum(2, DOUBLE)
    check_energy_and_friction(fmu, names, 4.0, pendulum_energy(2), relative_rates(2), capacities, 0.05)
    times = np.linspace(0.0, 3.0, 31)
    known = integrate(double_pendulum_bodies(list(DOUBLE)), np.array(start[:2]), np.array(start[2:]), times)
    run = simulate(fmu, 3.0, start=names, output_times=times)
    assert np.abs(np.array([run[name] for name in names]).T - known).max() < 1e-8


def test_a_chain_of_six_links_with_friction_in_its_joints() -> None:
    links, capacities = 6, (0.9, 0.8, 0.7, 0.5, 0.3, 0.2)
    start = {f"q{i}": 0.6 - 0.25 * i for i in range(links)}
    known = {f"joint{i}": c for i, c in enumerate(capacities)}
    fmu = pendulum(links, capacities)
    check_energy_and_friction(fmu, start, 2.0, pendulum_energy(links), relative_rates(links), known, 0.02)


def crank_lever(q: NDArray[np.float64]) -> NDArray[np.float64]:
    root = np.sqrt(0.64 - 0.09 * np.sin(q) ** 2)
    return -0.3 * np.sin(q) * (1 + 0.3 * np.cos(q) / root)


@pytest.mark.parametrize("F", [0.0, 0.05, 0.4])
def test_a_slider_crank_passes_its_dead_centres_and_loses_the_work_of_friction(F: float) -> None:
    """M(q) w^2/2 + F (way of the slider) stays: the angle decides the speed."""

    def place(q):
        return 0.3 * np.cos(q) + np.sqrt(0.64 - 0.09 * np.sin(q) ** 2)

    def way(a, b):
        """From angle a to b > a: dead centres at the multiples of pi, half a turn is 0.6 m."""
        first, last = np.floor(a / np.pi), np.floor(b / np.pi)
        from_centre = np.abs(place(b) - place(last * np.pi)) - np.abs(place(a) - place(first * np.pi))
        return 0.6 * (last - first) + from_centre

    rng = np.random.default_rng(3)
    came_to_rest = 0
    for q, w in [(0.0, 1.0), (np.pi / 2, 2.0), *zip(rng.uniform(-6, 6, 18), rng.uniform(0.3, 4, 18), strict=True)]:
        run = simulate(slider_crank(), 8.0, parameters={"F": F}, start={"q": q, "w": w})
        begin, inertia = (0.4 + 2.0 * crank_lever(np.asarray(angle)) ** 2 for angle in (q, run["q"]))
        energy = begin * w**2 / 2
        assert np.abs(inertia * run["w"] ** 2 / 2 + F * way(q, run["q"]) - energy).max() < 1e-12 * energy
        slip = crank_lever(run["q"]) * run["w"]
        assert np.abs(run["guide_force"]).max() <= F * (1 + 1e-12)
        moves = np.abs(slip) > 1e-9
        assert np.abs(run["guide_force"] - F * np.sign(slip))[moves].max() <= 1e-12
        came_to_rest += bool(abs(run["w"][-1]) < 1e-15)
    assert (came_to_rest > 0) == (F == 0.4)


def cart_pole_bodies() -> Bodies:
    def inertia(q):
        c = 0.15 * np.cos(q[1])
        return np.array([[1.3, c], [c, 0.075]])

    def forces(q, v):
        return np.array([0.15 * np.sin(q[1]) * v[1] ** 2, 0.15 * G * np.sin(q[1])])

    row = np.array([1.0, 0.0])
    return Bodies(inertia, forces, row[None], np.array([0.6]), [(row, 0.4, 2000.0, 3.0)])


def test_a_cart_with_a_pole_rubs_and_meets_its_stop() -> None:
    start = {"x": 0.2, "q": 0.4, "v": 1.5, "w": 0.0}

    def energy(run: Trajectory) -> NDArray[np.float64]:
        q, v, w = run["q"], run["v"], run["w"]
        pole = 0.3 * ((v + 0.5 * w * np.cos(q)) ** 2 + (0.5 * w * np.sin(q)) ** 2) / 2 + 0.3 * G * 0.5 * np.cos(q)
        return v**2 / 2 + pole + 1000.0 * np.maximum(run["x"] - 0.4, 0.0) ** 2

    def damping(run: Trajectory) -> NDArray[np.float64]:
        return 3.0 * run["v"] ** 2 * (run["x"] > 0.4)

    fmu = cart_pole()
    run = check_energy_and_friction(fmu, start, 3.0, energy, lambda run: run["v"][None], {"rail": 0.6}, 0.02, damping)
    assert {e.contact for e in run.events} == {"rail", "stop"}
    assert np.abs(run["stop_force"] - (run["x"] > 0.4) * (2000 * (run["x"] - 0.4) + 3 * run["v"])).max() < 1e-9
    times = np.linspace(0.0, 2.0, 41)
    known = integrate(cart_pole_bodies(), np.array([0.2, 0.4]), np.array([1.5, 0.0]), times)
    run = simulate(fmu, 2.0, start=start, output_times=times)
    assert np.abs(np.array([run[name] for name in start]).T - known).max() < 1e-8


def springs_energy(K: NDArray[np.float64]) -> Callable[[Trajectory], NDArray[np.float64]]:
    def energy(run: Trajectory) -> NDArray[np.float64]:
        q, v = (np.array([run[f"{letter}{i}"] for i in range(len(K))]) for letter in "qv")
        return ((v**2).sum(axis=0) + (q * (K @ q)).sum(axis=0)) / 2

    return energy


def speeds(n: int) -> Callable[[Trajectory], NDArray[np.float64]]:
    return lambda run: np.array([run[f"v{i}"] for i in range(n)])


def test_three_masses_in_a_row() -> None:
    K = np.array([[160.0, -60.0, 0.0], [-60.0, 100.0, -40.0], [0.0, -40.0, 40.0]])
    capacities = [1.0, 1.5, 0.7]
    start = {"q0": 0.1, "q1": -0.05, "q2": 0.2}
    fmu = three_masses()
    named = {f"f{i}": c for i, c in enumerate(capacities)}
    run = check_energy_and_friction(fmu, start, 3.0, springs_energy(K), speeds(3), named, 0.1)
    assert all(abs(run[f"v{i}"][-1]) < 1e-15 for i in range(3))  # at rest within their capacities
    bodies = Bodies(lambda _: np.eye(3), lambda q, _: -K @ q, np.eye(3), np.array(capacities))
    times = np.linspace(0.0, 3.0, 31)
    known = integrate(bodies, np.array(list(start.values())), np.zeros(3), times)
    run = simulate(fmu, 3.0, start=start, output_times=times)
    found = np.array([run[f"{letter}{i}"] for letter in "qv" for i in range(3)]).T
    assert np.abs(found - known).max() < 1e-9


@pytest.mark.nightly
def test_a_grid_of_blocks() -> None:
    side = 10
    n = side**2
    K = np.zeros((n, n))
    for row in range(side):
        for column in range(side):
            i = row * side + column
            for r, c in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
                if 0 <= r < side and 0 <= c < side:
                    K[i, i] += 50.0
                    K[i, r * side + c] -= 50.0
            K[i, i] += 50.0 * (row in (0, side - 1) or column in (0, side - 1))
    start = {f"q{i}": 0.2 * np.sin(1.3 * i) for i in range(n)}
    named = {f"f{i}": 1.0 + 0.25 * (i % 5) for i in range(n)}
    run = check_energy_and_friction(grid(side), start, 0.4, springs_energy(K), speeds(n), named, 0.05)
    assert {e.after for e in run.events} >= {-1, 0, 1}
