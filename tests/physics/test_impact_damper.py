"""The impact damper: momentum, restitution, energy, and its symmetric motion in closed form.

Symmetric motion with two impacts in a period T (Masri and Caughey 1966): at a time 0 the free mass leaves the right
wall with u, v being the speed of M before and v+ after; half a period later all is mirrored. So u takes it from
x0 + D/2 to -x0 - D/2, momentum and restitution e give the speeds of M, and the linear flow Phi over T/2 with the
steady response p to the force takes (x0, v+) to (-x0, -v):

    u = -(2 x0 + D)/(T/2),    v+ = v - 2 (m/M) u,    v+ - u = -e (v + u)
    Phi (s+ - p) = -(s - p),  s+ = (x0, v+), s = (x0, v)      so      p = (Phi + 1)^-1 (Phi s+ + s)

s, s+ are affine in x0, and the length of p is the amplitude of the response: a quadratic equation for x0. Its solutions
differ in the phase of the force.
"""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest
from lazy_fmu import LazyFmu
from scipy.linalg import expm

from fmu_models.base.errors import StickslipError
from fmu_models.sections.orbits import find_orbit, orbit_at
from fmu_models.simulation.run import simulate

DAMPER = LazyFmu("impact_damper")
DEFAULTS = {"M": 1.0, "m": 0.1, "k": 1.0, "c": 0.04, "f0": 0.1, "omega": 1.0, "D": 2.0, "e": 0.5}
PHI0 = 5.082783065777492
CASES = [{}, {"e": 0.8, "D": 1.5}, {"m": 0.2, "omega": 1.05}, {"c": 0.1, "f0": 0.2, "e": 0.3}]


def matrix(p):
    return np.array([[0.0, 1.0], [-p["k"] / p["M"], -p["c"] / p["M"]]])


def symmetric_motions(p, time=None):
    """Phase of the force, and (x, v, y, u), at a time after the impact at the right wall; a quarter of a period."""
    half = math.pi / p["omega"]
    time = half / 2 if time is None else time
    rho, e = p["m"] / p["M"], p["e"]
    # everything as (constant, factor of x0)
    u = np.array([-p["D"], -2.0]) / half
    before = np.stack([[0.0, 1.0], u * (1 - e + 2 * rho) / (1 + e)])
    after = np.stack([[0.0, 1.0], u * (1 - e - 2 * rho * e) / (1 + e)])
    flow = expm(matrix(p) * half)
    response = np.linalg.solve(flow + np.eye(2), flow @ after + before)
    scaled = response / np.array([[1.0], [p["omega"]]])
    steady = p["f0"] / (p["k"] - p["M"] * p["omega"] ** 2 + 1j * p["c"] * p["omega"])
    quadratic = [scaled[:, 1] @ scaled[:, 1], 2 * scaled[:, 0] @ scaled[:, 1], scaled[:, 0] @ scaled[:, 0]]
    quadratic[2] -= abs(steady) ** 2
    found = []
    for x0 in np.roots(quadratic):
        if abs(x0.imag) > 1e-12:
            continue
        at = np.array([1.0, x0.real])
        # the response p = Re(steady exp(i phase)), p' = Re(i omega steady exp(i phase))
        phase = cmath.phase(complex(scaled[0] @ at, -scaled[1] @ at) / steady)
        later = steady * cmath.exp(1j * (phase + p["omega"] * time))
        x, v = expm(matrix(p) * time) @ (after @ at - response @ at)
        x, v = x + later.real, v + (1j * p["omega"] * later).real
        speed = u @ at
        found.append(
            (phase + p["omega"] * time, {"x": x, "v": v, "y": x0.real + p["D"] / 2 + speed * time, "u": speed})
        )
    return found


@pytest.mark.parametrize("case", CASES)
def test_symmetric_two_impact_motion(case):
    """The closed form returns after half a period as its mirror image, with one impact in between."""
    p = DEFAULTS | case
    half = math.pi / p["omega"]
    returned = 0
    for phase, start in symmetric_motions(p):
        if abs(start["y"] - start["x"]) > p["D"] / 2 or start["u"] > 0:
            continue
        parameters = {**case, "phi0": phase}
        run = simulate(DAMPER, 2 * half, parameters=parameters, start=start, output_times=[half, 2 * half])
        if [event.contact for event in run.impacts] != ["left", "right"]:
            continue
        mirrored = [run[name][0] for name in start]
        assert mirrored == pytest.approx([-value for value in start.values()], abs=1e-12)
        assert [event.time for event in run.impacts] == pytest.approx(
            [half / 2, 3 * half / 2], abs=1e-11
        )  # not all are stable
        returned += 1
    assert returned >= 1


def test_default_start_lies_on_it():
    """In the middle of the cavity, y = x; there y = u (t - T/4)."""
    start = {name: float(DAMPER.variables[name].start or 0.0) for name in ("x", "v", "y", "u")}
    time = math.pi / 2 + start["y"] / start["u"]
    phase, found = min(symmetric_motions(DEFAULTS, time), key=lambda motion: abs(motion[1]["u"] - start["u"]))
    assert found == pytest.approx(start, abs=1e-12)
    assert phase % (2 * math.pi) == pytest.approx(PHI0, abs=1e-12)


