"""Table 2 of the discontinuous support: its motions of one and of three periods, against the exact flow of both modes.

    free     m x'' + c x' + k x = f0 cos(w t)
    contact  m x'' + (c + cs) x' + k x + ks (x - g) = f0 cos(w t), entered at x = g, left where ks (x - g) + cs x' = 0

An entry multiplies derivatives by [[1, 0], [-cs/m, 1]], the end of contact leaves them as they are.
"""

from __future__ import annotations

import numpy as np
import pytest
from closed_form import root
from scipy.linalg import expm
from scipy.optimize import fsolve

from fmu_models import Strobe, branch, load
from fmu_models.language.contact_kinds import RELEASED, TOUCHING

K, C, F0, CS, KS, G = 1.0, 0.05, 0.5, 0.6, 300.0, 1.6
ENTRY = np.array([[1.0, 0.0], [-CS, 1.0]])


def flow(x, t, length, omega, contact):
    """The state after some s from time t, and its derivative by x."""
    k, c, constant = (K + KS, C + CS, KS * G) if contact else (K, C, 0.0)
    response = F0 / (k - omega**2 + 1j * c * omega)

    def forced(time):
        wave = response * np.exp(1j * omega * time)
        return np.array([wave.real + constant / k, (1j * omega * wave).real])

    matrix = expm(np.array([[0.0, 1.0], [-k, -c]]) * length)
    return forced(t + length) + matrix @ (x - forced(t)), matrix


def period(x, omega, start, events, turns):
    """State and monodromy matrix after some turns of the forcing; about when contact begins and ends is given, s."""
    t, end, matrix = start, start + turns * 2 * np.pi / omega, np.eye(2)
    for guess, contact in events:
        ends = (lambda y: KS * (y[0] - G) + CS * y[1]) if contact else (lambda y: y[0] - G)
        near = 0.2 * min([1.0, *(abs(guess - other) for other, _ in events if other != guess)])
        from_x, from_t = x, t
        length = root(
            lambda s, x=from_x, t=from_t, c=contact, e=ends: e(flow(x, t, s, omega, c)[0]),
            start + guess - near - t,
            start + guess + near - t,
        )
        x, step = flow(x, t, length, omega, contact)
        t, matrix = t + length, step @ matrix
        matrix = matrix if contact else ENTRY @ matrix
    x, step = flow(x, t, end - t, omega, False)
    return x, step @ matrix


def solved(one):
    """The parameter of a special point by the exact flow, from a start nearby."""
    node = one.node
    phase, turns = node.problem.phase, node.problem.turns
    # a stop that is left by its force is away for us from there on
    events = [(event.time, event.before == TOUCHING) for event in node.seen.events if event.before != RELEASED]

    def equations(unknowns):
        x, omega = unknowns[:2], unknowns[2]
        start = phase * 2 * np.pi / omega
        after, matrix = period(x, omega, start, events, turns)
        if one.touch:  # from the start, which is free, to where the motion turns at the bound
            touching, _ = flow(x, start, unknowns[3], omega, False)
            return [*(after - x), touching[0] - G, touching[1]]
        return [*(after - x), np.linalg.det(matrix - (-1.0 if one.kind == "flip" else 1.0) * np.eye(2))]

    touch = [one.touch.miss.time] if one.touch else []
    assert all(event.time > time for time in touch for event in node.seen.events)
    found, _, _, message = fsolve(equations, [*node.z, *touch], xtol=1e-14, full_output=True)
    # near a touch the determinant changes by 1 within 1e-9 of the parameter
    assert np.abs(equations(found)).max() < 1e-8, message
    return float(found[2])


@pytest.fixture(scope="module")
def support():
    return load("discontinuous_support")


def strobe(support, omega, every):
    parameters = {"ks": KS, "cs": CS, "g": G, "omega": omega}
    return Strobe(support, forcing="omega", every=every, parameters=parameters)


@pytest.fixture(scope="module")
def families(support):
    """The motion of one period from above; those of three that start at rest, and beside the former, lead to."""
    return (
        branch(strobe(support, 0.98, 1), "omega", (0.8, 1.0), settle=True),
        branch(strobe(support, 0.91, 3), "omega", (0.8, 1.1), start={"x": 0.0, "v": 0.0}, settle=True),
        branch(strobe(support, 0.99, 3), "omega", (0.95, 1.1), start={"x": -1.0, "v": 1.0}, settle=True),
    )


def test_every_point_of_three_families(families):
    kinds = [[one.kind for one in sorted(family.special, key=lambda one: one.value)] for family in families]
    touch = "grazing, compliant"
    assert kinds == [
        [touch, "flip", "flip"],
        ["fold", touch, "fold", "flip", "fold", touch, "fold", touch, "fold"],
        [touch, touch, "fold"],
    ]
    for one in [one for family in families for one in family.special]:
        assert one.value == pytest.approx(solved(one), abs=1e-12), one.kind


def test_the_motion_of_three_periods_touches_where_it_is_known_to(families):
    values = [one.value for one in families[1].special if one.kind == "grazing, compliant"]
    assert min(abs(value - 0.9289664625404) for value in values) < 1e-12


def test_a_second_motion_of_three_periods_is_a_closed_loop(families):
    """It turns at a fold, and at a touch with +1 in the hull, where the branch has no tangent."""
    loop = families[2]
    assert [kind for kind, _ in loop.ends] == ["closed", "closed"]
    turn = min(loop.special, key=lambda one: one.value)
    assert turn.kind == "grazing, compliant" and list(turn.crossings) == ["+1"]
    assert loop.values.min() == pytest.approx(turn.value, abs=1e-6) and loop.values.min() > turn.value - 1e-12
