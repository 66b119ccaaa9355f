"""The impact of contacts by enumeration of all their states, and a body of as many of them as one likes."""

from __future__ import annotations

import functools
import itertools
from typing import NamedTuple

import numpy as np
import sympy
from colliding import LAWS, opened
from numpy.typing import NDArray

from fmu_models.fmu.fmu import Fmu
from fmu_models.language.impacts import Impact
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.run import simulate

CONTACTS, DIRECTIONS = 6, 8
Array = NDArray[np.float64]


class Impacts(NamedTuple):
    """Rates J v of gaps (even rows) and slips (odd rows) of a body of unit mass, and the laws of the contacts."""

    J: Array  # (2 n, directions)
    v: Array
    mu: Array  # (n,)
    e: Array  # (n,)


class Answer(NamedTuple):
    """What one assignment leads to."""

    work: float
    held: int
    impulse: Array
    load: float


@functools.cache
def body(law: str) -> Fmu:
    """Unit masses in all directions; gaps and slips are linear in the coordinates."""
    q = [Coordinate(f"q{i}", "m", "place", velocity=f"v{i}") for i in range(DIRECTIONS)]

    def row(name: str) -> list[Parameter]:
        return [Parameter(f"{name}_{i}", 0.1, "1", "direction") for i in range(DIRECTIONS)]

    contacts = []
    for k in range(CONTACTS):
        e = Parameter(f"e_{k}", 0.5, "1", "coefficient of restitution")
        mu = Parameter(f"mu_{k}", 0.3, "1", "coefficient of friction")
        offset = Parameter(f"offset_{k}", 0.0, "m", "gap at the origin")
        gap = offset + sum(a * x for a, x in zip(row(f"n{k}"), q, strict=True))
        slip = sympy.Add(*(a * x.v for a, x in zip(row(f"t{k}"), q, strict=True)))
        contacts.append(Impact(name=f"c{k}", gap=gap, restitution=LAWS[law](e), slip=slip, mu=mu))
    energy = Parameter("m", 1.0, "kg", "mass", positive=True) * sympy.Add(*(x.v**2 for x in q)) / 2
    return opened(
        Mechanism(name=f"body_{law}", title="t", source="s", coordinates=q, kinetic_energy=energy, contacts=contacts)
    )


def collided(law: str, problem: Impacts) -> Array:
    """Velocities after the impact, by the engine."""
    n, used = len(problem.mu), problem.J.shape[1]
    parameters = {f"offset_{k}": 0.0 if k < n else 1.0 for k in range(CONTACTS)}
    for k in range(n):
        parameters |= {f"e_{k}": problem.e[k], f"mu_{k}": problem.mu[k]}
        for i in range(DIRECTIONS):
            parameters[f"n{k}_{i}"] = problem.J[2 * k, i] if i < used else 0.0
            parameters[f"t{k}_{i}"] = problem.J[2 * k + 1, i] if i < used else 0.0
    start = {f"v{i}": problem.v[i] if i < used else 0.0 for i in range(DIRECTIONS)}
    run = simulate(body(law), 1e-9, start=start, parameters=parameters, output_times=[0.0])
    return np.array([run[f"v{i}"][0] for i in range(used)])


def answers(G: Array, rate: Array, target: Array, mu: Array, given: Array, speed: float) -> list[Answer]:
    """Impulses of one phase by every assignment {open, or with impulse: stick, slip+, slip-} that fits.

    The one that loses most comes first, of equal ones the one that holds most, then the one of least impulses.
    Redundant contacts share by least norm. Of an expansion there are also contacts that slip or stick with the impulse
    given. ``speed``: the largest rate.
    """
    n = len(mu)
    choices = [(True, 0), (True, 1), (True, -1), (False, 0), *([(False, 1), (False, -1)] if given.any() else [])]
    states = list(itertools.product(range(len(choices)), repeat=n))
    normal, tangent = np.arange(0, 2 * n, 2), np.arange(1, 2 * n, 2)
    A = np.tile(np.eye(2 * n), (len(states), 1, 1))
    right = np.zeros((len(states), 2 * n))
    code = np.array(states)
    closed = np.array([c for c, _ in choices])[code]
    slip = np.array([s for _, s in choices])[code]
    loaded = closed | (given > 0.0)
    for k in range(n):
        rows = closed[:, k]
        A[rows, 2 * k] = G[2 * k]
        right[:, 2 * k] = np.where(rows, target[k] - rate[2 * k], given[k])
        rows = loaded[:, k] & (slip[:, k] == 0)
        A[rows, 2 * k + 1] = G[2 * k + 1]
        right[rows, 2 * k + 1] = -rate[2 * k + 1]
        A[:, 2 * k + 1, 2 * k] += np.where(loaded[:, k], slip[:, k] * mu[k], 0.0)
    impulse = np.einsum("sij,sj->si", np.linalg.pinv(A, rcond=1e-12), right)
    after = rate + impulse @ G.T
    speed = 1e-9 * speed
    size = np.maximum(1e-9 * np.abs(impulse).max(axis=1, keepdims=True), speed / np.diag(G).max())
    N, T, y, slips = impulse[:, normal], impulse[:, tangent], after[:, normal] - target, after[:, tangent]
    fits = np.all(np.where(closed, np.abs(y) <= speed, y >= -speed), axis=1)
    fits &= np.all(np.where(closed, N - given >= -size, np.abs(N - given) <= size), axis=1)
    sticks = (np.abs(T) <= mu * N + size) & (np.abs(slips) <= speed)
    moves = (slip * slips >= -speed) & (np.abs(T + slip * mu * N) <= size)
    fits &= np.all(np.where(~loaded, np.abs(T) <= size, np.where(slip == 0, sticks, moves)), axis=1)
    work = np.einsum("si,si->s", impulse, rate + after) / 2
    held = closed.sum(axis=1) + (loaded & (slip == 0)).sum(axis=1)
    load = impulse**2 @ np.diag(G)
    found = [Answer(float(work[s]), int(held[s]), impulse[s], float(load[s])) for s in np.flatnonzero(fits)]
    return sorted(found, key=lambda a: (round(a.work, 9), -a.held, a.load))


def enumerated(law: str, problem: Impacts) -> list[Array]:
    """Velocities after the impact, by enumeration; none if nothing fits.

    More than one where redundant contacts can share the impulses of compression in several ways of the same work, since
    Poisson's rule gives back to each what it took.
    """
    J, nothing = problem.J, np.zeros(len(problem.mu))
    G, rate = J @ J.T, J @ problem.v
    speed = float(np.abs(rate).max())
    if law == "newton":
        target = np.where(rate[::2] < 0.0, -problem.e * rate[::2], 0.0)
        return [problem.v + J.T @ a.impulse for a in answers(G, rate, target, problem.mu, nothing, speed)[:1]]
    found = []
    first = answers(G, rate, nothing, problem.mu, nothing, speed)
    for compression in (a for a in first if a.work <= first[0].work + 1e-8 * abs(first[0].work)):
        middle, given = rate + G @ compression.impulse, problem.e * np.maximum(compression.impulse[::2], 0.0)
        for expansion in answers(G, middle, nothing, problem.mu, given, speed)[:1]:
            found.append(problem.v + J.T @ (compression.impulse + expansion.impulse))
    return found
