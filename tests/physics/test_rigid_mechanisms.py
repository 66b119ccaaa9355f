"""Mechanisms of rigid contacts with friction: energy, complementarity, and closed forms or independent code."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from colliding import opened, rod
from faces import face
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray
from scipy.integrate import quad

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.run import simulate

STICK, OPEN, CLOSED = 0, 2, 3
Array = NDArray[np.float64]


def between_events(fmu: Fmu, stop: float, longest: float, **run: Any) -> tuple[Any, Array]:
    """A run at the nodes of Gauss's rule between its events, on pieces of at most ``longest``, and their weights."""
    events = simulate(fmu, stop, **run).events
    marks = np.unique([0.0, stop, *(e.time for e in events if 0.0 < e.time < stop)])
    pieces = [np.linspace(a, b, 2 + int((b - a) / longest)) for a, b in itertools.pairwise(marks)]
    ends = np.unique(np.concatenate(pieces))
    node, weight = np.polynomial.legendre.leggauss(8)
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    times = (middle[:, None] + half[:, None] * node).ravel()
    return simulate(fmu, stop, output_times=times, **run), (half[:, None] * weight).ravel()


b, h = (Parameter(name, value, "m", "half a side", positive=True) for name, value in (("b", 0.2), ("h", 1.0)))
m, g = Parameter("m", 1.0, "kg", "mass", positive=True), Parameter("g", 9.81, "m/s2", "gravity")
e, mu = Parameter("e", 0.0, "1", "coefficient of restitution"), Parameter("mu", 0.8, "1", "coefficient of friction")


def of_energies(
    name: str, coordinates: Sequence[Coordinate], kinetic: sympy.Expr, potential: sympy.Expr, contacts: list[Impact]
) -> Fmu:
    """A mechanism, built."""
    return opened(
        Mechanism(
            name=name,
            title="t",
            source="s",
            coordinates=coordinates,
            kinetic_energy=kinetic,
            potential_energy=potential,
            contacts=contacts,
        )
    )


@cache
def rocking_block() -> Fmu:
    """A block of sides 2 b and 2 h on its two lower corners."""
    x, y = (Coordinate(name, "m", "of the middle", velocity=f"v{name}") for name in "xy")
    phi = Coordinate("phi", "rad", "angle", velocity="w")
    c, s = sympy.cos(phi), sympy.sin(phi)
    corners = [
        Impact(
            name=name, gap=y + k * b * s - h * c, restitution=Newton(e), slip=x.v + (h * c - k * b * s) * phi.v, mu=mu
        )
        for name, k in (("left", -1), ("right", 1))
    ]
    energy = m * (x.v**2 + y.v**2) / 2 + m * (b**2 + h**2) / 3 * phi.v**2 / 2
    return of_energies("rocking_block", [x, y, phi], energy, m * g * y, corners)


def rest_of_block(tilt: float) -> float:
    """When a block let go at ``tilt`` rests: falls and rises about its corners, w+ = (1 - 3/2 sin(alpha)^2) w-.

    Source: Housner, The behavior of inverted pendulum structures during earthquakes, Bull. Seism. Soc. Am. 53 (1963).
    """
    alpha, p2 = math.atan2(0.2, 1.0), 3 * 9.81 / (4 * math.hypot(0.2, 1.0))
    ratio = 1 - 1.5 * math.sin(alpha) ** 2

    def fall(tilt: float) -> float:
        """From rest to the ground: the integral of dtheta/w, with theta = tilt (1 - s^2)."""

        def slowness(s: float) -> float:
            drop = 2 * p2 * math.sin(alpha - tilt * (1 - s * s / 2)) * math.sin(tilt * s * s / 2)
            at_rest = 2 * math.sqrt(tilt / (2 * p2 * math.sin(alpha - tilt)))
            return 2 * tilt * s / math.sqrt(2 * drop) if s > 0 else at_rest

        return quad(slowness, 0, 1, epsabs=0, epsrel=1e-13)[0]

    total = fall(tilt)
    while tilt > 1e-28:
        # cos(alpha - tilt) - cos(alpha), without cancellation, shrinks by the square of the ratio
        energy = ratio**2 * 2 * math.sin(alpha - tilt / 2) * math.sin(tilt / 2)
        lower = energy / math.sin(alpha)
        for _ in range(60):
            lower = 2 * math.asin(min(1.0, energy / (2 * math.sin(alpha - lower / 2))))
        tilt = lower
        total += 2 * fall(tilt)
    return total


