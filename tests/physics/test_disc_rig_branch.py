"""The disc rig of class a over the speed of its disc: the cycle between its Hopf point and where it loses its stick.

Hopf         c = R^2 N (mu_s - mu_k) p / (1 + p r w0)^2: friction falls with the slip speed as fast as damping rises
stick lost   the cycle that slips all along, but at the point of release, where slip and its rate are zero
"""

from __future__ import annotations

import math

import pytest
from closed_form import root
from scipy.integrate import solve_ivp

from fmu_models import Strobe, branch, load

J, K, C, R, RADIUS, N = 0.0548, 2.62, 0.055, 0.125, 0.06, 5.0
# mu_s, mu_k, p; a speed on the cycle, a range of it
MATERIALS = {
    "paper/paper": ((0.35, 0.25, 15.0), 0.55, (0.4, 0.7)),
    "liner/rubber": ((0.5, 0.33, 20.0), 1.2, (0.8, 1.5)),
    "paper/rubber": ((0.65, 0.35, 15.0), 2.0, (1.5, 2.6)),
}


def hopf(mu_s, mu_k, p):
    return (math.sqrt(R**2 * N * (mu_s - mu_k) * p / C) - 1.0) / (p * RADIUS)


def stick_lost(mu_s, mu_k, p):
    """Where the smooth flow leads from the point of release back to it: from there forward and backward to one turn."""

    def apart(w):
        def rates(_, x):
            friction = N * ((mu_s - mu_k) / (1.0 + p * (RADIUS * w - R * x[1])) + mu_k)
            return [x[1], (R * friction - K * x[0] - C * x[1]) / J]

        def turns(_, x):
            return x[1]

        release = [(R * N * mu_s - C * RADIUS * w / R) / K, RADIUS * w / R]
        lowest = []
        for sense in (1, -1):
            turns.terminal, turns.direction = True, sense  # type: ignore[attr-defined]
            run = solve_ivp(
                lambda t, x, sense=sense: [sense * one for one in rates(t, x)],
                (0.0, 3.0), release, "DOP853", rtol=1e-13, atol=1e-15, events=turns,
            )  # fmt: skip
            lowest.append(float(run.y_events[0][0][0]))
        return lowest[0] - lowest[1]

    at_hopf = hopf(mu_s, mu_k, p)
    return root(apart, 1.1 * at_hopf, 1.8 * at_hopf)


@pytest.mark.nightly_for("liner/rubber", "paper/rubber")
@pytest.mark.parametrize("name", MATERIALS)
def test_from_the_hopf_point_to_the_lost_stick(name):
    law, speed, between = MATERIALS[name]
    parameters = dict(zip(("mu_s0", "mu_k0", "p0"), law, strict=True)) | {"N0": N, "w0": speed}
    rig = Strobe(load("disc_rig", contacts=["disc0"]), period=0.91, autonomous=True, parameters=parameters)
    found = branch(rig, "w0", between, settle=True)
    lost, end = sorted(found.special, key=lambda one: -one.value)
    assert (lost.kind, end.kind) == ("grazing-sliding corner", "Hopf")
    assert end.value == pytest.approx(hopf(*law), abs=1e-11)
    assert lost.value == pytest.approx(stick_lost(*law), abs=5e-12)
    assert lost.value_with_event == pytest.approx(lost.value, abs=1e-11)
    (share,) = lost.crossings["+1"]  # the fold without a tangent: the cycle turns there
    assert 0.0 < share < 1.0 and found.values.max() == pytest.approx(lost.value, abs=1e-6)
