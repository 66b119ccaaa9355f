"""Impacts by Newton's and by Poisson's rule, and closed contacts with friction, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from closed_form import root
from colliding import block, cradle, one_contact, pendulum, plate, rod
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.run import simulate

CLOSED = 3
STICK, SLIPS = 0, (-1, 1)


def collide(fmu, start, parameters):
    """Velocities after the impact that the start itself is."""
    run = simulate(fmu, 1e-9, start=start, parameters=parameters, output_times=[0.0])
    return {name: float(run[name][0]) for name in start}


@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_cradle_of_equal_restitution(law, e):
    """Ball 1 meets 2 and 3, which touch: both laws keep the latter together, v = ((1 - 2 e)/3, (1 + e)/3, (1 + e)/3).

    Newton: gap speeds e and 0 after. Poisson: impulses (2, 1)/3 of compression, e times those of expansion.
    """
    after = collide(cradle(law), {"v1": 1.0, "v2": 0.0, "v3": 0.0}, {"e": e, "e2": e})
    assert list(after.values()) == pytest.approx([(1 - 2 * e) / 3, (1 + e) / 3, (1 + e) / 3], abs=1e-15)


@pytest.mark.parametrize(("e", "e2"), [(0.3, 0.8), (0.0, 1.0), (0.5, 0.6), (0.8, 0.2), (1.0, 0.0)])
def test_cradle_of_unequal_restitution(e, e2):
    """Newton asks e2 nothing, since 2 and 3 do not approach. Poisson gives back e2/3 there, which throws ball 3 off
    where e2 > e: v = ((1 - 2 e)/3, (1 + 2 e - e2)/3, (1 + e2)/3); otherwise 2 and 3 stay together. Where e2 > 4 e
    ball 2 would run back into ball 1: the two go on with (2 - e2)/6.
    """
    start, parameters = {"v1": 1.0, "v2": 0.0, "v3": 0.0}, {"e": e, "e2": e2}
    together = [(1 - 2 * e) / 3, (1 + e) / 3, (1 + e) / 3]
    newton, poisson = (list(collide(cradle(law), start, parameters).values()) for law in ("newton", "poisson"))
    assert newton == pytest.approx(together, abs=1e-15)
    apart = [(1 - 2 * e) / 3, (1 + 2 * e - e2) / 3, (1 + e2) / 3]
    apart[:2] = [(2 - e2) / 6] * 2 if e2 > 4 * e else apart[:2]
    assert poisson == pytest.approx(apart if e2 > e else together, abs=1e-15)


@pytest.mark.nightly
@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(0, 1), st.floats(-2, 2), st.floats(0.1, 2), st.floats(-1.4, 1.4))
def test_laws_agree_for_one_smooth_contact(e, spin, fall, theta):
    """Without friction Newton's speeds and Poisson's impulses say the same."""
    start = {"y": math.sin(theta), "theta": theta, "vx": 0.3, "vy": -fall, "w": spin}
    if -fall - math.cos(theta) * spin > -1e-3:
        return
    newton, poisson = (collide(rod(law), start, {"e": e, "mu": 0.0}) for law in ("newton", "poisson"))
    assert newton == pytest.approx(poisson, abs=1e-13)


def rod_of(theta):
    """Mass matrix and directions of the rod with m = l = 1."""
    mass = np.diag([1.0, 1.0, 1 / 3])
    return mass, np.array([0.0, 1.0, -math.cos(theta)]), np.array([1.0, 0.0, math.sin(theta)])


@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize("mu", [0.0, 0.3, 0.59, 0.61, 1.5])
def test_rod_that_falls_on_one_end(law, mu):
    """At 45 degrees without spin: Lambda_T/Lambda_N = 3 s c/(1 + 3 s^2) = 0.6 holds the end, less makes it slip.

    Stick: Lambda_N = (1 + e) v/(G_NN - G_NT^2/G_TT), Lambda_T = -G_NT Lambda_N/G_TT; slip: Lambda_T = -+mu Lambda_N,
    Lambda_N = (1 + e) v/(G_NN -+ mu G_NT); G_NN = G_TT = 1 + 3/2, G_NT = -3/2.
    """
    e, v = 0.5, 2.0
    after = collide(
        rod(law), {"y": math.sqrt(0.5), "theta": math.pi / 4, "vx": 0.0, "vy": -v, "w": 0.0}, {"e": e, "mu": mu}
    )
    if mu > 0.6:
        normal = (1 + e) * v / (2.5 - 1.5**2 / 2.5)
        tangential = 0.6 * normal
    else:
        normal = (1 + e) * v / (2.5 - mu * 1.5)
        tangential = mu * normal
    arm = 3 * math.sqrt(0.5)
    expected = [tangential, normal - v, arm * (tangential - normal)]
    assert [after["vx"], after["vy"], after["w"]] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("law", ["newton", "poisson"])
@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.floats(0, 1), st.floats(0, 1), st.floats(0.05, 1.5), st.floats(-2, 2), st.floats(-2, 2), st.floats(0.1, 2))
def test_any_impact_of_the_rod(law, e, mu, theta, slide, spin, fall):
    """Against the two-case solution of stick and slip."""
    mass, normal, tangent = rod_of(theta)
    speeds = np.array([slide, -fall, spin])
    if normal @ speeds > -1e-2:
        return
    start = {"y": math.sin(theta), "theta": theta, "vx": slide, "vy": -fall, "w": spin}
    after = collide(rod(law), start, {"e": e, "mu": mu})
    expected = one_contact(mass, normal, tangent, speeds, e, mu, law)
    assert [after["vx"], after["vy"], after["w"]] == pytest.approx(expected, abs=1e-10)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(
    st.floats(0, 1), st.floats(0, 1), st.floats(0, 1.5), st.floats(0, 1.5),
    st.floats(-2, 2), st.floats(0, 2), st.floats(-2, 2), st.floats(0.2, 2), st.floats(0.1, 1), st.floats(0.05, 1),
)  # fmt: skip
def test_poisson_never_raises_the_energy(e, e2, mu, mu2, slide, fall, spin, b, h, J):
    """Two corners of a plate, of any two restitutions and frictions, at one instant."""
    start = {"vx": slide, "vy": -fall, "w": spin}
    parameters = {"e": e, "e2": e2, "mu": mu, "mu2": mu2, "b": b, "h": h, "J": J}
    after = collide(plate("poisson"), start, parameters)
    energy = [(s["vx"] ** 2 + s["vy"] ** 2 + J * s["w"] ** 2) / 2 for s in (start, after)]
    assert energy[1] <= energy[0] * (1 + 1e-12)
    assert min(after["vy"] - b * after["w"], after["vy"] + b * after["w"]) >= -1e-12 * (fall + abs(spin) + abs(slide))


def pendulum_impact(law, e, mu):
    """Kane's pendulum shortly before it meets the floor: speeds before and after, energies, the event."""
    angles = np.radians([20.0, 30.0])
    start = {"q1": angles[0] + 1e-6, "q2": angles[1] + 2e-6, "w1": -0.1, "w2": -0.2}
    parameters = {"e": e, "mu": mu, "height": float(np.cos(angles).sum())}
    first = simulate(pendulum(law), 2e-5, start=start, parameters=parameters)
    (event,) = first.impacts
    run = simulate(
        pendulum(law), 2e-5, start=start, parameters=parameters, output_times=event.time + np.array([-1e-9, 1e-9])
    )
    speeds = np.stack([run["w1"], run["w2"]], axis=1) + 1e-9 * np.array([1, -1])[:, None] * np.stack(
        [run["der(w1)"], run["der(w2)"]], axis=1
    )
    coupling = math.cos(angles[0] - angles[1]) / 2
    mass = np.array([[4 / 3, coupling], [coupling, 1 / 3]])
    return mass, np.sin(angles), np.cos(angles), speeds, event, first


