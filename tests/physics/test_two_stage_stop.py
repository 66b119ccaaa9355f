"""A two-stage stop against closed forms: a free mass that hits a spring, and beyond it a second one.

m x'' = -k1 x              0 < x < s
m x'' = -k1 x - k2 (x - s)     x > s
"""

from __future__ import annotations

import math

import pytest

from fmu_models import Coordinate, KelvinVoigt, Mechanism, Output, Parameter, TwoStageStop, load, simulate
from fmu_models.base.errors import StickslipError

M, K1, K2, GAP, S, V0 = 1.5, 40.0, 260.0, 0.3, 0.05, 0.8
m = Parameter("m", M, "kg", "mass", positive=True)
k1 = Parameter("k1", K1, "N/m", "stiffness of the first stage", minimum=0.0)
k2 = Parameter("k2", K2, "N/m", "stiffness of the second stage", minimum=0.0)
c = Parameter("c", 0.0, "N s/m", "damping of both stages", minimum=0.0)
gap = Parameter("gap", GAP, "m", "first gap")
s = Parameter("s", S, "m", "way from the first to the second stage", minimum=0.0)
x = Coordinate("x", "m", "place of the mass", velocity="v", v_start=V0)


def mass(release: str) -> tuple[Mechanism, TwoStageStop]:
    buffer = TwoStageStop(
        name="buffer",
        gap=gap - x,
        law=KelvinVoigt(k1, c),
        second_gap=gap + s - x,
        second_law=KelvinVoigt(k2, c),
        release=release,
    )
    outputs = [Output("F", buffer.force, "N", "force of the buffer")]
    model = Mechanism(
        name=f"buffered_by_{release}",
        title="Mass on a buffer of two stages",
        source="closed form",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        contacts=[buffer],
        outputs=outputs,
    )
    return model, buffer


def closed_form(v0: float) -> tuple[list[float], float, float]:
    """Times of the four events from the first touch, s; the largest depth, m; the largest force, N."""
    w1, w2, centre = math.sqrt(K1 / M), math.sqrt((K1 + K2) / M), K2 * S / (K1 + K2)
    first = math.asin(S * w1 / v0) / w1
    v1 = math.sqrt(v0**2 - (w1 * S) ** 2)
    second = math.atan2(v1 / w2, S - centre) / w2
    depth = centre + math.hypot(S - centre, v1 / w2)
    times = [0.0, first, first + 2 * second, 2 * (first + second)]
    return times, depth, K1 * depth + K2 * (depth - S)


@pytest.mark.parametrize("release", ["gap", "force"])
def test_a_mass_comes_back_as_the_closed_form_says(release):
    fmu = load(mass(release)[0])
    times, depth, force = closed_form(V0)
    touched = GAP / V0
    turn = touched + times[3] / 2
    run = simulate(fmu, 2.0, output_times=[0.0, turn, 2.0])
    assert [event.contact for event in run.events] == [f"buffer_{n}" for n in ("first", "second", "second", "first")]
    # times to rounding of a root, of order one
    assert [event.time for event in run.events] == pytest.approx([touched + t for t in times], rel=1e-13)
    assert run["x"][1] == pytest.approx(GAP + depth, rel=1e-13)
    assert run["F"][1] == pytest.approx(force, rel=1e-12)
    assert run["F"][[0, 2]].tolist() == [0.0, 0.0]
    assert run["v"][2] == pytest.approx(-V0, rel=1e-13)


def test_a_slow_mass_meets_the_first_stage_alone():
    v0 = 0.9 * S * math.sqrt(K1 / M)
    run = simulate(load(mass("gap")[0]), 4.0, start={"x": GAP, "v": v0}, output_times=[4.0])
    assert {event.contact for event in run.events} == {"buffer_first"}
    assert run.events[-1].time == pytest.approx(math.pi / math.sqrt(K1 / M), rel=1e-13)
    assert run["v"][-1] == pytest.approx(-v0, rel=1e-13)


def test_its_law_may_be_another_and_its_gaps_have_one_unit():
    model, buffer = mass("gap")
    assert model.with_law(buffer=KelvinVoigt(2 * k1, c)).law_of("buffer") == KelvinVoigt(2 * k1, c)
    turned = Coordinate("phi", "rad", "angle", velocity="w")
    with pytest.raises(StickslipError, match="stop 'buffer': its gap is in m, its second gap in rad"):
        TwoStageStop(
            name="buffer", gap=-x, law=buffer.law, second_gap=-turned, second_law=buffer.second_law, release="gap"
        )
