"""Stops, regions, smooth and set-valued laws: declarations, generated series and the balance of energy."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from compiled_model import CompiledModel

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_source import sources
from fmu_models.language.contacts import Law
from fmu_models.language.declaration import Output
from fmu_models.language.friction import Friction
from fmu_models.language.laws.arctan import Arctan
from fmu_models.language.laws.conti import Conti
from fmu_models.language.laws.conti_viscous import ContiViscous
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.laws.lankarani_nikravesh import LankaraniNikravesh
from fmu_models.language.laws.stribeck_cubic import StribeckCubic
from fmu_models.language.laws.tanh import Tanh
from fmu_models.language.laws.tustin import Tustin
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Input, Parameter
from fmu_models.language.stops import Stop
from fmu_models.language.values import check_values
from fmu_models.lowering.lower import lower

m = Parameter("m", 1.5, "kg", "mass", positive=True)
k = Parameter("k", 2.0, "N/m", "stiffness of the spring")
c = Parameter("c", 0.05, "N s/m", "damping")
f0 = Parameter("f0", 0.5, "N", "amplitude of the force")
w = Parameter("w", 1.1, "rad/s", "frequency of the force")
tau = Parameter("tau", 0.3, "rad", "phase of the force")
g = Parameter("g", 0.4, "m", "gap")
ks = Parameter("ks", 10.0, "N/m", "stiffness of the support")
cs = Parameter("cs", 0.3, "N s/m", "damping of the support")
kh = Parameter("kh", 300.0, "N/m^1.5", "stiffness of Hertz's contact")
e = Parameter("e", 0.9, "1", "restitution")
N = Parameter("N", 5.0, "N", "normal force")
mu = Parameter("mu", 0.4, "1", "friction coefficient")
mu_s = Parameter("mu_s", 0.5, "1", "static friction")
mu_k = Parameter("mu_k", 0.3, "1", "kinetic friction")
p = Parameter("p", 10.0, "s/m", "steepness")
b = Parameter("b", 0.14, "s/m", "viscous friction")
v_s = Parameter("v_s", 0.2, "m/s", "Stribeck speed")
a0 = Parameter("a0", 1.5, "N", "force at rest")
a1 = Parameter("a1", 1.4, "N s/m", "fall")
a3 = Parameter("a3", 0.45, "N s3/m3", "rise")
wall = Input("wall", 0.1, "m", "position of the wall")
belt = Input("belt", 0.2, "m/s", "speed of the belt")
x = Coordinate("x", "m", "displacement", velocity="v")
VOIGT = KelvinVoigt(ks, cs)
HERTZ = LankaraniNikravesh(kh, 1.5, e)


def stop(**changes: Any) -> Stop:
    return Stop(**{"name": "support", "gap": g - x, "law": VOIGT, "release": "force"} | changes)


def declare(*contacts: Any, **changes: Any) -> Mechanism:
    """A forced oscillator with contacts."""
    declaration: dict[str, Any] = {
        "name": "oscillator",
        "title": "oscillator",
        "source": "test",
        "coordinates": [x],
        "kinetic_energy": m * x.v**2 / 2,
        "potential_energy": k * x**2 / 2,
        "dissipation": c * x.v**2 / 2,
        "applied": {x: f0 * sympy.cos(w * TIME + tau)},
        "contacts": contacts,
    }
    return Mechanism(**declaration | changes)


def load(model: CompiledModel, time: float, **series: list[float]) -> None:
    """Set series x, v, and inputs in the order of the model; what is not given is zero."""
    indices = {q.name: ("x", i) for i, q in enumerate(model.system.states)}
    indices |= {q.name: ("u", i) for i, q in enumerate(model.system.inputs)}
    indices |= {f"{q.name}_rate": ("U", i) for i, q in enumerate(model.system.inputs)}
    for name, (kind, i) in indices.items():
        model.series(kind, i)[:] = 0.0
        values = series.get(name, [])
        model.series(kind, i)[: len(values)] = values
    model.series("t")[:] = 0.0
    model.series("t")[:2] = time, 1.0


WRONG = {
    "no release": (
        lambda: stop(release=""),
        "stop 'support' has no release rule. Say when it lets go: release='force'",
    ),
    "another release": (lambda: stop(release="zero"), "has release='zero'"),
    "power of the depth": (
        lambda: stop(law=LankaraniNikravesh(kh, 1.3, e)),
        "the depth to the power 13/10. The power must be",
    ),
    "negative power": (lambda: stop(law=LankaraniNikravesh(kh, -0.5, e)), "the depth to the power -1/2. The power"),
    "symbolic power": (lambda: stop(law=LankaraniNikravesh(kh, e, e)), "the depth to the power e"),
    "gap with velocity": (lambda: declare(stop(gap=g - x.v * m / cs)), "gap = .* depends on v; it says where"),
    "gap that stays": (lambda: declare(stop(gap=g)), "gap = g is the same wherever the body is"),
    "region with velocity": (
        lambda: declare(Friction(name="pad", slip=x.v, law=Coulomb(N, mu), where=x.v)),
        "contact 'pad': where = v depends on v",
    ),
    "derived name": (
        lambda: declare(outputs=[Output("energy", m * x.v**2, "J", "my own")]),
        "'energy' names both output 'my own' and a quantity that every mechanism shows",
    ),
    "name of a force": (
        lambda: declare(stop(), outputs=[Output("support_force", x, "m", "x")]),
        "'support_force' names both",
    ),
}


@pytest.mark.parametrize(("declaration", "lesson"), WRONG.values(), ids=WRONG.keys())
def test_a_mistake_is_answered_with_a_lesson(declaration, lesson):
    with pytest.raises(StickslipError, match=lesson):
        declaration()


@pytest.mark.parametrize(("power", "rooted"), [(0.5, True), (1, False), (1.5, True), (2, False), (2.5, True)])
def test_the_depth_has_whole_and_half_powers_down_to_its_root(power, rooted):
    assert stop(law=LankaraniNikravesh(kh, power, e)).rooted == rooted


UNITS = {
    "potential energy": (lambda: declare(potential_energy=k * x), "potential energy is in kg m s.-2, not in J"),
    "sum": (
        lambda: declare(potential_energy=k * x**2 + c * x**2),
        "potential energy: .* is in kg m.2 s.-., .* they cannot be added",
    ),
    "dissipation": (lambda: declare(dissipation=c * x.v), "the dissipation is in"),
    "force": (lambda: declare(applied={x: k * x.v}), "the force on x times its velocity"),
    "angle": (lambda: declare(applied={x: f0 * sympy.sin(TIME)}), "sin.time. of a quantity in s"),
    "stop": (lambda: declare(stop(law=KelvinVoigt(cs, cs))), "units do not match in the law of stop 'support'"),
    "gap": (lambda: declare(stop(gap=g - x**2)), "units do not match in the gap of stop"),
    "torque": (lambda: declare(Friction(name="pad", slip=x.v, law=Coulomb(g, mu))), "slip times force"),
    "law": (lambda: declare(Friction(name="pad", slip=x.v, law=Conti(N, mu_s, mu_k, k))), "the law of contact 'pad'"),
    "output": (lambda: declare(outputs=[Output("F", k * x, "N m", "force")]), "output 'F' is in .* not in N m"),
    "no unit": (lambda: declare(potential_energy=Parameter("q", 1.0, "Nn", "?") * x), "'Nn' is not a unit"),
}


@pytest.mark.parametrize(("declaration", "lesson"), UNITS.values(), ids=UNITS.keys())
def test_units_that_do_not_match_are_refused(declaration, lesson):
    with pytest.raises(StickslipError, match=lesson):
        declaration()


def test_a_stop_is_lowered_to_its_equations():
    support = stop(gap=g + wall - x)
    system = lower(declare(support, outputs=[Output("F", support.force, "N", "force")]))
    (contact,) = system.contacts
    assert (contact.kind.name, contact.sticks, contact.indicators) == ("stop", False, ("depth", "release"))
    assert sympy.expand(contact.depth - (x - g - wall)) == 0
    assert sympy.expand(contact.slip - (x.v - wall.rate)) == 0
    assert contact.slip_rate == x.a
    assert sympy.expand(contact.force + ks * support.penetration + cs * support.rate) == 0
    assert system.outputs[0].expression == -contact.force_symbol
    assert system.W[0, 0] == 1 / m
    released = lower(declare(stop(release="gap"))).contacts[0]
    assert released.indicators == ("depth",)
    assert released.release is None


def test_tables_say_what_every_contact_is():
    pad = Friction(name="pad", slip=x.v - belt, law=Coulomb(N, mu), where=x - g)
    hertz = stop(name="hertz", law=HERTZ, gap=x + g, release="gap")
    plain = Friction(name="plain", slip=x.v, law=Tanh(Coulomb(N, mu), Parameter("width", 1e-4, "m/s", "width")))
    model = CompiledModel(declare(pad, stop(), hertz, plain))
    assert model.table("sticks") == [1, 0, 0, 0]
    assert model.table("compliant") == [0, 1, 1, 0]
    assert model.table("bounded") == [1, 1, 1, 0]
    assert model.table("releases") == [0, 1, 0, 0]
    assert model.table("remembers") == [0, 0, 1, 0]
    assert model.table("rooted") == [0, 0, 1, 0]
    assert model.table("resets") == [0, 0, 0, 0]
    assert model.integers("sizes", 10)[8:] == [1, 2 + 2 + 1 + 1]
    load(model, 0.0, x=[0.7], v=[0.5])
    for contact, depth, size in ((0, 0.3, 1.1), (1, 0.3, 1.1), (2, -1.1, 1.1)):
        model.order(0, signs=[1.0, 0.0, 0.0, 1.0])
        assert model.series("d", contact)[0] == pytest.approx(depth, rel=1e-15)
        assert model.depth_magnitude(contact) == pytest.approx(size, rel=1e-15)


def test_kelvin_voigt_in_c_is_the_formula():
    model = CompiledModel(declare(stop()))
    load(model, 0.0, x=[0.7, -0.2, 0.05], v=[-0.2, 0.1])
    for order, (depth, rate) in enumerate(((0.3, -0.2), (-0.2, 0.1), (0.05, 0.0))):
        model.order(order)
        expected = 10.0 * depth + 0.3 * rate
        assert model.series("f")[order] == pytest.approx(-expected, rel=1e-14)
        assert model.series("l")[order] == pytest.approx(expected, rel=1e-14)


def hertz_force(depth: Any, rate: Any, entry: float) -> Any:
    """The formula, by mpmath."""
    return 300 * depth ** mpmath.mpf("1.5") * (1 + mpmath.mpf("0.75") * (1 - mpmath.mpf("0.9") ** 2) * rate / entry)


def assert_hertz(model: CompiledModel, depth: list[float], rate: list[float], orders: int) -> None:
    """Force against mpmath's Taylor coefficients of the formula along the two polynomials."""
    with mpmath.workdps(60):
        d, r = ([mpmath.mpf(value) for value in reversed(values)] for values in (depth, rate))
        if depth[0] == 0.0:  # s^3 (depth/s^2)^(3/2), which is analytic in s
            inner = mpmath.taylor(
                lambda s: hertz_force(mpmath.polyval(d[:-2], s), mpmath.polyval(r, s), 0.6), 0, orders - 3
            )
            expected = [0.0, 0.0, 0.0, *map(float, inner)]
        else:
            force = mpmath.taylor(lambda s: hertz_force(mpmath.polyval(d, s), mpmath.polyval(r, s), 0.6), 0, orders)
            expected = [float(value) for value in force]
    found = -model.series("f")[: orders + 1]
    assert np.all(np.abs(found - expected) <= 1e-12 * np.maximum.accumulate(np.abs(expected)))


