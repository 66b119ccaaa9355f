"""Periodic signals with jumps against exact solutions that are put together from knot to knot and event to event.

Sources: Fossas and Olivar, IEEE Transactions on Circuits and Systems I 43 (1996) 13-25 (the converter: flips at 24.516
and 31.12 V, chaos at 32.34 V).
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from fmpy import simulate_fmu
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mechanisms import mechanism, opened
from quick_export import quick_export
from scipy.optimize import root_scalar
from signalled import buck, follower, pushed

from fmu_models import (
    Automaton,
    Coordinate,
    Coulomb,
    Crossing,
    Friction,
    Parameter,
    PeriodicSignal,
    SensitiveRun,
    State,
    Strobe,
    basins,
    branch,
    equilibria,
    lyapunov,
    orbit_diagram,
    simulate,
)
from fmu_models.base.errors import StickslipError

PERIOD = 400e-6
NAMES = ("d", "k", "T", "t0", "p1", "p2", "s0", "s1", "s2", "s3")
DEFAULTS: dict[str, float] = dict(zip(NAMES, (0.15, 0.5, 1.7, 0.3, 0.3, 0.3, 1.0, -0.4, 0.6, 0.1), strict=True))


@pytest.fixture(scope="module")
def converter():
    return opened(buck())


@cache
def the_oscillator():
    return opened(pushed())


@pytest.fixture
def oscillator():
    return the_oscillator()


@pytest.fixture(scope="module")
def following():
    return opened(follower())


# --- the exact motion of the oscillator


def knots_of(p: dict[str, float], stop: float) -> list[tuple[float, float, float]]:
    """Begin of each piece, value there and slope, from the last knot before 0 on."""
    places, values = (0.0, p["p1"], p["p2"], 1.0), [p[f"s{n}"] for n in range(4)]
    pieces = []
    for cycle in range(-2 - math.ceil(abs(p["t0"]) / p["T"]), math.ceil((stop - p["t0"]) / p["T"]) + 1):
        for n in range(3):
            if places[n + 1] > places[n]:
                slope = (values[n + 1] - values[n]) / ((places[n + 1] - places[n]) * p["T"])
                pieces.append((p["t0"] + (cycle + places[n]) * p["T"], values[n], slope))
    return pieces


def flow(z: np.ndarray, p: dict[str, float], sign: float, t: Any) -> np.ndarray:
    """(x, v) after a time t from z = (x, v, s, s') with s a line: a particular line, and a damped oscillation."""
    x0, v0, s0, slope = z
    d = p["d"]
    w = math.sqrt(1.0 - d * d)
    at = s0 + p["k"] * sign - 2 * d * slope  # x = at + slope t solves the equation
    a, b = x0 - at, (v0 - slope + d * (x0 - at)) / w
    decay, c, s = np.exp(-d * t), np.cos(w * t), np.sin(w * t)
    x = decay * (a * c + b * s)
    v = decay * ((b * w - d * a) * c - (a * w + d * b) * s)
    return np.array([at + slope * t + x, slope + v])


def exact(p: dict[str, float], stop: float, x: Any = (0.4, 0.1)) -> tuple[np.ndarray, list[float], float]:
    """States at the end, times of the events, and how clear of a touch the nearest comes."""
    pieces, state, events, clear, sign = knots_of(p, stop), np.array(x, dtype=float), [], np.inf, 0.0
    for n, (begin, value, slope) in enumerate(pieces):
        end = min(pieces[n + 1][0] if n + 1 < len(pieces) else stop, stop)
        t = max(begin, 0.0)
        if end <= t:
            continue
        h = value + slope * (t - begin) - state[0]
        if sign and np.sign(h) != sign:
            events.append(t)
        clear, sign = min(clear, abs(h)), float(np.sign(h))
        while True:
            z = np.array([*state, value + slope * (t - begin), slope])

            def gap(later: Any, z: np.ndarray = z, sign: float = sign) -> Any:
                return sign * (z[2] + z[3] * later - flow(z, p, sign, later)[0])

            grid = np.linspace(0.0, end - t, 4001)[1:]
            gaps = gap(grid)
            below = np.flatnonzero(gaps < 0.0)
            if below.size == 0:
                clear = min(clear, gaps[40:].min(initial=np.inf))
                state, t = flow(z, p, sign, end - t), end
                break
            first = int(below[0])
            lower = grid[first - 1] if first else grid[0] * 1e-3
            if gap(lower) <= 0.0:
                return state, events, 0.0  # leaves and comes back at once
            later = root_scalar(gap, bracket=(lower, grid[first]), xtol=1e-15, rtol=1e-15).root
            state, t = flow(z, p, sign, later), t + later
            clear, sign = min(clear, abs(slope - state[1])), -sign
            events.append(t)
    return state, events, clear


@settings(max_examples=100, deadline=None)
@given(
    T=st.floats(0.5, 4.0),
    t0=st.floats(-9.0, 9.0),
    places=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
    values=st.tuples(*[st.floats(-2.0, 2.0)] * 4),
    k=st.floats(0.05, 1.5),
    stop=st.floats(1.0, 9.0),
)
def test_random_knots_and_phases(T, t0, places, values, k, stop):
    p1, p2 = (0.0 if place < 0.02 else 1.0 if place > 0.98 else place for place in sorted(places))
    p2 = p1 if p2 - p1 < 0.02 else p2
    p = DEFAULTS | dict(zip(NAMES[2:], (T, t0, p1, p2, *values), strict=True)) | {"k": k}
    end, events, clear = exact(p, stop)
    assume(clear > 1e-4)
    run = simulate(the_oscillator(), stop, parameters=p, output_times=[stop])
    assert [run["x"][-1], run["v"][-1]] == pytest.approx(end, abs=1e-10)
    # a jump at the very end is over or not, by its rounding
    found, expected = ([t for t in times if t < stop - 1e-9] for times in ([e.time for e in run.events], events))
    assert found == pytest.approx(expected, abs=1e-10)


def test_the_signal_is_shown_from_the_jump_on(oscillator):
    p = DEFAULTS
    times = np.array([0.0, 0.29, 0.3, 0.8, 0.3 + 0.3 * 1.7, 1.0, 2.0])
    run = simulate(oscillator, 2.0, output_times=times)
    pieces = knots_of(p, 3.0)
    last = [max((piece for piece in pieces if piece[0] <= t), key=lambda piece: piece[0]) for t in times]
    shown = zip(times, last, strict=True)
    assert run["s_now"] == pytest.approx([value + slope * (t - begin) for t, (begin, value, slope) in shown])


@pytest.mark.parametrize("p", [DEFAULTS, DEFAULTS | {"p2": 0.6, "t0": -20.3, "k": 0.9}], ids=["jump", "line"])
def test_derivatives_know_that_parameters_move_the_knots(oscillator, p):
    stop, step = 6.1, 1e-5
    with SensitiveRun(oscillator, by=["x", "v", *NAMES]) as runs:
        run = runs.run([stop], parameters=p)
    assert not run.one_sided

    def ends(name: str, by: float) -> np.ndarray:
        start = {"x": 0.4, "v": 0.1}
        moved = {**start, **p} | {name: {**start, **p}[name] + by}
        # both places of a jump move together, or the piece between them is none
        moved |= {"p2": moved["p1"]} if name == "p1" and p["p1"] == p["p2"] else {}
        end, events, _ = exact(moved, stop, (moved.pop("x"), moved.pop("v")))
        return np.array([*end, *events])

    for n, name in enumerate(run.by):
        if p["p1"] == p["p2"] and name == "p2":
            continue
        central = [(ends(name, h) - ends(name, -h)) / (2 * h) for h in (step, 2 * step)]
        expected = (4 * central[0] - central[1]) / 3
        both = [n, run.by.index("p2")] if name == "p1" and p["p1"] == p["p2"] else [n]
        found = [*run.derivative[-1][:, both].sum(axis=1), *run.event_derivative[:, both].sum(axis=1)]
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-8), name


