"""Friction by direction: closed forms of a block on a spring, and bodies integrated by themselves."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from dry_friction import Bodies, integrate
from mechanisms import LOAD, MASS, mechanism, opened

from fmu_models import oscillators
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.language.friction import Friction
from fmu_models.language.laws import LAWS
from fmu_models.language.laws.directional import Directional
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.validation.stress.cases import grid
from fmu_models.validation.stress.equations import StressEquations
from fmu_models.validation.stress.judge import StressSubject, judge

M, K, N = 1.25, 60.0, 4.905  # kg, N/m, N
PLUS, MINUS = 0.2, 0.5  # friction coefficients of positive and of negative slip, at any speed
COULOMB = {
    "mu_s_plus": PLUS,
    "mu_k_plus": PLUS,
    "mu_s_minus": MINUS,
    "mu_k_minus": MINUS,
    "p_plus": 0.0,
    "p_minus": 0.0,
}
PARAMETERS = {"m": M, "k": K, "N": N, "c": 0.0, **COULOMB}
REST = {"v_belt": 0.0}


@cache
def block(version: str = "3.0") -> Fmu:
    return Fmu.open(built("block_on_belt", laws={"belt": "directional"}, fmi_version=version))


def half_swings(x: float) -> list[float]:
    """Turning points from rest at x, m: each half swing is one about the place where friction holds the spring."""
    places = [x]
    while not -N * PLUS <= K * x <= N * MINUS:
        x = 2 * (N * MINUS if x > 0 else -N * PLUS) / K - x
        places.append(x)
    return places


@pytest.mark.parametrize("start", [0.31, -0.31, 0.04, 0.0409, -0.0164, -0.0163])
def test_a_block_let_go_turns_and_stays_where_the_closed_form_says(start: float) -> None:
    """Each half swing toward negative places takes 2 N mu_minus/k of the amplitude, the others 2 N mu_plus/k."""
    places = half_swings(start)
    half = np.pi * np.sqrt(M / K)
    times = half * np.arange(len(places) + 1)
    run = simulate(block(), times[-1], parameters=PARAMETERS, inputs=REST, start={"x": start}, output_times=times)
    np.testing.assert_allclose(run["x"], [*places, places[-1]], rtol=0, atol=1e-12)
    # it stays off the middle, and the force that holds it there is the spring's
    assert run["belt_state"][-1] == 0 and run["F"][-1] == pytest.approx(K * places[-1], rel=1e-11)
    swings = [e for e in run.events if e.time > 0]
    np.testing.assert_allclose([e.time for e in swings], half * np.arange(1, len(places)), rtol=1e-11)


@pytest.mark.parametrize(("belt", "bound"), [(0.01, N * MINUS), (-0.01, -N * PLUS)])
def test_a_belt_carries_the_block_to_the_bound_of_its_direction(belt: float, bound: float) -> None:
    """k |v| t = N mu_s of the slip that the belt asks for; its derivatives are those of the closed form."""
    release = bound / (K * belt)
    by = ("mu_s_plus", "mu_s_minus", "k")
    with SensitiveRun(block(), by=by) as sensitive:
        run = sensitive.run(
            np.array([0.0, 1.1 * release]), parameters=PARAMETERS, inputs={"v_belt": belt}, start={"x": 0.0, "v": belt}
        )
    first = next(i for i, e in enumerate(run.events) if e.time > 0)
    assert run.events[first].time == pytest.approx(release, rel=1e-12)
    expected = [0.0, N / (K * belt), -release / K] if belt > 0 else [-N / (K * belt), 0.0, -release / K]
    np.testing.assert_allclose(run.event_derivative[first], expected, rtol=1e-10, atol=1e-12)


def test_derivatives_go_through_the_turns_and_stay() -> None:
    """Of the last place: of 2 N mu/k for every half swing of a direction."""
    places = half_swings(0.31)
    with SensitiveRun(block(), by=("mu_s_plus", "mu_k_plus", "mu_s_minus", "mu_k_minus")) as sensitive:
        stop = np.pi * np.sqrt(M / K) * len(places)
        run = sensitive.run(np.array([0.0, stop]), parameters=PARAMETERS, inputs=REST, start={"x": 0.31})
    of = run.of("x")[-1]
    swings = len(places) - 1
    # every half swing mirrors what came before
    expected = {sign: 0.0 for sign in (1, -1)}
    for number in range(swings):
        sign = -1 if number % 2 == 0 else 1
        expected = {s: -value for s, value in expected.items()}
        expected[sign] += -sign * 2 * N / K
    assert of[0] + of[1] == pytest.approx(expected[1], rel=1e-9)
    assert of[2] + of[3] == pytest.approx(expected[-1], rel=1e-9)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_every_face_of_the_fmu_has_the_motion_of_the_engine(version: str) -> None:
    fmu, times = block(version), np.linspace(0.0, 1.5, 16)
    given: Any = {"parameters": PARAMETERS, "inputs": REST, "start": {"x": 0.31}}
    own = simulate(fmu, 1.5, output_times=times, **given)
    for method in ("auto", "co-simulation"):
        other = simulate_any(fmu, 1.5, method=method, tolerance=1e-11, output_times=times, **given)
        np.testing.assert_allclose(other["x"], own["x"], rtol=0, atol=2e-9)
        np.testing.assert_allclose(other["F"], own["F"], rtol=0, atol=1e-6)


@cache
def chain() -> Fmu:
    """Two masses between springs; one rubs on the ground, the other on the first: what each holds is in the law."""
    q = [Coordinate(f"q{i}", "m", f"place of mass {i}", velocity=f"v{i}") for i in range(2)]
    slips = [q[0].v, q[1].v - q[0].v]
    number = sympy.Float
    return opened(
        mechanism(
            "directed_chain",
            q,
            sympy.Add(*(MASS * x.v**2 / 2 for x in q)),
            Parameter("k", 100.0, "N/m", "stiffness", positive=True) * (q[0] ** 2 + (q[1] - q[0]) ** 2) / 2,
            [
                Friction(name=f"f{i}", slip=slip, law=Directional(LOAD, *map(number, (a, a, 0, b, b, 0))))
                for i, (slip, a, b) in enumerate(zip(slips, *BOUNDS, strict=True))
            ],
        )
    )


BOUNDS = ((4.0, 2.0), (1.0, 5.0))  # N, of each contact against positive and against negative slip


@pytest.mark.nightly_for("start0")
@pytest.mark.parametrize("start", [(0.3, 0.25), (-0.25, 0.3), (0.1, -0.3)])
def test_a_chain_moves_as_the_bodies_integrated_by_themselves(start: tuple[float, float]) -> None:
    stiffness = np.array([[200.0, -100.0], [-100.0, 100.0]])
    bodies = Bodies(
        lambda q: np.eye(2), lambda q, v: -stiffness @ q, np.array([[1.0, 0.0], [-1.0, 1.0]]), np.array(BOUNDS)
    )
    times = np.linspace(0.0, 2.4, 13)
    expected = integrate(bodies, np.array(start), np.zeros(2), times)
    run = simulate(chain(), 2.4, start={"q0": start[0], "q1": start[1]}, output_times=times)
    for place, name in enumerate(("q0", "q1", "v0", "v1")):
        np.testing.assert_allclose(run[name], expected[:, place], rtol=0, atol=1e-9)
    assert {e.contact for e in run.events if e.after == 0} >= {"f0"}


def test_friction_of_one_direction_alone_holds_on_that_side() -> None:
    """A free-wheel: without friction in positive slip the block rests in stick where the spring pulls it back."""
    values = PARAMETERS | {"mu_s_plus": 0.0, "mu_k_plus": 0.0}
    half = np.pi * np.sqrt(M / K)
    run = simulate(block(), 4 * half, parameters=values, inputs=REST, start={"x": 0.02}, output_times=[4 * half])
    assert run["belt_state"][0] == 0 and run["x"][0] == 0.02
    run = simulate(block(), 2 * half, parameters=values, inputs=REST, start={"x": -0.02}, output_times=[2 * half])
    assert run["x"][0] == pytest.approx(0.02, rel=1e-12) and run["belt_state"][0] == 0


@pytest.mark.nightly
def test_extremes_of_the_law_are_judged_accurate() -> None:
    """The stress grid of a model with the law in it."""
    model = oscillators.load("block_on_belt")
    (contact,) = model.contacts
    assert isinstance(contact, Friction)
    law = LAWS.load("directional").around(contact.law)
    model = model.with_law(belt=law)
    subject = StressSubject.of(model, block())
    cases = [one for one in grid("block_on_belt", model, StressEquations(model)) if one.quick]
    assert len(cases) > 5
    for case in cases:
        assert judge(case, subject).verdict == "accurate", judge(case, subject)