@pytest.mark.parametrize("tilt", [0.05, 0.1, 0.15])
@pytest.mark.parametrize("friction", [0.8, 5.0])
def test_a_rocking_block_comes_to_rest(tilt: float, friction: float) -> None:
    """At the limit of the geometric sequence over its two corners, and stays."""
    start = {"phi": tilt, "y": math.cos(tilt) + 0.2 * math.sin(tilt)}
    run = simulate(rocking_block(), 20.0, start=start, parameters={"mu": friction}, output_times=[0.0, 19.0, 20.0])
    last = run.events[-1].time
    assert last == pytest.approx(rest_of_block(tilt), rel=1e-10)
    assert np.abs([run[name][1:] for name in ("phi", "vx", "vy", "w")]).max() < 1e-11
    assert {int(run[f"{corner}_state"][-1]) for corner in ("left", "right")} == {CLOSED}
    assert run["y"][-1] == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("restitution", [0.3, 0.7])
def test_a_block_that_bounces_and_rocks_comes_to_rest(restitution: float) -> None:
    """Chatters of either corner within the chatter of both; it loses all its energy above that of rest by impacts."""
    start = {"phi": 0.1, "y": math.cos(0.1) + 0.2 * math.sin(0.1)}
    run = simulate(rocking_block(), 40.0, start=start, parameters={"e": restitution}, output_times=[40.0])
    assert {int(run[f"{corner}_state"][-1]) for corner in ("left", "right")} == {CLOSED}
    assert np.abs([run[name][-1] for name in ("phi", "vx", "vy", "w")]).max() < 1e-11
    assert sum(event.work for event in run.events) == pytest.approx(9.81 * (1.0 - start["y"]), rel=1e-9)


@cache
def ball_in_a_box() -> Fmu:
    """A disc of radius r between four walls, at the distances a and c from the middle."""
    x, y = (Coordinate(name, "m", "of the disc", velocity=f"v{name}") for name in "xy")
    phi = Coordinate("phi", "rad", "angle", velocity="w")
    r = Parameter("r", 0.1, "m", "radius", positive=True)
    J = Parameter("J", 0.005, "kg m2", "moment of inertia", positive=True)
    a, c = (Parameter(name, value, "m", "half a side") for name, value in (("a", 1.0), ("c", 0.7)))
    # the rim at a wall: the slip along the tangent that turns with the disc
    walls = {
        "floor": (y + c - r, x.v + r * phi.v),
        "ceiling": (c - r - y, -x.v + r * phi.v),
        "west": (x + a - r, -y.v + r * phi.v),
        "east": (a - r - x, y.v + r * phi.v),
    }
    contacts = [
        Impact(name=name, gap=gap, restitution=Newton(e), slip=slip, mu=mu) for name, (gap, slip) in walls.items()
    ]
    return of_energies("ball_in_a_box", [x, y, phi], m * (x.v**2 + y.v**2) / 2 + J * phi.v**2 / 2, m * g * y, contacts)


def bounced(state: Array, stop: float, e: float, mu: float, gravity: float) -> tuple[Array, int]:
    """The ball by parabolas and impulses: x, y, phi, vx, vy, w, and how often it hit a wall."""
    r, J, a, c, m = 0.1, 0.005, 1.0, 0.7, 1.0
    walls = [(1, 1, c - r, 0, 1), (1, -1, c - r, 0, -1), (0, 1, a - r, 1, -1), (0, -1, a - r, 1, 1)]
    t, hits = 0.0, 0
    while True:
        best, wall = stop - t, None
        for axis, side, reach, _, _ in walls:
            # side * q + reach = 0 on its way down
            pull = -gravity if axis == 1 else 0.0
            roots = np.roots([side * pull / 2, side * state[3 + axis], side * state[axis] + reach][pull == 0.0 :])
            for root in roots[np.isreal(roots)].real:
                if root > 1e-9 and side * (state[3 + axis] + pull * root) < 0 and root < best:
                    best, wall = root, (axis, side, reach)
        state[:3] += best * state[3:]
        state[1] -= gravity * best**2 / 2
        state[4] -= gravity * best
        t += best
        if wall is None:
            return state, hits
        hits += 1
        axis, side, reach = wall
        state[axis] = -side * reach
        _, _, _, other, sign = walls[[w[:3] for w in walls].index(wall)]
        normal = -(1 + e) * m * side * state[3 + axis]
        slip = sign * state[3 + other] + r * state[5]
        along = float(np.clip(-slip / (1 / m + r**2 / J), -mu * normal, mu * normal))
        state[3 + axis] *= -e
        state[3 + other] += sign * along / m
        state[5] += r * along / J


