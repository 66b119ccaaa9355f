"""The engine of a page: the bits of its native twin, the motions of the engine, functions of a digit's error."""

from __future__ import annotations

import ctypes
import math
import random
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
from checkout import ROOT
from explored import NODE, Twin, answers_at_ends, in_node, values_of
from some_nightly import some_nightly

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


@pytest.mark.parametrize("name", some_nightly(MOTIONS, ("hinge_clearance", "disc_rig")))
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


@pytest.mark.skipif(NODE is None, reason="node is not installed: the module cannot be run outside a browser")
@pytest.mark.parametrize("name", some_nightly(MOTIONS, ("hinge_clearance", "disc_rig")))
def test_a_parameter_at_an_end_of_its_range_moves_or_is_refused_in_words(name: str, tmp_path: Path):
    answers = answers_at_ends(name, tmp_path)  # how long they take, and those of all models: benchmarks/bench_explorer
    for one in answers:
        assert one.refused is None or len(one.refused.split()) > 4, one
        assert one.finite and (one.refused or (one.rows > 1 and one.steps > 0)), one
    zero = [one for one in answers if one.value == 0.0 and one.refused and "must be > 0" in one.refused]
    assert (
        len(answers) > 20 and (zero or name == "hinge_clearance") and sum(one.refused is None for one in answers) > 10
    )


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
LAST_PLACES = {"sin": 0.75, "cos": 0.75, "log2": 2.5, "tan": 2.5, "sinh": 3.5, "cosh": 3.5, "tanh": 3.0, "atan": 2.0}


def test_functions_with_the_same_bits_everywhere_are_right_to_the_last_digits(tmp_path: Path):
    code = ROOT / "fmu_models/explorer/c"
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
            for _ in range(1500):
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
        product = library.same_fma
        product.restype, product.argtypes = ctypes.c_double, (ctypes.c_double,) * 3
        for _ in range(2000):
            x, y = (rng.uniform(0.5, 2.0) * 2.0 ** rng.randint(-60, 60) for _ in "xy")
            # near the product, where all but its last digits vanish; far above and far below it
            z = rng.choice([-x * y, math.nextafter(-x * y, 0.0), x * y * 2.0 ** rng.randint(-120, 70), -1.0])
            assert product(x, y, z) == float(Fraction(x) * Fraction(y) + Fraction(z)), (x, y, z)
        # 1 - 2^-104 is all but half of the last digit, above an odd one: rounded twice it would go up
        assert product(1.0 + 2.0**-52, 1.0 - 2.0**-52, 2.0**53 + 2.0) == 2.0**53 + 2.0
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


FORMATS = ("%g", "%.17g", "%.10g", "%.2g", "%.1g", "%.0e", "%.1e")


def test_what_a_page_has_for_a_c_library_writes_as_python_does(tmp_path: Path):
    code = (ROOT / "fmu_models/explorer/c/freestanding.c").read_text()
    renamed = ("ldexp", "frexp", "strlen", "strcmp", "memcmp", "memchr", "snprintf", "vsnprintf")
    own = "".join(f"#define {name} own_{name}\n" for name in renamed)
    calls = """
int number(char *text, size_t room, const char *format, double value) { return snprintf(text, room, format, value); }
int words(char *text, size_t room, const char *a, int b, long long c, unsigned d, size_t e)
{ return snprintf(text, room, "%s|%.3s|%d|%lld|%u|%zu|%%", a, a, b, c, d, e); }
"""
    made = compile_shared(
        {"all.c": f"{own}#pragma GCC visibility push(default)\n{code}{calls}"},
        tmp_path / f"own{this_platform().suffix}",
    )
    library, rng, room = ctypes.CDLL(str(made)), random.Random(1), ctypes.create_string_buffer(64)
    library.number.argtypes = (ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_double)
    extremes = [0.0, -0.0, 5e-324, 2.5, 0.5, 999999.5, 0.00012345, 1e-5, 1.7976931348623157e308, math.inf, math.nan]
    library.own_ldexp.restype, library.own_ldexp.argtypes = ctypes.c_double, (ctypes.c_double, ctypes.c_int)
    library.own_frexp.restype = ctypes.c_double
    library.own_frexp.argtypes = (ctypes.c_double, ctypes.POINTER(ctypes.c_int))
    for k in range(2000):
        x = extremes[k] if k < len(extremes) else rng.uniform(-10.0, 10.0) * 10.0 ** rng.randint(-300, 300)
        for form in FORMATS:
            length = library.number(room, 64, form.encode(), x)
            assert room.value.decode() == form % x and length == len(form % x), (form, x)
        exponent, power = ctypes.c_int(), rng.randint(-2100, 900)
        if math.isfinite(x) and abs(x) < 1e30:
            assert library.own_ldexp(x, power) == math.ldexp(x, power)
            assert (library.own_frexp(x, exponent), exponent.value) == math.frexp(x)
    library.own_memcmp.argtypes = (ctypes.c_char_p, ctypes.c_char_p, ctypes.c_size_t)
    for one, other in (b"abc", b"abd"), (b"abc", b"abc"), (b"a\xff", b"a\x01"), (b"b", b"a"):
        for size in range(len(one) + 1):
            told, want = library.own_memcmp(one, other, size), (one[:size] > other[:size]) - (one[:size] < other[:size])
            assert (told > 0) - (told < 0) == want
    said = b"abcd|abc|-7|-9000000000000000000|4000000000|7|%"
    given = (b"abcd", -7, ctypes.c_longlong(-9 * 10**18), ctypes.c_uint(4 * 10**9), ctypes.c_size_t(7))
    assert library.words(room, 64, *given) == len(said) and room.value == said
    assert library.words(room, 5, *given) == len(said) and room.value == b"abcd"
