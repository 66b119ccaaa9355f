"""Quantities of a period, against closed forms of the free motion, and those of each mode with 25 digits in contact."""

from __future__ import annotations

import json
from typing import Any

import mpmath
import numpy as np
import pytest
from forty_digits import Field
from lazy_fmu import LazyFmu

from fmu_models import Crossing, Iteration, StickslipError, Strobe, branch, branches, load, orbit_diagram
from fmu_models.maps.logistic import MAP as LOGISTIC

SUPPORT = LazyFmu("discontinuous_support")
K, C, F0, KS, CS, G = 1.0, 0.05, 0.5, 10.0, 0.3, 4.0


def support(omega: float, **more: float) -> Strobe:
    return Strobe(SUPPORT, forcing="omega", parameters={"omega": omega, **more})


def measured(of: str, omega: float = 0.8, **more: float) -> Any:
    return branch(support(omega, **more), "omega", (omega, omega + 0.05), start={"x": 0, "v": 0}, settle=True, of=of)


def free_amplitude(omega: Any) -> Any:
    return F0 / mpmath.sqrt((K - omega**2) ** 2 + (C * omega) ** 2)


FREE = {
    "max(x)": free_amplitude,
    "min(x)": lambda w: -free_amplitude(w),
    "amplitude(v)": lambda w: w * free_amplitude(w),
    "rms(x)": lambda w: free_amplitude(w) / mpmath.sqrt(2),
    "mean(x)": lambda w: mpmath.mpf(0),
    "mean(energy)": lambda w: (1 + w**2) * free_amplitude(w) ** 2 / 4,
    "energy(power_dissipated)": lambda w: mpmath.pi * C * w * free_amplitude(w) ** 2,
    "impact_speed(support)": lambda w: mpmath.mpf(0),
}


@pytest.mark.parametrize("of", FREE)
def test_of_the_free_motion(of):
    found = measured(of)
    value, slope = found.amounts[0]
    with mpmath.workdps(30):
        exact, change = FREE[of](mpmath.mpf(0.8)), mpmath.diff(FREE[of], mpmath.mpf(0.8))
    assert value == pytest.approx(float(exact), abs=2e-13)
    assert slope == pytest.approx(float(change), abs=1e-10)


def contact_orbit(omega: Any) -> dict[str, Any]:
    """The motion of period 1 in contact, of which entry (t, v) recurs after a period."""
    period = 2 * mpmath.pi / omega
    free = Field(c=C, k=K, f=F0, w=omega)
    held = Field(c=C + mpmath.mpf(CS), k=K + KS, b=KS * G, f=F0, w=omega)

    def contact(t: Any, v: Any) -> tuple[Any, Any]:
        flow = held.flow(t, mpmath.mpf(G), v, mpmath)

        def force(at: Any) -> Any:
            x, speed = flow(at)
            return KS * (x - G) + CS * speed

        return flow, mpmath.findroot(force, t + 0.61 / omega)

    def again(t: Any, v: Any) -> tuple[Any, Any]:
        flow, leave = contact(t, v)
        x, speed = flow(leave)
        x, speed = free.flow(leave, x, speed, mpmath)(t + period)
        return x - G, speed - v

    t, v = mpmath.findroot(again, (mpmath.mpf("0.1562619"), mpmath.mpf("1.9761292")))
    flow, leave = contact(t, v)
    top = mpmath.findroot(lambda at: flow(at)[1], t + 0.3)

    def force(at: Any) -> Any:
        return KS * (flow(at)[0] - G) + CS * flow(at)[1]

    spent = mpmath.quad(lambda at: force(at) * flow(at)[1], [t, top, leave])
    mean = mpmath.quad(force, [t, top, leave]) / period
    return {
        "max(x)": flow(top)[0],
        "impact_speed(support)": v,
        "energy(support_force,x)": spent,
        "energy(power_stops)": spent,
        "mean(support_force)": mean,
    }


@pytest.fixture(scope="module")
def orbits():
    with mpmath.workdps(25):
        h = mpmath.mpf(10) ** -8
        return [contact_orbit(1 + k * h) for k in (-1, 0, 1)], h


@pytest.mark.parametrize(
    "of", ["max(x)", "impact_speed(support)", "energy(support_force,x)", "energy(power_stops)", "mean(support_force)"]
)
def test_of_the_motion_in_contact(orbits, of):
    (before, exact, after), h = orbits
    found = branch(support(1.0), "omega", (1.0, 1.01), of=of)
    value, slope = found.amounts[0]
    assert value == pytest.approx(float(exact[of]), abs=1e-12)
    assert slope == pytest.approx(float((after[of] - before[of]) / (2 * h)), abs=1e-9)


def test_derivatives_are_those_along_the_branch():
    """The force jumps at entry, and the phase of the strobe is not 0."""
    for of in ("max(support_force)", "rms(support_force)", "min(x)", "amplitude(v)"):
        found = branches(support(1.0), "omega", (0.95, 1.19), of=of).branches[0]
        sides = [found.amounts_at(1.1 + h)[0, 0] for h in (-1e-5, 1e-5)]
        assert found.amounts_at(1.1)[0, 1] == pytest.approx((sides[1] - sides[0]) / 2e-5, abs=1e-7)


def test_of_a_cycle_that_nothing_forces():
    """x1 + 2 x2 of the planar Hopf system is larger for larger mu: its cycle grows as mu, its period stays."""
    system = Strobe(load("planar_hopf"), period=4.8, autonomous=True, parameters={"mu": 1.0})
    found = branch(system, "mu", (0.9, 1.1), start={"x1": 0.0, "x2": 2.0}, settle=True, of="amplitude(x1)")
    assert found.amounts[:, 0] / found.values == pytest.approx(found.amounts[0, 0] / found.values[0], rel=1e-11)
    assert found.amounts[:, 1] == pytest.approx(found.amounts[:, 0] / found.values, rel=1e-9)