@pytest.mark.nightly_for("newton-0.5-0.5", "poisson-0.5-0.5")
@pytest.mark.parametrize(("e", "mu"), [(0.5, 0.5), (0.7, 0.25), (0.7, 0.5), (0.9, 1.0), (0.3, 0.0)])
@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_kane_pendulum(law, e, mu):
    """Two rods at 20 and 30 degrees with -0.1 and -0.2 rad/s: the impact in closed form; its work is that of the event.

    Kane and Levinson, Dynamics: Theory and Applications (1985): friction and Newton's restitution can raise it.
    """
    mass, normal, tangent, speeds, event, run = pendulum_impact(law, e, mu)
    expected = one_contact(mass, normal, tangent, speeds[0], e, mu, law)
    assert speeds[1] == pytest.approx(expected, abs=1e-9)
    energies = [0.5 * w @ mass @ w for w in (speeds[0], expected)]
    assert event.work == pytest.approx(energies[1] - energies[0], abs=1e-9)
    if law == "poisson":
        assert event.work < 0
    assert bool(run.gains) == (event.work > 0)


def test_newton_with_friction_can_raise_the_energy():
    """Kane's pendulum at e = 0.7 and mu = 0.5, and what tells of it; not with Poisson's rule, not without friction."""
    *_, event, run = pendulum_impact("newton", 0.7, 0.5)
    assert event.work > 1e-4
    assert run.gains == (event,)
    for law, mu in (("poisson", 0.5), ("newton", 0.0), ("poisson", 0.0)):
        *_, event, run = pendulum_impact(law, 0.7, mu)
        assert event.work < 0
        assert run.gains == ()


