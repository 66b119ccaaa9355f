"""Derivatives of Taylor coefficients along directions, of generated code, against mpmath's in 50 digits."""

from __future__ import annotations

import ctypes

import mpmath
import numpy as np
import sympy
from test_jets import EVERY_OPERATION, ORDER, TOLERANCE, e, m, paths, u, v, x

from fmu_models.codegen.c_source import sources
from fmu_models.language.automaton import Automaton
from fmu_models.language.quantities import TIME, State
from fmu_models.lowering.lower import lower
from fmu_models.toolchain.compiler import compile_shared, engine_sources

# derivatives of what follows from parameters are differences in the driver, good to 1e-10
BY_PARAMETERS = 1e-8

DRIVER = """
#pragma GCC visibility push(default)
#include "model.c"
#include "tangents/variation.h"
#include "tangents/pair_jets.h"
#include "model_variation.c"

static Jets jets;
static Variation along;

double *value(char kind, int i)
{
    return kind == 't' ? jets.t : kind == 'u' ? jets.u[i] : kind == 'x' ? jets.x[i] : jets.a[i];
}

double *derivative(char kind, int i)
{
    Pair *found = kind == 't' ? along.t : kind == 'u' ? along.u[i] : kind == 'x' ? along.x[i] : along.a[i];
    return (double *)found;
}

/* the first direction changes no parameter, the second nothing else */
void orders(const double *p, const double *direction, int n)
{
    const double step = 1e-5;
    double d[MODEL_ROOM(MODEL_ND)], more[MODEL_ROOM(MODEL_ND)], less[MODEL_ROOM(MODEL_ND)];
    double up[MODEL_NP], down[MODEL_NP];
    for (int i = 0; i < MODEL_NP; i++) {
        along.p[i] = (Pair){0.0, direction[i]};
        up[i] = p[i] + step * direction[i];
        down[i] = p[i] - step * direction[i];
    }
    model_prepare(p, d);
    model_prepare(up, more);
    model_prepare(down, less);
    for (int i = 0; i < MODEL_ND; i++) {
        along.d[i] = (Pair){0.0, (more[i] - less[i]) / (2.0 * step)};
    }
    along.moved = 1;
    for (int k = 0; k <= n; k++) {
        model_acceleration(p, d, &jets, k);
        model_acceleration_variation(p, d, &jets, &along, k);
    }
}
"""


def test_every_operation_varies_as_its_derivative_says(tmp_path):
    place, speed = State("place", "1", "x"), State("speed", "1", "v")
    results = [State(f"s{i}", "1", "an expression") for i in range(len(EVERY_OPERATION))]
    flows = {one: each.xreplace({x: place, v: speed}) for one, each in zip(results, EVERY_OPERATION, strict=True)}
    model = Automaton(
        name="varied",
        title="varied",
        source="test",
        states=[place, speed, *results],
        flows={place: speed, speed: place, **flows},
    )
    system = lower(model)
    headers = {name: text for name, text in engine_sources().items() if name.endswith(".h")}
    compile_shared({**sources(system), **headers, "all.c": DRIVER}, tmp_path / "library")
    library = ctypes.CDLL(str(tmp_path / "library"))
    for function in (library.value, library.derivative):
        function.restype = ctypes.POINTER(ctypes.c_double)
        function.argtypes = [ctypes.c_char, ctypes.c_int]

    values = {p.name: p.value for p in system.parameters}
    directions: dict[sympy.Symbol, float] = {m: 0.7, e: -0.4}
    places: dict[sympy.Symbol, tuple[str, int]] = {x: ("x", 0), v: ("x", 1), u: ("u", 0), TIME: ("t", 0)}
    rng = np.random.default_rng(3)
    changes: dict[sympy.Symbol, np.ndarray] = {
        s: rng.uniform(-1, 1, ORDER + 1) * 0.6 ** np.arange(ORDER + 1) for s in (x, v)
    }
    changes[u], changes[TIME] = (np.array([first] + [0.0] * ORDER) for first in (0.5, -0.3))
    for symbol, (kind, i) in places.items():
        np.ctypeslib.as_array(library.value(kind.encode(), i), (32,))[: ORDER + 1] = paths()[symbol]
        np.ctypeslib.as_array(library.derivative(kind.encode(), i), (32, 2))[: ORDER + 1, 0] = changes[symbol]
    numbers = ctypes.c_double * len(values)
    library.orders(numbers(*values.values()), numbers(*(directions[p] for p in system.parameters)), ORDER)

    for i, expression in enumerate(EVERY_OPERATION):
        found = np.ctypeslib.as_array(library.derivative(b"a", i + 2), (32, 2))[: ORDER + 1].T
        value = np.array(reference(expression, {}, {}))
        for lane, (path, parameters) in enumerate(((changes, {}), ({}, directions))):
            step = mpmath.mpf(10) ** -20
            more, less = (reference(expression, path, parameters, sign * step) for sign in (1, -1))
            with mpmath.workdps(50):
                expected = np.array([float((a - b) / (2 * step)) for a, b in zip(more, less, strict=True)])
            size = np.maximum.accumulate(np.maximum(np.abs(expected), np.abs(value.astype(float))))
            tolerance = (BY_PARAMETERS if lane else 10 * TOLERANCE) * size
            assert np.all(np.abs(found[lane] - expected) <= tolerance), f"{expression}: {found[lane]}, not {expected}"


def reference(expression, path, parameters, step=0):
    """Taylor coefficients of a neighbour, which lies so many steps along a direction."""
    function = sympy.lambdify([x, v, u, TIME, m, e], expression, modules="mpmath")
    with mpmath.workdps(60):
        polynomials = [
            [
                mpmath.mpf(c) + step * mpmath.mpf(float(dc))
                for c, dc in zip(paths()[s], path.get(s, [0.0] * (ORDER + 1)), strict=True)
            ]
            for s in (x, v, u, TIME)
        ]
        constants = [mpmath.mpf(p.value) + step * parameters.get(p, 0) for p in (m, e)]

        def along(time):
            return function(*(mpmath.polyval(c[::-1], time) for c in polynomials), *constants)

        return mpmath.taylor(along, 0, ORDER)
