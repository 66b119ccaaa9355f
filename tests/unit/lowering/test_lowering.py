"""Lowering and generated functions against equations of motion derived by hand."""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
import test_automaton
import test_stops
from compiled_model import CompiledModel

from fmu_models.codegen.c_source import sources
from fmu_models.codegen.lane_tables import lane_tables
from fmu_models.language.automaton import Automaton
from fmu_models.language.declaration import Output
from fmu_models.language.friction import Friction
from fmu_models.language.laws.conti import Conti
from fmu_models.language.laws.lugre import LuGre
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Input, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.oscillators import load, names

RIG = load("disc_rig")
CONTI = RIG.law_of("disc0")
assert isinstance(CONTI, Conti)
LUGRE = RIG.restricted_to(["disc0"]).with_law(disc0=LuGre.around(CONTI, "0"))

# cart (mass M) with a pendulum (point mass m on a rod l); friction of the cart and of the pendulum's tip on one belt
M = Parameter("M", 2.0, "kg", "mass of the cart", positive=True)
m = Parameter("m", 0.7, "kg", "mass of the pendulum", positive=True)
l = Parameter("l", 0.4, "m", "length of the rod", positive=True)  # noqa: E741 - the letter of the textbooks
g = Parameter("g", 9.81, "m/s2", "gravity", positive=True)
b = Parameter("b", 0.3, "N s/m", "damping of the cart", minimum=0.0)
f0 = Parameter("f0", 1.0, "N", "amplitude of the force")
nu = Parameter("nu", 1.0, "rad/s", "frequency of the force")
N = Parameter("N", 5.0, "N", "normal force", minimum=0.0)
v_belt = Input("v_belt", 0.2, "m/s", "speed of the belt")
x = Coordinate("x", "m", "position of the cart", velocity="v")
phi = Coordinate("phi", "rad", "angle of the rod from hanging", velocity="w")
cart = Friction(name="cart", slip=x.v - v_belt, law=Conti(N, *map(sympy.Float, (0.4, 0.3, 10.0))))
tip = Friction(
    name="tip", slip=x.v + l * sympy.cos(phi) * phi.v - v_belt, law=Conti(N, *map(sympy.Float, (0.5, 0.3, 5.0)))
)
PENDULUM = Mechanism(
    name="pendulum_on_cart",
    title="Pendulum on a cart",
    source="test",
    coordinates=[x, phi],
    kinetic_energy=(M + m) * x.v**2 / 2 + m * l * x.v * phi.v * sympy.cos(phi) + m * l**2 * phi.v**2 / 2,
    potential_energy=-m * g * l * sympy.cos(phi),
    dissipation=b * x.v**2 / 2,
    applied={x: f0 * sympy.sin(nu * TIME)},
    contacts=[cart, tip],
    outputs=[Output("xdd", x.a, "m/s2", "acceleration of the cart")],
)


def same(found: Any, expected: Any) -> bool:
    """Whether two expressions, or two matrices, are equal."""
    difference = sympy.simplify(found - expected)
    return difference == 0 * difference


def quantity(mechanism: Mechanism, name: str) -> Any:
    return next(q for q in (*mechanism.parameters, *mechanism.inputs) if q.name == name)


def test_disc_rig_is_lowered_to_its_equations():
    J, k, c, R, r, N0, mu_s0, mu_k0, p0 = RIG.parameters[:9]
    theta = RIG.coordinates[0]
    system = lower(RIG)
    assert same(system.acceleration[0], -(k * theta + c * theta.v) / J)
    assert same(system.W, sympy.ones(1, 2) * -R / J)
    assert same(system.G, sympy.ones(2, 2) * R**2 / J)
    assert system.constant_inertia
    disc0 = system.contacts[0]
    s, y = disc0.sign_symbol, disc0.slip_symbol
    assert same(disc0.slip_rate, r * quantity(RIG, "w0").rate - R * theta.a)
    assert same(disc0.force, -s * N0 * ((mu_s0 - mu_k0) / (1 + p0 * s * y) + mu_k0))
    assert same(disc0.capacity, N0 * mu_s0)
    assert {str(term) for term in disc0.slip_terms} == {"w0*r", "-R*omega"}


