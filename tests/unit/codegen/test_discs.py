"""Discs of generated code: images of points of complex discs lie within the radii that model/discs.h gives."""

from __future__ import annotations

import cmath
import ctypes
import math

import numpy as np
import pytest

from fmu_models.codegen.c_source import sources
from fmu_models.lowering.lower import lower
from fmu_models.oscillators import load
from fmu_models.toolchain.compiler import compile_shared, engine_sources

DISCS = 4
RADII = (1e-3, 0.7, 1.3, 2.5)
LARGEST = 1e150

DRIVER = """
#pragma GCC visibility push(default)
#include "model.c"
#include "model/discs.h"
#include <fenv.h>
int raised(void) { return fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW); }
void clear(void) { feclearexcept(FE_ALL_EXCEPT); }
void image(int which, double a, const double *r, double b, const double *s, double value, double *y)
{
    switch (which) {
    case 0: disc_product(y, a, r, b, s); break;
    case 1: disc_quotient(y, r, b, 1.0, s, value); break;
    case 2: disc_exp(y, a, r, value); break;
    case 3: disc_wave(y, r, value, b); break;
    case 4: disc_tanh(y, a, r, value); break;
    case 5: disc_sqrt(y, a, r, 1.0); break;
    case 6: disc_log(y, a, r); break;
    case 7: disc_power(y, a, r, b, value); break;
    case 8: disc_atan(y, a, r); break;
    default: break;
    }
}
"""

# value of two operands, and the partner that a wave is given for the second operand
FUNCTIONS = {
    "product": lambda a, b: a * b,
    "quotient": lambda a, b: a / b,
    "exp": lambda a, b: cmath.exp(a),
    "sin": lambda a, b: cmath.sin(a),
    "tanh": lambda a, b: cmath.tanh(a),
    "sqrt": lambda a, b: cmath.sqrt(a),
    "log": lambda a, b: cmath.log(a),
    "power": lambda a, b: a**-1.7,
    "atan": lambda a, b: cmath.atan(a),
}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    everything = {**engine_sources(), **sources(lower(load("block_on_belt"))), "all.c": DRIVER}
    return ctypes.CDLL(str(compile_shared(everything, tmp_path_factory.mktemp("discs") / "library")))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_images_lie_within_their_discs(library: ctypes.CDLL, name: str) -> None:
    """1000 points on the border of each disc, about centres on both sides of the singular places."""
    function = FUNCTIONS[name]
    angles = np.exp(2j * np.pi * np.arange(1000) / 1000)
    four = ctypes.c_double * DISCS
    bounded = 0
    negative = ((-0.6, 1.3), (-1.7, -0.4)) if name not in ("sqrt", "log", "power") else ()
    for a, b in ((0.4, 1.3), (3.0, -2.0), (0.9, 0.1), (12.0, 4.0), (0.05, 1.3), *negative):
        value = function(a, b).real
        second = {"sin": math.cos(a), "power": -1.7}.get(name, b)
        radii, result = four(*RADII), four()
        numbers = [ctypes.c_double(number) for number in (a, second, value)]
        library.image(
            list(FUNCTIONS).index(name), numbers[0], radii, numbers[1], radii, numbers[2], ctypes.byref(result)
        )
        for radius, bound in zip(RADII, result, strict=True):
            if bound >= LARGEST:
                continue
            bounded += 1
            shifted = zip(a + radius * angles, b + radius * np.roll(angles, 137), strict=True)
            farthest = max(abs(function(p, q) - value) for p, q in shifted)
            assert farthest <= bound * (1 + 1e-3), (a, b, radius)
    assert bounded >= 6


@pytest.mark.parametrize("name", ["tanh", "atan"])
@pytest.mark.parametrize("a", [0.4, 1.7, 3.0, 12.0])
def test_discs_of_an_odd_function_are_as_wide_on_either_side(library: ctypes.CDLL, name: str, a: float) -> None:
    """f(-z) = -f(z); where tanh is flat its disc is small on both."""
    four = ctypes.c_double * DISCS
    widths = []
    for place in (a, -a):
        radii, result = four(*RADII), four()
        value = FUNCTIONS[name](place, 0.0).real
        numbers = [ctypes.c_double(number) for number in (place, 0.0, value)]
        library.image(
            list(FUNCTIONS).index(name), numbers[0], radii, numbers[1], radii, numbers[2], ctypes.byref(result)
        )
        widths.append(list(result))
    assert widths[0] == widths[1]


def test_no_operation_overflows(library: ctypes.CDLL) -> None:
    """Radii that have no bound stay numbers, and raise no flag that a host may have made a trap."""
    four = ctypes.c_double * DISCS
    for which in range(len(FUNCTIONS)):
        radii, result = four(1e3, 1e30, LARGEST, LARGEST), four()
        library.clear()
        library.image(
            which, ctypes.c_double(2.0), radii, ctypes.c_double(0.5), radii, ctypes.c_double(0.3), ctypes.byref(result)
        )
        assert library.raised() == 0, list(FUNCTIONS)[which]
        assert all(0.0 <= radius <= LARGEST * (1 + 1e-9) for radius in result)