def test_hertz_has_the_right_series_inside_and_in_the_root_of_time_at_its_edge():
    model = CompiledModel(declare(stop(law=HERTZ, gap=-x, release="force")))
    model.remember(0, 0.6)
    inside = [0.02, 0.3, -0.4, 0.1, 0.02]
    edge = [0.0, 0.0, 0.6, 0.05, -0.3, 0.02]  # of the root s of the time: x = 0.6 s^2 + ...
    rate = [0.6, -0.1, 0.3, 0.02]
    for depth in (inside, edge):
        load(model, 0.0, x=depth, v=rate)
        for order in range(11):
            model.order(order)
        assert_hertz(model, depth, rate, 10)
        release = 1 + 0.75 * 0.19 * np.array(rate) / 0.6 - np.array([0, 1, 1, 1])
        assert model.series("l")[:4] == pytest.approx(release, rel=1e-14)


def test_hertz_outside_is_nothing_and_leaves_with_zero_slope():
    model = CompiledModel(declare(stop(law=HERTZ, gap=-x, release="gap")))
    model.remember(0, 0.6)
    for depth in ([-1e-18, -0.3], [0.0, -0.3]):
        load(model, 0.0, x=depth, v=[-0.3])
        for order in range(2):
            model.order(order)
        assert not model.series("f")[:2].any()


