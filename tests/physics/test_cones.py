"""Friction with two directions: closed forms, a plane that shakes, a ball that comes to roll, a turntable."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from cones import rest, shaken
from mechanisms import opened
from quick_export import quick_export

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.language.friction import Friction
from fmu_models.language.laws.arctan import Arctan
from fmu_models.language.laws.conti import Conti
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.directional import Directional
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.laws.lugre import LuGre
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter
from fmu_models.language.stops import Stop
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun

MASS, LOAD, MU = 1.3, 10.0, 0.3
F = MU * LOAD / MASS  # friction per mass, m/s2
M = Parameter("m", MASS, "kg", "mass", positive=True)
N = Parameter("N", LOAD, "N", "load")
FRICTION = Parameter("mu", MU, "1", "friction coefficient", minimum=0.0)
DRIVE = Parameter("D", 1.0, "N", "drive")
X = Coordinate("x", "m", "place along x", velocity="vx")
Y = Coordinate("y", "m", "place along y", velocity="vy")
SLIDE = {"vx": 2.0 * np.cos(2.0), "vy": 2.0 * np.sin(2.0)}


def body(
    name: str, contacts: list[Any], applied: dict[Any, Any], inertia: Any = 0, more: tuple[Coordinate, ...] = ()
) -> Mechanism:
    return Mechanism(
        name=name,
        title=name,
        source="test",
        coordinates=[X, Y, *more],
        kinetic_energy=M * (X.v**2 + Y.v**2) / 2 + inertia,
        applied=applied,
        contacts=contacts,
    )


def cone(law: Any = None, slip: Any = (X.v, Y.v), **more: Any) -> Any:
    return Friction(name="rub", slip=slip, law=law or Coulomb(N, FRICTION), **more)


@cache
def plane() -> Fmu:
    return opened(body("plane", [cone()], {X: DRIVE}))


def shaking() -> dict[Any, Any]:
    pace = Parameter("pace", 1.0, "rad/s", "pace of the drive")
    return {X: 3.3 * sympy.cos(3 * pace * TIME) * DRIVE, Y: 2.2 * sympy.sin(2.2 * pace * TIME) * DRIVE}


def drive(t: float) -> np.ndarray:
    return np.array([3.3 * np.cos(3 * t), 2.2 * np.sin(2.2 * t)]) / MASS


def closed(vx: Any, vy: Any, D: Any, m: Any, mu: Any) -> tuple[Any, Any, Any]:
    return rest(mpmath.hypot(vx, vy), mpmath.atan2(vy, vx), mu * LOAD / m, D / m)


def test_a_slide_rests_when_and_where_the_closed_form_says() -> None:
    """Time and place of rest, the hodograph on the way, and what friction has taken: all of it."""
    start = (SLIDE["vx"], SLIDE["vy"], 1.0, MASS, MU)
    with mpmath.workdps(30):
        time, along, across = map(float, closed(*map(mpmath.mpf, start)))
    run = simulate(plane(), 2.0, start=SLIDE, output_times=np.linspace(0.0, 2.0, 41))
    assert run.events[0].time == pytest.approx(time, rel=1e-13) and len(run.events) == 1
    np.testing.assert_allclose([run["x"][-1], run["y"][-1]], [along, across], rtol=0, atol=1e-13)
    slides = run.time < time
    w, q = np.hypot(run["vx"], run["vy"])[slides], np.arctan2(run["vy"], run["vx"])[slides]
    k = F * MASS
    C = w * np.sin(q) / np.tan(q / 2) ** k
    np.testing.assert_allclose(C, C[0], rtol=1e-12)
    assert np.all(run["rub_state"][slides] == 1) and np.all(run["rub_state"][~slides] == 0)
    # the force on the body is -3 N along the slip, and at rest what the drive asks for
    np.testing.assert_allclose(run["rub_x_force"][slides], MU * LOAD * np.cos(q), rtol=1e-12)
    np.testing.assert_allclose(run["rub_y_force"][slides], MU * LOAD * np.sin(q), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(run["rub_x_force"][~slides], 1.0, rtol=1e-12)
    np.testing.assert_allclose(run["power_dissipated"][slides], MU * LOAD * w, rtol=1e-12)


def test_derivatives_of_the_rest_are_those_of_the_closed_form() -> None:
    by = ("vx", "vy", "D", "m", "mu")
    with SensitiveRun(plane(), by=by) as sensitive:
        run = sensitive.run(np.array([0.0, 1.5]), start=SLIDE)
    here = (SLIDE["vx"], SLIDE["vy"], 1.0, MASS, MU)
    with mpmath.workdps(40):
        orders = [tuple(int(i == j) for j in range(5)) for i in range(5)]
        expected = [
            [float(mpmath.diff(lambda *at, of=of: closed(*at)[of], here, order)) for order in orders] for of in range(3)
        ]
    np.testing.assert_allclose(run.event_derivative[0], expected[0], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.of("x")[-1], expected[1], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.of("y")[-1], expected[2], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.of("vx")[-1], 0.0, atol=1e-14)


def test_a_drive_as_strong_as_friction_leaves_a_sum_constant() -> None:
    """|v| (1 + cos q) is kept, and the slide never ends."""
    run = simulate(plane(), 40.0, start=SLIDE, parameters={"D": MU * LOAD}, output_times=np.linspace(0.0, 40.0, 9))
    w = np.hypot(run["vx"], run["vy"])
    np.testing.assert_allclose(w + run["vx"], 2.0 * (1 + np.cos(2.0)), rtol=1e-12)
    assert not run.events


@pytest.mark.parametrize("uphill", [0.0, 1e-12])
def test_a_slide_against_a_drive_beyond_friction_turns_without_rest(uphill: float) -> None:
    D, v = 4.0, 1.0
    turn = v / (D / MASS + F)
    run = simulate(plane(), 4.0, start={"vx": -v, "vy": uphill}, parameters={"D": D}, output_times=[0.0, turn, 4.0])
    assert run["vx"][-1] == pytest.approx((4.0 - turn) * (D / MASS - F), rel=1e-10)
    assert run["x"][1] == pytest.approx(-v * turn / 2, rel=1e-9) and not run.events


def test_a_drive_that_jumps_on_a_body_at_rest_carries_it_along() -> None:
    fmu = opened(body("thrown", [cone()], {X: DRIVE * 4, Y: DRIVE * 3}))
    run = simulate(fmu, 1.0, output_times=[0.0, 1.0])
    way = (5.0 - MU * LOAD) / MASS / 2
    np.testing.assert_allclose([run["x"][-1], run["y"][-1]], [0.8 * way, 0.6 * way], rtol=1e-13)


LAWS = {
    "coulomb": (Coulomb(N, FRICTION), lambda w: F),
    "conti": (
        Conti(N, FRICTION, sympy.Float(0.2), sympy.Float(2.0)),
        lambda w: LOAD / MASS * (0.2 + 0.1 / (1 + 2 * w)),
    ),
}


@pytest.mark.parametrize("law", LAWS)
def test_a_plane_that_shakes_drops_and_takes_its_body_as_dop853_says(law: str) -> None:
    """Six rests and as many onsets, in which friction holds as much as it takes in slip."""
    declared, f = LAWS[law]
    fmu, end = opened(body(f"shaken_{law}", [cone(declared)], shaking())), 6.0
    run = simulate(fmu, end, start={"vx": 0.5, "vy": 0.1}, output_times=np.linspace(0.0, end, 7))
    place, times = shaken(drive, f, end, np.array([0.5, 0.1]))
    assert len(times) > 6
    np.testing.assert_allclose([event.time for event in run.events], times, rtol=0, atol=1e-10)
    np.testing.assert_allclose([run["x"][-1], run["y"][-1]], place, rtol=0, atol=1e-11)


@pytest.mark.parametrize("end", [0.3, 2.0, 3.3])
def test_derivatives_go_through_rests_and_onsets(end: float) -> None:
    """Beside differences of fourth order, of runs that slide, have rested, and slide anew."""
    law = Conti(N, FRICTION, Parameter("mu_k", 0.2, "1", "in slip"), Parameter("p", 2.0, "s/m", "slope"))
    fmu = opened(body("varied", [cone(law)], shaking()))
    given = {"vx": 0.5, "vy": 0.1, "D": 1.0, "m": MASS, "mu": MU, "p": 2.0}
    recorded = ("x", "y", "rub_x_force")
    with SensitiveRun(fmu, by=tuple(given), recorded=recorded) as sensitive:
        run = sensitive.run(np.array([0.0, end]), start={"vx": 0.5, "vy": 0.1})

    def ends(name: str, by: float) -> np.ndarray:
        moved = given | {name: given[name] + by}
        start = {v: moved.pop(v) for v in ("vx", "vy")}
        motion = simulate(fmu, end, start=start, parameters=moved, output_times=[0.0, end])
        return np.array([motion[of][-1] for of in recorded])

    h = 1e-4
    for i, name in enumerate(given):
        slopes = (8 * (ends(name, h) - ends(name, -h)) - (ends(name, 2 * h) - ends(name, -2 * h))) / (12 * h)
        np.testing.assert_allclose([run.of(of)[-1][i] for of in recorded], slopes, rtol=1e-7, atol=2e-9)


def test_a_ball_with_spin_rolls_after_the_time_of_the_textbook() -> None:
    """Its slip keeps its direction; it rolls after 2 w/(7 mu g), with 5/7 of its speed and 2/7 of its spin."""
    inertia, radius = 0.4 * MASS * 0.01, 0.1
    turn = [Coordinate(f"a{i}", "rad", f"turn about {i}", velocity=f"w{i}") for i in "xy"]
    R = Parameter("R", radius, "m", "radius", positive=True)
    J = Parameter("J", inertia, "kg m2", "moment of inertia", positive=True)
    slip = X.v - R * turn[1].v, Y.v + R * turn[0].v
    fmu = opened(body("ball", [cone(slip=slip)], {}, J * (turn[0].v ** 2 + turn[1].v ** 2) / 2, tuple(turn)))
    v, spin = np.array([1.0, 0.5]), np.array([-20.0, 7.0])
    slides = v + radius * np.array([-spin[1], spin[0]])
    w = np.hypot(*slides)
    rolls = 2 * w / (7 * F)
    run = simulate(
        fmu,
        2 * rolls,
        start={"vx": v[0], "vy": v[1], "wx": spin[0], "wy": spin[1]},
        output_times=[0.0, rolls, 2 * rolls],
    )
    assert run.events[0].time == pytest.approx(rolls, rel=1e-13)
    after = v - 2 / 7 * slides
    np.testing.assert_allclose([run["vx"][-1], run["vy"][-1]], after, rtol=1e-13)
    way = v * rolls - slides / w * F * rolls**2 / 2 + after * rolls
    np.testing.assert_allclose([run["x"][-1], run["y"][-1]], way, rtol=1e-13)


def test_a_block_on_a_turntable_slips_where_the_table_is_too_fast() -> None:
    """Of a table that spins up slowly at w = A t: (A r)^2 + (w^2 r)^2 = (mu g)^2."""
    A, r = 0.5, 0.4
    spin = Parameter("A", A, "rad/s2", "spin up") * TIME
    fmu = opened(body("turntable", [cone(slip=(X.v + spin * Y, Y.v - spin * X))], {}))
    with SensitiveRun(fmu, by=("A", "mu")) as sensitive:
        run = sensitive.run(np.array([0.0, 5.0]), start={"x": r})
    slips = ((F / r) ** 2 - A**2) ** 0.25 / A
    assert run.events[0].time == pytest.approx(slips, rel=1e-12)
    # of the logarithm of that time
    share = 1 / (2 * ((F / r) ** 2 - A**2))
    expected = slips * np.array([-1 / A - A * share, (F / r) ** 2 / MU * share])
    np.testing.assert_allclose(run.event_derivative[0], expected, rtol=1e-9)


def test_a_block_on_a_belt_comes_to_slip_along_it_alone() -> None:
    """What moves across the belt dies out, to nothing in the end; that costs no steps, and the motion is that of one
    slip speed, event by event."""
    k, belt = Parameter("k", 50.0, "N/m", "stiffness", positive=True), Parameter("vb", 0.2, "m/s", "speed of the belt")
    law = Conti(N, FRICTION * 2, FRICTION, Parameter("p", 1.0, "s/m", "slope"))

    def motion(name: str, contact: Any, across: float) -> Any:
        spring = {X: -k * X, Y: -k * Y}
        start = {"x": 0.1, "vx": 0.2, "y": across}
        return simulate(
            opened(body(name, [contact], spring)), 30.0, start=start, output_times=np.linspace(0.0, 30.0, 7)
        )

    one = motion("belt_along", Friction(name="rub", slip=X.v - belt, law=law), 0.0)
    straight = motion("belt", cone(law, (X.v - belt, Y.v)), 0.0)
    np.testing.assert_allclose([e.time for e in straight.events], [e.time for e in one.events], rtol=1e-12)
    np.testing.assert_allclose(straight["x"], one["x"], rtol=0, atol=1e-11)
    turned = motion("belt", cone(law, (X.v - belt, Y.v)), 1e-3)
    assert abs(turned["y"][-1]) < 1e-40 and turned.steps < 100 * len(turned.events)
    np.testing.assert_allclose(
        np.diff([e.time for e in turned.events])[-6:], np.diff([e.time for e in one.events])[-6:]
    )


def test_unlike_inertia_along_and_across_keeps_the_balance_and_its_derivatives() -> None:
    """The slip of a body that is heavier across: its time of rest is no closed form."""
    extra = Parameter("m2", 1.1, "kg", "mass across", positive=True)
    fmu = opened(body("unlike", [cone()], {X: DRIVE}, extra * Y.v**2 / 2 + X.v * Y.v * extra / 10))
    by = ("vx", "vy", "D", "mu")
    with SensitiveRun(fmu, by=by) as sensitive:
        run = sensitive.run(np.array([0.0, 3.0]), start=SLIDE)
    given = {**SLIDE, "D": 1.0, "mu": MU}

    def rests(name: str, by: float) -> float:
        moved = given | {name: given[name] + by}
        start = {v: moved.pop(v) for v in ("vx", "vy")}
        return simulate(fmu, 3.0, start=start, parameters=moved).events[0].time

    h = 1e-4
    slopes = [(8 * (rests(n, h) - rests(n, -h)) - (rests(n, 2 * h) - rests(n, -2 * h))) / (12 * h) for n in by]
    np.testing.assert_allclose(run.event_derivative[0], slopes, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_every_face_of_the_fmu_has_the_motion_of_the_engine(version: str, tmp_path: Path) -> None:
    fmu = Fmu.open(quick_export(body("faces", [cone()], shaking()), tmp_path / "faces.fmu", fmi_version=version))
    times, start = np.linspace(0.0, 5.0, 11), {"vx": 0.5, "vy": 0.1}
    own = simulate(fmu, 5.0, start=start, output_times=times)
    for method, near in (("auto", 1e-7), ("co-simulation", 1e-12)):
        other = simulate_any(fmu, 5.0, method=method, tolerance=1e-9, start=start, output_times=times)
        for name in ("x", "y"):
            np.testing.assert_allclose(other[name], own[name], rtol=0, atol=near)


def test_stacked_bodies_and_a_stop_keep_the_balance_of_energy() -> None:
    """A body on the shaking one, which runs into a stop: each cone sticks and slips by itself."""
    top = [Coordinate(f"{i}2", "m", f"place of the upper body along {i}", velocity=f"v{i}2") for i in "xy"]
    M2 = Parameter("M2", 0.7, "kg", "upper mass", positive=True)
    wall = Stop(
        name="wall",
        gap=sympy.Float(0.05) - X,
        law=KelvinVoigt(Parameter("kw", 5000.0, "N/m", "stiffness"), Parameter("cw", 1.0, "N s/m", "damping")),
        release="gap",
    )
    upper = Friction(name="top", slip=(top[0].v - X.v, top[1].v - Y.v), law=Coulomb(N, sympy.Float(0.07)))
    energy = M2 * (top[0].v ** 2 + top[1].v ** 2) / 2
    stacked = body("stacked", [cone(), upper, wall], shaking(), energy, tuple(top))
    fmu = opened(stacked)
    start = {"vx": 0.5, "vy": 0.1, "vx2": 0.3, "vy2": -0.4}
    run = simulate(fmu, 4.0, start=start, output_times=np.linspace(0.0, 4.0, 40001))
    powers = run["power_input"] - run["power_dissipated"] - run["power_stops"]
    gained = np.concatenate([[0.0], np.cumsum((powers[1:] + powers[:-1]) / 2 * 1e-4)])
    np.testing.assert_allclose(run["energy"] - run["energy"][0], gained, rtol=0, atol=2e-5)
    assert {int(s) for s in run["rub_state"]} == {0, 1} and {int(s) for s in run["top_state"]} == {0, 1}
    held = run["rub_state"] == 0
    pull = np.hypot(run["rub_x_force"], run["rub_y_force"])
    assert np.all(pull[held] <= MU * LOAD * (1 + 1e-12)) and pull[~held] == pytest.approx(MU * LOAD, rel=1e-12)


def parts(**law: Any) -> dict[str, Any]:
    return {name: sympy.Float(value) for name, value in law.items()}


REFUSED = {
    "bristles": (lambda: cone(LuGre(Coulomb(N, FRICTION), **parts(sigma0=1e4, sigma1=10.0))), "internal states"),
    "other the other way": (
        lambda: cone(Directional(N, *[FRICTION, FRICTION, sympy.Float(0.0), FRICTION * 2, FRICTION, sympy.Float(0.0)])),
        "whichever way",
    ),
    "smoothed": (lambda: cone(Arctan(Coulomb(N, FRICTION), Parameter("eps", 1e-3, "m/s", "width"))), "never sticks"),
    "three": (lambda: cone(slip=(X.v, Y.v, X.v)), "3 slip speeds"),
    "one twice": (lambda: body("twice", [cone(slip=(X.v, 2 * X.v))], {}), "go with each other"),
    "units": (lambda: body("units", [cone(slip=(X.v, Y.v * DRIVE))], {}), "units do not match"),
    "beside": (
        lambda: body("beside", [cone(), Friction(name="side", slip=X.v, law=Coulomb(N, FRICTION))], {}),
        "rub on the same motion",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_makes_no_cone_is_refused_in_words(case: str) -> None:
    declared, words = REFUSED[case]
    with pytest.raises(StickslipError, match=words):
        declared()
