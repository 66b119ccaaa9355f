"""Filippov systems declared as automata: sliding and saltation against their closed forms.

Saltation across h(t, x) = 0, from f- to f+ (or onto the sliding flow fs in place of f+), with n = grad h:

    S = 1 + (f+ - f-) n^T / (n^T f- + dh/dt)

Source: Filippov (1988), section 2.4; Leine and Nijmeijer (2004), chapter 7.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from closed_form import root
from fmpy import simulate_fmu
from quick_export import quick_export
from scipy.linalg import expm

from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton, Switch
from fmu_models.language.quantities import TIME, Parameter, State
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

A = np.array([[-0.2, 1.0], [-1.0, -0.1]])
FREE, NORMAL = np.array([3.0, 0.5]), np.array([1.0, -0.5])
START = np.array([-1.0, 0.5])


def exported(folder: Path, states: list[State], flows: list[Any], *switches: Switch) -> Fmu:
    """An automaton as an FMU."""
    automaton: Any = Automaton(
        name="sliding",
        title="sliding",
        source="test",
        states=states,
        flows=dict(zip(states, flows, strict=True)),
        switches=switches,
    )
    return Fmu.open(quick_export(automaton, folder / "sliding.fmu"))


@pytest.fixture(scope="module")
def relay(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    """x' = -sgn(x) + F cos(t)."""
    x = State("x", "1", "state", start=1.0)
    force = Parameter("F", 0.3, "1", "amplitude of the forcing")
    border = Switch(name="border", function=x)
    return exported(tmp_path_factory.mktemp("relay"), [x], [-border.sign + force * sympy.cos(TIME)], border)


def test_a_relay_slides_exactly(relay):
    """1 - t + 0.3 sin(t) = 0 at t = 1.288...; |0.3 cos(t)| < 1 holds it there for good."""
    arrival = root(lambda t: 1 - t + 0.3 * np.sin(t), 1.0, 2.0)
    run = simulate(relay, 100.0)
    (entry,) = run.events
    assert (entry.before, entry.after) == (1, 0)
    assert entry.time == pytest.approx(arrival, rel=1e-14)
    assert arrival == pytest.approx(1.288, abs=1e-3)
    assert not (np.abs(run["x"][run.time > arrival]) > 1e-12).any()
    free = run.time < arrival
    assert run["x"][free] == pytest.approx(1 - run.time[free] + 0.3 * np.sin(run.time[free]), abs=1e-14)


def test_a_relay_lets_go_where_the_forcing_outweighs_it(relay):
    """Sliding ends at |F cos(t)| = 1; released at t1 to minus, x = t - t1 + F (sin(t) - sin(t1)) until it is back."""
    run = simulate(relay, 20.0, parameters={"F": 1.5})
    releases = [event for event in run.events if event.before == 0]
    limit = np.arccos(1 / 1.5)
    assert [event.time % np.pi for event in releases] == pytest.approx([np.pi - limit] * len(releases), rel=1e-12)
    assert [event.after for event in releases] == [-1, 1, -1, 1, -1, 1]
    first = releases[0].time
    landing = root(lambda t: t - first + 1.5 * (np.sin(t) - np.sin(first)), first + 1.0, first + 4.0)
    assert next(e.time for e in run.events if e.after == 0 and e.time > first) == pytest.approx(landing, rel=1e-12)


def test_a_relay_starts_on_its_border_and_stays(relay):
    run = simulate(relay, 10.0, start={"x": 0.0})
    assert run.events == () and not run["x"].any()


def test_a_relay_forgets_its_start(relay):
    found = flow_derivative(relay, 5.0, by=["F"])
    assert found.by_start.tolist() == [[0.0]]
    assert found.by_parameter["F"].tolist() == [0.0]


def planar(folder: Path, jump: np.ndarray, speed: float) -> Fmu:
    """x' = A x + FREE + jump sgn(h), h = NORMAL x - speed t."""
    x = [State(f"x{i + 1}", "1", "state", start=START[i]) for i in range(2)]
    function = sum(n * x[i] for i, n in enumerate(NORMAL)) - speed * TIME
    border = Switch(name="border", function=function)
    flows = [sum(A[i, k] * x[k] for k in range(2)) + FREE[i] + jump[i] * border.sign for i in range(2)]
    return exported(folder, x, flows, border)


def affine(matrix: np.ndarray, constant: np.ndarray, start: np.ndarray, t: float) -> np.ndarray:
    """x(t) of x' = matrix x + constant."""
    block = np.zeros((3, 3))
    block[:2, :2], block[:2, 2] = matrix, constant
    return (expm(t * block) @ [*start, 1.0])[:2]