@pytest.mark.parametrize("cycles", [0.0, 1e3, 1e9])
def test_the_phase_of_a_force_is_exact_at_any_time(cycles):
    frequency = Parameter("nu", 0.429, "1/s", "frequency")
    turning = f0 * sympy.sin(2 * sympy.pi * frequency * TIME + tau)
    model = CompiledModel(declare(applied={x: f0 * sympy.cos(w * TIME + tau) + turning}))
    time, rest = 2.75 + cycles / 0.429, 1.3e-9
    load(model, time)
    model.rest_of_time(rest)
    for order in range(6):
        model.order(order)
    with mpmath.workdps(60):
        exact = mpmath.mpf(time) + mpmath.mpf(rest)
        force = mpmath.taylor(
            lambda t: (
                (mpmath.cos(mpmath.mpf(1.1) * t + 0.3) + mpmath.sin(2 * mpmath.pi * mpmath.mpf(0.429) * t + 0.3)) / 3
            ),
            exact,
            5,
        )
    # rounding of sines and their products; a phase rounded like the time would be wrong by 1e-6 at 1e9 cycles
    errors = model.series("a")[:6] - [float(value) for value in force]
    assert abs(errors[0]) < 1e-16
    assert np.abs(errors).max() < 1e-15, errors


CONTI = Conti(N, mu_s, mu_k, p)
width = Parameter("width", 1e-2, "m/s", "width")
# force against the slip speed v = 0.3, worked out by hand from the formulas
LAWS: dict[str, tuple[Law, float, float, bool]] = {
    "coulomb": (Coulomb(N, mu), 2.0, 2.0, True),
    "cubic": (StribeckCubic(a0, a1, a3), 1.5 - 0.42 + 0.45 * 0.027, 1.5, True),
    "exponential": (Tustin(N, mu_s, mu_k, v_s), 5 * (0.3 + 0.2 * float(mpmath.exp(-1.5))), 2.5, True),
    "viscous": (ContiViscous(N, mu_s, mu_k, p, b), 5 * (0.2 / 4 + 0.3) + 0.21, 2.5, True),
    "tanh": (Tanh(CONTI, width), 5 * (0.2 / 4 + 0.3), 2.5, False),
    "arctan": (Arctan(Coulomb(N, mu), width), 2.0 * 2 / float(mpmath.pi) * float(mpmath.atan(30)), 2.0, False),
}