@pytest.mark.parametrize(
    ("gravity", "e", "mu"), [(0.0, 0.9, 0.3), (0.0, 1.0, 0.1), (9.81, 0.95, 0.2), (9.81, 0.8, 1.0)]
)
def test_a_ball_in_a_box_with_four_frictional_walls(gravity: float, e: float, mu: float) -> None:
    start = {"x": 0.1, "y": 0.2, "vx": 3.0, "vy": -1.3, "w": 7.0}
    stop, parameters = (0.9 if e == 0.8 else 4.0), {"g": gravity, "e": e, "mu": mu}
    run = simulate(ball_in_a_box(), stop, start=start, parameters=parameters, output_times=np.linspace(0, stop, 301))
    end, hits = bounced(np.array([0.1, 0.2, 0.0, 3.0, -1.3, 7.0]), stop, e, mu, gravity)
    assert len(run.impacts) == hits >= 3
    assert [run[name][-1] for name in ("x", "y", "phi", "vx", "vy", "w")] == pytest.approx(end, abs=1e-9)
    energy = (run["vx"] ** 2 + run["vy"] ** 2 + 0.005 * run["w"] ** 2) / 2 + gravity * run["y"]
    done = np.cumsum([0.0, *(event.work for event in run.impacts)])
    lost = done[np.searchsorted([event.time for event in run.impacts], run.time, side="right")]
    assert np.abs(energy - lost - energy[0]).max() < 1e-9 * energy[0]


BLOCKS = 3
MASS, FRICTION, STIFFNESS, SPEED = (1.0, 0.7, 0.4), (0.5, 0.35, 0.2), (30.0, 0.0, 12.0), 0.3


@cache
def stack() -> Fmu:
    """Blocks on each other on a belt; the lowest and the highest hang on springs, which rise as they do not."""
    x = [Coordinate(f"x{i}", "m", f"of block {i}", velocity=f"v{i}") for i in range(BLOCKS)]
    y = [Coordinate(f"y{i}", "m", f"height of block {i}", velocity=f"u{i}") for i in range(BLOCKS)]
    belt = Parameter("belt", SPEED, "m/s", "speed of the belt")
    masses = [Parameter(f"m{i}", MASS[i], "kg", "mass", positive=True) for i in range(BLOCKS)]
    springs = [Parameter(f"k{i}", STIFFNESS[i], "N/m", "stiffness") for i in range(BLOCKS)]
    contacts = [
        Impact(
            name=f"c{i}",
            gap=y[i] - (y[i - 1] if i else 0),
            restitution=Newton(sympy.S.Zero),
            slip=x[i].v - (x[i - 1].v if i else belt),
            mu=sympy.Float(FRICTION[i]),
        )
        for i in range(BLOCKS)
    ]
    kinetic = sympy.Add(*(n * (a.v**2 + c.v**2) / 2 for n, a, c in zip(masses, x, y, strict=True)))
    potential = sympy.Add(*(n * g * c + k * a**2 / 2 for n, k, a, c in zip(masses, springs, x, y, strict=True)))
    return of_energies("stack", [*x, *y], kinetic, potential, contacts)


