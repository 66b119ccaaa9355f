"""Derivatives of motions whose steps are sums, against the exact flow of each mode in complex numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from close_columns import close
from lazy_fmu import LazyFmu
from scipy.linalg import expm

from fmu_models.simulation.sensitivity import SensitiveRun

pytestmark = pytest.mark.digits

SUPPORT = LazyFmu("discontinuous_support")
TABLE = {"m": 1.0, "k": 1.0, "c": 0.05, "f0": 0.5, "omega": 1.0, "ks": 10.0, "cs": 0.3, "g": 4.0}
START = {"x": 3.648464099396639, "v": 2.514570496974713}
TINY = 1e-40


def flow(m: Any, c: Any, k: Any, push: Any, f0: Any, omega: Any) -> np.ndarray:
    """The rates of (x, v, cos, sin, 1) where m x'' + c x' + k x = f0 cos(omega t) + push."""
    rates = np.zeros((5, 5), dtype=complex)
    rates[0, 1] = 1.0
    rates[1] = -k / m, -c / m, f0 / m, 0.0, push / m
    rates[2, 3], rates[3, 2] = -omega, omega
    return rates


def fallen(rates: np.ndarray, z: np.ndarray, row: np.ndarray, near: float) -> tuple[Any, np.ndarray]:
    """When row z falls to zero, near a time, and z then: Newton's method in complex numbers."""
    t: Any = near
    for _ in range(12):
        then = expm(rates * t) @ z
        t = t - (row @ then) / (row @ rates @ then)
    return t, expm(rates * t) @ z


def touched_once(times: list[float], x: Any, v: Any, m: Any, k: Any, c: Any, f0: Any, omega: Any, ks: Any, cs: Any,
                 g: Any, events: list[float]) -> list[Any]:  # fmt: skip
    """(x, v) at times before, in and after the first contact, and the times of its beginning and end."""
    free, on = flow(m, c, k, 0.0, f0, omega), flow(m, c + cs, k + ks, ks * g, f0, omega)
    start = np.array([x, v, 1.0, 0.0, 1.0], dtype=complex)
    begin, touching = fallen(free, start, np.array([1.0, 0.0, 0.0, 0.0, -g]), events[0])
    lasting, left = fallen(on, touching, np.array([ks, cs, 0.0, 0.0, -ks * g]), events[1] - events[0])
    before, inside, after = times
    points = expm(free * before) @ start, expm(on * (inside - begin)) @ touching
    points = *points, expm(free * (after - begin - lasting)) @ left
    return [*np.array(points)[:, :2].ravel(), begin, begin + lasting]


@pytest.mark.parametrize("changed", [{}, {"c": 0.0}, {"omega": 0.0, "f0": 0.3}, {"k": 0.0, "c": 0.0}])
def test_every_direction_is_that_of_the_exact_flow(changed: dict[str, float]):
    parameters = TABLE | changed
    values = START | parameters
    with SensitiveRun(SUPPORT, by=list(values)) as run:
        entry, leaving = (event.time for event in run.run([6.0], parameters=parameters).events[:2])
        times = [0.7 * entry, 0.5 * (entry + leaving), leaving + 0.5]
        found = run.run(times, parameters=parameters)
    exact = [
        touched_once(times, **{**values, name: values[name] + TINY * 1j}, events=[entry, leaving]) for name in values
    ]
    derivatives = np.imag(np.array(exact)).T / TINY
    assert close(found.values.ravel(), np.real(exact[0][:6]), 1e-12)
    assert close(found.derivative.reshape(6, -1), derivatives[:6], 1e-11)
    assert close(found.event_derivative[:2], derivatives[6:], 1e-11)
    for i, name in enumerate(values):
        with SensitiveRun(SUPPORT, by=[name]) as run:
            assert close(run.run(times, parameters=parameters).derivative[..., 0], found.derivative[..., i], 1e-13)