@pytest.mark.parametrize(("law", "force", "capacity", "sticks"), LAWS.values(), ids=LAWS.keys())
def test_friction_laws_are_odd_and_have_their_values(law, force, capacity, sticks):
    mechanism = declare(Friction(name="pad", slip=x.v, law=law))
    model = CompiledModel(mechanism)
    for sign in (1.0, -1.0):
        load(model, 0.0, v=[0.3 * sign])
        model.order(0, signs=[sign])
        assert model.series("f")[0] == pytest.approx(-sign * force, rel=1e-12)
        assert model.series("c")[0] == pytest.approx(capacity, rel=1e-15)
    assert model.table("sticks") == [sticks]


@pytest.mark.parametrize("law", [Tanh(CONTI, width), Arctan(CONTI, width)])
def test_a_smoothed_law_vanishes_at_rest_whatever_the_sign(law):
    model = CompiledModel(declare(Friction(name="pad", slip=x.v, law=law)))
    for sign in (1.0, -1.0, 0.0):
        load(model, 0.0)
        model.order(0, signs=[sign])
        assert model.series("f")[0] == 0.0


BAD_VALUES = [
    (Tustin(N, mu_s, mu_k, v_s), {"v_s": 0.0}, "v_s must be positive"),
    (Tustin(N, mu_s, mu_k, v_s), {"mu_k": 0.6}, "mu_k exceeds mu_s"),
    (ContiViscous(N, mu_s, mu_k, p, b), {"b": -1.0}, "b is negative: viscous friction brakes"),
    (StribeckCubic(a0, a1, a3), {"a0": -1.0}, "a0 is negative"),
    (Tanh(CONTI, width), {"width": 0.0}, "width must be positive"),
]


