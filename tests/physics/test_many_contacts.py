"""Many contacts at once, contacts that share a motion, and levers that vanish."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import sympy
from mechanisms import crank_without_rod, opened
from scipy.integrate import solve_ivp

from fmu_models.codegen.lane_tables import lane_obstacles
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.simulation.run import simulate

STIFFNESS, CAPACITY = 100.0, [4.0 + 0.5 * (i % 7) for i in range(100)]


def declared_chain(n: int, stiffness: float, between: bool | None = None) -> Mechanism:
    """Masses between springs, the last of them free; each rubs on the ground, or on the one before it, or on none."""
    q = [Coordinate(f"q{i}", "m", f"place of mass {i}", velocity=f"v{i}") for i in range(n)]
    m = Parameter("m", 1.0, "kg", "mass", positive=True)
    k = Parameter("k", stiffness, "N/m", "stiffness")
    N = Parameter("N", 1.0, "N", "unit of the loads")
    slips = [] if between is None else [q[i].v - (q[i - 1].v if between and i else 0) for i in range(n)]
    return Mechanism(
        name="chain",
        title="chain",
        source="test",
        coordinates=q,
        kinetic_energy=sympy.Add(*(m * x.v**2 / 2 for x in q)),
        potential_energy=k * q[0] ** 2 / 2 + sum(k * (q[i + 1] - q[i]) ** 2 / 2 for i in range(n - 1)),
        contacts=[
            Friction(name=f"f{i}", slip=slip, law=Coulomb(N, sympy.Float(CAPACITY[i]))) for i, slip in enumerate(slips)
        ],
    )


@cache
def chain(n: int, between: bool) -> Fmu:
    return opened(declared_chain(n, STIFFNESS, between))


@pytest.mark.nightly_for("100-False")
@pytest.mark.parametrize(("n", "between"), [(8, False), (8, True), (14, False), (14, True), (100, False)])
def test_a_chain_that_sticks_and_slips_obeys_energy_and_friction(n: int, between: bool) -> None:
    fmu = chain(n, between)
    start = {f"q{i}": 0.3 * np.sin(1.7 * i + 0.2) for i in range(n)}
    stop = 0.5 if n > 50 else 2.0
    events = simulate(fmu, stop, start=start).events
    changes = [e.time for e in events if 0.0 < e.time < stop]
    assert {e.after for e in events} >= {-1, 0, 1}
    times = np.unique(np.concatenate([[0.0], changes, [stop]]))
    middle = np.sort(np.concatenate([times, (times[1:] + times[:-1]) / 2]))
    run = simulate(fmu, stop, start=start, output_times=middle)
    q = np.array([run[f"q{i}"] for i in range(n)])
    v = np.array([run[f"v{i}"] for i in range(n)])
    force = np.array([run[f"f{i}_force"] for i in range(n)])
    extension = np.diff(q, axis=0, prepend=0.0)
    energy = (v**2).sum(axis=0) / 2 + STIFFNESS / 2 * (extension**2).sum(axis=0)
    way = extension if between else q
    slip = np.diff(v, axis=0, prepend=0.0) if between else v
    capacity = np.array(CAPACITY[:n])[:, None]
    # between two events no slip changes its sign
    lost = np.concatenate([[0.0], np.cumsum((capacity * np.abs(np.diff(way, axis=1))).sum(axis=0))])
    assert np.abs(energy + lost - energy[0]).max() < 1e-9 * energy[0]
    inside = np.setdiff1d(np.arange(len(middle)), np.searchsorted(middle, times))
    f, y = force[:, inside], slip[:, inside]
    assert np.all(np.abs(f) <= capacity * (1 + 1e-12))
    assert np.abs(np.minimum(np.abs(y), capacity - np.sign(y) * f)).max() < 1e-12


def test_discs_of_one_speed_stick_up_to_the_sum_of_what_they_hold() -> None:
    """One with constant friction; a grid of speeds and starts."""
    fmu = Fmu.open(built("disc_rig"))
    N, R, disc, k, c = 4.905, 0.125, 0.06, 2.62, 0.055
    for constant in ({"mu_s1": 0.35, "mu_k1": 0.35}, {"p1": 0.0}):
        most = N * (0.65 + constant.get("mu_s1", 0.65))
        for w in (0.2, 0.3, 0.41, 0.5, 0.83, 1.2, -0.41, -0.83, 2.0):
            for theta, omega in ((0.0, 0.0), (0.25, 0.0), (-0.2, disc * w / R)):
                start = {"theta": theta, "omega": omega}
                run = simulate(fmu, 10.0, parameters=constant, inputs={"w0": w, "w1": w}, start=start)
                both = run["F0"] + run["F1"]
                # the sum is never more than both hold, and a joint stick ends where it is reached
                assert np.abs(both).max() <= most * (1 + 1e-9)
                releases = [e.time for e in run.events if e.before == 0 and e.after != 0]
                if not releases:
                    continue
                times = np.unique(releases)
                at = simulate(
                    fmu, 10.0, parameters=constant, inputs={"w0": w, "w1": w}, start=start, output_times=times
                )
                needed = (k * at["theta"] + c * disc * w / R) / R
                assert np.abs(needed) == pytest.approx(most, rel=1e-9)


@cache
def crank() -> Fmu:
    return opened(crank_without_rod())


@pytest.mark.parametrize("F", [0.0, 0.05, 0.3])
def test_a_crank_passes_its_dead_centres(F: float) -> None:
    """It loses the work of its friction and no more; from 40 places and speeds."""
    rng = np.random.default_rng(1)
    starts = [(1.0, 1.0), *zip(rng.uniform(-6, 6, 39), rng.uniform(0.3, 3, 39) * rng.choice([-1, 1], 39), strict=True)]

    def way(q):
        """The integral of |sin|."""
        turns = np.floor(q / np.pi)
        return 2 * turns + 1 - np.cos(q - turns * np.pi)

    for q, w in starts:
        run = simulate(crank(), 10.0, parameters={"F": F}, start={"q": q, "w": w})
        lost = F * 0.3 * np.abs(way(run["q"]) - way(q))
        assert np.abs(run["w"] ** 2 / 2 + lost - w**2 / 2).max() < 1e-12 * w**2
        assert F > 0.0 or run["q"][-1] == pytest.approx(q + 10.0 * w, rel=1e-12)


def test_a_crank_against_an_integration_between_dead_centres() -> None:
    F, q, w, stop = 0.3, 1.0, 1.2, 4.0
    t, y, sign = 0.0, np.array([q, w]), 1.0

    def dead_centre(_: float, y: np.ndarray) -> float:
        return float(np.sin(y[0]))

    dead_centre.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    while t < stop:
        part = solve_ivp(
            lambda _, y, sign=sign: [y[1], -0.3 * F * sign * np.sin(y[0])],
            (t, stop),
            y,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=dead_centre,
        )
        t, y = part.t[-1], part.y[:, -1].copy()
        if part.status == 1:
            sign = -sign
            y[0] += 1e-13
    for run, tolerance in (
        (simulate(crank(), stop, parameters={"F": F}, start={"q": q, "w": w}), 1e-11),
        (simulate_any(crank(), stop, parameters={"F": F}, start={"q": q, "w": w}), 1e-6),
    ):
        assert run["q"][-1] == pytest.approx(y[0], rel=tolerance)
        assert run["w"][-1] == pytest.approx(y[1], rel=tolerance)


def test_a_wave_along_many_masses_is_followed_at_the_cost_of_its_frequency() -> None:
    """Against the modes of the chain. Where the wave has not come to yet nothing moves by 1e-100 m, and no step is made
    shorter for that; exact steps of so many states are left to the series."""
    n = 80
    declared = declared_chain(n, 1.0)
    (obstacle,) = lane_obstacles(lower(declared))
    assert "160 states" in obstacle
    times = np.linspace(0.0, 20.0, 41)
    run = simulate(opened(declared), 20.0, start={"v0": 1.0}, output_times=times)
    matrix = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    matrix[-1, -1] = 1.0
    squares, modes = np.linalg.eigh(matrix)
    omega = np.sqrt(squares)
    places = modes @ (modes[0][:, None] * np.sin(np.outer(omega, times)) / omega[:, None])
    assert np.abs(np.array([run[x.name] for x in declared.coordinates]) - places).max() < 1e-12
    assert run.steps < 300
