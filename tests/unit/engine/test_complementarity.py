"""Forces of many contacts at once: small problems against the enumeration of all assignments, large by the laws."""

from __future__ import annotations

import ctypes
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from fmu_models.toolchain.compiler import compile_shared, engine_sources

TOLERANCE = 1e-10
DRIVER = """
#pragma GCC visibility push(default)
#include "events/complementarity.c"
#include "events/lemke.c"

int solve(int n, const double *G, const double *b, const double *size, const double *lower, const double *upper,
          const double *mu, const int *partner, double tolerance, signed char *state, double *force, double *room,
          double *lemke_room)
{
    const BoxProblem problem = {n, G, b, size, lower, upper, mu, partner, tolerance, NULL};
    return complementarity_solve(&problem, state, force, room, lemke_room);
}
"""


class Problem(NamedTuple):
    """y = b + G l, lower - mu l_N <= l <= upper + mu l_N."""

    G: np.ndarray
    b: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    mu: np.ndarray
    partner: np.ndarray

    @property
    def size(self) -> int:
        return len(self.b)

    def bounds(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of the forces, with what the friction of rigid contacts gets from them."""
        spread = np.where(self.partner >= 0, self.mu * force[self.partner], 0.0)
        return self.lower - spread, self.upper + spread

    def error(self, force: np.ndarray) -> float:
        """By how much rates and bounds are violated, in parts of their terms; infinite if a force is not finite."""
        if not np.all(np.isfinite(force)):
            return np.inf
        own = np.abs(np.diag(self.G))
        root = np.sqrt(np.where(own > 0.0, own, 1.0))
        terms = (np.abs(self.b) + np.abs(self.G) @ np.abs(force)) / root
        # a rate of which all terms are rounding is zero
        terms = np.maximum(terms, 1e-3 * terms.max()) if terms.max() > 0.0 else np.ones(self.size)
        rate = (self.b + self.G @ force) / (root * terms)
        lower, upper = self.bounds(force)
        unit = terms / root
        outside = np.maximum(np.maximum(lower - force, force - upper) / unit, 0.0)
        above = np.minimum(np.maximum(rate, 0.0), np.maximum(force - lower, 0.0) / unit)
        below = np.minimum(np.maximum(-rate, 0.0), np.maximum(upper - force, 0.0) / unit)
        return float(max(outside.max(), above.max(), below.max()))


@pytest.fixture(scope="module")
def solver(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., tuple[bool, np.ndarray, np.ndarray]]:
    output = tmp_path_factory.mktemp("solver") / "solver.library"
    compile_shared({**engine_sources(), "all.c": DRIVER}, Path(output))
    library = ctypes.CDLL(str(output))

    def solve(
        problem: Problem, state: np.ndarray | None = None, lemke: bool = True
    ) -> tuple[bool, np.ndarray, np.ndarray]:
        n = problem.size
        state = np.zeros(n, np.int8) if state is None else state.astype(np.int8)
        force = np.zeros(n)
        arrays = [np.ascontiguousarray(a, dtype=float) for a in problem[:1]]
        arrays += [np.ascontiguousarray(a, dtype=float) for a in (problem.b, np.abs(problem.b))]
        arrays += [np.ascontiguousarray(a, dtype=float) for a in (problem.lower, problem.upper, problem.mu)]
        partner = np.ascontiguousarray(problem.partner, dtype=np.int32)
        room, more = np.zeros((n + 10) * n), np.zeros((4 * n + 8) * n)
        pointers = [a.ctypes.data_as(ctypes.c_void_p) for a in (*arrays, partner)]
        found = library.solve(
            n,
            *pointers,
            ctypes.c_double(TOLERANCE),
            state.ctypes.data_as(ctypes.c_void_p),
            force.ctypes.data_as(ctypes.c_void_p),
            room.ctypes.data_as(ctypes.c_void_p),
            more.ctypes.data_as(ctypes.c_void_p) if lemke else None,
        )
        return bool(found), state, force

    return solve


def enumerate_states(problem: Problem) -> list[np.ndarray]:
    """The forces of every assignment {held, lower, upper} that fits; redundant ones by least norm."""
    found = []
    identity = np.eye(problem.size)
    unit = 1.0 / np.sqrt(np.diag(problem.G))
    matrix = problem.G * np.outer(unit, unit)
    for states in itertools.product((0, -1, 1), repeat=problem.size):
        state = np.array(states)
        if np.any((state == 1) & np.isinf(problem.upper)):
            continue
        A, right = matrix.copy(), -problem.b * unit
        for i in np.flatnonzero(state):
            A[i] = identity[i]
            right[i] = (problem.upper[i] if state[i] > 0 else problem.lower[i]) / unit[i]
            if problem.partner[i] >= 0:
                A[i, problem.partner[i]] = -state[i] * problem.mu[i] * unit[problem.partner[i]] / unit[i]
        force = unit * np.linalg.lstsq(A, right, rcond=1e-13)[0]
        if problem.error(force) < 1e-8:
            found.append(force)
    return found


def friction(G: np.ndarray, b: np.ndarray, capacity: np.ndarray) -> Problem:
    n = len(b)
    return Problem(G, b, -capacity, capacity, np.zeros(n), np.full(n, -1))


def dense(n: int, rng: np.random.Generator) -> Problem:
    J = rng.standard_normal((n, n + 1))
    return friction(J @ J.T, 3.0 * rng.standard_normal(n), rng.uniform(0.1, 2.0, n))


def chain(n: int, rng: np.random.Generator) -> Problem:
    """Masses that rub on each other."""
    J = np.eye(n) - np.eye(n, k=1)
    J = J @ np.diag(rng.uniform(0.3, 3.0, n))
    return friction(J @ J.T, 3.0 * rng.standard_normal(n), rng.uniform(0.1, 2.0, n))


def parallel(n: int, rng: np.random.Generator) -> Problem:
    """All on one body."""
    return friction(np.ones((n, n)), np.full(n, 2.0 * n * rng.standard_normal()), rng.uniform(0.1, 2.0, n))


def redundant(n: int, rng: np.random.Generator) -> Problem:
    J = rng.integers(-1, 2, (n, max(1, n // 2))).astype(float)
    J[:, 0] += np.all(J == 0.0, axis=1)
    return friction(J @ J.T, J @ (3.0 * rng.standard_normal(J.shape[1])), rng.uniform(0.1, 2.0, n))


def ill_scaled(n: int, rng: np.random.Generator) -> Problem:
    problem = dense(n, rng)
    unit = 10.0 ** rng.uniform(-4, 4, n)
    return friction(problem.G * np.outer(unit, unit), problem.b * unit, problem.upper / unit)


def integer(n: int, rng: np.random.Generator) -> Problem:
    """Many ties."""
    J = rng.integers(-1, 2, (n, n)).astype(float) + (n + 1.0) * np.eye(n)
    capacity = rng.integers(1, 4, n).astype(float)
    force = rng.integers(-3, 4, n).clip(-capacity, capacity)
    return friction(J @ J.T, -J @ J.T @ force, capacity)


def smooth_rigid(n: int, rng: np.random.Generator) -> Problem:
    J = rng.standard_normal((n, max(1, n - 1)))
    b = J @ rng.standard_normal(J.shape[1])
    return Problem(J @ J.T, b, np.zeros(n), np.full(n, np.inf), np.zeros(n), np.full(n, -1))


def rigid(contacts: int, rng: np.random.Generator, mu: float = 0.3) -> Problem:
    """Corners of blocks: normal directions and friction in turn; little friction, so that the motion is unique."""
    n = 2 * contacts
    J = rng.standard_normal((n, n + 2))
    b = 2.0 * rng.standard_normal(n)
    odd = np.arange(n) % 2 == 1
    return Problem(
        J @ J.T,
        b,
        np.zeros(n),
        np.where(odd, 0.0, np.inf),
        np.where(odd, rng.uniform(0.1, 1.0) * mu, 0.0),
        np.where(odd, np.arange(n) - 1, -1),
    )


SYMMETRIC = [dense, chain, parallel, redundant, ill_scaled, integer, smooth_rigid]


@pytest.mark.parametrize("kind", SYMMETRIC)
def test_rates_are_those_of_the_enumeration(kind, solver) -> None:
    """The rates are unique where G is symmetric, whatever the split of the load."""
    rng = np.random.default_rng(3)
    for n, repetitions in ((1, 60), (2, 60), (3, 40), (4, 20), (5, 8), (6, 3), (7, 1), (8, 1)):
        for _ in range(repetitions):
            problem = kind(n, rng)
            expected = enumerate_states(problem)
            found, _, force = solver(problem, lemke=False)
            assert found == bool(expected)
            if found:
                root = np.sqrt(np.diag(problem.G))
                scale = (np.abs(problem.b) + np.abs(problem.G) @ np.abs(force)) / root
                difference = problem.G @ (force - expected[0]) / root
                assert np.all(np.abs(difference) <= 1e-8 * np.maximum(scale, 1e-3 * scale.max()))
                assert problem.error(force) < 1e-9


@pytest.mark.parametrize("mu", [0.1, 0.5, 1.0])
def test_rigid_contacts_with_friction_have_a_state_of_the_enumeration(mu: float, solver) -> None:
    rng = np.random.default_rng(4)
    for contacts, repetitions in ((1, 60), (2, 40), (3, 6)):
        for _ in range(repetitions):
            problem = rigid(contacts, rng, mu)
            expected = enumerate_states(problem)
            found, _, force = solver(problem)
            assert found and expected
            assert min(np.abs(force - e).max() for e in expected) <= 1e-8 * (1.0 + np.abs(force).max())


@pytest.mark.parametrize("kind", SYMMETRIC)
@pytest.mark.parametrize("n", [20, 50, 100])
def test_many_contacts_obey_the_laws(kind, n: int, solver) -> None:
    rng = np.random.default_rng(n)
    for _ in range(5):
        problem = kind(n, rng)
        found, state, force = solver(problem, lemke=False)
        assert found and problem.error(force) < 1e-9
        again, warm, same = solver(problem, state, lemke=False)
        assert again and np.array_equal(warm, state) and problem.error(same) < 1e-9


@pytest.mark.parametrize("contacts", [8, 16, 32])
@pytest.mark.parametrize("mu", [0.1, 0.5, 1.0])
def test_many_rigid_contacts_with_friction_obey_the_laws(contacts: int, mu: float, solver) -> None:
    rng = np.random.default_rng(contacts)
    for _ in range(8):
        problem = rigid(contacts, rng, mu)
        found, _, force = solver(problem)
        assert found and problem.error(force) < 1e-9


def test_contacts_in_parallel_share_the_load_by_their_capacities(solver) -> None:
    problem = friction(np.ones((3, 3)), np.full(3, -3.0), np.array([1.0, 2.0, 3.0]))
    found, state, force = solver(problem)
    assert found and not state.any()
    assert force == pytest.approx([0.5, 1.0, 1.5], rel=1e-6)


def test_a_contact_without_a_lever_is_never_held(solver) -> None:
    problem = friction(np.diag([0.0, 1.0]), np.array([2.0, 0.5]), np.array([1.0, 1.0]))
    found, state, force = solver(problem)
    assert found and state.tolist() == [-1, 0]
    assert force.tolist() == [-1.0, -0.5]


def test_friction_that_jams_a_rigid_contact_has_no_state(solver) -> None:
    """Painleve: pushing harder pulls the body in; only where it would leave anyway both states are there."""
    one = np.ones(1)
    for b, held in ((-1.0, None), (1.0, 0)):
        problem = Problem(-one, b * one, 0.0 * one, np.inf * one, 0.0 * one, np.array([-1]))
        found, state, _ = solver(problem)
        assert found == (held is not None)
        assert not found or state[0] == held
