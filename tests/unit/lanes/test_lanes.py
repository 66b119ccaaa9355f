"""The exact flow in lanes: which models have it, the same bits for any number of lanes, the motions of the series."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from benchmark_scripts import benchmark_script
from lane_mechanisms import c, k, length, m, opened, x

from fmu_models.analyses.basins import basins
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.lane_tables import lane_obstacles
from fmu_models.families.jobs import ESCAPED, Jobs
from fmu_models.fmu.load import load
from fmu_models.lanes.library import lanes_of
from fmu_models.language.automaton import Automaton, Switch
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Input, State
from fmu_models.language.stops import Stop
from fmu_models.lowering.lower import lower
from fmu_models.lowering.piecewise_linear import obstacles
from fmu_models.oscillators import MODELS
from fmu_models.oscillators import load as declaration
from fmu_models.report.model_sheet import sheet
from fmu_models.sections.engine import LanesBackend
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.run import simulate

T = 2.0 * math.pi
GO = np.zeros(1, np.int32)
LINEAR = {
    *("discontinuous_support", "bouncing_ball", "impact_pair", "impact_damper", "fermi_accelerator"),
    *("two_domain_oscillator", "woodpecker", "planar_hopf", "planar_multiple_crossing", "drive_motor"),
}
# what a family of each varies, and its default otherwise
FAMILIES = benchmark_script("bench_lanes").FAMILIES


# contacts that forces hold: what varies, where the motions start, and s of a strobe of what nothing forces
HELD = {
    "hinge": ("omega", (0.4, 2.5), {}, None),
    "damper": ("omega", (0.6, 1.5), {}, None),
    "table": ("omega", (1.0, 1.6), {"z": 8.0}, None),
    "woodpecker": ("eN1", (0.3, 0.6), {}, 0.146),
}


def held_family(name: str, count: int, rows: int) -> tuple[Strobe, Jobs]:
    varied, (low, high), start, period = HELD[name]
    forced: dict[str, Any] = {"forcing": "omega"} if period is None else {"period": period, "autonomous": True}
    system = Strobe(load(name) if name == "woodpecker" else opened(name), **forced)
    return system, Jobs(np.tile(system.start(start), (count, 1)), {varied: np.linspace(low, high, count)}, rows=rows)


def family(name: str, count: int, rows: int) -> tuple[Strobe, Jobs]:
    forcing, values, varied, (low, high) = FAMILIES[name]
    system = Strobe(load(name), forcing=forcing, parameters=values)
    starts = np.tile(system.start({"x": 0.0, "v": 0.0} if name == "discontinuous_support" else {}), (count, 1))
    return system, Jobs(starts, {varied: np.linspace(low, high, count)}, rows=rows)


def test_the_proof_knows_which_models_are_linear_in_every_mode():
    found = {name: obstacles(lower(declaration(name))) for name in MODELS.members()}
    assert {name for name, why in found.items() if not why} == LINEAR
    assert found["disc_rig"][0] == ("contact 'disc0': 1/(p0*|v| + 1) is not linear in the speed, but for p0 = 0")
    assert "d**(3/2) is not linear in the depth" in found["hinge_clearance"][0]


def test_what_is_linear_may_still_have_contacts_that_lanes_do_not_follow():
    system = lower(declaration("woodpecker"))
    assert obstacles(system) == lane_obstacles(system) == ()
    beak, *others = system.contacts
    jumps = dataclasses.replace(beak, rooted=True)
    found = lane_obstacles(dataclasses.replace(system, contacts=(jumps, *others)))
    assert found == ("contact 'beak': its jumps are not followed in lanes",)


@pytest.mark.parametrize("name", FAMILIES)
def test_lanes_make_the_motions_of_the_series(name):
    system, jobs = family(name, 100, 10)
    lanes, series = system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)
    assert lanes.in_lanes.sum() > 0.98 * lanes.steps.sum()
    assert series.in_lanes.sum() == 0
    errors = np.abs(lanes.points - series.points).max(axis=1) / np.abs(series.points).max(axis=(0, 1))
    assert np.median(errors) < 2e-13
    assert errors.max() < 1e-9
    assert np.array_equal(lanes.began, series.began)
    assert lanes.held == pytest.approx(series.held, abs=1e-10)


@pytest.mark.parametrize("name", FAMILIES)
def test_results_are_the_same_bits_for_any_number_of_lanes(name, monkeypatch):
    system, jobs = family(name, 13, 40)
    known = lanes_of(system.fmu)
    steppers = [one for width in (1, 2, 4, 8) if (one := known.stepper(width)) is not None]
    assert [one.lanes for one in steppers][:2] == [1, 2]
    widest = known.stepper()
    assert widest is not None and widest.lanes == steppers[-1].lanes
    made = []
    for stepper in steppers:
        with monkeypatch.context() as patch:
            patch.setitem(vars(system.backend), "stepper", lambda _, one=stepper: one)
            made.append(system.run(jobs, GO))
    # events of few motions come at other times
    assert isinstance(system.backend, LanesBackend)
    chosen = [system.backend.stepper(motions) for motions in (1, 3, 4, 64)]
    assert [one and one.lanes for one in chosen] == [1, 1, 2, widest.lanes]
    alone = np.concatenate([system.run(jobs.part(i, i + 1), GO).points for i in range(len(jobs))])
    for one in made:
        assert np.array_equal(one.points, alone)
        assert np.array_equal(one.held, made[0].held)


@pytest.mark.parametrize("name", HELD)
def test_contacts_stick_close_and_jam_in_lanes(name, monkeypatch):
    system, jobs = held_family(name, 60, 5)
    lanes, series = system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)
    assert lanes.in_lanes.tolist() == lanes.steps.tolist()
    errors = np.abs(lanes.points - series.points).max(axis=1) / np.abs(series.points).max(axis=(0, 1))
    assert np.median(errors) < 1e-12
    assert errors.max() < 1e-9
    assert lanes.began.sum() > 100
    assert np.array_equal(lanes.began, series.began)
    assert lanes.held.max() > 0.1
    assert lanes.held == pytest.approx(series.held, abs=1e-9)
    # whatever lanes leave to the engine on the way, and for whom
    part = jobs.part(20, 33)
    for width in (1, 2, 4, 8):
        stepper = lanes_of(system.fmu).stepper(width)
        if stepper is not None:
            monkeypatch.setitem(vars(system.backend), "stepper", lambda _, one=stepper: one)
            assert np.array_equal(system.run(part, GO).points, lanes.points[20:33])


def test_a_resonance_without_damping_grows_as_it_should():
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={"c": 0.0, "g": 1e5})
    made = system.run(Jobs(np.zeros((3, 2)), transient=999, rows=1), GO)
    # x = f0/2 t sin(t), v = f0/2 (sin(t) + t cos(t))
    with mpmath.workdps(30):
        t = 1000 * mpmath.mpf(T)
        exact = [float(t / 4 * mpmath.sin(t)), float((mpmath.sin(t) + t * mpmath.cos(t)) / 4)]
    assert made.in_lanes.tolist() == [1000] * 3
    assert made.points[:, 0] == pytest.approx(np.tile(exact, (3, 1)), abs=1e-12 * abs(exact[1]))


def test_a_switch_slides_on_a_surface_that_time_moves():
    """Looked at after what is no period of the harmonic: on the surface of that time, not of the beginning."""
    x = State("x", "1", "x")
    switch = Switch(name="side", function=x - sympy.sin(TIME))
    drawn = Automaton(
        name="moved", title="Moved", source="tests", states=[x], flows={x: -x / 2 - 2 * switch.sign}, switches=[switch]
    )
    system = Strobe(load(drawn), period=1.0, autonomous=True)
    made = system.run(Jobs(np.tile(system.start({"x": 0.3}), (3, 1)), rows=1), GO)
    assert made.in_lanes.tolist() == [1] * 3
    assert made.points[:, 0, 0] == pytest.approx(math.sin(1.0), abs=1e-12)


def test_the_lightest_touch_is_seen_and_none_is_invented():
    # from the place of rest with the speed v: the highest point of a damped swing is known
    depths = np.concatenate([np.logspace(-3, math.log10(3e-14), 400), -np.logspace(-3, math.log10(3e-14), 400)])
    speeds = np.linspace(1.0, 3.0, 800)
    with mpmath.workdps(30):
        d = mpmath.mpf(0.05) / 2
        w = mpmath.sqrt(1 - d * d)
        at = mpmath.atan(w / d) / w
        peak = mpmath.exp(-d * at) * mpmath.sin(w * at) / w
        gaps = np.array([float(peak * mpmath.mpf(v) - h * mpmath.mpf(v)) for v, h in zip(speeds, depths, strict=True)])
    starts = np.stack([np.zeros(800), speeds], axis=1)
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={"f0": 0.0, "omega": 1.2})
    made = system.run(Jobs(starts, {"g": gaps}, rows=1), GO)
    assert made.in_lanes.sum() == 800
    assert made.began[:400].sum() == 400
    assert made.began[400:].sum() == 0


def test_a_stiff_support_has_its_origin_on_the_wall():
    values = {"ks": 1e9, "omega": 0.95}
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters=values)
    jobs = Jobs(np.zeros((8, 2)) + np.linspace(0.0, 1.0, 8)[:, None], rows=10)
    lanes, series = system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)
    assert lanes.in_lanes.sum() == lanes.steps.sum()
    assert lanes.began.sum() > 8
    assert lanes.points == pytest.approx(series.points, abs=1e-10)


def test_a_lane_that_goes_to_infinity_harms_no_other():
    system, jobs = family("discontinuous_support", 9, 20)
    far = dataclasses.replace(jobs, starts=np.where(np.arange(9)[:, None] == 4, 1e12, jobs.starts))
    made, known = system.run(far, GO), system.run(jobs, GO)
    assert made.outcomes[4] == ESCAPED
    others = np.arange(9) != 4
    assert np.array_equal(made.points[others], known.points[others])


def test_what_rests_on_its_table_stays_in_lanes():
    values = {"omega": 1.0, "g": 1.0, "A": 1.2}
    system = Strobe(load("bouncing_ball"), forcing="omega", parameters=values)
    # e = 0: no bounce; otherwise so many that the engine completes them; e = 1: none is the last
    jobs = Jobs(np.array([[60.0, 0.0]] * 4), {"e": np.array([0.0, 0.2, 0.6, 1.0])}, rows=6)
    made, series = system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)
    assert made.in_lanes.tolist() == made.steps.tolist()
    assert made.points == pytest.approx(series.points, abs=1e-9)
    assert np.array_equal(made.began, series.began)
    assert made.held == pytest.approx(series.held, abs=1e-7)
    # without bounces: thrown off where the table falls faster than g, caught, and carried from there to the next throw
    with mpmath.workdps(30):
        off = mpmath.asin(1 / mpmath.mpf(1.2))
        height, speed = 1.2 * mpmath.sin(off), 1.2 * mpmath.cos(off)
        flight = mpmath.findroot(lambda s: height + speed * s - s * s / 2 - 1.2 * mpmath.sin(off + s), 2.2)
    assert made.held[0, -1, 0] == pytest.approx(float(2 * mpmath.pi - flight), abs=1e-14)
    assert "series" not in system.how


def test_a_stepper_that_is_none_is_refused():
    with pytest.raises(StickslipError, match=r"no stepper 'euler'\. Choose auto or taylor"):
        Strobe(load("discontinuous_support"), forcing="omega", stepper="euler")


def test_basins_are_those_of_the_series_pixel_by_pixel():
    line = np.linspace(-8.0, 8.0, 21)
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={"omega": 1.1})
    found, series = (basins(one, x=line, v=line) for one in (system, system.stepped_by("taylor")))
    assert np.array_equal(found.labels, series.labels)
    assert found.how.startswith("exact flow, up to")
    assert series.how == ""


def test_show_says_what_is_in_the_way_of_the_exact_flow():
    exact = sheet(declaration("disc_rig"))["exact_flow"]
    assert not exact["linear"] and len(exact["obstacles"]) == 2
    assert sheet(declaration("impact_pair"))["exact_flow"] == {"linear": True, "lanes": True, "obstacles": []}


def test_a_wall_moved_by_an_input_is_held_over_a_strobe() -> None:
    """The rate of the input, which a stop's damper and its release read, is none there."""
    wall = Input("wall", 0.0, "m", "place of the wall")
    law = KelvinVoigt(k=100 * k, c=c)
    moved = Mechanism(
        name="moved",
        title="Moved",
        source="test",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2,
        contacts=[Stop(name="stop", gap=length + wall - x, law=law, release="force")],
    )
    fmu = load(moved)
    system = Strobe(fmu, period=5.0, autonomous=True, parameters={"wall": 0.2})
    point = system.run(Jobs(system.start({"v": 3.0})[None], {}, rows=1), GO).points[0, 0]
    run = simulate(fmu, 5.0, inputs={"wall": 0.2}, start={"v": 3.0}, output_times=[5.0])
    assert run.events
    assert point == pytest.approx([run["x"][-1], run["v"][-1]], abs=1e-12)