@pytest.mark.parametrize(("law", "values", "lesson"), BAD_VALUES, ids=lambda v: str(v)[:40])
def test_values_that_a_law_cannot_have_are_refused(law, values, lesson):
    with pytest.raises(StickslipError, match=lesson):
        check_values(declare(Friction(name="pad", slip=x.v, law=law)), values)


def test_restitution_lies_between_zero_and_one():
    with pytest.raises(StickslipError, match="e must lie between 0 and 1"):
        check_values(declare(stop(law=HERTZ)), {"e": 1.1})


def test_energy_changes_by_the_powers_shown():
    """A body in a moving frame on a belt against a moving wall, along an arbitrary motion with its contact forces."""
    speed = Parameter("speed", 0.3, "m/s", "speed of the frame")
    pad = Friction(name="pad", slip=x.v - belt, law=CONTI)
    mechanism = declare(
        pad,
        stop(gap=g + wall - x),
        kinetic_energy=m * (x.v + speed * sympy.cos(w * TIME)) ** 2 / 2,
        potential_energy=k * (x - wall) ** 2 / 2,
    )
    model = CompiledModel(mechanism)
    names = [output.name for output in model.system.outputs]
    assert names == ["energy", "power_input", "power_dissipated", "power_stops", "pad_force", "support_force"]
    load(model, 0.7, x=[0.8], v=[0.5], wall=[0.1, 0.25], wall_rate=[0.25], belt=[0.2, -0.4], belt_rate=[-0.4])
    for order in range(9):
        model.order(order, signs=[1.0, 0.0])
        force = model.series("f", 0)[order] + model.series("f", 1)[order]
        model.series("x", 0)[order + 1] = model.series("x", 1)[order] / (order + 1)
        model.series("x", 1)[order + 1] = (model.series("a")[order] + force / 1.5) / (order + 1)
    shown = {name: model.series("y", i)[:9] for i, name in enumerate(names)}
    change = shown["power_input"] - shown["power_dissipated"] - shown["power_stops"]
    assert np.allclose(shown["energy"][1:] * np.arange(1, 9), change[:8], rtol=1e-12, atol=1e-13)
    assert shown["power_dissipated"][0] == pytest.approx(0.05 * 0.25 + 0.3 * shown["pad_force"][0], rel=1e-14)
    assert shown["pad_force"][0] == pytest.approx(5 * (0.2 / 4 + 0.3), rel=1e-14)
    assert shown["support_force"][0] == pytest.approx(10 * 0.3 + 0.3 * 0.25, rel=1e-13)
    assert shown["power_stops"][0] == pytest.approx(0.25 * (10 * 0.3 + 0.3 * 0.25), rel=1e-13)


def test_the_entry_speed_divides_once_per_order_and_nothing_else():
    text = sources(lower(declare(stop(law=HERTZ))))["model_kind.c"]
    law = text[text.index("void KIND(law_0)") : text.index("void model_law(")]
    assert law.count("j->memory[0]") == 1
    assert law.count("jet_root(") == 1
    assert law.count("jet_product(") == 2


def test_another_law_of_a_stop_keeps_what_outputs_show():
    support = stop()
    shown = [Output("F", support.force, "N", "force"), Output("rate", support.rate, "m/s", "rate of the depth")]
    hertz = declare(support, outputs=shown).with_law(support=HERTZ)
    (new,) = hertz.contacts
    assert isinstance(new, Stop)
    assert [output.expression for output in hertz.outputs] == [new.force, new.rate]
    assert new.rooted
    assert "kh" in [q.name for q in hertz.parameters]
    assert [output.name for output in hertz.restricted_to([]).outputs] == []


def test_friction_in_a_region_acts_as_elsewhere_and_has_a_depth():
    start = Parameter("start", 0.2, "m", "where the pad begins")
    model = CompiledModel(declare(Friction(name="pad", slip=x.v - belt, law=Coulomb(N, mu), where=x - start)))
    load(model, 0.0, x=[0.5, -0.1], v=[-0.1, 0.2], belt=[0.2])
    for order in range(2):
        model.order(order, signs=[-1.0])
    assert model.series("d")[:2] == pytest.approx([0.3, -0.1], rel=1e-15)
    assert model.series("f")[:2] == pytest.approx([2.0, 0.0], rel=1e-15)
    assert model.system.contacts[0].indicators == ("depth", "slip")