@pytest.mark.parametrize("case", CASES)
def test_volume_shrinks_by_e_squared_per_impact(case):
    """Two impacts in a period, friction of the dashpot: the product of the multipliers is e^4 exp(-c T/M)."""
    p = DEFAULTS | case
    T = 2 * math.pi / p["omega"]
    checked = 0
    for phase, start in symmetric_motions(p):
        parameters = {**case, "phi0": phase}
        if abs(start["y"] - start["x"]) > p["D"] / 2 or start["u"] > 0:
            continue
        orbit = orbit_at(DAMPER, T, start, parameters=parameters)
        if orbit.residual < 1e-9:
            scale = np.linalg.norm(orbit.monodromy, 2) ** 2
            expected = p["e"] ** 4 * math.exp(-p["c"] * T / p["M"])
            assert np.linalg.det(orbit.monodromy) == pytest.approx(expected, abs=float(1e-13 * scale))
            checked += 1
    assert checked


def test_default_motion_damps():
    """At resonance: moduli 0.873 and 0.538 over half a period; amplitude 0.297 in place of f0/(c omega) = 2.5."""
    orbit = find_orbit(DAMPER, 2 * math.pi, {"x": -0.3, "v": -0.02, "y": -0.3, "u": -0.7})
    assert orbit.stable
    assert np.sqrt(np.abs(orbit.multipliers)) == pytest.approx([0.873, 0.873, 0.538, 0.538], abs=5e-4)
    run = simulate(DAMPER, 2 * math.pi)
    assert np.abs(run["x"]).max() == pytest.approx(0.297, abs=5e-4)


@pytest.mark.parametrize("case", [*CASES, {"D": 0.3, "e": 0.7}, {"m": 1.0, "e": 1.0}, {"e": 0.0, "D": 1.0}])
def test_every_impact(case):
    """M v + m u is kept; v - u turns to -e times itself; the energy falls by (1 - e^2) w^2 M m/(M + m)/2."""
    p = DEFAULTS | case
    start = {"x": 0.0, "v": 0.5, "y": 0.0, "u": 0.0}
    stop = 40.0
    impacts = simulate(DAMPER, stop, parameters=case, start=start).impacts
    last = -1.0
    reduced = p["M"] * p["m"] / (p["M"] + p["m"])
    checked = 0
    for event in impacts[:15]:
        step = 1e-8
        if event.time - last < 1e-3 or event.time + 1e-3 > stop:
            last = event.time
            continue
        times = [event.time - step, event.time + step]
        run = simulate(DAMPER, stop, parameters=case, start=start, output_times=times)
        # at the impact: v'' step^2 is nothing
        v, u = (run[name] + step * run[f"der({name})"] * [1, -1] for name in ("v", "u"))
        assert p["M"] * v[1] + p["m"] * u[1] == pytest.approx(p["M"] * v[0] + p["m"] * u[0], abs=1e-12)
        assert v[1] - u[1] == pytest.approx(-p["e"] * (v[0] - u[0]), abs=1e-12)
        loss = (1 - p["e"] ** 2) * (v[0] - u[0]) ** 2 * reduced / 2
        assert event.work == pytest.approx(-loss, abs=1e-12)
        last = event.time
        checked += 1
    assert checked >= 2


@pytest.mark.parametrize("case", [{}, {"D": 0.5, "e": 0.7}, {"e": 0.0, "D": 1.0}, {"f0": 0.0, "D": 0.5}])
def test_energy_balance(case):
    """Energy now = energy at the start + work of the force - work of the dashpot + work of all impacts."""
    p, stop = DEFAULTS | case, 30.0
    start = {"x": 0.0, "v": 0.5, "y": 0.0, "u": 0.0}
    run = simulate(DAMPER, stop, parameters=case, start=start, output_times=[0.0, stop])
    bounds = np.unique([0.0, stop, *(event.time for event in run.events)])
    nodes, weights = np.polynomial.legendre.leggauss(20)
    pieces = [np.linspace(a, b, 3) for a, b in itertools.pairwise(bounds)]
    ends = np.concatenate([np.stack([piece[:-1], piece[1:]], axis=1) for piece in pieces])
    middle, half = ends.mean(axis=1)[:, None], np.diff(ends, axis=1) / 2
    times = (middle + half * nodes).ravel()
    at = simulate(DAMPER, stop, parameters=case, start=start, output_times=np.maximum.accumulate(times))
    power = p["f0"] * np.cos(p["omega"] * times + PHI0) * at["v"] - p["c"] * at["v"] ** 2
    supplied = (half * weights).ravel() @ power
    lost = sum(event.work for event in run.impacts)
    assert lost < 0
    assert run["energy"][1] == pytest.approx(run["energy"][0] + supplied + lost, abs=1e-11)


def test_walls_that_overlap_are_refused():
    with pytest.raises(StickslipError, match="walls overlap"):
        simulate(DAMPER, 1.0, parameters={"D": -0.1})