def test_points_of_other_sections_know_the_phase(oscillator):
    section = Crossing(oscillator, "v", level=0.0, period=1.7)
    point = section.step(np.array([section.start({"x": 0.4, "v": 0.0, "phase": 0.45})])).points
    whole, derivative = section.step(point), section.step(point).derivatives[0]
    assert np.isfinite(whole.points).all()
    for i, name in enumerate(section.states):
        if name == "v":
            continue
        h = 1e-6 * np.eye(len(section.states))[i]
        ahead, behind = (section.step(point + move, derivative=False).points[0] for move in (h, -h))
        assert derivative[:, i] == pytest.approx((ahead - behind) / 2e-6, abs=1e-7), name


def test_knots_that_do_not_ascend_are_refused(oscillator):
    with pytest.raises(StickslipError, match="the knots of 's' must ascend from 0 to 1"):
        simulate(oscillator, 1.0, parameters={"p1": 0.8})


# --- sliding along a ramp, and a reset by a clock


def test_it_slides_up_a_ramp_and_falls_at_the_jump(following):
    """Up the ramp at its rate; after the jump down at 2 until it meets the next ramp, x = 1 - 2 t = t at 1/3."""
    times = np.array([0.5, 1.0 + 1 / 6, 1.0 + 1 / 3, 1.9, 2.25])
    run = simulate(following, 2.3, output_times=times)
    assert run["x"] == pytest.approx([0.5, 2 / 3, 1 / 3, 0.9, 0.5], abs=1e-13)
    assert run["y"] == pytest.approx([0.25, 0.25, 0.5, 0.5, 0.5], abs=1e-13)
    resets = [event for event in run.events if event.reset]
    assert [(event.contact, event.time) for event in resets] == [("up", 0.25), ("up", 1.25), ("up", 2.25)]
    slides = [event.time for event in run.events if event.contact == "side"]
    assert slides == pytest.approx([1.0, 4 / 3, 2.0], abs=1e-13)


