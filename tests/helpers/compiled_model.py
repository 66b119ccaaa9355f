"""The generated C of a mechanism, compiled on its own and called through ctypes, for tests of what it computes."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from quick_export import QUICK

from fmu_models.codegen.c_source import sources
from fmu_models.language.automaton import Automaton
from fmu_models.language.mechanism import Mechanism
from fmu_models.lowering.lower import lower
from fmu_models.toolchain.compiler import compile_shared, engine_sources

_TERMS = 32

_DRIVER = """
#pragma GCC visibility push(default)
#include "model.c"

static Jets jets;

const int sizes[] = {MODEL_NQ, MODEL_NZ, MODEL_NC, MODEL_NP, MODEL_NU, MODEL_NY, MODEL_ND, MODEL_NW,
                     MODEL_NV, MODEL_NI};

double *series(char kind, int i, int c)
{
    switch (kind) {
    case 't': return jets.t;
    case 'u': return jets.u[i];
    case 'U': return jets.du[i];
    case 'x': return jets.x[i];
    case 'a': return jets.a[i];
    case 'z': return jets.zrate[i];
    case 's': return jets.slip[i];
    case 'r': return jets.slip_rate[i];
    case 'c': return jets.capacity[i];
    case 'd': return jets.depth[i];
    case 'l': return jets.release[i];
    case 'f': return jets.force[i];
    case 'y': return jets.y[i];
    case 'W': return jets.W[i][c];
    case 'G': return jets.G[i][c];
    default: return 0;
    }
}

void set_sign(int c, double sign)
{
    jets.sign[c] = sign;
}

void set_memory(int c, double speed)
{
    jets.memory[c] = speed;
}

void set_time_rest(double rest)
{
    jets.time_rest = rest;
}

/* whatever an earlier step left behind must not matter */
void spoil(void)
{
    double *all = (double *)&jets;
    for (size_t i = 0; i < sizeof jets / sizeof *all; i++) {
        all[i] = NAN;
    }
    jets.time_rest = 0.0;
}

/* order k of everything, in the order that model.h prescribes */
void order(const double *p, int k)
{
    double d[MODEL_ROOM(MODEL_ND)];
    model_prepare(p, d);
    model_slip(p, d, &jets, k);
    model_depth(p, d, &jets, k);
    model_depth(p, d, &jets, k + 1); /* a law with a root of the depth needs it one order ahead */
    if (k == 0 || !MODEL_CONSTANT_INERTIA) {
        model_inertia(p, d, &jets, k);
    }
    model_acceleration(p, d, &jets, k);
    for (int c = 0; c < MODEL_NC; c++) {
        model_law(p, d, &jets, k, c);
        model_release(p, d, &jets, k, c);
        model_stick(p, d, &jets, k, c);
    }
    model_internal(p, d, &jets, k);
    model_outputs(p, d, &jets, k);
}

double magnitude(const double *p, int c)
{
    double d[MODEL_ROOM(MODEL_ND)];
    model_prepare(p, d);
    return model_slip_magnitude(p, d, &jets, c);
}

double depth_magnitude(const double *p, int c)
{
    double d[MODEL_ROOM(MODEL_ND)];
    model_prepare(p, d);
    return model_depth_magnitude(p, d, &jets, c);
}

void reset(const double *p, int c, double *x)
{
    double d[MODEL_ROOM(MODEL_ND)];
    model_prepare(p, d);
    model_reset(p, d, &jets, c, x);
}
"""


class CompiledModel:
    """A model's generated functions at one point of its parameters, by default their start values."""

    def __init__(self, mechanism: Mechanism | Automaton) -> None:
        self.system = lower(mechanism)
        self.sources = sources(self.system)
        headers = {name: text for name, text in engine_sources().items() if name.endswith(".h")}
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            output = Path(folder) / "model.library"
            compile_shared({**self.sources, **headers, "all.c": _DRIVER}, output, options=QUICK)
            self._library = ctypes.CDLL(str(output))
        self._library.series.restype = ctypes.POINTER(ctypes.c_double)
        self._library.series.argtypes = [ctypes.c_char, ctypes.c_int, ctypes.c_int]
        self._library.set_memory.argtypes = [ctypes.c_int, ctypes.c_double]
        self._library.set_time_rest.argtypes = [ctypes.c_double]
        self._library.set_sign.argtypes = [ctypes.c_int, ctypes.c_double]
        self._library.magnitude.restype = ctypes.c_double
        self._library.depth_magnitude.restype = ctypes.c_double
        self._library.model_violation.restype = ctypes.c_char_p
        self._library.spoil()

    def series(self, kind: str, i: int = 0, c: int = 0) -> np.ndarray:
        """View of a series of Jets, (32,); ``kind`` as in ``series`` of the driver. A copy where it is one constant."""
        if kind in "WG" and self.system.constant_inertia:
            return np.pad([self._library.series(kind.encode(), i, c)[0]], (0, _TERMS - 1))
        return np.ctypeslib.as_array(self._library.series(kind.encode(), i, c), shape=(_TERMS,))

    def order(self, k: int, parameters: Mapping[str, float] | None = None, signs: Sequence[float] = ()) -> None:
        """Compute order k of everything from the orders 0..k of t, u, x."""
        for c, sign in enumerate(signs):
            self._library.set_sign(c, sign)
        self._library.order(self._point(parameters), k)

    def magnitude(self, c: int) -> float:
        """Sum of magnitudes of the terms of a slip speed at order 0."""
        return self._library.magnitude(self._point(None), c)

    def depth_magnitude(self, c: int) -> float:
        """The same for a depth."""
        return self._library.depth_magnitude(self._point(None), c)

    def remember(self, c: int, speed: float) -> None:
        """Set the speed at which contact c was entered."""
        self._library.set_memory(c, speed)

    def rest_of_time(self, rest: float) -> None:
        """Set the part of the time that t[0] has no room for."""
        self._library.set_time_rest(rest)

    def reset(self, c: int) -> list[float]:
        """States after the jump of contact c."""
        x = (ctypes.c_double * len(self.system.states))()
        self._library.reset(self._point(None), c, x)
        return list(x)

    def table(self, name: str) -> list[int]:
        """What model_contact_<name> says of every contact."""
        return list((ctypes.c_ubyte * len(self.system.contacts)).in_dll(self._library, f"model_contact_{name}"))

    def violation(self, parameters: Mapping[str, float]) -> str | None:
        """What model_violation says."""
        sentence = self._library.model_violation(self._point(parameters))
        return sentence.decode() if sentence is not None else None

    def integers(self, name: str, count: int) -> list[int]:
        """An exported array of int."""
        return list((ctypes.c_int * count).in_dll(self._library, name))

    def shorts(self, name: str, count: int) -> list[int]:
        """An exported array of short."""
        return list((ctypes.c_short * count).in_dll(self._library, name))

    def numbers(self, name: str, count: int) -> list[float]:
        """An exported array of double."""
        return list((ctypes.c_double * count).in_dll(self._library, name))

    def _point(self, parameters: Mapping[str, float] | None) -> ctypes.Array[ctypes.c_double]:
        values = {p.name: p.value for p in self.system.parameters} | dict(parameters or {})
        return (ctypes.c_double * max(len(values), 1))(*values.values())
