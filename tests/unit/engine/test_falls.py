"""Where a polynomial first falls to zero (engine/step/roots.c), against a search by samples and bisection."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from fmu_models.toolchain.compiler import compile_shared, engine_sources

SHIM = """
#include "step/roots.h"
__attribute__((visibility("default"))) double fall(const double *c, int n, double sign, double h)
{ return signed_first_fall(c, n, sign, h); }
__attribute__((visibility("default"))) double until(const double *c, int n, double h, double end)
{ return fall_until(c, n, 1.0, h, end); }
__attribute__((visibility("default"))) double safe(const double *c, int n, double h, double slack)
{ return safe_length(c, n, 1.0, h, slack); }
#include "step/roots.c"
"""
NUMBERS = np.random.default_rng(7)
EVERY = np.linspace(0.0, 1.0, 40001)
ROUNDING = np.finfo(float).eps


@pytest.fixture(scope="module")
def roots(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder: Path = tmp_path_factory.mktemp("roots")
    names = ("step/roots.c", "step/roots.h", "step/polynomial.h")
    sources = {name: text for name, text in engine_sources().items() if name in names}
    dll = ctypes.CDLL(str(compile_shared({**sources, "all.c": SHIM}, folder / "roots.so")))
    dll.fall.restype = dll.safe.restype = dll.until.restype = ctypes.c_double
    dll.fall.argtypes = (ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_double)
    dll.until.argtypes = (ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_double)
    dll.safe.argtypes = (ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_double)
    return dll


def series(degree: int, ratio: float, first: float) -> np.ndarray:
    """Terms that shrink like those of a Taylor series; the first is positive, and perhaps small beside the others."""
    c = NUMBERS.standard_normal(degree + 1) * ratio ** np.arange(degree + 1)
    c[0] = first * abs(c[0]) + 1e-12
    return c


def sampled(c: np.ndarray) -> np.ndarray:
    return np.polynomial.polynomial.polyval(EVERY, c)


def first_root(c: np.ndarray, values: np.ndarray) -> float:
    """-1 if there is none."""
    below = np.nonzero(values <= 0.0)[0]
    if not below.size:
        return -1.0
    i = int(below[0])
    root = brentq(
        lambda s: np.polynomial.polynomial.polyval(s, c), EVERY[i - 1], EVERY[i], xtol=1e-300, rtol=4 * ROUNDING
    )
    return float(root)  # pyright: ignore[reportArgumentType]  (no full output is asked for)


@pytest.mark.parametrize("ratio", [0.26, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("degree", [1, 2, 5, 8, 9, 16, 17, 24, 30])
def test_the_first_fall_is_found_to_rounding(roots: ctypes.CDLL, degree: int, ratio: float) -> None:
    found = 0
    for first in (1.0, 1e-2, 1e-5):
        for _ in range(40):
            c = series(degree, ratio, first)
            values, size = sampled(c), np.abs(c).sum()
            turns = np.abs(values[1:-1][(values[1:-1] <= values[:-2]) & (values[1:-1] < values[2:])])
            if (turns.size and turns.min() < 1e-6 * size) or abs(values[-1]) < 1e-12 * size:
                continue  # a touch, or a root at the very end: rounding and samples cannot tell
            expected = first_root(c, values)
            h, sign = float(2.0 ** NUMBERS.integers(-20, 20)), float(NUMBERS.choice([-1.0, 1.0]))
            scaled = np.ascontiguousarray(sign * c / h ** np.arange(degree + 1))
            fall = roots.fall(scaled.ctypes.data, degree, sign, h)
            if expected < 0.0:
                assert fall == -1.0
                continue
            found += 1
            slope = np.polynomial.polynomial.polyval(expected, np.polynomial.polynomial.polyder(c))
            terms = np.polynomial.polynomial.polyval(expected, np.abs(c))
            # the root moves by rounding of the terms over the slope
            assert abs(fall / h - expected) <= 8 * ROUNDING * (terms / abs(slope) + expected)
    assert found > 10


@pytest.mark.parametrize(("ratio", "short"), [(0.26, 1 / 32), (0.7, 1.0)])
def test_a_safe_length_is_safe_and_long(roots: ctypes.CDLL, ratio: float, short: float) -> None:
    cut = 0
    for _ in range(400):
        c = series(24, ratio, 1.0)
        values = sampled(c)
        slack = 0.2 * c[0]
        safe = roots.safe(c.ctypes.data, 24, 1.0, slack)
        assert 0.0 <= safe <= 1.0 and (values[safe >= EVERY] > slack).all()
        below = np.nonzero(values <= slack)[0]
        end = EVERY[below[0]] if below.size else 1.0
        assert safe >= 0.99 * end - short  # a hundredth of the way, and six halvings where terms shrink fast
        cut += 0.0 < safe < 1.0
    assert cut > 20


def test_what_starts_at_or_below_zero_falls_at_once(roots: ctypes.CDLL) -> None:
    for c in ([0.0, 1.0], [-1.0, 3.0, 1.0], [0.0, -1.0, 0.0, 0.0, 2.0]):
        array = np.array(c)
        assert roots.fall(array.ctypes.data, array.size - 1, 1.0, 1.0) == 0.0


# positive, and of order 16 by terms that grow at the end
FACTORS = ([1.0, 0.3, 0.2, 0.1], [1.0, *[0.0] * 11, 3.0])


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("r", [0.3, 0.49, 0.77, 0.99])
def test_close_pairs_of_roots_are_seen_and_touches_are_none(roots: ctypes.CDLL, r: float, factor: list[float]) -> None:
    """(s - r)^2 + d has no root, (s - r)^2 - d two close ones, times a factor that is positive."""
    for d in (1e-4, 1e-7, 1e-10):
        for side in (1.0, -1.0):
            c = np.polynomial.polynomial.polymul([r * r + side * d, -2.0 * r, 1.0], factor)
            fall = roots.fall(c.ctypes.data, c.size - 1, 1.0, 1.0)
            assert fall == (-1.0 if side > 0.0 else pytest.approx(r - np.sqrt(d), abs=4 * ROUNDING / np.sqrt(d)))


def test_what_falls_later_than_asked_is_left_out_and_no_digit_of_the_rest_changes(roots: ctypes.CDLL) -> None:
    found = left = 0
    for _ in range(2000):
        c = series(24, 0.5, 1.0)
        where, degree, h = c.ctypes.data, 24, 0.8
        fall = roots.fall(where, degree, 1.0, h)
        if fall <= 0.0:
            assert roots.until(where, degree, h, 0.5 * h) == fall
            continue
        found += 1
        assert roots.until(where, degree, h, min(fall * (1.0 + 1e-9), h)) == fall
        before = roots.until(where, degree, h, fall * (1.0 - 1e-6))
        left += before == -1.0
        assert before in (-1.0, fall)
    assert found > 200
    assert left > 0.9 * found
