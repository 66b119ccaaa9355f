"""modelDescription.xml: units, references and structure against what the mechanism says."""

from __future__ import annotations

import dataclasses
import math

import pytest
import sympy
from lxml import etree  # type: ignore[attr-defined]  # compiled, without types

from fmu_models.codegen.model_description import model_description
from fmu_models.codegen.model_structure import ModelStructure, ModelUnknown
from fmu_models.codegen.package import variant
from fmu_models.codegen.rights import Rights
from fmu_models.codegen.variables import base_unit
from fmu_models.language.declaration import Output
from fmu_models.language.friction import Friction
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.lankarani_nikravesh import LankaraniNikravesh
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.language.stops import Stop
from fmu_models.lowering.lower import lower


@pytest.fixture(scope="module")
def rig() -> ModelStructure:
    return ModelStructure(lower(variant("disc_rig")))


@pytest.mark.parametrize(
    ("unit", "base"),
    [
        ("N m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}),
        ("kg m2", {"kg": 1, "m": 2}),
        ("N m s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("rad/s2", {"rad": 1, "s": -2}),
        ("s/m", {"m": -1, "s": 1}),
        ("1", {}),
        ("mm", {"m": 1, "factor": 0.001}),
    ],
)
def test_units_in_base_units(unit: str, base: dict[str, float]) -> None:
    assert base_unit(unit) == base


def test_references_are_consecutive_in_the_order_of_the_engine(rig: ModelStructure) -> None:
    names = [v.name for v in rig.variables.listed]
    assert [v.reference for v in rig.variables.listed] == list(range(1, len(names) + 1))
    order = ["time", "J", "w0", "w1", "w0_rate", "w1_rate", "theta", "omega", "der(theta)", "der(omega)", "F0"]
    order += ["disc0_state", "disc1_state", "disc0_indicator", "disc1_indicator"]
    assert [name for name in names if name in order] == order


def test_dependencies_follow_the_equations(rig: ModelStructure) -> None:
    names = {v.reference: v.name for v in rig.variables.listed}
    unknowns = [*rig.derivative_unknowns, *rig.output_unknowns, *rig.indicator_unknowns]
    depends = {u.variable.name: u.dependencies and {names[r] for r in u.dependencies} for u in unknowns}
    assert depends["der(theta)"] == {"omega"}
    assert depends["slip0"] == {"omega", "w0"}
    # in stick the forces carry the spring, the dashpot and both drives' accelerations
    everything = {"theta", "omega", "w0", "w1", "w0_rate", "w1_rate"}
    assert depends["der(omega)"] == depends["F0"] == depends["alpha"] == everything
    assert "disc0_state" not in depends


def test_how_unknowns_depend_is_said(rig: ModelStructure) -> None:
    names = {v.reference: v.name for v in rig.variables.listed}

    def said(unknowns: list[ModelUnknown]) -> dict[str, dict[str, str] | None]:
        return {
            u.variable.name: None
            if u.dependencies is None
            else dict(zip((names[r] for r in u.dependencies), u.kinds or (), strict=True))
            for u in unknowns
        }

    running = said([*rig.derivative_unknowns, *rig.output_unknowns])
    assert running["der(theta)"] == {"omega": "constant"}
    assert running["slip0"] == {"w0": "tunable", "omega": "tunable"}
    assert running["energy"] == {"theta": "dependent", "omega": "dependent"}
    starting = said(rig.initial_unknowns)
    assert starting["der(theta)"] == {"omega": "constant"}
    assert starting["slip0"] == dict.fromkeys(["r", "R", "w0", "omega"], "dependent")
    assert starting["energy"] == dict.fromkeys(["J", "k", "theta", "omega"], "dependent")
    # whether the body sticks to a disc at the start depends on all that is given
    assert starting["der(omega)"] is starting["F0"] is None


def test_bounces_at_the_start_depend_on_everything() -> None:
    ball = ModelStructure(lower(variant("bouncing_ball")))
    assert {u.dependencies for u in ball.initial_unknowns} == {None}


def test_contact_states_are_outputs_where_they_are_asked_for() -> None:
    """Importers that read every output as a real number cannot open an FMU with integer outputs."""
    system = lower(variant("disc_rig"))
    shown = ModelStructure(dataclasses.replace(system, exposed=frozenset({"disc0_state"})))
    causality = {v.name: v.causality for v in shown.variables.listed}
    assert (causality["disc0_state"], causality["disc1_state"]) == ("output", "local")
    (state,) = (u for u in shown.output_unknowns if u.variable.name == "disc0_state")
    assert state.dependencies is None  # through the events on everything
    assert state in shown.initial_unknowns
    assert not any(v.integer for v in (u.variable for u in ModelStructure(system).output_unknowns))


def test_a_free_mechanism_depends_on_its_states_alone() -> None:
    free = ModelStructure(lower(variant("disc_rig", contacts=[])))
    names = {v.reference: v.name for v in free.variables.listed}
    (alpha,) = (u for u in free.output_unknowns if u.variable.name == "alpha")
    assert {names[r] for r in alpha.dependencies or ()} == {"theta", "omega"}
    assert free.variables.indicators == []


def test_bounds_and_nominal_values(rig: ModelStructure) -> None:
    by_name = {v.name: v for v in rig.variables.listed}
    assert by_name["J"].attributes["min"] == "0.0"
    assert by_name["theta"].attributes["nominal"] == "0.1"
    assert by_name["disc0_state"].attributes["min"] == "-1"
    assert by_name["der(omega)"].unit == "rad/s2"
    assert by_name["der(omega)"].derivative == by_name["omega"].reference


@pytest.mark.parametrize(("place", "force"), [("m", "N"), ("rad", "N m"), ("1", "1")])
def test_what_acts_along_an_angle_is_a_moment(place: str, force: str) -> None:
    """Power over speed: W/(m/s) = N, W/(rad/s) = N m; a scaled model has neither."""
    q = Coordinate("q", place, "place")
    inertia = Parameter("J", 1.0, {"m": "kg", "rad": "kg m2", "1": "1"}[place], "inertia")
    load, one = Parameter("load", 1.0, force, "load"), sympy.S.One
    rubs = Friction(name="rubs", slip=q.v, law=Coulomb(N=load, mu=one))
    law = LankaraniNikravesh(load / Parameter("width", 1.0, place, "width"), 1, sympy.S.Zero)
    contacts = [
        rubs,
        Stop(name="soft", gap=q + Parameter("play", 1.0, place, "play"), law=law, release="gap"),
        Impact(name="hard", gap=-q, restitution=Newton(0), slip=q.v, mu=one),
    ]
    shown = [Output("doubled", 2 * contacts[2].force + rubs.force, force, "forces of one unit")]
    energy = inertia * q.v**2 / 2
    body = Mechanism(
        name="body", title="t", source="s", coordinates=[q], kinetic_energy=energy, contacts=contacts, outputs=shown
    )
    units = {v.name: v.unit for v in ModelStructure(lower(body)).variables.listed}
    forces = ("rubs_force", "soft_force", "hard_force", "hard_friction_force")
    assert {units[name] for name in forces} == {force}
    assert units["soft_memory"] == f"{place}/s"


def test_text_is_escaped() -> None:
    system = dataclasses.replace(lower(variant("block_on_belt")), title='block & "belt" <1>')
    for version in ("2.0", "3.0"):
        text = model_description(ModelStructure(system), "token", version, "tool", Rights())
        assert 'description="block &amp; &#34;belt&#34; &lt;1&gt;"' in text


def test_angles_are_shown_in_degrees_and_drives_in_turns(rig: ModelStructure) -> None:
    by_name = {v.name: v.display_unit for v in rig.variables.listed}
    shown = [by_name[name] for name in ("theta", "omega", "der(omega)", "w0", "J")]
    assert shown == ["deg", "deg/s", "deg/s2", "rpm", None]
    degrees = 180.0 / math.pi
    factors = {
        "rad": {"deg": degrees},
        "rad/s": {"deg/s": degrees, "rpm": 30.0 / math.pi},
        "rad/s2": {"deg/s2": degrees},
    }
    assert {unit: pytest.approx(to) for unit, to in factors.items()} == rig.variables.display_units


def test_the_same_quantity_has_one_reference_where_the_version_allows_it(rig: ModelStructure) -> None:
    """Both are the friction force of a disc: the rig's own output, and that of every contact."""
    references = {
        version: {
            v.get("name"): int(str(v.get("valueReference")))
            for v in etree.fromstring(model_description(rig, "token", version, "tool", Rights()).encode()).iter()
            if v.get("valueReference") and v.get("name")
        }
        for version in ("2.0", "3.0")
    }
    two, three = references["2.0"], references["3.0"]
    assert {name for name in two if two[name] != three[name]} == {"disc0_force", "disc1_force"}
    assert (two["disc0_force"], two["disc1_force"]) == (two["F0"], two["F1"])
    assert len(set(three.values())) == len(three)
