"""The engine of a page: the bits of its native twin, the motions of the engine, functions of a digit's error."""

from __future__ import annotations

import ctypes
import math
import random
from pathlib import Path

import mpmath
import numpy as np
import pytest
from explored import NODE, Twin, in_node, values_of

from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate
from fmu_models.toolchain.compiler import compile_shared
from fmu_models.toolchain.platforms import this_platform

# model, changed values, end of the run, section, period of its forcing: friction, stops of Hertz, impacts with
# friction, two contacts at once
MOTIONS = {
    "forced_stick_slip": ({}, 40.0, None, 2.0 * math.pi / 1.6),
    "hinge_clearance": ({}, 30.0, {"state": 1, "level": 0.0, "direction": -1}, 1.0 / 0.429),
    "woodpecker": ({}, 0.5, {"state": 1, "level": 0.0, "direction": 0}, 0.0),
    "disc_rig": ({"w0": 0.41, "theta": 0.1}, 20.0, {"state": 1, "level": 0.0, "direction": -1}, 0.0),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_a_page_has_the_bits_of_its_native_twin_and_the_motion_of_the_engine(name: str, tmp_path: Path):
    changed, until, section, period = MOTIONS[name]
    fmu, times = load(name), np.linspace(0.0, MOTIONS[name][1], 301)
    values = values_of(fmu, **changed)
    twin = Twin(fmu, tmp_path).run(values, times, section)
    assert twin.refused is None and twin.rows.shape[0] == times.size and len(twin.events) > 3
    assert twin.period == pytest.approx(period, rel=1e-15)
    assert (len(twin.crossings) > 3) == (section is not None)
    start, parameters, inputs = (
        {name: value for name, value in changed.items() if name in names}
        for names in (fmu.states, fmu.parameters, fmu.inputs)
    )
    known = simulate(fmu, until, output_times=times, start=start, parameters=parameters, inputs=inputs)
    # a last digit of a sine or a power, carried along a motion that may part from its neighbours
    for i, state in enumerate(fmu.states):
        scale = np.abs(known[state]).max()
        assert np.abs(twin.rows[:40, 1 + i] - known[state][:40]).max() < 1e-11 * scale
    assert len(twin.events) == len(known.events)
    if NODE is None:
        pytest.skip("node is not installed: the module cannot be run outside a browser")
    page = in_node(fmu, tmp_path, values, times, section)
    assert page.refused is None and page.steps == twin.steps
    for part in ("rows", "crossings", "events"):
        assert getattr(page, part).tobytes() == getattr(twin, part).tobytes()


def test_the_engine_refuses_in_its_own_words(tmp_path: Path):
    fmu = load("forced_stick_slip")
    twin = Twin(fmu, tmp_path)
    refused = twin.run(values_of(fmu, m=-1.0), np.array([1.0]), None)
    assert refused.refused is not None and "m must be > 0 kg (mass of the block)" in refused.refused
    assert twin.run(values_of(fmu), np.array([1.0]), None).refused is None


FUNCTIONS = {
    "exp": lambda r: r.uniform(-700.0, 700.0),
    "log": lambda r: 10.0 ** r.uniform(-300.0, 300.0) if r.random() < 0.5 else 1.0 + r.uniform(-0.5, 0.5),
    "sin": lambda r: r.choice([r.uniform(-7.0, 7.0), r.uniform(-1e9, 1e9), math.pi * r.randint(1, 999)]),
    "tan": lambda r: r.uniform(-7.0, 7.0),
    "sinh": lambda r: r.uniform(-3.0, 3.0),
    "tanh": lambda r: r.uniform(-3.0, 3.0),
    "atan": lambda r: 10.0 ** r.uniform(-3.0, 3.0),
}
FUNCTIONS |= {"cos": FUNCTIONS["sin"], "cosh": FUNCTIONS["sinh"], "log2": FUNCTIONS["log"]}
LAST_PLACES = {"log2": 2.5, "tan": 2.5, "sinh": 3.5, "cosh": 3.5, "tanh": 3.0, "atan": 2.0}


def test_functions_with_the_same_bits_everywhere_are_right_to_the_last_digits(tmp_path: Path):
    code = Path(__file__).parents[2] / "fmu_models/explorer/c"
    sources: dict[str, str | bytes] = {name: (code / name).read_text() for name in ("mathematics.c", "mathematics.h")}
    shown = "#pragma GCC visibility push(default)\n"
    made = compile_shared(
        {**sources, "all.c": f'{shown}#include "mathematics.c"\n'}, tmp_path / f"same{this_platform().suffix}"
    )
    library, rng = ctypes.CDLL(str(made)), random.Random(1)
    with mpmath.workprec(200):
        for name, place in FUNCTIONS.items():
            function = getattr(library, f"same_{name}")
            function.restype, function.argtypes = ctypes.c_double, (ctypes.c_double,)
            for _ in range(300):
                x = place(rng)
                true = mpmath.log(x, 2) if name == "log2" else getattr(mpmath, name)(mpmath.mpf(x))
                error = float(abs(mpmath.mpf(function(x)) - true)) / math.ulp(float(true))
                assert error < LAST_PLACES.get(name, 1.0), f"{name}({x!r}) misses by {error} of its last place"
        power = library.same_pow
        power.restype, power.argtypes = ctypes.c_double, (ctypes.c_double, ctypes.c_double)
        for _ in range(300):
            x, y = 10.0 ** rng.uniform(-12.0, 12.0), rng.uniform(-20.0, 20.0)
            true = mpmath.mpf(x) ** mpmath.mpf(y)
            assert float(abs(mpmath.mpf(power(x, y)) - true)) < math.ulp(float(true))
    inf = math.inf
    for x, y in (
        (-2.0, 3.0),
        (3.0, 2.0),
        (-0.0, 3.0),
        (-0.0, -3.0),
        (0.5, inf),
        (inf, -1.0),
        (-1.0, inf),
        (math.nan, 0.0),
    ):
        want = -inf if (x, y) == (-0.0, -3.0) else math.pow(x, y)
        assert repr(power(x, y)) == repr(want), (x, y)