def test_stacked_blocks_on_a_belt() -> None:
    """The load is that of all above; slips and friction obey Coulomb; the belt's work and that of friction balance."""
    start = {"x0": 0.02, "v1": 0.4, "v2": -0.5}
    run, weight = between_events(stack(), 6.0, 0.02, start=start)
    assert {event.after for event in run.events} >= {STICK, -1}
    assert all(event.contact.endswith("_friction") for event in run.events)
    v = np.array([run[f"v{i}"] for i in range(BLOCKS)])
    slip = np.diff(v, axis=0, prepend=SPEED)
    force = np.array([run[f"c{i}_friction_force"] for i in range(BLOCKS)])
    load = np.array([run[f"c{i}_force"] for i in range(BLOCKS)])
    expected = 9.81 * np.cumsum(MASS[::-1])[::-1]
    assert np.abs(load - expected[:, None]).max() < 1e-12 * expected[0]
    capacity = np.array(FRICTION)[:, None] * load
    assert np.all(np.abs(force) <= capacity * (1 + 1e-12))
    assert np.abs(np.minimum(np.abs(slip), capacity - np.sign(slip) * force)).max() < 1e-12
    ends = simulate(stack(), 6.0, start=start, output_times=[0.0, 6.0])
    parts = [MASS[i] * ends[f"v{i}"] ** 2 / 2 + STIFFNESS[i] * ends[f"x{i}"] ** 2 / 2 for i in range(BLOCKS)]
    energy = np.sum(parts, axis=0)
    # friction takes from both sides of each contact, and the belt drives the lowest
    power = -(force * slip).sum(axis=0) - SPEED * force[0]
    assert energy[1] - energy[0] == pytest.approx(weight @ power, abs=1e-9 * energy[0])


def sliding_rod(friction: float, spin: float, slide: float = -1.0) -> dict[str, Any]:
    """At 45 degrees its end slides and neither rises nor falls."""
    theta = math.pi / 4
    start = {
        "y": math.sin(theta),
        "theta": theta,
        "vx": slide - math.sin(theta) * spin,
        "vy": math.cos(theta) * spin,
        "w": spin,
    }
    return {"start": start, "parameters": {"g": 9.81, "mu": friction}}


LIMIT = (1 + 3 / 2) / (3 / 2)


def test_which_solution_of_painleve_is_taken() -> None:
    """mu beyond (1 + 3 c^2)/(3 s c), and so much spin that the end would rise by itself, s w^2 > g: it may lift off, or
    stay down with a force that presses more by friction than it lifts. It stays down: what can be held is.
    """
    fast = math.sqrt(9.81 / math.sin(math.pi / 4)) + 1.0
    down = simulate(rod("newton"), 1e-3, output_times=[0.0], **sliding_rod(LIMIT + 0.1, fast))
    assert (int(down["end_state"][0]), int(down["end_friction_state"][0])) == (CLOSED, -1)
    # G_NN - mu G_NT < 0 times the force is minus what the end would rise with
    rises = math.sin(math.pi / 4) * fast**2 - 9.81
    assert down["end_force"][0] == pytest.approx(rises / (1.5 * (LIMIT + 0.1) - 2.5), rel=1e-9)


@pytest.mark.parametrize(("depth", "located"), [(1e-5, True), (0.05, False)])
def test_an_importer_far_below_the_wall_is_told_of_its_step_and_not_only_of_painleve(
    depth: float, located: bool
) -> None:
    fmu, given = rod("newton"), sliding_rod(LIMIT + 0.1, 0.0)
    with face(fmu, co_simulation=False) as f:
        f.set(given["parameters"] | given["start"] | {"y": 2.0})
        f.initialize()
        f.update()
        f.api.enterContinuousTimeMode()
        f.api.setTime(0.5)
        below = given["start"] | {"y": given["start"]["y"] - depth, "vy": -1e-7}
        f.set_states(np.array([below.get(name, 0.0) for name in fmu.states]))
        f.api.enterEventMode()
        with pytest.raises(FMICallException):
            f.update()
        said = f.messages[-1]
    blames = "the event of contact 'end' was never located" in said and "the importer's step is too long" in said
    assert "no states of 'end' fit the motion" in said
    assert blames != located


def test_painleve_without_a_solution_is_refused_with_words() -> None:
    with pytest.raises(StickslipError, match=r"no states of 'end'.* fit the motion.*Painleve.*lower its coefficient"):
        simulate(rod("newton"), 0.01, **sliding_rod(LIMIT + 0.1, 0.0))
