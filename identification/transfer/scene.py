"""Fitted values in a scene: the numbers change, comments, order and units of the file stay."""

from collections.abc import MutableMapping, Sequence
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import write_whole
from fmu_models.base.registry import moved
from fmu_models.base.toml_document import Document
from fmu_models.scene.check import checked_scene
from fmu_models.scene.read import read_scene
from fmu_models.scene.scene import Scene
from identification.transfer.values import HandedValue

TABLES = ("parameters", "free")


def write_scene(source: Path, target: Path, values: Sequence[HandedValue], *, overwrite: bool = False) -> Path:
    """Write a copy of a scene with these values; a parameter that the scene leaves at its default is added to
    ``[parameters]``. StickslipError: not a scene, a parameter that its model does not have, a unit of something else,
    or ``target`` exists and ``overwrite`` is false, or cannot be written."""
    import tomlkit

    scene = read_scene(source)
    if target.suffix != ".toml":
        raise StickslipError(f"'{target}' must end in .toml, as scenes do.")
    document: Any = tomlkit.parse(source.read_text("utf-8"))
    laws = [(document["laws"], contact, law) for contact, law in scene.laws.items()]
    for table, key, reference in [(document, "model", scene.model), *laws]:
        if (path := moved(reference, scene.folder, target.parent)) != reference:
            table[key] = path
    for value in values:
        if value.target not in scene.parameters:
            raise StickslipError(
                f"Scene '{source}' has no parameter '{value.target}'.{nearest(value.target, scene.parameters)} Name it "
                f"with --name {value.name}=ITS_NAME, or choose what to hand on with --only."
            )
        unit = _unit(scene, value, source)
        if value.in_unit(unit, f"'{source}'") != scene.parameters[value.target]:
            _put(document, value, unit, source)
    with write_whole(target, overwrite=overwrite) as temporary:
        temporary.write_text(tomlkit.dumps(document), "utf-8")
        # what it names relative to itself lies beside the target
        written = checked_scene(Document(target, temporary.read_text("utf-8")))
        for value in values:
            expected = value.in_unit(_unit(scene, value, source), f"'{source}'")
            if abs(written.parameters[value.target] - expected) > 1e-12 * abs(expected):
                raise StickslipError(f"'{source}': '{value.target}' could not be changed. Change it by hand.")
    return target


def _unit(scene: Scene, handed: HandedValue, source: Path) -> str:
    """Unit of the parameter in the scene's model."""
    from fmu_models.codegen.package import variant

    model = variant(scene.model, scene.contacts, scene.laws, beside=scene.folder)
    quantities = {q.name: q for q in (*model.parameters, *model.inputs)}
    if handed.target not in quantities:
        raise StickslipError(f"Scene '{source}' does not use '{handed.target}': its contact is left out there.")
    return quantities[handed.target].unit


def _put(document: MutableMapping[str, Any], handed: HandedValue, unit: str, source: Path) -> None:
    """Change the value where it stands: a number stays a number in the model's unit, a text keeps its unit."""
    where = f"'{source}'"
    value = handed.in_unit(unit, where)
    table = next((document[name] for name in TABLES if handed.target in document.get(name, {})), None)
    if table is None:
        document.setdefault("parameters", {})[handed.target] = value if unit == "1" else f"{value!r} {unit}"
        return
    old = table[handed.target]
    if isinstance(old, str):
        suffix = old.split(maxsplit=1)[1] if len(old.split(maxsplit=1)) > 1 else ""
        table[handed.target] = f"{handed.in_unit(suffix, where)!r} {suffix}" if suffix else repr(value)
    else:
        table[handed.target] = value