def test_a_later_clock_sees_a_later_state(following):
    """y = x(1 + late) = 1 - 2 late before 1/3 and late beyond it."""
    for late, slope in ((0.25, -2.0), (0.5, 1.0)):
        with SensitiveRun(following, by=["late"]) as runs:
            run = runs.run([1.9], parameters={"late": late})
        assert run.of("y")[-1, 0] == pytest.approx(slope, abs=1e-12)


def test_a_square_wave_pushes_a_block():
    """3 N for 1 s of 4 s, friction 1 N, 1 kg: 2 m/s at 1 s, at rest from 3 s to 4 s at 3 m, then again."""
    x, m = Coordinate("x", "m", "place"), Parameter("m", 1.0, "kg", "mass", positive=True)
    push, grip = Parameter("F", 3.0, "N", "push"), Parameter("N", 1.0, "N", "load", positive=True)
    long = Parameter("T", 4.0, "s", "period", positive=True)
    force = PeriodicSignal.square("force", "N", "push", period=long, high=push, duty=0.25)
    floor = Friction(name="floor", slip=x.v, law=Coulomb(grip, sympy.S.One))
    block = mechanism("pushed_block", [x], m * x.v**2 / 2, -force * x, [floor])
    run = simulate(opened(block), 5.0, output_times=[1.0, 3.5, 5.0])
    assert run["x"] == pytest.approx([1.0, 3.0, 4.0], abs=1e-13)
    assert run["x_v"] == pytest.approx([2.0, 0.0, 2.0], abs=1e-13)
    assert [(event.time, event.after) for event in run.events] == [(pytest.approx(3.0, abs=1e-13), 0), (4.0, 1)]


# --- the converter


def test_a_converter_doubles_its_period_at_the_tick_that_its_ramp_says(converter):
    sweep = orbit_diagram(Strobe(converter), "E", [24.0, 26.0, 31.5, 32.0, 32.2], transient=3000)
    assert sweep.periods.tolist() == [[1, 2, 4, 4, 8]]


def test_a_converter_is_chaotic_where_published(converter):
    """The sum of the exponents is the divergence, for saltation at a comparator without a memory keeps areas."""
    exponents = lyapunov(Strobe(converter, parameters={"E": 32.5}), periods=20000, transient=2000)
    assert exponents.values[0] > 0.3
    assert exponents.values.sum() == pytest.approx(-PERIOD / (22.0 * 47e-6), rel=1e-12)


