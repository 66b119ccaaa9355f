"""Rigid contacts: declarations, their two directions, generated tables and series, and what a trajectory tells."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import sympy
from compiled_model import CompiledModel

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.model_structure import ModelStructure
from fmu_models.language.declaration import Output
from fmu_models.language.friction import Friction
from fmu_models.language.impacts import MAX_IMPACTS, Impact, Newton, Poisson
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Input, InternalState, Parameter
from fmu_models.language.values import check_values
from fmu_models.lowering.lower import lower
from fmu_models.oscillators import load
from fmu_models.report.model_sheet import sheet
from fmu_models.simulation.trajectory import Event, Trajectory

m = Parameter("m", 1.5, "kg", "mass", positive=True)
J = Parameter("J", 0.2, "kg m2", "moment of inertia", positive=True)
s = Parameter("s", 0.1, "kg m", "static moment")
A = Parameter("A", 0.1, "m", "amplitude of the wall")
w = Parameter("w", 1.1, "rad/s", "frequency of the wall")
phi = Parameter("phi", 0.3, "rad", "phase of the wall")
R = Parameter("R", 0.5, "m", "radius", positive=True)
e = Parameter("e", 0.6, "1", "restitution")
mu = Parameter("mu", 0.3, "1", "friction coefficient")
k = Parameter("k", 4.0, "N/m", "stiffness")
wall = Input("wall", 0.1, "m", "position of the wall")
belt = Input("belt", 0.2, "m/s", "speed of the wall along itself")
x = Coordinate("x", "m", "height", velocity="v", start=1.0)
t = Coordinate("t", "rad", "angle", velocity="u")
z = InternalState("z", "m", "deflection")
GAP = x - A * sympy.sin(w * TIME + phi) - wall


def impact(**changes: Any) -> Impact:
    """A disc that meets a moving wall with its rim."""
    declaration: dict[str, Any] = {"name": "rim", "gap": GAP, "restitution": Newton(e), "description": "rim on wall"}
    return Impact(**declaration | {"slip": R * t.v - belt, "mu": mu} | changes)


def smooth(**changes: Any) -> Impact:
    return impact(**{"slip": None, "mu": None} | changes)


def declare(*contacts: Any, **changes: Any) -> Mechanism:
    """An unbalanced disc with contacts."""
    declaration: dict[str, Any] = {
        "name": "disc",
        "title": "disc",
        "source": "test",
        "coordinates": [x, t],
        "kinetic_energy": (m * x.v**2 + J * t.v**2) / 2 + s * x.v * t.v,
        "potential_energy": k * x**2 / 2,
        "contacts": contacts,
    }
    return Mechanism(**declaration | changes)


def named(i: int) -> Impact:
    return smooth(name=f"rim{i}")


WRONG = {
    "gap that stays": (lambda: declare(smooth(gap=A - wall)), "contact 'rim': gap = .* is the same wherever the body"),
    "gap with velocity": (
        lambda: declare(smooth(gap=x - x.v * m / k)),
        "contact 'rim': gap = .* depends on v; it says",
    ),
    "slip not affine": (
        lambda: declare(impact(slip=t.v**2 * R)),
        "contact 'rim': slip = .* is not affine in the veloc",
    ),
    "slip without velocity": (
        lambda: declare(impact(slip=belt)),
        "'rim': slip = belt is independent of every velocity",
    ),
    "slip of accelerations": (lambda: declare(impact(slip=R * t.v - t.a)), "'rim': slip depends on acceleration t_a"),
    "slip without mu": (
        lambda: impact(mu=None),
        "contact 'rim' has slip but no mu. Give both for a contact with frict",
    ),
    "mu without slip": (lambda: impact(slip=None), "contact 'rim' has mu but no slip. Give both"),
    "restitution of a state": (
        lambda: impact(restitution=Newton(e * x / A)),
        "contact 'rim': restitution = .* depends on x; it may use parameters only",
    ),
    "restitution of time": (lambda: impact(restitution=Poisson(w * TIME)), "restitution = w.time depends on time"),
    "mu of an input": (
        lambda: impact(mu=mu * wall / A),
        "contact 'rim': mu = .* depends on wall; it may use parameters",
    ),
    "a bare number": (lambda: impact(restitution=0.5), "has restitution=0.5. Say by which rule: Newton.e. for speeds"),
    "more than elastic": (
        lambda: impact(restitution=Newton(1.5)),
        "restitution of contact 'rim' must lie between 0 and 1, found 1.5",
    ),
    "less than plastic": (lambda: impact(restitution=Poisson(-0.1)), "between 0 and 1, found -0.1"),
    "friction that drives": (lambda: impact(mu=-0.1), "mu of contact 'rim' must not be negative, found -0.1"),
    "too many": (
        lambda: declare(*(named(i) for i in range(MAX_IMPACTS + 1))),
        "disc has 33 rigid contacts; at most 32 can be answered together",
    ),
    "indefinite inertia": (
        lambda: declare(smooth(), kinetic_energy=(m * x.v**2 + J * t.v**2) / 2 + 10 * s * x.v * t.v),
        "disc: the mass matrix is not positive definite at the start values .the determinant of its first 2 rows and "
        "columns is -0.7.*Look at the signs",
    ),
    "inertia that is negative at the start": (
        lambda: declare(smooth(), kinetic_energy=m * (A - x) / A * x.v**2 / 2 + J * t.v**2 / 2),
        "not positive definite at the start values .its first entry is -13.5",
    ),
    "foreign friction force": (
        lambda: declare(rim := smooth(), outputs=[Output("F", rim.friction_force, "N", "force")]),
        "rim_friction_force belongs to a contact that is not part",
    ),
    "force in a gap": (lambda: declare(rim := smooth(), smooth(name="b", gap=x - rim.force / k)), "'b' uses rim_force"),
    "name of the state": (
        lambda: declare(impact(), outputs=[Output("rim_state", x, "m", "x")]),
        "'rim_state' names both",
    ),
    "name of the friction": (lambda: declare(impact(), smooth(name="rim_friction")), "'rim_friction' names both"),
    "name of its state": (
        lambda: declare(impact(), outputs=[Output("rim_friction_state", x, "m", "x")]),
        "'rim_friction_state' names both",
    ),
    "name of its force": (
        lambda: declare(impact(), outputs=[Output("rim_friction_force", x, "m", "x")]),
        "'rim_friction_force' names both",
    ),
    "unit of the gap": (lambda: declare(smooth(gap=t * R * R)), "the gap of contact 'rim' is in m.2, not in m"),
    "unit of the slip": (lambda: declare(impact(slip=t.v)), "the slip of contact 'rim' is in s.-1, not in m/s"),
    "unit of e": (lambda: declare(smooth(restitution=Newton(R))), "the restitution of contact 'rim' is in m, not in 1"),
    "unit of mu": (lambda: declare(impact(mu=R)), "mu of contact 'rim' is in m, not in 1"),
    "unit of a force": (
        lambda: declare(rim := smooth(), outputs=[Output("F", rim.force, "m", "force")]),
        "output 'F' is in .* not in m",
    ),
    "another law": (
        lambda: declare(impact()).with_law(rim=Coulomb(k * A, mu)),
        "contact 'rim' of disc is rigid: it has no law that could be another, but a restitution .Newton.",
    ),
    "its friction by name": (lambda: declare(impact()).restricted_to(["rim_friction"]), "no contact 'rim_friction'"),
}


@pytest.mark.parametrize(("declaration", "lesson"), WRONG.values(), ids=WRONG.keys())
def test_a_mistake_is_answered_with_a_lesson(declaration, lesson):
    with pytest.raises(StickslipError, match=lesson):
        declaration()


def test_what_is_no_mistake():
    declare(*(named(i) for i in range(MAX_IMPACTS)))
    declare(impact(restitution=Poisson(0), mu=0), impact(name="b", restitution=Newton(1)))
    declare(kinetic_energy=(m * x.v**2 - J * t.v**2) / 2)  # without impacts an engine needs no positive energy
    scaled = Coordinate("q", "1", "scaled", velocity="p")
    ball = Impact(name="ball", gap=scaled, restitution=Newton(e), slip=scaled.v, mu=mu)
    shown = [Output("F", ball.force + ball.friction_force, "1", "forces")]
    declare(ball, coordinates=[scaled], kinetic_energy=scaled.v**2 / 2, potential_energy=scaled, outputs=shown)


BAD_VALUES = [
    ({"e": 1.1}, r"restitution of contact 'rim' must lie between 0 and 1 \(found e = 1.1\)"),
    ({"e": -0.1}, "restitution of contact 'rim' must lie between 0 and 1"),
    ({"mu": -0.1}, r"mu of contact 'rim' must not be negative \(found mu = -0.1\)"),
    ({"s": 0.55}, r"the mass matrix must be positive definite; the determinant of its first 2 rows and columns is"),
]


@pytest.mark.parametrize(("values", "lesson"), BAD_VALUES, ids=lambda v: str(v)[:20])
def test_values_that_an_impact_cannot_have_are_refused_here_and_in_c(values, lesson):
    mechanism = declare(impact())
    with pytest.raises(StickslipError, match=lesson):
        check_values(mechanism, values)
    found = CompiledModel(mechanism).violation(values)
    assert found is not None and found in lesson.replace("\\", "").partition(" (")[0] + " not positive"


@pytest.mark.parametrize("values", [{"e": 0.0}, {"e": 1.0}, {"mu": 0.0}, {"s": 0.54}])
def test_limiting_values_are_accepted(values):
    check_values(declare(impact()), values)
    assert CompiledModel(declare(impact())).violation(values) is None


def test_the_mass_matrix_is_asked_for_only_where_signs_leave_it_open():
    strict = [r for r in declare(impact()).all_requirements if r.strict]
    (found,) = strict
    assert sympy.expand(found.expression - (m * J - s**2)) == 0
    assert not [r for r in declare(Friction(name="f", slip=x.v, law=Coulomb(k * A, mu))).all_requirements if r.strict]
    assert len(load("woodpecker").all_requirements) == 2 + 2 * 3  # geometry, and e and mu of every contact
    length = Parameter("length", 1.0, "m", "of any sign")
    signed = declare(smooth(), kinetic_energy=m * length / R * x.v**2 / 2 + J * t.v**2 / 2)
    (found,) = [r for r in signed.all_requirements if r.strict]  # J stands apart, and its sign is known
    assert sympy.simplify(found.expression - m * length / R) == 0
    moving = declare(smooth(), kinetic_energy=m * sympy.cosh(x / R) * x.v**2 / 2 + J * t.v**2 / 2)
    assert not [r for r in moving.all_requirements if r.strict]  # states decide that as well


def test_a_contact_is_lowered_to_two_directions():
    mechanism = declare(smooth(name="other", gap=R - x, restitution=Poisson(e**2)), impact())
    system = lower(mechanism)
    other, normal, tangent = system.contacts
    assert [c.name for c in system.contacts] == ["other", "rim", "rim_friction"]
    assert [c.directions for c in mechanism.contacts] == [1, 2]
    assert [c.kind.name for c in system.contacts] == ["impact", "impact", "impact_friction"]
    assert [c.indicators for c in system.contacts] == [("gap",), ("gap",), ("slip",)]
    assert [c.partner for c in system.contacts] == [None, 2, 1]
    assert [c.sticks for c in system.contacts] == [False, False, True]
    assert [(c.restitution, c.poisson) for c in (other, normal)] == [(e**2, True), (e, False)]
    assert (tangent.friction, tangent.depth, tangent.capacity) == (mu, None, 0)
    speed = A * w * sympy.cos(w * TIME + phi)
    assert sympy.expand(normal.slip - (x.v - speed - wall.rate)) == 0
    assert sympy.expand(normal.slip_rate - (x.a + A * w**2 * sympy.sin(w * TIME + phi))) == 0
    assert normal.depth is not None and sympy.expand(normal.depth + GAP) == 0
    assert tangent.slip_rate == R * t.a - belt.rate
    D = m * J - s**2
    W = sympy.Matrix([[-J, J, -s * R], [s, -s, m * R]]) / D
    assert sympy.simplify(system.W - W) == sympy.zeros(2, 3)
    assert sympy.simplify(system.G - sympy.Matrix([[-1, 0], [1, 0], [0, R]]) * W) == sympy.zeros(3, 3)
    assert system.constant_inertia and system.indicator_count == 3


def test_tables_and_coefficients_in_c():
    pad = Friction(name="pad", slip=x.v, law=Coulomb(k * A, mu))
    model = CompiledModel(declare(smooth(name="other", gap=R - x, restitution=Poisson(e**2)), pad, impact()))
    assert model.table("impulsive") == [1, 0, 1, 0]
    assert model.table("poisson") == [1, 0, 0, 0]
    assert model.shorts("model_contact_partner", 4) == [-1, -1, 3, 2]
    assert model.table("sticks") == [0, 1, 0, 1]
    assert model.table("bounded") == [1, 0, 1, 0]
    assert model.table("compliant") == [0, 0, 0, 0]
    text = model.sources["model_kind.c"]
    assert "#define MODEL_IMPACTS 2" in model.sources["model_sizes.h"]
    restitution = text[text.index("Real model_restitution") : text.index("Real model_friction")]
    assert "case 0: return d[" in restitution and "case 2: return p[" in restitution and restitution.count("case") == 2
    assert text[text.index("Real model_friction") :].count("case 3: return p[") == 1


def load_motion(model: CompiledModel) -> None:
    """x = 0.7 + 0.5 t - t^2, t = 0.2 - 0.3 t, and moving inputs, at the time 0.4."""
    series = {("x", 0): [0.7, 0.5, -1.0], ("x", 1): [0.2, -0.3], ("x", 2): [0.5, -2.0], ("x", 3): [-0.3]}
    names = [u.name for u in model.system.inputs]
    for name, value, rate in (("wall", 0.1, 0.25), ("belt", 0.2, -0.4)):
        series |= {("u", names.index(name)): [value, rate], ("U", names.index(name)): [rate]}
    for (kind, i), values in series.items():
        model.series(kind, i)[:] = 0.0
        model.series(kind, i)[: len(values)] = values
    model.series("t")[:] = 0.0
    model.series("t")[:2] = 0.4, 1.0


def test_series_of_gap_and_slip_in_c():
    model = CompiledModel(declare(impact()))
    load_motion(model)
    for order in range(3):
        model.order(order)
    c, sine = math.cos(1.1 * 0.4 + 0.3), math.sin(1.1 * 0.4 + 0.3)
    gap = 0.7 - 0.1 * sine - 0.1
    rate = 0.5 - 0.11 * c - 0.25
    assert model.series("d", 0)[:2] == pytest.approx([-gap, -rate], rel=1e-14)
    assert model.series("s", 0)[:2] == pytest.approx([rate, -2 + 0.121 * sine], rel=1e-14)
    assert model.series("s", 1)[:2] == pytest.approx([0.5 * -0.3 - 0.2, 0.4], rel=1e-14)
    # without contact forces the spring acts on x: v' = -J k x/D, u' = s k x/D
    D = 1.5 * 0.2 - 0.01
    assert model.series("r", 0)[0] == pytest.approx(-0.2 * 4 * 0.7 / D + 0.121 * sine, rel=1e-14)
    assert model.series("r", 1)[0] == pytest.approx(0.5 * 0.1 * 4 * 0.7 / D + 0.4, rel=1e-14)
    assert model.series("c", 0)[:3] == pytest.approx(0.0, abs=0.0)
    assert model.depth_magnitude(0) == pytest.approx(0.7 + 0.1 * sine + 0.1, rel=1e-14)
    assert model.magnitude(0) == pytest.approx(0.5 + 0.11 * c + 0.25, rel=1e-14)


def test_forces_and_powers_that_every_mechanism_shows():
    rim = impact()
    shown = [Output("N", rim.force, "N", "normal force"), Output("T", rim.friction_force, "N", "friction force")]
    model = CompiledModel(declare(rim, outputs=shown))
    names = [output.name for output in model.system.outputs]
    assert names == ["N", "T", "energy", "power_input", "power_dissipated", "rim_force", "rim_friction_force"]
    load_motion(model)
    model.order(0)
    model.series("f", 0)[0], model.series("f", 1)[0] = 2.0, -0.6
    model.order(0)
    found = dict(zip(names, (model.series("y", i)[0] for i in range(len(names))), strict=True))
    assert (found["N"], found["rim_force"]) == (2.0, 2.0)
    assert (found["T"], found["rim_friction_force"]) == (-0.6, 0.6)
    # the wall moves with 0.25 + 0.11 cos against the normal force, the belt with 0.2 along the friction force
    assert found["power_input"] == pytest.approx(2.0 * (0.25 + 0.11 * math.cos(0.74)) - 0.6 * 0.2, rel=1e-13)
    assert found["power_dissipated"] == pytest.approx(0.6 * (0.5 * -0.3 - 0.2), rel=1e-13)


def test_restriction_keeps_what_belongs_to_the_contacts_kept():
    other = smooth(name="other", gap=R - x, restitution=Poisson(e))
    rim = impact()
    mechanism = declare(rim, other, outputs=[Output("T", rim.friction_force, "N", "T"), Output("y", x, "m", "x")])
    one = mechanism.restricted_to(["other"])
    assert [o.name for o in one.outputs] == ["y"]
    assert "mu" not in [p.name for p in one.parameters] and one.inputs == ()
    assert [r.sentence[:30] for r in one.all_requirements] == [
        "restitution of contact 'other'",
        "the mass matrix must be positi",
    ]
    assert mechanism.restricted_to([]).all_requirements == ()


def test_the_description_of_an_fmu_names_both_directions():
    description = ModelStructure(lower(declare(impact())))
    names = {v.reference: v.name for v in description.variables.listed}
    assert list(names.values())[-4:] == ["rim_state", "rim_friction_state", "rim_indicator", "rim_friction_indicator"]
    states = {v.name: v for v in description.variables.contact_states}
    assert "2 open, 3 closed, 5 chattering" in states["rim_state"].description
    assert states["rim_state"].description.startswith("rim on wall: ")
    assert states["rim_state"].maximum == 5
    assert "0 stick" in states["rim_friction_state"].description
    unknowns = [*description.derivative_unknowns, *description.output_unknowns, *description.indicator_unknowns]
    depends = {u.variable.name: u.dependencies and {names[r] for r in u.dependencies} for u in unknowns}
    closed = {"x", "time", "belt_rate"}  # the spring, the wall and the belt carry the forces
    assert depends["rim_force"] == depends["rim_friction_force"] == depends["der(v)"] == closed
    assert depends["rim_indicator"] == closed | {"wall"}
    assert depends["rim_friction_indicator"] == closed | {"u", "belt"}


def test_the_model_sheet_tells_restitution_and_friction():
    normal, tangent = sheet(declare(impact(restitution=Poisson(e))))["contacts"]
    assert (normal["kind"], normal["law"], normal["states"]) == ("impact", "Poisson", ["open", "closed", "chattering"])
    assert normal["equations"]["restitution"] == "Poisson, e"
    assert (tangent["kind"], tangent["law"]) == ("impact friction", "Coulomb")
    assert tangent["states"] == ["slip+", "slip-", "stick", "away"]
    equations = sheet(declare(impact()))["equations"]
    assert equations[2:] == ["m*v' + s*u' = -k*x + lambda_rim", "J*u' + s*v' = R*lambda_rim_friction"]


def trajectory(*events: Event) -> Trajectory:
    return Trajectory(np.zeros(1), {"energy": np.array([-2.0])}, {"energy": "J"}, events, 0, 0)


def test_a_trajectory_tells_impacts_and_those_that_raised_the_energy():
    bounce = Event(0.5, "rim", 2, 2, -0.25, True)
    elastic = Event(0.6, "rim", 2, 2, 0.0, True)
    landing = Event(0.7, "rim", 2, 3, 1e-11, True)
    rounding = Event(0.8, "rim", 2, 2, 1e-13, True)
    release = Event(0.9, "rim", 3, 2, 0.0, True)
    stop = Event(1.0, "stop", 2, 3)
    made = trajectory(bounce, elastic, landing, rounding, release, stop)
    assert made.impacts == (bounce, elastic, landing, rounding)
    assert made.gains == (landing,)
    assert trajectory().gains == ()
    assert str(bounce) == "0.5 s: rim bounce, -0.25 J"
    assert str(landing) == "0.7 s: rim open -> closed, 1e-11 J"
    assert str(release) == "0.9 s: rim closed -> open"
    assert str(stop) == "1 s: stop away -> touching"
    assert str(dataclasses.replace(release, before=5, after=3)) == "0.9 s: rim chattering -> closed"


OVERLAPS = [
    ("impact_pair", {"D": 0.0}, "the walls overlap: their distance D must be positive"),
    ("impact_damper", {"D": -1.0}, "the walls overlap: the clearance D must be positive"),
    ("fermi_accelerator", {"L": 1.0}, "the walls overlap: their distance L must be larger than the amplitude A"),
    ("woodpecker", {"r_0": 0.0031}, "the sleeve overlaps the pole: its radius r_M must be larger than r_0"),
    ("woodpecker", {"l_S": 0.023}, "the beak overlaps the pole"),
    ("bouncing_ball", {"e": 1.01}, "e = 1.01 is out of range"),
]


@pytest.mark.parametrize(("name", "values", "lesson"), OVERLAPS, ids=lambda v: str(v)[:30])
def test_walls_that_overlap_are_refused(name, values, lesson):
    with pytest.raises(StickslipError, match=lesson):
        check_values(load(name), values)


def test_the_woodpecker_has_the_matrices_of_the_paper():
    """Equations (22), with J_M in the mass matrix."""
    mechanism = load("woodpecker")
    by_name: dict[str, Any] = {q.name: q for q in mechanism.parameters}
    m_M, m_S, J_M, J_S = (by_name[name] for name in ("m_M", "m_S", "J_M", "J_S"))
    l_M, l_G, l_S, r_M, h_M, h_S = (by_name[name] for name in ("l_M", "l_G", "l_S", "r_M", "h_M", "h_S"))
    c, g = by_name["c_phi"], by_name["g"]
    _, sleeve, bird = mechanism.coordinates
    M = sympy.Matrix(
        [
            [m_S + m_M, m_S * l_M, m_S * l_G],
            [m_S * l_M, J_M + m_S * l_M**2, m_S * l_M * l_G],
            [m_S * l_G, m_S * l_M * l_G, J_S + m_S * l_G**2],
        ]
    )
    h = sympy.Matrix([-(m_S + m_M) * g, -c * (sleeve - bird) - m_S * g * l_M, -c * (bird - sleeve) - m_S * g * l_G])
    w = sympy.Matrix(
        [[0, 1, 0, 1, 0, 1], [0, l_M, h_M, r_M, -h_M, r_M], [-h_S, l_G - l_S, 0, 0, 0, 0]]
    )  # beak, lower, upper: normal, tangential
    system = lower(mechanism)
    assert sympy.simplify(M * sympy.Matrix(system.acceleration) - h) == sympy.zeros(3, 1)
    assert sympy.simplify(M * system.W - w) == sympy.zeros(3, 6)