def test_block_on_a_shaking_table():
    """N = m (g - A omega^2 sin(omega t)): the block slips where F = mu N, with v' = F/m - mu N/m, and sticks again
    where v = (F/m - mu g)(t - t1) - mu A omega (cos(omega t) - cos(omega t1)) is zero.
    """
    g, A, omega, mu, F = 9.81, 0.05, 10.0, 0.4, 2.5
    period = 2 * math.pi / omega
    begin = math.asin((g - F / mu) / (A * omega**2)) / omega

    def speed(t):
        return (F - mu * g) * (t - begin) - mu * A * omega * (math.cos(omega * t) - math.cos(omega * begin))

    end = root(speed, period / 2 - begin, period)
    run = simulate(
        block(),
        5 * period,
        parameters={"g": g, "A": A, "omega": omega, "mu": mu, "F": F},
        start={"vy": A * omega},
        output_times=np.linspace(0, 5 * period, 1001),
    )
    assert {event.contact for event in run.events} == {"table_friction"}
    times = np.array([event.time for event in run.events]).reshape(5, 2)
    assert times == pytest.approx(np.add.outer(period * np.arange(5), [begin, end]), abs=1e-12)
    assert [event.after for event in run.events] == [1, STICK] * 5
    phase = run.time % period
    slips = (phase > begin) & (phase < end) & (run.time < 4.9 * period)
    assert run["vx"][slips] == pytest.approx([speed(t) for t in phase[slips]], abs=1e-12)
    assert np.abs(run["vx"][(phase < begin - 1e-9) | (phase > end + 1e-9)]).max() < 1e-14
    assert run["y"] == pytest.approx(A * np.sin(omega * run.time), abs=1e-14)
    assert set(run["table_state"]) == {CLOSED}


def test_block_slows_down_on_a_table_at_rest():
    """v0 against mu g: stops after v0/(mu g), at v0^2/(2 mu g)."""
    run = simulate(block(), 2.0, parameters={"g": 9.81, "mu": 0.3}, start={"vx": 2.0})
    (event,) = run.events
    assert (event.before, event.after) == (1, STICK)
    assert event.time == pytest.approx(2 / (0.3 * 9.81), rel=1e-14)
    assert run["x"][-1] == pytest.approx(4 / (2 * 0.3 * 9.81), rel=1e-14)


def test_block_that_is_thrown_lands_with_friction():
    """e = 0, onto a table at rest with slide s and fall f: slip goes on with s - mu f, or stops if mu f > s."""
    for slide, fall, mu in ((3.0, 2.0, 0.5), (0.5, 2.0, 0.5), (-3.0, 2.0, 0.5)):
        after = collide(block(), {"vx": slide, "vy": -fall}, {"e": 0.0, "mu": mu, "g": 9.81})
        expected = math.copysign(max(0.0, abs(slide) - mu * fall), slide)
        assert [after["vx"], after["vy"]] == pytest.approx([expected, 0.0], abs=1e-15)


def test_sliding_rod_without_a_solution():
    """Painleve: with mu > (1 + 3 c^2)/(3 s c) the force of the end that slides forwards would have to pull.

    G_NN - mu |G_NT| < 0 while the end accelerates into the floor: neither closed nor open. Below that mu it slides on.
    """
    theta = math.pi / 4
    limit = (1 + 3 / 2) / (3 / 2)
    start = {"y": math.sin(theta), "theta": theta, "vx": -1.0}
    with pytest.raises(StickslipError, match=r"'end', 'end_friction'|'end'.*Painleve"):
        simulate(rod("newton"), 0.01, start=start, parameters={"g": 9.81, "mu": limit + 0.1})
    run = simulate(rod("newton"), 0.01, start=start, parameters={"g": 9.81, "mu": limit - 0.3})
    assert run["end_state"][0] == CLOSED
    assert run["end_friction_state"][0] in SLIPS
