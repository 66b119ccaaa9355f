"""Declarations: what they derive, and the lesson each mistake is answered with."""

from __future__ import annotations

from typing import Any

import pytest
import sympy

from fmu_models import oscillators
from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.declaration import Output
from fmu_models.language.friction import Friction
from fmu_models.language.laws.conti import Conti
from fmu_models.language.laws.lugre import LuGre
from fmu_models.language.laws.stribeck import Stribeck
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Input, Parameter, per_second
from fmu_models.language.values import check_values

m = Parameter("m", 1.0, "kg", "mass", positive=True)
k = Parameter("k", 4.0, "N/m", "stiffness", minimum=0.0)
N = Parameter("N", 2.0, "N", "normal force", minimum=0.0)
mu_s = Parameter("mu_s", 0.5, "1", "static friction", minimum=0.0, maximum=2.0)
mu_k = Parameter("mu_k", 0.3, "1", "kinetic friction", minimum=0.0)
p = Parameter("p", 10.0, "s/m", "steepness", minimum=0.0)
v_s = Parameter("v_s", 0.1, "m/s", "Stribeck speed")
mu_v = Parameter("mu_v", 0.0, "s/m", "viscous friction")
nu = Parameter("nu", 2.0, "rad/s", "frequency")
length = Parameter("length", 1.0, "m", "length")
v_belt = Input("v_belt", 0.1, "m/s", "belt speed")
x = Coordinate("x", "m", "displacement")
y = Coordinate("y", "m", "another displacement")
LAW = Conti(N, mu_s, mu_k, p)
belt = Friction(name="belt", slip=x.v - v_belt, law=LAW)


def declare(**changes: Any) -> Mechanism:
    """A block on a belt, with changes."""
    declaration: dict[str, Any] = {
        "name": "block",
        "title": "block",
        "source": "test",
        "coordinates": [x],
        "kinetic_energy": m * x.v**2 / 2,
        "potential_energy": k * x**2 / 2,
        "contacts": [belt],
    }
    return Mechanism(**declaration | changes)


def contact(slip: sympy.Expr, **changes: Any) -> Friction:
    return Friction(**{"name": "belt", "slip": slip, "law": LAW} | changes)


def test_a_quantity_carries_its_facts_and_never_collides():
    assert (m.name, m.value, m.unit, m.description, m.positive, m.minimum) == ("m", 1.0, "kg", "mass", True, 0.0)
    assert Parameter("m", 1.0, "kg", "mass", positive=True) != m
    assert (x.v.name, x.v.unit, x.a.unit) == ("x_v", "m/s", "m/s2")
    assert (v_belt.rate.name, v_belt.rate.unit) == ("v_belt_rate", "m/s2")
    assert Coordinate("theta", "rad", "angle", velocity="omega").v.name == "omega"
    assert per_second("1") == "1/s"


def test_quantities_come_in_the_order_of_declaration():
    assert [q.name for q in declare().parameters] == ["m", "k", "N", "mu_s", "mu_k", "p"]
    assert [q.name for q in declare().inputs] == ["v_belt"]


WRONG = {
    "slip depends on acceleration": (
        {"contacts": [contact(x.v - x.a)]},
        "contact 'belt': slip depends on acceleration x_a; write it with x.v",
    ),
    "slip not affine": ({"contacts": [contact(x.v**2 - v_belt)]}, "not affine in the velocities"),
    "slip times slip": (
        {"coordinates": [x, y], "kinetic_energy": m * (x.v**2 + y.v**2) / 2, "contacts": [contact(x.v * y.v)]},
        "not affine in the velocities",
    ),
    "slip without velocity": ({"contacts": [contact(x - v_belt)]}, "independent of every velocity"),
    "no coordinate": ({"coordinates": []}, "has no coordinate"),
    "no inertia": (
        {"coordinates": [x, y], "kinetic_energy": m * x.v**2 / 2},
        "coordinate 'y' has no inertia.*m\\*y.v\\*\\*2/2",
    ),
    "singular inertia": (
        {"coordinates": [x, y], "kinetic_energy": m * (x.v + y.v) ** 2 / 2},
        "some motion of the coordinates has no kinetic energy",
    ),
    "inertia that is singular wherever one looks": (
        {
            "coordinates": [x, y],
            "kinetic_energy": m * (sympy.cos(x / length) * x.v + sympy.sin(x / length) * y.v) ** 2 / 2,
        },
        "some motion of the coordinates has no kinetic energy",
    ),
    "more contacts than there is room for": (
        {"contacts": [contact(x.v, name=f"f{i}") for i in range(201)]},
        "has 201 contacts .* at most 200 can be held at rest together",
    ),
    "not quadratic": ({"kinetic_energy": m * x.v**4}, "not quadratic in the velocities"),
    "damping as potential": ({"potential_energy": k * x.v**2}, "potential energy depends on a velocity.*dissipation"),
    "two of one name": (
        {"potential_energy": k * x**2 / 2 + Parameter("N", 1.0, "N", "nominal load") * x},
        "'N' names both parameter 'normal force' and parameter 'nominal load'",
    ),
    "output named like a state": ({"outputs": [Output("x_v", x.v, "m/s", "speed")]}, "'x_v' names both"),
    "named like the time": ({"outputs": [Output("time", x, "m", "x")]}, "'time' names both the time"),
    "named like a contact state": ({"outputs": [Output("belt_state", x, "m", "x")]}, "'belt_state' names both"),
    "not a name": ({"outputs": [Output("a b", x, "m", "x")]}, "'a b' is not a name"),
    "model not a name": ({"name": "2body"}, "'2body' is not a name"),
    "plain symbol": ({"potential_energy": sympy.Symbol("q") * x}, "'q' is not a quantity of it; declare it"),
    "foreign coordinate": ({"potential_energy": y**2}, "'y' is not a quantity of it"),
    "foreign contact": (
        {"outputs": [Output("F", contact(x.v).force, "N", "force")]},
        "belongs to a contact that is not part of this mechanism",
    ),
    "rate used": ({"potential_energy": v_belt.rate * x}, "v_belt_rate is used directly"),
    "force in an energy": ({"potential_energy": belt.force * x}, "belt_force is used in an energy"),
    "acceleration in a force": ({"applied": {x: x.a}}, "x_a is used in an energy"),
    "force on a stranger": ({"applied": {y: k}}, "a force is applied to 'y', which is not a coordinate"),
    "two parameters of a law that are one": (
        {"contacts": [Friction(name="belt", slip=x.v - v_belt, law=Stribeck(N, mu_k, mu_k, v_s, mu_v))]},
        "v_s drops out: no energy, contact or output depends on it.*two parameters of a law are one",
    ),
    "requirement on a state": ({"requirements": [Requirement(x, "x >= 0")]}, "may use parameters only"),
}