def test_cart_and_pendulum_are_lowered_to_the_textbook_equations():
    system = lower(PENDULUM)
    s, c = sympy.sin(phi), sympy.cos(phi)
    pull = f0 * sympy.sin(nu * TIME) - b * x.v
    D = M + m * s**2
    assert same(system.acceleration[0], (pull + m * l * phi.v**2 * s + m * g * s * c) / D)
    assert same(system.acceleration[1], -(c * pull + m * l * phi.v**2 * s * c + (M + m) * g * s) / (l * D))
    W = sympy.Matrix([[1 / D, s**2 / D], [-c / (l * D), M * c / (m * l * D)]])
    assert same(system.W, W)
    assert same(system.G, sympy.Matrix([[1, 0], [1, l * c]]) * W)
    assert not system.constant_inertia
    rate = x.a + l * c * phi.a - l * s * phi.v**2 - v_belt.rate
    assert same(system.contacts[1].slip_rate, rate)


def test_kinetic_energy_that_depends_on_time_gives_its_inertial_force():
    V = Parameter("V", 3.0, "m/s", "speed of the frame")
    moving = Mechanism(
        name="moving",
        title="mass in a frame that moves with the speed v0 cos(nu t)",
        source="test",
        coordinates=[x],
        kinetic_energy=m * (x.v + V * sympy.cos(nu * TIME)) ** 2 / 2,
    )
    assert same(lower(moving).acceleration[0], V * nu * sympy.sin(nu * TIME))


def test_impulses_change_the_energy_that_is_quadratic_in_the_velocities():
    """A bead on a hoop that turns about its diameter: the turning has energy of its own."""
    hoop = Mechanism(
        name="hoop",
        title="bead on a hoop that turns",
        source="test",
        coordinates=[phi],
        kinetic_energy=m * l**2 * (phi.v**2 + (nu * sympy.sin(phi)) ** 2) / 2,
    )
    assert same(lower(hoop).kinetic_energy, m * l**2 * phi.v**2 / 2)


def start(model: CompiledModel, state: list[float], inputs: list[tuple[float, float]], time: float = 0.0) -> None:
    """Load order 0 of the states and both orders of inputs and time."""
    for i, value in enumerate(state):
        model.series("x", i)[:] = 0.0
        model.series("x", i)[0] = value
    for i, (value, rate) in enumerate(inputs):
        model.series("u", i)[:] = 0.0
        model.series("u", i)[:2] = value, rate
        model.series("U", i)[:] = 0.0
        model.series("U", i)[0] = rate
    model.series("t")[:] = 0.0
    model.series("t")[:2] = time, 1.0


def run_free(model: CompiledModel, n: int, order: int, signs: list[float]) -> None:
    """Series of a motion without contact forces."""
    for k in range(order + 1):
        model.order(k, signs=signs)
        for i in range(n):
            model.series("x", i)[k + 1] = model.series("x", n + i)[k] / (k + 1)
            model.series("x", n + i)[k + 1] = model.series("a", i)[k] / (k + 1)


def test_slip_rate_is_the_derivative_of_slip_along_the_motion():
    model = CompiledModel(PENDULUM)
    start(model, [0.1, 0.6, 0.3, -1.2], [(0.2, 0.7)], time=0.4)
    run_free(model, 2, 10, signs=[1.0, -1.0])
    orders = np.arange(1, 11)
    for c in range(2):
        slip, rate = model.series("s", c), model.series("r", c)
        scale = np.maximum.accumulate(np.abs(rate[:10]))
        assert np.all(np.abs(slip[1:11] * orders - rate[:10]) <= 1e-12 * scale)