def test_what_impacts_take_is_what_comes_in():
    """Newton's law: each takes (1 - e^2) m u^2/2 of the approach u."""
    system = Strobe(
        load("impact_pair"), forcing="omega", parameters={"e": 0.6, "D": 6.0, "A": 1.0, "omega": 1.0, "m": 1.0}
    )
    taken, speed = (
        branch(system, "D", (5.5, 6.5), settle=True, of=of) for of in ("energy(right)", "impact_speed(right)")
    )
    (work, work_slope), (u, u_slope) = taken.amounts_at(6.0)[0], speed.amounts_at(6.0)[0]
    assert speed.units["largest impact speed of right"] == "m/s"
    assert work == pytest.approx(0.32 * u**2, rel=1e-12)
    assert work_slope == pytest.approx(0.64 * u * u_slope, rel=1e-8)


def test_specials_lie_on_the_curve_and_it_is_told():
    found = branches(support(0.8), "omega", (0.8, 1.4), of="max(x)")
    (member,) = found.branches
    touches = [a for s, a in zip(member.special, member.special_amounts, strict=True) if s.kind.startswith("graz")]
    assert touches == pytest.approx([G, G], abs=1e-12)
    frame: Any = found.frame
    assert frame["max(x)"].max() > 5.1
    assert np.isfinite(frame["d max(x)/d omega"]).all()
    record = json.loads(json.dumps(found.record()))["branches"][0]["amounts"]
    assert record["max(x)"] == frame["max(x)"].tolist()
    assert len(record["special"]) == 4
    axes = found.plot()
    assert axes.get_ylabel() == "largest x (m)"
    lines: Any
    (lines,) = axes.collections
    assert len(lines.get_segments()) == 3  # stable, unstable, stable
    assert [dashes is None for _, dashes in lines.get_linestyles()] == [True, False, True]


def test_sweeps_show_them_too():
    """At its maxima x is the largest of the period, as seen by a strobe."""
    values = np.linspace(0.9, 1.2, 7)
    common: dict[str, Any] = {"direction": "both", "transient": 500, "start": {"x": 0.0, "v": 0.0}}
    peaks = Crossing(SUPPORT, "v", 0.0, -1, forcing="omega")
    by_peaks = orbit_diagram(peaks, "omega", values, of="max(x)", **common)
    by_strobe = orbit_diagram(support(0.9), "omega", values, of="max(x)", **common)
    assert by_peaks.shown[..., 0] == pytest.approx(by_peaks.points[..., 0, 0], abs=1e-12)
    assert by_strobe.shown[..., 0] == pytest.approx(by_peaks.points[..., 0, 0], abs=1e-12)
    frame: Any = by_strobe.frame
    assert frame["max(x)"].notna().all()
    assert by_strobe.plot().get_ylabel() == "largest x (m)"


def test_what_does_not_repeat_itself_has_one_for_each_step():
    system = support(0.94, ks=300.0, cs=0.6, g=1.6)
    found = orbit_diagram(system, "omega", [0.94], points=20, of="max(x)")
    assert found.periods[0, 0] == 0
    once = found.points[0, 0]
    following = orbit_diagram(system, "omega", [0.94], points=20, of="min(x)")
    assert np.isfinite(found.shown).sum() == 20
    assert (found.shown[0, 0] >= once[:, 0] - 1e-12).all()
    assert (following.shown[0, 0] <= once[:, 0] + 1e-12).all()


def test_of_two_periods_it_is_the_larger():
    system = support(0.98, ks=300.0, cs=0.6, g=1.6).folded(3)
    start = {"x": 0.0, "v": 0.0}
    three = orbit_diagram(support(0.98, ks=300.0, cs=0.6, g=1.6), "omega", [0.98], start=start, of="max(x)")
    once = orbit_diagram(system, "omega", [0.98], start=start, of="max(x)")
    assert three.shown[0, 0, 0] == pytest.approx(once.shown[0, 0, 0], abs=1e-11)


@pytest.mark.parametrize(
    ("of", "said"),
    [
        ("mox(x)", "no quantity of a period. Did you mean 'max'"),
        ("max(y)", "has no variable 'y'"),
        ("impact_speed(x)", "has no contact 'x'"),
        ("energy(support)", "no variable or rigid contact 'support'"),
        ("max(x,v)", "is not understood"),
        ("y", "So are quantities of a period: max"),
    ],
)
def test_what_is_none_is_refused_before_any_run(of, said):
    for follow in (branches, orbit_diagram):
        with pytest.raises(StickslipError, match=said):
            follow(support(1.0), "omega", (1.0, 1.1), of=of)


def test_a_map_has_none():
    with pytest.raises(StickslipError, match=r"no state 'max\(x\)'"):
        orbit_diagram(Iteration.of(LOGISTIC), "r", [3.1], of="max(x)")


def test_the_free_curve_is_laid_below():
    from fmu_models.analyses.branch import follow_branch

    form = "f0/sqrt((k - m*omega**2)**2 + (c*omega)**2)"
    found = follow_branch(support(0.8), "omega", (0.8, 0.9), of="max(x)", closed_form=form)
    axes = found.plot()
    (line,) = [one for one in axes.lines if str(one.get_label()).endswith("closed form")]
    omega = np.asarray(line.get_xdata(), float)
    assert line.get_ydata() == pytest.approx([float(free_amplitude(w)) for w in omega], rel=1e-12)
    assert axes.get_ylim()[1] < 3.0
    with pytest.raises(StickslipError, match="no parameter 'F'"):
        follow_branch(support(0.8), "omega", (0.8, 0.9), of="max(x)", closed_form="F/omega")
