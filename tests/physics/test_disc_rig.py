"""The disc rig against its reference values: equations (1), (2), (10) for one disc, (11) to (20) for two.

The reference values come from an independent event-driven Taylor code of order 26; two other codes confirm them to
1e-12 (one disc) and 1e-10 (two discs). They are printed with twelve decimals, hence the tolerances.
"""

from __future__ import annotations

import numpy as np
import pytest
from steady_cycle import disc_rig, steady_cycle

from fmu_models.simulation.run import simulate

pytestmark = pytest.mark.digits

MATERIALS = {"paper/rubber": (0.65, 0.35, 15.0), "liner/rubber": (0.5, 0.33, 20.0)}
ONE = ("disc0",)
TWO = ("disc0", "disc1")


def friction(material: str, discs: tuple[int, ...]) -> dict[str, float]:
    mu_s, mu_k, p = MATERIALS[material]
    return {f"{name}{i}": value for i in discs for name, value in (("mu_s", mu_s), ("mu_k", mu_k), ("p", p))}


@pytest.mark.parametrize(
    ("material", "w0", "period", "minimum", "maximum", "stick"),
    [
        ("paper/rubber", 0.20, 1.157232571396, 0.103722811325, 0.162208670860, 0.396740041392),
        ("paper/rubber", 0.41, 1.039471232750, 0.077851661205, 0.173042955346, 0.310208614961),
        ("paper/rubber", 0.83, 0.958270761812, 0.042045292385, 0.195281872247, 0.212966229350),
        ("liner/rubber", 0.83, 0.918873578071, 0.034747831443, 0.162276936214, 0.114839846304),
    ],
)
def test_one_disc_reaches_the_reference_cycle(material, w0, period, minimum, maximum, stick):
    cycle = steady_cycle(disc_rig(ONE), inputs={"w0": w0}, parameters=friction(material, (0,)), start={"theta": 0.14})
    assert cycle.period == pytest.approx(period, rel=1e-9)
    assert cycle.minimum["theta"] == pytest.approx(minimum, rel=1e-9)
    assert cycle.maximum["theta"] == pytest.approx(maximum, rel=1e-9)
    assert cycle.stick["disc0"] == pytest.approx(stick, rel=1e-9)


def test_one_disc_sticks_and_lets_go_at_the_reference_angles():
    """Release in closed form: theta = (R N mu_s - c r w/R)/k."""
    cycle = steady_cycle(disc_rig(ONE), inputs={"w0": 0.83}, start={"theta": 0.14})
    release = (0.125 * 4.905 * 0.65 - 0.055 * 0.06 * 0.83 / 0.125) / 2.62
    assert cycle.angles["disc0", 0] == pytest.approx([0.062442607905], rel=1e-9)
    assert cycle.angles["disc0", 1] == pytest.approx([release], rel=1e-13)
    assert release == pytest.approx(0.143747805344, rel=1e-11)


@pytest.mark.parametrize(
    ("w0", "w1", "period", "minimum", "maximum", "stick0", "stick1"),
    [
        (0.41, 0.83, 1.240683492251, 0.165591261286, 0.304098449952, 0.4558702846, 0.0),
        (0.83, 0.83, 1.119370261661, 0.110122771115, 0.341411666625, 0.3927019884, 0.3927019884),
        (1.40, 0.83, 1.043139513424, 0.124657641567, 0.320583906166, 0.0, 0.3224480738),
        (1.50, -0.5, 1.164278079826, -0.070096962075, 0.077415151319, 0.0, 0.4002053150),
    ],
)
def test_two_discs_reach_the_reference_cycle(w0, w1, period, minimum, maximum, stick0, stick1):
    cycle = steady_cycle(disc_rig(TWO), inputs={"w0": w0, "w1": w1}, start={"theta": 0.14})
    assert cycle.period == pytest.approx(period, rel=1e-9)
    assert cycle.minimum["theta"] == pytest.approx(minimum, rel=1e-9)
    assert cycle.maximum["theta"] == pytest.approx(maximum, rel=1e-9)
    assert cycle.stick.get("disc0", 0.0) == pytest.approx(stick0, abs=1e-10)
    assert cycle.stick.get("disc1", 0.0) == pytest.approx(stick1, abs=1e-10)


@pytest.mark.parametrize("force", [2.0, 4.905, 12.0])
@pytest.mark.parametrize(("w0", "sticking"), [(0.8299, {"disc0"}), (0.83, {"disc0", "disc1"}), (0.8301, {"disc1"})])
def test_sliding_exchange(w0, sticking, force):
    """Stick moves from disc 0 to disc 1 where the speeds are equal, at every normal force (section 2.5.1)."""
    cycle = steady_cycle(
        disc_rig(TWO), inputs={"w0": w0, "w1": 0.83}, parameters={"N0": force, "N1": force}, start={"theta": 0.14}
    )
    assert cycle.sticking == sticking