def test_energy_of_the_free_pendulum_changes_by_the_work_done_on_it():
    model = CompiledModel(PENDULUM)
    start(model, [0.1, 0.6, 0.3, -1.2], [(0.2, 0.7)], time=0.4)
    run_free(model, 2, 12, signs=[1.0, -1.0])
    values = {p: p.value for p in PENDULUM.parameters}
    energy = sympy.lambdify(
        [x, phi, x.v, phi.v], (PENDULUM.kinetic_energy + PENDULUM.potential_energy).xreplace(values), "mpmath"
    )
    state = [[mpmath.mpf(value) for value in model.series("x", i)[:13][::-1]] for i in range(4)]
    with mpmath.workdps(40):
        rates = mpmath.taylor(lambda t: energy(*(mpmath.polyval(s, t) for s in state)), 0, 9)[1:]

        def power(t):
            speed = mpmath.polyval(state[2], t)
            return (mpmath.sin(mpmath.mpf(0.4) + t) - mpmath.mpf(b.value) * speed) * speed

        expected = mpmath.taylor(power, 0, 8)
    for k, (rate, work) in enumerate(zip(rates, expected, strict=True)):
        assert abs(float(rate) * (k + 1) - float(work)) < 1e-12 * max(abs(float(w)) for w in expected)


