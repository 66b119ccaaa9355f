"""What a scene leaves out of its model and why, and how much smaller its FMU is than that of its whole model."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from fmu_models.codegen.package import built, variant
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contacts import Contact
from fmu_models.language.quantities import Input, InternalState, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.scene.reduce import built_scene, reduced
from fmu_models.scene.scene import Scene


@dataclass(frozen=True)
class LeftOut:
    """A part of the model that the scene's FMU does not have: what kind of part, its name, and why it is not there."""

    kind: str
    name: str
    why: str


def left_out(scene: Scene) -> tuple[LeftOut, ...]:
    """What a scene leaves out, by kind."""
    declared = whole_model = variant(scene.model, beside=scene.folder)
    law_contacts = [name for name in scene.laws if scene.contacts is None or name in scene.contacts]
    if law_contacts:
        whole_model = variant(declared, laws={name: scene.laws[name] for name in law_contacts}, beside=scene.folder)
    mechanism = variant(declared, scene.contacts, scene.laws, beside=scene.folder)
    system, small = lower(whole_model), reduced(scene)
    contacts = {contact.name for contact in small.contacts}
    gone = [
        contact for contact in whole_model.contacts if scene.contacts is not None and contact.name not in scene.contacts
    ]
    belongs = {s.name: contact.name for contact in gone for s in _symbols(contact) - mechanism.symbols}
    omissions = [
        LeftOut("contact", c.name, "not among the contacts in use") for c in system.contacts if c.name not in contacts
    ]
    states = {state.name for state in small.states}
    omissions += [
        LeftOut("state", z.name, f"belongs to contact {belongs[z.name]}")
        for z in system.internal_states
        if z.name not in states
    ]
    present = {q.name for q in (*small.parameters, *small.inputs)}
    for quantity in (*system.parameters, *system.inputs):
        if quantity.name in present:
            continue
        kind = "parameter" if isinstance(quantity, Parameter) else "input"
        if quantity.name in scene.fixed:
            unit = "" if quantity.unit == "1" else f" {quantity.unit}"
            why = f"constant of the code, {scene.fixed[quantity.name]:g}{unit}"
        else:
            why = f"belongs to contact {belongs.get(quantity.name, 'left out')}"
        omissions.append(LeftOut(kind, quantity.name, why))
    possible = {output.name for output in lower(mechanism).outputs}
    for output in system.outputs:
        symbols: Any = output.expression.free_symbols
        if output.name not in scene.outputs:
            of = sorted({belongs[s.name] for s in symbols if s.name in belongs})
            why = "not asked for" if output.name in possible else f"shows contact {', '.join(of)}"
            omissions.append(LeftOut("output", output.name, why))
    return tuple(omissions)


def _symbols(contact: Contact) -> set[Any]:
    """What belongs to a contact: its parameters, inputs, internal states and what outputs show of it."""
    quantities = {s for s in contact.symbols if isinstance(s, Parameter | Input | InternalState)}
    return quantities | set(contact.shown) | {getattr(contact, "reaction", None)} - {None}


@dataclass(frozen=True)
class Size:
    """How large an FMU is: numbers of its parts, by its XML, and bytes."""

    contacts: int
    indicators: int
    states: int
    parameters: int
    inputs: int
    outputs: int
    bytes: int


def size(fmu: Fmu) -> Size:
    """Count the parts of an FMU."""
    description: Any = fmu.description
    indicators = description.numberOfEventIndicators if fmu.fmi == 2 else len(description.eventIndicators)
    counts = {name: len(getattr(fmu, name)) for name in ("contacts", "states", "parameters", "inputs", "outputs")}
    return Size(indicators=int(indicators), bytes=fmu.path.stat().st_size, **counts)


def whole_model(scene: Scene) -> Fmu:
    """The FMU of the model with all its contacts, parameters and outputs, under the laws of the scene."""
    return Fmu.open(built(scene.model, laws=scene.laws, beside=scene.folder))


def explained(scene: Scene) -> dict[str, Any]:
    """What is left out, and sizes of the scene's FMU and of that of its model."""
    sizes = {"scene": size(Fmu.open(built_scene(scene))), "model": size(whole_model(scene))}
    omissions = [dataclasses.asdict(omission) for omission in left_out(scene)]
    return {"left_out": omissions, "sizes": {name: dataclasses.asdict(one) for name, one in sizes.items()}}
