"""Scenes from files: checked against their model once, and kept until file or model change."""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path

from fmu_models.base import shipped
from fmu_models.base.cache import digest
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.files import is_sealed, named_file, seal, write_whole
from fmu_models.base.toml_document import read_document
from fmu_models.codegen.package import kept_by_name, kept_folder
from fmu_models.scene.kinds import KINDS
from fmu_models.scene.scene import Scene

SUFFIX = ".toml"


def read_scene(
    path: str | os.PathLike[str], constants: Mapping[str, float | str] | None = None, *, trust: bool = False
) -> Scene:
    """Read a scene; one of our own models that was read before needs neither its model nor SymPy.

    Args:
        path: of a TOML file, or the name of one that comes along.
        constants: of the scene, or texts with a unit, in place of those in the file; then ``departs`` says which.
        trust: Python files that it names may run.

    Raises:
        StickslipError: no such file, or what is wrong in it, with its line; or it names code that is not trusted;
            a constant that it does not have.
    """
    if constants:
        return _departing(read_scene(path, trust=trust), constants, trust)
    path = find(path)
    try:
        text = path.read_bytes()
    except OSError as error:
        raise StickslipError(f"'{path}' cannot be read ({error.strerror}). Give a scene, a TOML file.") from error
    cached = kept_folder("scene", str(path), digest(text), digest(*_own_sources())) / "scene.json"
    if is_sealed(cached):
        return Scene.from_json(cached.read_text("utf-8"))
    from fmu_models.scene.check import checked_scene

    scene = checked_scene(read_document(path, trust=trust))
    from_logs = any(drive.column for drive in scene.drives.values())  # which may change while the text stays
    if from_logs or not kept_by_name(scene.model, scene.laws) or scene.compute.kind not in KINDS.members():
        return scene
    with write_whole(cached, overwrite=True) as temporary:
        temporary.write_text(scene.to_json(), "utf-8")
    seal(cached)
    return scene


def _departing(scene: Scene, constants: Mapping[str, float | str], trust: bool) -> Scene:
    """A scene with other constants, checked as if its file said so."""
    from fmu_models.scene.check import checked_scene

    document = read_document(Path(scene.path), trust=trust)
    for name, value in constants.items():
        if name in scene.varied:
            raise StickslipError(f"'{name}' is what scene '{scene.name}' varies. Change its values in [compute] there.")
        refuse_unknown(name, scene.constants, f"Scene '{scene.name}' has no constant '{name}'.")
        table = next((key for key in ("free", "drives") if name in document.table(key)), "parameters")
        document.data.setdefault(table, {})[name] = value
    return dataclasses.replace(checked_scene(document), departs={name: scene.constants[name] for name in constants})


def find(path: str | os.PathLike[str]) -> Path:
    """The file of a scene that is given by its path, or by the name of one that comes along. StickslipError: there is
    none."""
    return named_file(path, shipped.scenes(), "scene")


def files() -> list[Path]:
    """The scenes of our own models that come along, by name."""
    return shipped.files(shipped.SCENES, SUFFIX)


def _own_sources() -> list[bytes]:
    return [path.read_bytes() for path in sorted(Path(__file__).parent.rglob("*.py"))]
