"""Least shocks out of basins: against stable manifolds and motions that SciPy integrates, and closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar
from wells import forced_well, ring, well

from fmu_models import StickslipError, Strobe, least_shock, load


def distance_to_manifold(c: float) -> float:
    """From (1, 0) to the stable manifold of (0, 0), along which time goes back from the saddle."""
    slope, least = (-c - math.sqrt(c**2 + 4)) / 2, math.inf
    for side in (1e-8, -1e-8):
        run = solve_ivp(
            lambda t, x: [-x[1], -(x[0] - x[0] ** 3 - c * x[1])], (0, 25), [side, side * slope], rtol=1e-12,
            atol=1e-16, method="DOP853", dense_output=True,
        )  # fmt: skip

        def distance(t: float, at=run.sol) -> float:
            return float(np.hypot(at(t)[0] - 1.0, at(t)[1]))

        times = np.linspace(0.0, 25.0, 2001)
        k = int(np.argmin([distance(t) for t in times]))
        bounds = (times[max(k - 1, 0)], times[min(k + 1, 2000)])
        nearest: Any = minimize_scalar(distance, bounds=bounds, method="bounded", options={"xatol": 1e-9})
        least = min(least, float(nearest.fun))
    return least


@pytest.mark.parametrize("c", [0.25, 0.05])
def test_the_least_shock_of_a_double_well_is_the_way_to_the_stable_manifold(c):
    found = least_shock(Strobe(well(), parameters={"c": c}), {"x": 1.0})
    assert found.size == pytest.approx(distance_to_manifold(c), rel=1e-7) and not found.upper_bound
    assert found.labels <= 500 and found.edge == "equilibrium" and found.clear < found.size
    assert np.linalg.norm(found.shock) == pytest.approx(found.size, rel=1e-12)


def test_the_norm_is_the_one_that_is_asked_for():
    """A speed that counts thrice: an ellipse about the same point touches the border elsewhere; one state alone."""
    usual = least_shock(well(), {"x": 1.0})
    found = least_shock(well(), {"x": 1.0}, weights={"x": 1.0, "v": 3.0})
    assert found.size == pytest.approx(math.hypot(found.shock[0], 3.0 * found.shock[1]), rel=1e-12)
    assert found.size >= usual.size
    alone = least_shock(well(), {"x": 1.0}, weights={"v": 2.0})
    assert alone.shock[0] == 0.0 and alone.size == pytest.approx(2.0 * abs(alone.shock[1]), rel=1e-12)
    ends = []
    for share in (1.0 - 1e-6, 1.0 + 1e-6):
        start = [1.0, share * alone.shock[1]]
        run = solve_ivp(lambda t, x: [x[1], x[0] - x[0] ** 3 - 0.25 * x[1]], (0, 60), start, rtol=1e-11, atol=1e-13)
        ends.append(run.y[0, -1] > 0)
    assert ends == [True, False]


def test_the_least_shock_of_a_forced_double_well():
    """A little less stays, a little more leaves, in an integration of its own."""
    found = least_shock(forced_well(), {"x": 1.0})
    assert found.labels <= 500 and not found.upper_bound
    ends = []
    for share in (1.0 - 1e-6, 1.0 + 1e-6):
        run = solve_ivp(
            lambda t, x: [x[1], x[0] - x[0] ** 3 - 0.25 * x[1] + 0.1 * math.cos(t)], (0, 60),
            found.point + share * found.shock, rtol=1e-11, atol=1e-13, method="DOP853",
        )  # fmt: skip
        ends.append(run.y[0, -1] > 0)
    assert ends == [True, False]


@pytest.mark.parametrize("x", [1.2, 0.1])
def test_the_way_to_the_edge_of_a_ring_is_a_half_from_either_side(x):
    found = least_shock(ring(), {"x": x})
    assert found.size == pytest.approx(0.5, rel=1e-8) and found.labels <= 500
    assert found.edge.startswith("cycle of 6.28")


def test_a_border_without_a_known_motion_gives_an_upper_bound():
    fractal = least_shock(forced_well().at(A=0.2), {"x": 1.0})
    assert fractal.upper_bound and "at most" in repr(fractal) and fractal.labels <= 500
    ball = least_shock(Strobe(load("bouncing_ball"), forcing="omega"))
    assert ball.upper_bound and ball.edge in ("a wall", "not decided")


def test_what_is_asked_for_is_checked():
    with pytest.raises(StickslipError, match="no state 'y'"):
        least_shock(well(), weights={"y": 1.0})
    with pytest.raises(StickslipError, match="weight of 'v' must be positive, found -1"):
        least_shock(well(), weights={"v": -1.0})
    with pytest.raises(StickslipError, match="No shock of planar_hopf up to"):
        least_shock(Strobe(load("planar_hopf"), parameters={"mu": -1.0}), labels=40)
