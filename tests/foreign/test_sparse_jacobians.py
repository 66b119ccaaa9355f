"""Stiff FMUs of many states, whose Jacobian is sparse: by closed forms, and by scipy's Radau."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest
from models import Models
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import root_scalar

from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any
from fmu_models.simulation.trajectory import Trajectory
from fmu_models.toolchain.compiler import compile_shared

C = Path(__file__).parents[2] / "fmu_models" / "importer" / "c"


def rod(run: Trajectory, n: int, stride: int) -> NDArray[np.float64]:
    """(n_times, n): cells in their order along the rod of heat.c."""
    return np.column_stack([run[f"x{stride * k % n}"] for k in range(n)])


def modes(n: int, rate: float, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n_times, n): modes 1 and 3 of the rod, each of which decays by itself."""
    shapes = [np.sin(k * np.pi * np.arange(1, n + 1) / (n + 1)) for k in (1, 3)]
    rates = [4 * rate * np.sin(k * np.pi / (2 * (n + 1))) ** 2 for k in (1, 3)]
    return np.sum([np.outer(np.exp(-r * times), shape) for r, shape in zip(rates, shapes, strict=True)], axis=0)


def warmed(
    model: Models, name: str, n: int, stop: float, tolerance: float, *, stride: int = 7
) -> tuple[Trajectory, float]:
    """A run of the rod, and its error."""
    first = modes(n, 1e4, np.zeros(1))[0]
    times = np.linspace(0.0, stop, 21)
    start = {f"x{stride * k % n}": value for k, value in enumerate(first)}
    run = simulate_any(
        model(name), stop, method="stiff", tolerance=tolerance, start=start, output_times=times, record=[]
    )
    return run, float(np.abs(rod(run, n, stride) - modes(n, 1e4, times)).max())


@pytest.mark.parametrize("name", ["heat", "heat_silent", "heat_wrong", "heat_exact"])
def test_modes_of_a_rod(model: Models, fmi: int, name: str) -> None:
    run, error = warmed(model, name, 40, 0.05, 1e-10)
    assert error < 1e-9
    assert "Jacobians by 3 evaluations" in run.method
    declared = fmi > 1 and name not in ("heat_silent", "heat_wrong")
    assert ("as its declared dependencies allow" in run.method) == declared
    assert ("dependencies that the FMU declares are wrong: 78 are missing" in run.method) == (
        name == "heat_wrong" and fmi > 1
    )


def test_a_search_asks_once_for_each_state(model: Models) -> None:
    runs = [warmed(model, name, 40, 0.05, 1e-10)[0] for name in ("heat", "heat_silent")]
    assert runs[0].steps == runs[1].steps
    # and the declared pattern is checked in two directions
    assert runs[1].evaluations - runs[0].evaluations in (41 - 2, 0)


def test_the_order_of_states_does_not_matter(model: Models) -> None:
    shuffled, ordered = (
        warmed(model, name, 40, 0.05, 1e-7, stride=stride)[0]
        for name, stride in (("heat_silent", 7), ("heat_ordered", 1))
    )
    assert (shuffled.steps, shuffled.evaluations) == (ordered.steps, ordered.evaluations)


