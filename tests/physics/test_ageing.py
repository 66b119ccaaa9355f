"""Breakaway that ages in stick: a block on a belt against each phase by itself, and the faces of its FMU."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from closed_form import root
from fmpy import simulate_fmu
from mechanisms import LENGTH, LOAD, MASS, STIFFNESS, mechanism
from scipy.integrate import solve_ivp

from fmu_models import load, oscillators
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.language.friction import Friction
from fmu_models.language.law_parameter import T_0
from fmu_models.language.laws import LAWS
from fmu_models.language.laws.ageing import Ageing
from fmu_models.language.quantities import Coordinate, Input
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal
from fmu_models.validation.stress.cases import grid
from fmu_models.validation.stress.equations import StressEquations
from fmu_models.validation.stress.judge import StressSubject, judge

M, K, N, BELT = 1.25, 60.0, 4.905, 0.1  # kg, N/m, N, m/s
LAW = {"mu_s": 0.65, "mu_k": 0.35, "p": 15.0, "b": 0.03}
PARAMETERS = {"m": M, "k": K, "N": N, "c": 0.0, **LAW}
GIVEN: Any = {"parameters": PARAMETERS, "inputs": {"v_belt": BELT}, "start": {"x": 0.0, "v": BELT}}


@cache
def block(version: str = "3.0") -> Fmu:
    return Fmu.open(built("block_on_belt", laws={"belt": "ageing"}, fmi_version=version))


def breakaway(time: float, mu_s: float, b: float) -> float:
    return mu_s + b * np.log10(1 + time / T_0)


def marks(count: int, mu_s: float, mu_k: float, p: float, b: float) -> list[tuple[float, float]]:
    """Time and place at the ends of stick and slip in turn, from rest on the belt at x = 0."""
    t, x, found = 0.0, 0.0, []
    for _ in range(count):
        held = root(lambda d, x=x: K * (x + BELT * d) - N * breakaway(d, mu_s, b), 1e-9, 10.0)
        t, x = t + held, x + BELT * held
        found.append((t, x))

        def rates(_: float, y: np.ndarray) -> list[float]:
            speed = max(BELT - y[1], 0.0)
            return [y[1], (N * ((mu_s - mu_k) / (1 + p * speed) + mu_k) - K * y[0]) / M]

        def stops(_: float, y: np.ndarray) -> float:
            return y[1] - BELT

        stops.terminal, stops.direction = True, 1.0  # type: ignore[attr-defined]
        run = solve_ivp(rates, (0.0, 5.0), [x, BELT], method="DOP853", rtol=2.3e-14, atol=1e-16, events=stops)
        t, x = t + run.t_events[0][0], run.y_events[0][0][0]
        found.append((t, x))
    return found


def test_every_stick_ages_anew_and_slip_begins_with_a_fall() -> None:
    expected = marks(3, **LAW)
    times = np.array([time for time, _ in expected])
    run = simulate(block(), times[-1] + 1e-3, **GIVEN)
    events = [event for event in run.events if event.time > 0]
    np.testing.assert_allclose([event.time for event in events], times, rtol=1e-10)
    near = 1e-7
    there = simulate(block(), times[-1] + near, output_times=np.sort([*(times - near), *(times + near)]), **GIVEN)
    before, after = there["t_stick"][::2], there["t_stick"][1::2]
    sticks = np.diff([0.0, *times])[::2]
    np.testing.assert_allclose(before[::2], sticks - near, rtol=1e-9)
    np.testing.assert_allclose([*before[1::2], *after[::2]], 0.0, atol=0)
    np.testing.assert_allclose(after[1::2], near, rtol=1e-2)
    force = there["F"].reshape(-1, 2)[::2]
    levels = np.array([breakaway(one, LAW["mu_s"], LAW["b"]) for one in sticks])
    np.testing.assert_allclose(force[:, 0], N * levels, rtol=1e-5)
    np.testing.assert_allclose(force[:, 1], N * LAW["mu_s"], rtol=1e-5)


def test_what_is_set_elsewhere_does_not_end_a_stick() -> None:
    """A block has come to rest on the ground, another mass that it feels is pushed on by an input: bends of that, and
    steps of Co-Simulation that set it anew, leave the clock alone."""
    x, y = (Coordinate(name, "m", "place", velocity=f"v{name}") for name in "xy")
    push = Input("push", 0.0, "N", "push")
    law = Ageing(LOAD, *map(sympy.Float, (0.9, 0.5, 15.0)), b=sympy.Float(0.03), t_0=sympy.Float(T_0))
    both = MASS * (x.v**2 + y.v**2 + x.v * y.v * sympy.cos((x - y) / LENGTH) / 4) / 2
    potential = STIFFNESS * y**2 / 2 - push * y
    fmu = load(mechanism("pushed", [x, y], both, potential, [Friction(name="ground", slip=x.v, law=law)]))
    start = {"vx": 0.3, "vy": 0.1}
    rests = simulate(fmu, 2.0, start=start).events[-1].time
    for knot in np.linspace(rests + 0.01, 1.9, 40):
        pushed = Signal([0.0, knot, 2.0], [0.0, 0.0, 0.01])
        run = simulate(fmu, 2.0, start=start, inputs={"push": pushed}, output_times=[2.0])
        assert run["t_stick"][-1] == pytest.approx(2.0 - rests, abs=1e-9)
    signal = np.array([(0.0, 0.0), (2.0, 0.01)], dtype=[("time", "f8"), ("push", "f8")])
    run = simulate_fmu(
        str(fmu.path),
        fmi_type="CoSimulation",
        stop_time=2.0,
        output_interval=0.02,
        start_values=start,
        input=signal,
        output=["t_stick"],
    )
    assert run["t_stick"][-1] == pytest.approx(2.0 - rests, abs=1e-3)


def test_derivatives_of_later_releases_know_how_long_a_stick_was() -> None:
    """Central differences of the phases by themselves."""
    count, names = 2, ("mu_s", "mu_k", "b")
    with SensitiveRun(block(), by=names) as sensitive:
        run = sensitive.run(np.array([0.0, marks(count, **LAW)[-1][0] + 0.01]), **GIVEN)
    found = np.array([d for event, d in zip(run.events, run.event_derivative, strict=True) if event.time > 0])
    step = 1e-5
    for place, name in enumerate(names):
        more, less = (marks(count, **{**LAW, name: LAW[name] + sign * step}) for sign in (1, -1))
        expected = [(a[0] - b[0]) / (2 * step) for a, b in zip(more, less, strict=True)]
        np.testing.assert_allclose(found[:, place], expected, rtol=1e-6, atol=1e-7)


@pytest.mark.nightly_for("2.0")
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_every_face_of_the_fmu_has_the_motion_of_the_engine(version: str) -> None:
    fmu, times = block(version), np.linspace(0.0, 2.0, 21)
    own = simulate(fmu, 2.0, output_times=times, **GIVEN)
    for method in ("auto", "co-simulation"):
        other = simulate_any(fmu, 2.0, method=method, tolerance=1e-11, output_times=times, **GIVEN)
        np.testing.assert_allclose(other["x"], own["x"], rtol=0, atol=1e-8)
        np.testing.assert_allclose(other["t_stick"], own["t_stick"], rtol=0, atol=1e-7)


@pytest.mark.nightly
def test_extremes_of_the_law_are_judged_accurate() -> None:
    """The stress grid of a model with the law in it."""
    model = oscillators.load("block_on_belt")
    (contact,) = model.contacts
    assert isinstance(contact, Friction)
    model = model.with_law(belt=LAWS.load("ageing").around(contact.law))
    subject = StressSubject.of(model, block())
    for case in (one for one in grid("block_on_belt", model, StressEquations(model)) if one.quick):
        cell = judge(case, subject)
        assert cell.verdict == "accurate", cell
