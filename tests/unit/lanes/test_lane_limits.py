"""What lanes do at the edge of what they are for: values that grow, decay, repeat or do not, and declarations that
qualify for some parameters alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy
from quick_export import quick_export

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.lane_tables import lane_obstacles
from fmu_models.families.jobs import ESCAPED, FINISHED, Jobs
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.lowering.piecewise_linear import obstacles
from fmu_models.sections.strobe import Strobe

GO = np.zeros(1, np.int32)


def both(system: Strobe, starts: Any, periods: int = 5, **varied: Any) -> tuple[Any, Any]:
    """The same motions by lanes and by series."""
    jobs = Jobs(
        np.asarray(starts, dtype=float), {n: np.asarray(v, dtype=float) for n, v in varied.items()}, rows=periods
    )
    return system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)


def test_no_damping_and_stiffnesses_that_are_equal_are_ordinary():
    # a resonance, and two modes of one matrix: neither has eigenvectors or a particular solution of its own
    values = {"d": 0.0, "w1": 1.0, "w2": 1.0, "W": 1.0, "b1": 0.0, "b2": 0.0}
    system = Strobe(load("two_domain_oscillator"), forcing="W", parameters=values)
    lanes, series = both(system, [[0.3, 1.0], [0.0, 2.0]])
    assert lanes.in_lanes.sum() == lanes.steps.sum()
    assert lanes.points == pytest.approx(series.points, abs=1e-11)
    # x'' = b twice over: nilpotent
    free = system.at(w1=0.0, w2=0.0, b1=0.5, b2=-0.5)
    lanes, series = both(free, [[0.3, 1.0], [0.1, 2.0]])
    assert lanes.in_lanes.sum() == lanes.steps.sum()
    assert lanes.points == pytest.approx(series.points, abs=1e-10)


def test_what_decays_comes_to_rest_and_not_to_the_least_of_numbers():
    values = {"f0": 0.0, "c": 1.0, "g": 1.0}
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters=values)
    made = system.run(Jobs(np.array([[0.5, 0.0]]), transient=299, rows=1), GO)
    assert made.points[0, 0].tolist() == [0.0, 0.0]


def test_many_sub_steps_in_a_period_are_left_to_the_series_and_others_are_not():
    values = {"f0": 0.0, "omega": 1e-4, "c": 0.5, "g": 1.0}
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters=values)
    # 1e5 steps of the grid in the first, a few in the second
    lanes, series = both(system, [[0.5, 0.0]] * 2, 1, omega=[1e-4, 1.0])
    assert lanes.in_lanes.tolist() == [0, 1]
    assert lanes.points == pytest.approx(series.points, abs=1e-12)
    assert "50 % of the steps made now by series" in system.how


m = Parameter("m", 1.0, "kg", "mass", positive=True)
k = Parameter("k", 1.0, "N/m", "stiffness")
c = Parameter("c", 0.1, "N s/m", "damping; below zero it drives")
a = Parameter("a", 0.0, "N/m3", "hardening")
w = Parameter("w", 1.0, "rad/s", "frequency of the first force", positive=True)
w2 = Parameter("w2", 2.0, "rad/s", "frequency of the second force", positive=True)
f1 = Parameter("f1", 1.0, "N", "amplitude of the first force")
f2 = Parameter("f2", 0.4, "N", "amplitude of the second force")
gap = Parameter("gap", 1.5, "m", "mean place of the wall")
e = Parameter("e", 0.8, "1", "restitution")
q = Coordinate("q", "m", "displacement", velocity="v")


def beaten(**more: Any) -> Mechanism:
    """A mass between spring and wall under two forces, the second of which shakes the wall too."""
    second = sympy.sin(w2 * TIME + sympy.Rational(1, 3))
    force = f1 * sympy.cos(w * TIME) + f2 * second
    declared: dict[str, Any] = {
        "name": "beaten_mass",
        "title": "Mass under two forces",
        "source": "this test",
        "coordinates": [q],
        "kinetic_energy": m * q.v**2 / 2,
        "potential_energy": k * q**2 / 2,
        "applied": {q: force - c * q.v},
        "contacts": [Impact(name="wall", gap=gap * (1 + second / 10) - q, restitution=Newton(e))],
    }
    return Mechanism(**{**declared, **more})


@pytest.fixture(scope="module")
def strobe(tmp_path_factory: pytest.TempPathFactory) -> Strobe:
    path = quick_export(beaten(), tmp_path_factory.mktemp("beaten") / "beaten_mass.fmu")
    return Strobe(Fmu.open(path), forcing="w")


def test_a_sum_of_sinusoids_is_followed_and_one_without_a_period_refused(strobe):
    starts = np.linspace([0.0, 0.0], [1.0, 1.0], 20)
    lanes, series = both(strobe, starts, 10)
    assert lanes.in_lanes.sum() == lanes.steps.sum()
    assert lanes.began.sum() > 50
    assert lanes.points == pytest.approx(series.points, abs=1e-9)
    jobs = Jobs(starts, rows=2, derivatives=True)
    near, near_series = strobe.run(jobs, GO), strobe.stepped_by("taylor").run(jobs, GO)
    assert near.in_lanes.sum() == near.steps.sum()
    assert near.derivatives == pytest.approx(near_series.derivatives, rel=1e-8, abs=1e-8)
    for mixed in (strobe.at(w2=math.sqrt(2.0)), strobe.stepped_by("taylor").at(w2=1.5)):
        with pytest.raises(StickslipError, match=r"another 6\.28319 s later\. Strobe it with a period that all"):
            mixed.run(Jobs(starts[:2], rows=2), GO)
    halves = Strobe(strobe.fmu, forcing="w", parameters={"w2": 1.5}, every=2)
    lanes, series = both(halves, starts[:3], 3)
    assert lanes.points == pytest.approx(series.points, abs=1e-9)


def test_damping_that_drives_grows_until_it_escapes_and_harms_no_other(strobe):
    driven = strobe.at(k=0.0, f2=0.0)
    values = np.array([0.1, -2.0, 0.2, 0.0])
    starts = np.tile([0.0, -1.0], (4, 1))
    lanes, series = both(driven, starts, 20, c=values)
    assert lanes.outcomes.tolist() == series.outcomes.tolist() == [FINISHED, ESCAPED, FINISHED, FINISHED]
    alone = driven.run(Jobs(starts[2:], {"c": values[2:]}, rows=20), GO)
    assert np.array_equal(lanes.points[2:], alone.points)
    assert lanes.points[[0, 2, 3]] == pytest.approx(series.points[[0, 2, 3]], abs=1e-8)
    # the same on the way to the first row
    late = driven.run(Jobs(starts, {"c": values}, transient=19), GO)
    assert late.outcomes.tolist() == lanes.outcomes.tolist()
    assert late.steps.tolist() == lanes.steps.tolist()
    assert np.array_equal(late.points[2:, 0], lanes.points[2:, -1])


def test_numbers_beyond_all_others_end_their_lane_alone(strobe):
    starts = np.array([[0.0, 0.1], [-1e308, -1e308], [0.0, 0.3]])
    lanes, _ = both(strobe, starts, 3)
    assert lanes.outcomes.tolist() == [FINISHED, ESCAPED, FINISHED]
    alone = strobe.run(Jobs(starts[[0, 2]], rows=3), GO)
    assert np.array_equal(lanes.points[[0, 2]], alone.points)


def test_a_declaration_that_is_linear_for_some_parameters_says_for_which():
    hard = lower(beaten(name="hard_mass", potential_energy=k * q**2 / 2 + a * q**4 / 4))
    said = ("the rate of v: q**3 is not linear in the states, but for a = 0",)
    assert obstacles(hard) == lane_obstacles(hard) == said


@pytest.mark.parametrize("sign", [1, -1])
def test_a_force_whose_squares_cancel_is_linear(sign):
    """(q + gap)^2 - q^2 is 2 gap q + gap^2; with one sign the spring's force is cancelled too."""
    squares = k * (q + gap) ** 2 / (2 * gap) - k * q**2 / (2 * gap)
    assert obstacles(lower(beaten(name="bevelled_mass", applied={q: sign * squares - c * q.v}))) == ()


def test_a_ramp_is_linear_but_no_strobe_repeats_it():
    rising = lower(beaten(name="risen_mass", applied={q: f1 * w * TIME - c * q.v}))
    assert obstacles(rising) == ()
    assert lane_obstacles(rising) == ("the rate of v rises with the time: it is another at each strobe",)
    # faster than a ramp it is not linear
    bent = lower(beaten(name="bent_mass", applied={q: f1 * (w * TIME) ** 2 - c * q.v}))
    assert "is not linear in the states" in obstacles(bent)[0]


def test_a_model_without_contacts_has_lanes_too():
    system = Strobe(load("drive_motor"), period=0.1, autonomous=True)
    lanes, series = both(system, np.tile(system.start(), (3, 1)))
    assert lanes.in_lanes.sum() == lanes.steps.sum()
    assert lanes.points == pytest.approx(series.points, rel=1e-11, abs=1e-11)