def test_basins_at_a_tick(converter):
    grid = basins(Strobe(converter, parameters={"E": 26.0}), v=np.linspace(11, 13, 4), i=[0.4, 0.6])
    assert [len(attractor.points) for attractor in grid.attractors] == [2] and (grid.labels == 0).all()


def test_a_branch_over_the_frequency_of_the_ramp(converter):
    """The multipliers along it are the determinant: exp(-T/RC) is their product at every frequency."""
    line, same = (
        branch(Strobe(converter, forcing=forcing, parameters={"E": 20.0}), "f", (2000.0, 3500.0), settle=True)
        for forcing in (None, "f")
    )
    assert line.values == pytest.approx(same.values, rel=1e-9) and line.multipliers == pytest.approx(
        same.multipliers, rel=1e-8
    )
    product = np.prod(line.multipliers, axis=1)
    assert product == pytest.approx(np.exp(-1 / (line.values * 22.0 * 47e-6)), rel=1e-9)
    assert {end["kind"] for end in line.named_ends} <= {"range", "flip"} and len(line.values) > 5


def test_a_strobe_follows_the_period_of_all_signals(following, converter):
    strobe = Strobe(following)
    assert strobe.periods({}, 1) == 1.0 and strobe.at(T=3.0).periods({}, 1) == 3.0
    assert Strobe(converter).periods({"f": np.array([1000.0, 3000.0])}, 2) == pytest.approx([1e-3, 1 / 3000], rel=1e-15)
    assert Crossing(converter, "v", level=11.9).states[-1] == "phase"
    with pytest.raises(StickslipError, match="'ramp' forces the motion"):
        Strobe(converter, autonomous=True)


def clocked(*periods: float) -> Any:
    """x' = c1 + c2 + ... - x of clocks that are high most of the time."""
    x, second = State("x", "1", "state"), Parameter("tau", 1.0, "s", "time", positive=True)
    clocks = [PeriodicSignal.square(f"c{n}", "1", "c", period=T * second, duty=0.9) for n, T in enumerate(periods)]
    flows = {x: (sum(clocks) - x) / second}
    return opened(Automaton(name="clocked", title="Clocked", source="test", states=[x], flows=flows))


def test_a_clock_forces_the_motion_though_it_is_high_whenever_looked_at():
    """x = 1 - (1 - x) exp(-t) while it is high, for 4.5 s of 5 s, then x exp(-t)."""
    fmu = clocked(5.0)
    (motion,) = basins(fmu, x=[0.0, 2.0]).attractors
    assert motion.points[0, 0] == pytest.approx((np.exp(-0.5) - np.exp(-5)) / (1 - np.exp(-5)), rel=1e-12)
    with pytest.raises(StickslipError, match="is forced"):
        equilibria(fmu, "tau", (1.0, 2.0))


def test_clocks_of_two_periods_need_one_for_both():
    fmu = clocked(1, 1.5)
    with pytest.raises(StickslipError, match=r"periods of their own \(c0 tau, c1 1.5\*tau\)"):
        Strobe(fmu)
    assert Strobe(fmu, period=3.0).step(np.array([[0.5]])).why == {}


def test_a_wrong_period_is_refused(converter):
    with pytest.raises(StickslipError, match="What forces the motion is another"):
        lyapunov(Strobe(converter, period=300e-6), periods=10)


# --- FMUs


@pytest.mark.parametrize("fmi_version", ["2.0", "3.0"])
@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_fmpy_comes_to_the_exact_end(tmp_path: Path, kind: str, fmi_version: str):
    """Of Model Exchange its solver's tolerance is left; its step ends at each jump, which it knows beforehand."""
    path = quick_export(pushed(), tmp_path / "pushed.fmu", fmi_version=fmi_version)
    end, _, _ = exact(DEFAULTS, 6.1)
    options = {"output_interval": 0.1, "relative_tolerance": 1e-10, "output": ["x", "v"]}
    run = simulate_fmu(str(path), fmi_type=kind, stop_time=6.1, **options)
    assert [run["x"][-1], run["v"][-1]] == pytest.approx(end, abs=2e-7 if kind == "ModelExchange" else 1e-12)