def test_outputs_show_the_acceleration_with_contact_forces():
    for mechanism, name, state, inputs in (
        (PENDULUM, "xdd", [0.1, 0.6, 0.3, -1.2], [(0.2, 0.7)]),
        (RIG, "alpha", [0.1, 0.3], [(0.83, 0.0), (0.41, 0.2)]),
    ):
        model = CompiledModel(mechanism)
        start(model, state, inputs)
        for k in range(4):
            model.order(k, signs=[1.0, -1.0])
            forces = [model.series("f", c) for c in range(2)]
            expected = model.series("a", 0)[k] + sum(
                np.dot(model.series("W", 0, c)[: k + 1], forces[c][k::-1]) for c in range(2)
            )
            output = model.series("y", [o.name for o in model.system.outputs].index(name))[k]
            assert output == pytest.approx(expected, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_conti_force_in_c_is_that_of_the_formula(sign):
    model = CompiledModel(RIG)
    speed = 0.9 * sign
    start(model, [0.1, 0.3], [(speed, -0.4), (0.41, 0.0)])
    model.series("x", 1)[1] = 0.25
    for k in range(13):
        model.order(k, signs=[sign, 1.0])
    y0, y1 = 0.06 * speed - 0.125 * 0.3, 0.06 * -0.4 - 0.125 * 0.25
    with mpmath.workdps(40):
        force = mpmath.taylor(
            lambda t: -sign * 4.905 * (mpmath.mpf("0.3") / (1 + 15 * sign * (y0 + y1 * t)) + mpmath.mpf("0.35")), 0, 12
        )
    assert np.allclose(model.series("f", 0)[:13], [float(c) for c in force], rtol=1e-12, atol=0.0)
    assert model.series("c", 0)[0] == pytest.approx(4.905 * 0.65, rel=1e-15)
    assert not model.series("c", 0)[1:13].any()


def test_force_laws_are_odd_and_steady_lugre_is_conti():
    assert isinstance(CONTI, Conti)
    lugre = LuGre.around(CONTI)
    v = sympy.Symbol("v", positive=True)
    assert same(CONTI.force(-v, sympy.Integer(-1)), -CONTI.force(v, sympy.Integer(1)))
    (steady,) = sympy.solve(lugre.rates(v, sympy.Integer(1))[0], lugre.bristle)
    force = lugre.force(v, sympy.Integer(1)).xreplace({lugre.bristle: steady})
    assert same(force, CONTI.force(v, sympy.Integer(1)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_lugre_in_c_is_that_of_the_formula(sign):
    model = CompiledModel(LUGRE)
    z, slip = 3e-6, 0.06 * 0.83 * sign - 0.125 * 0.05
    start(model, [0.0, 0.05, z], [(0.83 * sign, 0.0)])
    model.order(0, signs=[sign])
    steady = 4.905 * (0.3 / (1 + 15 * abs(slip)) + 0.35)
    rate = slip - 2e5 * abs(slip) * z / steady
    assert model.series("z")[0] == pytest.approx(rate, rel=1e-13)
    assert model.series("f")[0] == pytest.approx(-(2e5 * z + 100.0 * rate), rel=1e-13)
    assert LUGRE.name == "disc_rig_disc0_lugre"
    assert [contact.sticks for contact in model.system.contacts] == [False]


def test_magnitude_sums_the_terms_that_cancel():
    model = CompiledModel(RIG)
    start(model, [0.0, -0.3], [(0.83, 0.0), (-0.41, 0.0)])
    assert model.magnitude(0) == pytest.approx(0.06 * 0.83 + 0.125 * 0.3, rel=1e-15)
    assert model.magnitude(1) == pytest.approx(0.06 * 0.41 + 0.125 * 0.3, rel=1e-15)


def test_sizes_and_start_values():
    model = CompiledModel(RIG)
    nq, nz, nc, n_p, nu, ny, _, _ = model.integers("sizes", 8)
    assert (nq, nz, nc, n_p, nu, ny) == (1, 0, 2, 13, 2, 5 + 3 + 2)  # energy and two powers, a force of each contact
    assert model.numbers("model_start_parameters", 13) == [p.value for p in RIG.parameters]
    assert model.numbers("model_start_inputs", 2) == [0.83, 0.41]


def test_a_mechanism_without_contacts_inputs_and_outputs_compiles():
    free = Mechanism(name="free", title="t", source="s", coordinates=[x], kinetic_energy=m * x.v**2 / 2)
    model = CompiledModel(free)
    start(model, [0.0, 1.0], [])
    model.order(0)
    assert model.series("a")[0] == 0.0
    assert model.integers("sizes", 8)[:6] == [1, 0, 0, 1, 0, 3]
    assert model.violation({}) is None


def variants() -> dict[str, Mechanism | Automaton]:
    """Every mechanism whose text must not depend on the process."""
    assert isinstance(CONTI, Conti)
    both = RIG.with_law(disc0=LuGre.around(CONTI, "0"))
    free = RIG.restricted_to([])
    stops = test_stops.declare(test_stops.stop(law=test_stops.HERTZ, gap=test_stops.g - test_stops.x - test_stops.wall))
    declared = (*(load(name) for name in names()), both, LUGRE, free, PENDULUM, stops, test_automaton.declare())
    return {m.name: m for m in declared}


def text_hash() -> str:
    systems = [lower(mechanism) for mechanism in variants().values()]
    texts = [text for system in systems for text in (*sources(system).values(), lane_tables(system) or "")]
    return hashlib.sha256("".join(texts).encode()).hexdigest()


def test_generated_text_is_the_same_in_every_process():
    code = "import test_lowering; print(test_lowering.text_hash())"
    hashes = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)}
        run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        hashes.add(run.stdout.strip())
    assert hashes == {text_hash()}


def test_token_names_the_model_and_its_variables():
    texts = [sources(lower(mechanism))["model_sizes.h"] for mechanism in variants().values()]
    tokens = [re.findall(r'^#define MODEL_TOKEN "\{([0-9a-f-]{36})\}"$', text, re.MULTILINE) for text in texts]
    assert all(len(found) == 1 for found in tokens)
    assert len({found[0] for found in tokens}) == len(tokens)


BAD_VALUES = [
    ({"J": 0.0}, "J"),
    ({"N0": -1.0}, "N0"),
    ({"mu_k0": 0.7}, "mu_k0 exceeds mu_s0"),
    ({"mu_s1": 0.2}, "mu_k1 exceeds mu_s1"),
    ({"p0": -1e-9}, "p0"),
    ({"k": float("nan")}, "k must be a finite number"),
    ({"c": float("inf")}, "c must be a finite number"),
    ({"r": float("nan")}, "r must be a finite number"),
]
GOOD_VALUES = [{}, {"N0": 0.0}, {"mu_k0": 0.65}, {"p0": 0.0}, {"p1": 1e6}, {"k": 0.0, "c": 0.0}]


@pytest.fixture(scope="module")
def rig() -> CompiledModel:
    return CompiledModel(RIG)


@pytest.mark.parametrize(("values", "sentence"), BAD_VALUES, ids=lambda v: str(v))
def test_violation_names_what_is_wrong(rig, values, sentence):
    found = rig.violation(values)
    assert found is not None
    assert found.startswith(sentence)


def test_violation_of_a_strict_requirement():
    assert CompiledModel(LUGRE).violation({"N0": 0.0}) == (
        "N0 or mu_s0 is zero: LuGre's law divides by the steady friction force"
    )


@pytest.mark.parametrize("values", GOOD_VALUES, ids=lambda v: str(v))
def test_limiting_values_are_no_violation(rig, values):
    assert rig.violation(values) is None
