"""Families of motions of FMUs that others made, against closed forms and our own model of the same equations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from models import foreign
from scipy.linalg import expm

from fmu_models.analyses.attractors import claimed
from fmu_models.analyses.basins import basins
from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.analyses.spectrum import line_spectrum
from fmu_models.base.errors import StickslipError
from fmu_models.families.jobs import Jobs
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.sections.crossing import Crossing, Impacts
from fmu_models.sections.oscillator import FmuSection
from fmu_models.sections.periodic import PeriodicMotion, find_cycles, motion_at
from fmu_models.sections.strobe import Strobe

D, F, OMEGA = 0.1, 0.5, 1.3
PERIOD = 2.0 * math.pi / OMEGA
TABLE_2 = {"ks": 300.0, "cs": 0.6, "g": 1.6, "omega": 0.86}
POINTS = np.array([[0.0, 0.0], [1.0, 1.0], [0.5, -1.0], [-1.0, 0.3]])


def forced(points: np.ndarray, begin: float, time: float) -> np.ndarray:
    """x'' + 2 d x' + x = f cos(omega t) after a time, in closed form."""
    size = F / complex(1.0 - OMEGA**2, 2.0 * D * OMEGA)
    steady = [
        np.array([z.real, -OMEGA * z.imag]) for z in (size * np.exp(1j * OMEGA * t) for t in (begin, begin + time))
    ]
    return steady[1] + (points - steady[0]) @ expm(np.array([[0.0, 1.0], [-1.0, -2.0 * D]]) * time).T


def settled(system: FmuSection) -> PeriodicMotion:
    rows = system.make(Jobs(system.start({"x": 0.0, "v": 0.0})[None], transient=1000, rows=48, longest=24), workers=1)
    (motion,) = claimed(system, rows).motions
    assert motion is not None
    return motion


@pytest.mark.parametrize(
    ("name", "said", "digits"), [("forced", "directional", 1e-12), ("forced_silent", "rates", 1e-10)]
)
def test_a_strobe_is_the_closed_form_and_so_is_its_derivative(model, fmi, name, said, digits):
    if fmi == 1:
        said, digits = "rates", 1e-10  # it has no directional derivatives
    strobe = Strobe(model(name), forcing="omega")
    made = strobe.step(POINTS)
    assert made.points == pytest.approx(forced(POINTS, 0.0, PERIOD), abs=1e-11)
    assert made.derivatives == pytest.approx(
        np.stack([forced(np.eye(2), 0.0, PERIOD) - forced(np.zeros((2, 2)), 0.0, PERIOD)] * 4).swapaxes(1, 2),
        abs=digits,
    )
    assert said in strobe.how and not made.why


def test_a_section_is_where_the_closed_form_crosses_it(model):
    section = Crossing(model("forced"), "x", 0.2, -1, forcing="omega")
    point = section.start({"x": 0.2, "v": 0.4, "phase": 0.3})
    made = section.step(point[None])
    x, v = forced(point[:2], 0.3 * PERIOD, float(made.times[0]))
    assert made.points[0] == pytest.approx([x, v, (0.3 + made.times[0] / PERIOD) % 1.0], abs=1e-11)
    assert x == pytest.approx(0.2, abs=1e-11) and v < 0.0
    for number in (1, 2):
        beside = [
            section.step((point + s * 1e-5 * np.eye(3)[number])[None], derivative=False).points[0] for s in (1, -1)
        ]
        assert made.derivatives[0, :, number] == pytest.approx((beside[0] - beside[1]) / 2e-5, abs=1e-8)


def test_the_support_is_ours_with_its_contacts_multipliers_and_basins(model):
    own, other = (
        Strobe(f, forcing="omega", parameters=TABLE_2) for f in (load("discontinuous_support"), model("support"))
    )
    ours, theirs = own.step(POINTS), other.step(POINTS)
    assert theirs.points == pytest.approx(ours.points, abs=1e-10)
    assert theirs.derivatives == pytest.approx(ours.derivatives, abs=1e-8)
    one, two = settled(own), settled(other)
    assert (two.period, one.period) == (3, 3) and two.residual < 1e-11
    assert two.stability.eigenvalues == pytest.approx(one.stability.eigenvalues, abs=1e-9)
    found = [lyapunov(s.at(omega=0.94), {"x": 0.0, "v": 0.0}, periods=800, transient=50) for s in (own, other)]
    assert abs(found[0].per_time[0] - found[1].per_time[0]) < 3.0 * math.hypot(*(e.per_time_errors[0] for e in found))
    assert found[1].how == other.how and "how" in repr(found[1]) and "exact flow" in found[0].how
    line = np.linspace(-8.0, 8.0, 5)
    maps = [basins(s.at(ks=10.0, cs=0.3, g=4.0, omega=1.18), x=line, v=line) for s in (own, other)]
    assert (maps[0].labels == maps[1].labels).all() and len(maps[1].attractors) == 2
    lines = [line_spectrum(s, m, lines=3) for s, m in ((own, one), (other, two))]
    assert lines[1].amplitude == pytest.approx(lines[0].amplitude, abs=1e-9)


def test_a_limit_cycle_of_what_nothing_forces(model):
    section = Crossing(model("van_der_pol"), "x")
    rows = section.make(Jobs(section.start({"x": 2.0, "v": 0.0})[None], transient=10, rows=1))
    motion = motion_at(section, find_cycles(section, rows.points)[0])
    assert motion.time == pytest.approx(6.66328685932313, abs=1e-9)  # period for mu = 1
    ((multiplier,),) = (motion.stability.eigenvalues,)
    found = lyapunov(Strobe(model("van_der_pol"), period=1.0, autonomous=True), periods=400, motions=2, transient=60)
    assert found.zero == 0 and abs(found.values[0]) < 1e-6
    assert found.values[1] == pytest.approx(math.log(multiplier.real) / motion.time, abs=2e-3)


def test_where_an_event_moves_the_states_differences_of_motions_tell(model):
    # from one top to the next a ball keeps e^2 of its height
    section = Crossing(model("ball"), "v", 0.0, -1, parameters={"e": 0.7})
    made = section.step(np.array([[1.0, 0.0]]))
    assert made.points[0] == pytest.approx([0.49, 0.0], abs=1e-12)
    assert made.derivatives[0] == pytest.approx(np.diag([0.49, 0.0]), abs=1e-7)


def test_what_is_not_met_and_what_cannot_be_asked_is_said(model):
    section = Crossing(model("forced"), "x", 50.0, 1, forcing="omega")
    made = section.step(section.start({"x": 0.0})[None])
    assert "1000 periods" in made.why[0] and np.isnan(made.points).all()
    diagram = orbit_diagram(section, "d", [0.1, 0.2], transient=1, points=1)
    assert all("1000 periods" in why for why in diagram.failures.values()) and len(diagram.failures) == 2
    with pytest.raises(StickslipError, match="tells no contacts"):
        Impacts(model("ball"), "table")
    with pytest.raises(StickslipError, match="no parameter 'omga'"):
        Strobe(model("forced"), forcing="omga")


def test_a_co_simulation_has_no_section(tmp_path):
    with pytest.raises(StickslipError, match="Model Exchange"):
        Strobe(Fmu.open(foreign("integers", tmp_path)), period=1.0)
