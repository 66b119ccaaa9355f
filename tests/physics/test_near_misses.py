"""What a run with derivatives tells of events that it almost has: gaps at their least, by closed form."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from mechanisms import mechanism, opened

from fmu_models.fmu.fmu import Fmu
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.engine import engine_of
from fmu_models.simulation.whole_run import Differentiator, Passage, Request


@cache
def between_walls() -> Fmu:
    """x'' = -w^2 x between walls at 1 and -1.5, which it does not reach."""
    m, k = Parameter("m", 2.0, "kg", "mass"), Parameter("k", 8.0, "N/m", "spring")
    near, far = Parameter("near", 1.0, "m", "wall"), Parameter("far", 1.5, "m", "other wall")
    e = Parameter("e", 0.8, "1", "restitution")
    x = Coordinate("x", "m", "place")
    walls = [
        Impact(name="right", gap=near - x, restitution=Newton(e)),
        Impact(name="left", gap=x + far, restitution=Newton(e)),
    ]
    return opened(mechanism("between_walls", [x], m * x.v**2 / 2, k * x**2 / 2, walls))


def passage(x: float, v: float, stop: float) -> Passage:
    """Of a run from there, by its states and the near wall."""
    fmu = between_walls()
    engine, names = engine_of(fmu), [*fmu.states, "near"]
    references = np.array([fmu.variables[name].valueReference for name in names], np.uint32)
    instance = engine.take()
    run = Differentiator(engine, instance, references, 2)
    start = dict(zip(references.tolist(), (x, v, 1.0), strict=True))
    run.run(Request(np.array([0.0, stop]), references[:2]), start, 0.0, 1e-12)
    engine.give(instance)
    assert run.passage is not None
    return run.passage


def test_gaps_at_their_least_and_their_derivatives():
    amplitude, w = 0.8, 2.0
    # the phase begins at .3: nearest to the right wall at (2 pi - .3)/w, to the left at (pi - .3)/w, and again
    found = passage(amplitude * math.cos(0.3), -w * amplitude * math.sin(0.3), 5.0)
    times = [(n * math.pi - 0.3) / w for n in (1, 2, 3)]
    assert found.misses["time"] == pytest.approx(times, abs=1e-9)
    assert found.misses["contact"].tolist() == [1, 0, 1]
    assert found.misses["value"] == pytest.approx([1.5 - amplitude, 1.0 - amplitude, 1.5 - amplitude], abs=1e-12)
    assert found.misses["begins"].tolist() == [0, 0, 0] and found.misses["slope"] == pytest.approx(np.zeros(3))
    # the amplitude is sqrt(x^2 + v^2/w^2): it changes with the start by cos and -sin/w of the phase
    by_start = np.array([math.cos(0.3), -math.sin(0.3) / w])
    expected = [[*-by_start, 0.0], [*-by_start, 1.0], [*-by_start, 0.0]]
    assert found.miss_derivatives == pytest.approx(np.array(expected), abs=1e-11)


def test_a_run_that_comes_near_nothing_has_none():
    found = passage(0.8, 0.0, 0.3)
    assert (len(found.misses), len(found.miss_derivatives)) == (0, 0)
    assert found.rates[0] == pytest.approx([0.0, -4.0 * 0.8], abs=1e-12)