@pytest.mark.parametrize(("changes", "lesson"), WRONG.values(), ids=WRONG.keys())
def test_a_mistake_is_answered_with_a_lesson(changes, lesson):
    with pytest.raises(StickslipError, match=lesson):
        declare(**changes)


def test_a_good_declaration_is_accepted():
    outputs = [
        Output("F", belt.force, "N", "force"),
        Output("slip", belt.slip, "m/s", "slip"),
        Output("a", x.a, "m/s2", "a"),
    ]
    assert declare(outputs=outputs, applied={x: N * sympy.sin(nu * TIME) - k * x**3 / length**2}).outputs == tuple(
        outputs
    )


def test_restriction_drops_what_only_the_others_used():
    rig = oscillators.load("disc_rig")
    one = rig.restricted_to(["disc1"])
    assert one.name == "disc_rig_disc1"
    assert [q.name for q in one.parameters] == ["J", "k", "c", "R", "r", "N1", "mu_s1", "mu_k1", "p1"]
    assert [q.name for q in one.inputs] == ["w1"]
    assert [o.name for o in one.outputs] == ["F1", "slip1", "alpha"]
    free = rig.restricted_to([])
    assert free.name == "disc_rig_free"
    assert [q.name for q in free.parameters] == ["J", "k", "c"]
    assert [o.name for o in free.outputs] == ["alpha"]
    assert free.inputs == ()
    assert rig.restricted_to(["disc1", "disc0"]) is rig


def test_unknown_contacts_are_answered_with_the_nearest():
    rig = oscillators.load("disc_rig")
    with pytest.raises(StickslipError, match=r"no contact 'disk0'\. Did you mean 'disc0'"):
        rig.restricted_to(["disk0"])
    with pytest.raises(StickslipError, match="no contact 'disc2'"):
        rig.with_law(disc2=LAW)


def test_another_law_keeps_the_outputs():
    mechanism = declare(outputs=[Output("F", belt.force, "N", "force")]).with_law(belt=LuGre.around(LAW, "_b"))
    assert mechanism.name == "block_lugre"
    assert [state.name for state in mechanism.internal_states] == ["z_b"]
    assert [q.name for q in mechanism.parameters[-2:]] == ["sigma0_b", "sigma1_b"]
    assert mechanism.outputs[0].expression == mechanism.contacts[0].force != belt.force


def test_oscillators_are_found_by_name():
    assert {"block_on_belt", "disc_rig"} <= set(oscillators.names())
    for name in oscillators.names():
        assert oscillators.load(name).name == name
    with pytest.raises(StickslipError, match=r"No model is called 'dics_rig'\. Did you mean 'disc_rig'"):
        oscillators.load("dics_rig")


BAD_VALUES = [
    ({"mu_x": 1.0}, "block has no parameter 'mu_x'. Did you mean 'mu_"),
    ({"m": 0.0}, "m = 0 kg is out of range: mass must be > 0 kg"),
    ({"k": -1.0}, "k = -1 N/m is out of range: stiffness must be >= 0 N/m"),
    ({"mu_s": 2.5}, "mu_s = 2.5 is out of range: static friction must be <= 2"),
    ({"k": float("nan")}, "k = nan is not a finite number"),
    ({"k": float("inf")}, "k = inf is not a finite number"),
    ({"mu_k": 0.6}, r"mu_k exceeds mu_s: Conti's law needs mu_s >= mu_k \(found mu_s = 0.5, mu_k = 0.6\)"),
]


@pytest.mark.parametrize(("values", "lesson"), BAD_VALUES, ids=lambda v: str(v))
def test_values_out_of_range_are_answered_with_a_lesson(values, lesson):
    with pytest.raises(StickslipError, match=lesson):
        check_values(declare(), values)


def test_no_oscillator_takes_a_mass_of_zero():
    for name in oscillators.names():
        model = oscillators.load(name)
        for mass in [q for q in model.parameters if q.unit in ("kg", "kg m2")]:
            with pytest.raises(StickslipError, match=f"{mass.name} = 0 .* must be > 0"):
                check_values(model, {mass.name: 0.0})


@pytest.mark.parametrize("values", [{}, {"N": 0.0}, {"mu_k": 0.5}, {"p": 0.0}, {"p": 1e6, "mu_s": 2.0}])
def test_limiting_values_are_accepted(values):
    check_values(declare(), values)


def test_lugre_needs_a_steady_force():
    with pytest.raises(StickslipError, match="N or mu_s is zero"):
        check_values(declare().with_law(belt=LuGre.around(LAW)), {"N": 0.0})