@pytest.mark.parametrize(("force", "exchange"), [(3.0, 0.8565), (4.8693068, 1.2), (6.0, 1.4204)])
@pytest.mark.parametrize("side", [-1, 1])
def test_sticking_on_disc_0_disappears(force, exchange, side):
    """w1 = -0.5 rad/s, paper/rubber: disc 0 is touched below the bifurcation speed and not above it (section 4.1.2)."""
    inputs = {"w0": exchange + side * 2e-4, "w1": -0.5}
    cycle = steady_cycle(disc_rig(TWO), inputs=inputs, parameters={"N0": force, "N1": force}, start={"theta": 0.14})
    assert ("disc0" in cycle.sticking) == (side < 0)


@pytest.mark.parametrize(("speed", "cycles"), [(1.69, True), (2.44, False)])
def test_cycle_ends_at_the_fold_speed(speed, cycles):
    """N = 5 N, paper/rubber: the stick-slip cycle exists up to 2.430 rad/s."""
    trajectory = simulate(disc_rig(ONE), 120.0, inputs={"w0": speed}, parameters={"N0": 5.0})
    late = [event for event in trajectory.events if event.time > 100.0]
    assert bool(late) == cycles


def test_no_friction_is_the_damped_oscillator():
    """Without contacts: theta = theta0 exp(-s t)(cos w t + s/w sin w t), s = c/2J, w^2 = k/J - s^2."""
    trajectory = simulate(disc_rig(()), 20.0, start={"theta": 0.15})
    s = 0.055 / (2 * 0.0548)
    w = np.sqrt(2.62 / 0.0548 - s * s)
    t = trajectory.time
    exact = 0.15 * np.exp(-s * t) * (np.cos(w * t) + s / w * np.sin(w * t))
    assert np.abs(trajectory["theta"] - exact).max() < 1e-12
    assert trajectory.events == ()


@pytest.mark.parametrize("p", [1.0, 1e2, 1e4, 1e6])
def test_steep_laws_agree_with_a_tighter_run(p):
    """A release starts with zero acceleration inside a layer whose rate grows like p."""
    runs = [
        simulate(disc_rig(ONE), 5.0, inputs={"w0": 0.83}, parameters={"p0": p, "N0": 8.0}, tolerance=tolerance)
        for tolerance in (1e-12, 1e-15)
    ]
    times = [[event.time for event in run.events] for run in runs]
    assert times[0] == pytest.approx(times[1], abs=1e-11)


def test_constant_friction_dies_out_in_straight_lines():
    """mu_s = mu_k, w = 0, c = 0: each half swing shrinks by 2 R N mu/k until stick holds (Coulomb's free decay)."""
    parameters = {"mu_s0": 0.1, "mu_k0": 0.1, "c": 0.0}
    trajectory = simulate(disc_rig(ONE), 20.0, inputs={"w0": 0.0}, parameters=parameters, start={"theta": 0.4})
    loss = 2 * 0.125 * 4.905 * 0.1 / 2.62
    half_swings = np.ceil((0.4 - loss / 2) / loss)
    assert trajectory["theta"][-1] == pytest.approx((-1) ** half_swings * (0.4 - half_swings * loss), abs=1e-12)
    assert trajectory["disc0_state"][-1] == 0


@pytest.mark.parametrize(("side", "state"), [(1, 1), (-1, 0)])
def test_start_exactly_on_the_boundary(side, state):
    """At zero slip and full capacity: at the release angle the disc lets go, at its mirror image it keeps sticking."""
    w, capacity = 0.2, 4.905 * 0.65
    omega = 0.06 * w / 0.125
    theta = (side * 0.125 * capacity - 0.055 * omega) / 2.62
    trajectory = simulate(disc_rig(ONE), 1e-3, inputs={"w0": w}, start={"theta": theta, "omega": omega})
    assert trajectory["disc0_state"][-1] == state


def test_contact_without_load_changes_nothing():
    loaded = simulate(disc_rig(ONE), 25.0, inputs={"w0": 0.83}, parameters={"N0": 8.0})
    both = simulate(disc_rig(TWO), 25.0, inputs={"w0": 0.83, "w1": 0.83}, parameters={"N0": 8.0, "N1": 0.0})
    assert np.abs(loaded["theta"] - both["theta"]).max() < 1e-11


def test_speeds_may_be_opposite_and_symmetric():
    """w1 = -w0 at rest: both discs pull equally, and the body stays where it is."""
    trajectory = simulate(disc_rig(TWO), 10.0, inputs={"w0": 0.83, "w1": -0.83})
    assert np.abs(trajectory["theta"]).max() == 0.0
