"""Branches over turns that begin to stick: Den Hartog's oscillator by closed form, two friction contacts and a stop.

Source: Den Hartog, Transactions of the ASME 53 (1931): x'' + x + mu sgn x' = cos(omega t). The motion with two stops a
period leaves +A where cos(omega t) = A - mu and comes to rest at -A: one equation for A. It begins to stick as it
turns where it leaves at once, which is one equation more for mu.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy
from mechanisms import opened
from scipy.optimize import root, root_scalar

from fmu_models import TIME, Coordinate, Coulomb, Friction, KelvinVoigt, Mechanism, Parameter, Stop, Strobe, branch

W = 0.7
ONE = sympy.S.One
omega = Parameter("omega", W, "rad/s", "frequency", positive=True)
force = Parameter("f0", 1.0, "N", "amplitude of the force")
x = Coordinate("x", "m", "place", velocity="v")
z = Coordinate("z", "m", "place of the damper", velocity="w")


def den_hartog() -> Mechanism:
    m, k = Parameter("m", 1.0, "kg", "mass", positive=True), Parameter("k", 1.0, "N/m", "stiffness")
    mu = Parameter("mu", 0.6, "N", "friction", minimum=0.0)
    return Mechanism(
        name="den_hartog",
        title="Den Hartog's oscillator",
        source="closed form",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2,
        applied={x: force * sympy.cos(omega * TIME)},
        contacts=[Friction(name="dry", slip=x.v, law=Coulomb(mu, ONE))],
    )


def two_frictions(on_ground: bool) -> Mechanism:
    """A driven mass that rubs on the ground and meets a stop, and a small one that rubs on it, or on the ground."""
    names = {"m1": 1.0, "m2": 0.2, "k1": 1.0, "k2": 0.2, "c1": 0.05, "c2": 0.02, "ks": 20.0, "cs": 0.3, "gap": 1.0}
    units = {"m": "kg", "k": "N/m", "c": "N s/m", "g": "m"}
    p = {name: Parameter(name, value, units[name[0]], name) for name, value in names.items()}
    limits = [Parameter("F1", 0.3, "N", "friction"), Parameter("F2", 0.1, "N", "friction")]
    slips = x.v, z.v if on_ground else z.v - x.v
    return Mechanism(
        name="two_frictions",
        title="two friction contacts and a stop",
        source="test",
        coordinates=[x, z],
        kinetic_energy=p["m1"] * x.v**2 / 2 + p["m2"] * z.v**2 / 2,
        potential_energy=p["k1"] * x**2 / 2 + p["k2"] * (z - x) ** 2 / 2,
        dissipation=p["c1"] * x.v**2 / 2 + p["c2"] * (z.v - x.v) ** 2 / 2,
        applied={x: force * sympy.cos(omega * TIME)},
        contacts=[
            Friction(name="ground", slip=slips[0], law=Coulomb(limits[0], ONE)),
            Friction(name="damper", slip=slips[1], law=Coulomb(limits[1], ONE)),
            Stop(name="stop", gap=p["gap"] - x, law=KelvinVoigt(p["ks"], p["cs"]), release="force"),
        ],
    )


def flight(A: float, mu: float, start: float, t: float) -> tuple[float, float]:
    """Place and speed so long after it has left A, at rest, backwards."""
    gain = 1.0 / (1.0 - W**2)
    a, b = A - mu - gain * math.cos(W * start), gain * W * math.sin(W * start)
    place = mu + gain * math.cos(W * (start + t)) + a * math.cos(t) + b * math.sin(t)
    return place, -gain * W * math.sin(W * (start + t)) - a * math.sin(t) + b * math.cos(t)


def left_over(A: float, mu: float) -> float:
    """By how much the next rest misses -A."""
    start = math.acos(A - mu) / W
    times = np.linspace(1e-3, 1.1 * math.pi / W, 2001)
    speeds = [flight(A, mu, start, t)[1] for t in times]
    end = next(i for i in range(1, len(times)) if speeds[i - 1] < 0.0 <= speeds[i])
    rest = root_scalar(lambda t: flight(A, mu, start, t)[1], bracket=(times[end - 1], times[end]), xtol=1e-15).root
    return flight(A, mu, start, rest)[0] + A


@pytest.fixture(scope="module")
def dry():
    return branch(Strobe(opened(den_hartog()), forcing="omega"), "mu", (0.6, 0.999), settle=True)


def test_both_turns_begin_to_stick_at_once(dry):
    assert [kind for kind, _ in dry.ends] == ["range", "range"] and dry.stable.all()
    (onset,) = dry.special
    # at rest at -A after half a period, and leaving A at once
    half = math.pi / W
    known = root(
        lambda u: [*np.add(flight(u[0], u[2], u[1], half), (u[0], 0.0)), math.cos(W * u[1]) - u[0] + u[2]],
        (1.47, 1.03, 0.72),
        tol=1e-15,
    ).x
    assert (onset.kind, onset.contact) == ("crossing-sliding", "dry")
    assert [onset.value, onset.value_with_event] == pytest.approx([known[2]] * 2, abs=1e-13)
    # the tangent goes on through the point: sticking undoes as much as turning
    assert onset.multipliers[0] == pytest.approx(0.049515566, abs=1e-9)
    assert onset.multipliers_with_event[0] == pytest.approx(onset.multipliers[0], abs=1e-12) and not onset.crossings
    assert [len(word) for word in onset.words] == [2, 4]


def test_amplitudes_with_two_stops_are_those_of_the_closed_form(dry):
    sticking = [node for node in dry.nodes if len(node.word) == 4]
    compared = 0
    for node in sticking:
        rest = next(event for event in node.seen.events if event.after == 0 and event.before == 1)
        A = float(node.problem._state(node.z, rest.time)[0])  # where it has come to rest, upwards
        # next to 1 the amplitude changes by the inverse of what is left of it for an error of the equation
        if 1.0 - abs(node.multipliers[0]) < 1e-3:
            continue
        known = root_scalar(left_over, args=(node.value,), bracket=(A * (1 - 1e-6), A * (1 + 1e-6)), xtol=1e-16).root
        assert pytest.approx(known, abs=1e-12) == A, node.value
        compared += 1
    assert compared > 30 and sticking[-1].value == 0.999


def test_the_onset_over_the_frequency(dry):
    onset = dry.special[0].curve("omega", (0.68, 0.75))
    assert [kind for kind, _ in onset.ends] == ["range", "range"]


@pytest.mark.nightly_for("False-1.0")
@pytest.mark.parametrize(("on_ground", "begin"), [(False, 1.0), (False, 0.5), (True, 1.0)])
def test_two_friction_contacts_and_a_stop_over_the_frequency(on_ground, begin):
    """As far as the range goes, whichever contacts stick, slip and touch on the way."""
    system = Strobe(opened(two_frictions(on_ground)), forcing="omega", parameters={"omega": begin})
    found = branch(system, "omega", (0.5, 1.5), settle=True)
    assert [kind for kind, _ in found.ends] == ["range", "range"]
    assert len(set(found.words)) >= 5
    assert np.abs(np.array([node.seen.residual for node in found.nodes])).max() < 2e-9


def test_a_contact_that_always_sticks_is_told():
    """A damper that sticks wherever it is: the motions stand beside one another, none alone."""
    system = Strobe(opened(two_frictions(True)), forcing="omega", parameters={"omega": 1.0, "F2": 0.6})
    found = branch(system, "omega", (0.5, 1.5), settle=True)
    kinds = {kind for kind, _ in found.ends}
    assert kinds == {"set"} and "'damper' sticks wherever it is" in found.ends[0][1]