def arrive(jump: np.ndarray, speed: float) -> tuple[float, np.ndarray]:
    """When and where the motion from START, with h < 0, reaches h = 0."""

    def h(t: float) -> float:
        return float(NORMAL @ affine(A, FREE - jump, START, t) - speed * t)

    t = root(h, 0.0, 2.0)
    return t, affine(A, FREE - jump, START, t)


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_crossing_has_the_saltation_matrix(tmp_path, speed):
    jump = np.array([0.5, -0.4])
    fmu = planar(tmp_path, jump, speed)
    t, there = arrive(jump, speed)
    before = A @ there + FREE - jump
    saltation = np.eye(2) + np.outer(2 * jump, NORMAL) / (NORMAL @ before - speed)
    found = flow_derivative(fmu, t + 0.2)
    assert [event.after for event in simulate(fmu, t + 0.2).events] == [1]
    assert found.end == pytest.approx(affine(A, FREE + jump, there, 0.2), rel=1e-12)
    assert expm(-0.2 * A) @ found.by_start @ expm(-t * A) == pytest.approx(saltation, abs=1e-8)
    rate = (NORMAL @ (before + 2 * jump) - speed) / (NORMAL @ before - speed)
    assert np.linalg.det(found.by_start) == pytest.approx(rate * np.exp(np.trace(A) * (t + 0.2)), rel=1e-11)


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_sliding_follows_the_convex_mean_and_has_its_saltation_matrix(tmp_path, speed):
    """On h = 0 the mean is P (A x + FREE) + jump speed/(n jump), P = 1 - jump n^T/(n^T jump)."""
    jump = np.array([-4.0, 1.0])
    fmu = planar(tmp_path, jump, speed)
    t, there = arrive(jump, speed)
    P = np.eye(2) - np.outer(jump, NORMAL) / (NORMAL @ jump)
    shift = P @ FREE + jump * speed / (NORMAL @ jump)
    run = simulate(fmu, t + 0.5, output_times=[t + 0.5])
    assert [(event.before, event.after) for event in run.events] == [(-1, 0)]
    assert [run["x1"][0], run["x2"][0]] == pytest.approx(affine(P @ A, shift, there, 0.5), rel=1e-12)
    before, sliding = A @ there + FREE - jump, P @ A @ there + shift
    saltation = np.eye(2) + np.outer(sliding - before, NORMAL) / (NORMAL @ before - speed)
    found = flow_derivative(fmu, t + 0.5)
    assert found.by_start == pytest.approx(expm(0.5 * P @ A) @ saltation @ expm(t * A), abs=1e-8)
    assert abs(np.linalg.det(found.by_start)) < 1e-12


def test_two_switches_slide_at_once(tmp_path):
    """x' = -sgn(x) + sgn(y)/2, y' = -sgn(y) - sgn(x)/3 + cos(t)/4: both reach zero and stay."""
    x, y = State("x", "1", "x", start=1.0), State("y", "1", "y", start=2.0)
    one, other = Switch(name="one", function=x), Switch(name="other", function=y)
    flows = [-one.sign + other.sign / 2, -other.sign - one.sign / 3 + sympy.cos(TIME) / 4]
    run = simulate(exported(tmp_path, [x, y], flows, one, other), 20.0)
    # y = 2 - 4 t/3 + sin(t)/4 while both are positive
    arrival = root(lambda t: 2 - 4 * t / 3 + np.sin(t) / 4, 1.0, 2.0)
    assert run.events[0].time == pytest.approx(arrival, rel=1e-13)
    assert {event.contact: event.after for event in run.events} == {"one": 0, "other": 0}
    late = run.time > 5.0
    assert np.abs([run["x"][late], run["y"][late]]).max() < 1e-12


def test_what_is_held_at_zero_has_only_rounding_in_its_last_terms(tmp_path: Path) -> None:
    """A relay holds a state against a pulse far ahead, whose tail leaves rounding in the last terms of a series that is
    zero: no step is judged by those."""
    x = State("x", "1", "x")
    relay = Switch(name="s0", function=x)
    pulse = sympy.Rational(3, 16) * sympy.tanh(64 * (TIME - sympy.Rational(11, 16)))
    flow = -x / 2 + sympy.Rational(9, 64) * x - pulse - sympy.Rational(115, 64) * relay.sign
    fmu = exported(tmp_path, [x], [flow], relay)
    run = simulate_fmu(
        str(fmu.path),
        fmi_type="CoSimulation",
        stop_time=3.0,
        output_interval=0.05,
        start_values={"x": 0.078125},
        output=["x"],
    )
    assert np.abs(run["x"][run["time"] > 0.0482]).max() < 1e-15