def test_reactions_that_diffuse(model: Models) -> None:
    n, stop = 25, 10.0
    place = np.arange(1, n + 1) / (n + 1)

    def rates(t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        u, v = y[:n], y[n:]
        bends = [
            (n + 1) ** 2 * np.diff(np.concatenate([[end], part, [end]]), 2) / 50 for part, end in ((u, 1.0), (v, 3.0))
        ]
        return np.concatenate([1 + u**2 * v - 4 * u + bends[0], 3 * u - u**2 * v + bends[1]])

    first = np.concatenate([1 + np.sin(2 * np.pi * place), np.full(n, 3.0)])
    times = np.linspace(0.0, stop, 11)
    start = {f"x{i}": value for i, value in enumerate(first)}
    run = simulate_any(
        model("brusselator"), stop, method="stiff", tolerance=1e-10, start=start, output_times=times, record=[]
    )
    reference = solve_ivp(rates, (0.0, stop), first, method="Radau", rtol=1e-11, atol=1e-12, t_eval=times)
    found = np.column_stack([run[f"x{i}"] for i in range(2 * n)])
    assert np.abs(found - reference.y.T).max() < 2e-8
    assert "by probing" in run.method


def test_an_event_that_couples_other_states(model: Models) -> None:
    n, rate, stop = 40, 1e3, 1.0
    apart = rate * (np.eye(n, k=1) - 2 * np.eye(n) + np.eye(n, k=-1))
    joined = apart.copy()
    joined[[0, -1], [-1, 0]] += rate
    joined[[0, -1], [0, -1]] -= rate
    event = root_scalar(lambda t: (expm(apart * t) @ np.ones(n))[n // 2] - 0.5, bracket=(1e-3, stop), xtol=1e-14).root
    expected = expm(joined * (stop - event)) @ expm(apart * event) @ np.ones(n)
    run = simulate_any(model("ring"), stop, method="stiff", tolerance=1e-10, output_times=[0.0, stop])
    assert [round(e.time, 9) for e in run.events] == [round(event, 9)]
    assert np.abs([run[f"x{i}"][-1] for i in range(n)] - expected).max() < 1e-9
    # of the ring three where its length is a multiple of three, and four else
    assert "Jacobians by 4 evaluations" in run.method


def test_full_rows_and_columns(model: Models) -> None:
    n, stop = 41, 0.05
    matrix = np.diag(-1e3 * np.arange(n, dtype=float))
    matrix[:, 0] += 1e3 * np.arange(n)
    matrix[0] = [-2e3, *[1e3 / (n - 1)] * (n - 1)]
    run = simulate_any(model("hub"), stop, method="stiff", tolerance=1e-10, start={"x0": 1.0}, output_times=[0, stop])
    expected = expm(matrix * stop)[:, 0]
    assert np.abs([run[f"x{i}"][-1] for i in range(n)] - expected).max() < 1e-9
    assert f"Jacobians by {n} evaluations" in run.method


@pytest.mark.nightly
def test_a_thousand_cells(model: Models, fmi: int) -> None:
    run, error = warmed(model, "heat_1000", 1000, 0.1, 1e-8)
    assert error < 1e-7
    assert run.evaluations < 2000 + 1000 * (fmi == 1)


@pytest.mark.nightly
def test_more_than_there_is_room_for(model: Models) -> None:
    with pytest.raises(MotionError, match="for 6000 states at t = 0 s, with more numbers"):
        simulate_any(model("crowd"), 0.01, method="stiff", record=[])
    run = simulate_any(model("crowd"), 0.01, method="dopri5", tolerance=1e-8, record=[], output_times=[0.0, 0.01])
    assert abs(run["x17"][-1] - np.exp(-10.0)) < 1e-9


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The solvers, and what follows from a pattern, behind functions that take plain arrays."""
    wrapped = """
#include "elimination.h"
#include "sparse.h"
#define OUT __attribute__((visibility("default")))
OUT int solve(double *a, int n, int lower, int upper, int *pivot, double *b)
{
    const Band band = linear_band(n, lower, upper);
    if (!linear_real_factor(a, band, pivot)) return 0;
    linear_real_solve(a, band, pivot, b);
    return 1;
}
OUT int solve_complex(double complex *a, int n, int lower, int upper, int *pivot, double complex *b)
{
    const Band band = linear_band(n, lower, upper);
    if (!linear_complex_factor(a, band, pivot)) return 0;
    linear_complex_solve(a, band, pivot, b);
    return 1;
}
OUT int arrange(int n, const int64_t *start, const int *rows, int *colour, int *place, int *band)
{
    Pattern p = {0};
    if (!pattern_set(&p, n, start, rows)) return -1;
    for (int i = 0; i < n; i++) {
        colour[i] = p.colour[i];
        place[i] = p.place[i];
    }
    band[0] = p.band.lower;
    band[1] = p.band.upper;
    band[2] = p.elimination != NULL;
    const int colours = p.colours;
    pattern_free(&p);
    return colours;
}
OUT double work(int n, const int64_t *start, const int *rows, int *order)
{
    return elimination_order(n, (const int64_t *[]){start, start}, (const int *[]){rows, rows}, 1e9, order);
}
OUT int solve_sparse(int n, const int64_t *start, const int *rows, const double *jacobian, const double *shift,
                     int *order, double *b, double complex *c)
{
    Pattern p = {0};
    Factors of_real = {0}, of_complex = {0};
    const int fits = pattern_set(&p, n, start, rows)
                     && work(n, start, rows, order) >= 0
                     && sparse_new(&of_real, n, order, sizeof(double)) && sparse_new(&of_complex, n, order, sizeof *c);
    int regular = 0;
    for (int round = 0; round < 2 && fits; round++)
        regular = sparse_real_factor(&of_real, &p, jacobian, shift[0])
                  && sparse_complex_factor(&of_complex, &p, jacobian, shift[0] + shift[1] * I);
    if (regular) sparse_real_solve(&of_real, b);
    if (regular) sparse_complex_solve(&of_complex, c);
    sparse_free(&of_real);
    sparse_free(&of_complex);
    pattern_free(&p);
    return regular;
}
"""
    parts = ("linear", "pattern", "elimination", "sparse")
    sources = {f"{name}.{kind}": (C / f"{name}.{kind}").read_bytes() for name in parts for kind in "ch"}
    library = tmp_path_factory.mktemp("sparse") / "sparse.so"
    files = ("wrapped.c", *(f"{name}.c" for name in parts))
    return ctypes.CDLL(str(compile_shared({**sources, "wrapped.c": wrapped.encode()}, library, files=files)))


def pointer(array: NDArray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


@pytest.mark.parametrize(
    ("n", "lower", "upper"), [(1, 0, 0), (7, 6, 6), (30, 1, 1), (30, 4, 2), (30, 2, 17), (9, 0, 3)]
)
@pytest.mark.parametrize("kind", [float, complex])
def test_systems_with_a_band(compiled: ctypes.CDLL, n: int, lower: int, upper: int, kind: type) -> None:
    rng = np.random.default_rng(n + lower)
    matrix = rng.standard_normal((n, n)).astype(kind)
    if kind is complex:
        matrix += 1j * rng.standard_normal((n, n))
    i, j = np.indices((n, n))
    matrix[(i - j > lower) | (j - i > upper)] = 0.0
    matrix[np.diag_indices(n)] *= 1e-3 if lower else 1.0  # rows are exchanged
    width = min(n, 2 * lower + upper + 1)
    stored = np.zeros((n, width), dtype=kind)
    for row in range(n):
        first = min(max(0, row - lower), n - width)
        stored[row] = matrix[row, first : first + width]
    right = rng.standard_normal(n).astype(kind)
    solution, pivot = right.copy(), np.zeros(n, dtype=np.int32)
    solve = compiled.solve if kind is float else compiled.solve_complex
    assert solve(pointer(stored), n, lower, upper, pointer(pivot), pointer(solution)) == 1
    assert np.abs(matrix @ solution - right).max() < 1e-12 * np.abs(solution).max() * n
    assert solve(pointer(0.0 * stored), n, lower, upper, pointer(pivot), pointer(solution)) == 0


@pytest.mark.parametrize("seed", range(6))
def test_colours_and_order_of_a_pattern(compiled: ctypes.CDLL, seed: int) -> None:
    """A grid in random order, some of its links in one direction only, and states that nothing touches."""
    rng = np.random.default_rng(seed)
    side = 6
    n = side * side + 2
    names = rng.permutation(n)
    entries = {(names[k], names[k]) for k in range(side * side)}
    for k in range(side * side):
        for other in [k + 1] * (k % side < side - 1) + [k + side] * (k < side * (side - 1)):
            ways = [(k, other), (other, k)][: rng.integers(1, 3)]
            entries |= {(names[column], names[row]) for column, row in ways}
    columns, rows = np.array(sorted(entries)).T
    start, rows = np.searchsorted(columns, np.arange(n + 1)), rows.astype(np.int32)
    colour, place, band = (np.zeros(size, dtype=np.int32) for size in (n, n, 3))
    colours = compiled.arrange(n, *map(pointer, (start, rows, colour, place, band)))
    assert colours == colour.max() + 1 <= 10
    pairs = set(zip(colour[columns], rows, strict=True))
    assert len(pairs) == len(entries)  # of one colour no two columns have a row in common
    assert sorted(place) == list(range(n))
    below = place[rows] - place[columns]
    assert [below.max(), -below.min()] == band[:2].tolist()
    assert band[:2].max() <= 2 * side


@pytest.mark.parametrize("pivots", [False, True])
@pytest.mark.parametrize(("n", "links"), [(1, 0), (12, 20), (60, 70), (60, 300)])
def test_sparse_systems(compiled: ctypes.CDLL, n: int, links: int, pivots: bool) -> None:
    rng = np.random.default_rng(n + links)
    matrix = np.zeros((n, n))
    for i, j in rng.integers(0, n, (links, 2)):
        matrix[i, j], matrix[j, i] = rng.standard_normal(2)
    if pivots:
        matrix[np.arange(n), np.roll(np.arange(n), 1)] += 3.0
        matrix[np.roll(np.arange(n), 1), np.arange(n)] += 1.0
    matrix[np.diag_indices(n)] = 0.0  # none in the pattern: only the shift is there
    rows, start = np.zeros(0, dtype=np.int32), [0]
    for column in matrix.T:
        rows = np.append(rows, np.flatnonzero(column)).astype(np.int32)
        start.append(rows.size)
    entries = np.concatenate([column[np.flatnonzero(column)] for column in matrix.T])
    shift = np.array([1e-6 if pivots and n > 1 else 2.0, 1.5])
    right = rng.standard_normal(n)
    order, real, complex_ = np.zeros(n, dtype=np.int32), right.copy(), right.astype(complex)
    arrays = (np.array(start, dtype=np.int64), rows, entries, shift, order, real, complex_)
    assert compiled.solve_sparse(n, *map(pointer, arrays)) == 1
    assert sorted(order) == list(range(n))
    for solution, shifted in ((real, shift[0]), (complex_, shift[0] + 1j * shift[1])):
        expected = np.linalg.solve(shifted * np.eye(n) - matrix, right)
        assert np.abs(solution - expected).max() < 1e-9 * np.abs(expected).max()
    shift[:] = 0.0
    if not links:
        assert compiled.solve_sparse(n, *map(pointer, arrays)) == 0


def test_what_is_solved_by_entries(compiled: ctypes.CDLL) -> None:
    """A plate and a hub are, a rod is not: there a band is cheaper."""
    side = 30
    plate = {(k, k) for k in range(side * side)}
    for k in range(side * side):
        neighbours = [k + 1] * (k % side < side - 1) + [k + side] * (k < side * (side - 1))
        plate |= {pair for other in neighbours for pair in ((k, other), (other, k))}
    rod = {(k, i) for k in range(100) for i in range(max(0, k - 1), min(100, k + 2))}
    hub = {pair for k in range(100) for pair in ((k, k), (0, k), (k, 0))}
    compiled.work.restype = ctypes.c_double
    # of a hub each state but one has one neighbour left, and of a rod; of the plate as a bound
    for n, entries, sparse, work in ((side * side, plate, 1, 200e3), (100, rod, 0, 99), (100, hub, 1, 99)):
        columns, rows = np.array(sorted(entries)).T
        start, rows = np.searchsorted(columns, np.arange(n + 1)), rows.astype(np.int32)
        colour, place, band = (np.zeros(size, dtype=np.int32) for size in (n, n, 3))
        compiled.arrange(n, *map(pointer, (start, rows, colour, place, band)))
        assert band[2] == sparse
        assert compiled.work(n, *map(pointer, (start, rows, colour))) <= work


def test_modes_of_a_plate(model: Models) -> None:
    """Cells between cold edges: two modes, each of which decays by itself."""
    side, rate, stop = 18, 1e3, 0.2
    times = np.linspace(0.0, stop, 5)
    shapes = [np.sin(k * np.pi * np.arange(1, side + 1) / (side + 1)) for k in (1, 2)]
    rates = [4 * rate * np.sin(k * np.pi / (2 * (side + 1))) ** 2 for k in (1, 2)]
    first, second = np.outer(shapes[0], shapes[1]).ravel(), np.outer(shapes[1], shapes[1]).ravel()
    expected = np.outer(np.exp(-(rates[0] + rates[1]) * times), first) + np.outer(np.exp(-2 * rates[1] * times), second)
    start = {f"x{i}": value for i, value in enumerate(first + second)}
    run = simulate_any(
        model("plate"), stop, method="stiff", tolerance=1e-10, start=start, output_times=times, record=[]
    )
    found = np.column_stack([run[f"x{i}"] for i in range(side * side)])
    assert np.abs(found - expected).max() < 1e-9
    assert "found by probing" in run.method
