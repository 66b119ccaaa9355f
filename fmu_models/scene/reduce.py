"""The smallest FMU for a scene: the contacts in use, constants folded into the code, the outputs asked for."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, cast

from fmu_models.base.files import write_whole
from fmu_models.codegen.package import PLAIN, Packaging, built_of, checked, kept_as, kept_by_name, variant, write
from fmu_models.fmu.load import named_map
from fmu_models.scene.scene import Drive, Scene

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model
    from fmu_models.language.maps import Map
    from fmu_models.language.mechanism import Mechanism
    from fmu_models.lowering.hybrid_system import HybridSystem


def reduced(scene: Scene) -> HybridSystem:
    """The system of a scene: what its FMU is made from. StickslipError: a free parameter has a value that the model
    cannot have."""
    from fmu_models.language.values import check_values
    from fmu_models.lowering.fold import fold
    from fmu_models.lowering.lower import lower

    system = fold(
        lower(_variant(scene)),
        fixed=scene.fixed,
        values={**scene.free, **{name: drive.values[0] for name, drive in scene.drives.items()}},
        start=scene.start,
        outputs=scene.outputs,
    )
    check_values(system, scene.free)
    return dataclasses.replace(system, name=scene.name, title=scene.title, source=scene.source)


def declared(scene: Scene) -> Model:
    """The declaration of a scene's model where it is a map, else what names it."""
    declared_map = named_map(scene.model, scene.folder) if scene.of_map else None
    return cast("Model", declared_map or scene.model)


def _variant(scene: Scene) -> Mechanism:
    return variant(declared(scene), scene.contacts, scene.laws, beside=scene.folder)


def built_scene(scene: Scene, fmi_version: str = "3.0") -> Path:
    """The FMU of a scene, from the user's cache if it was built before; of our own models without any symbolic work.
    StickslipError: unknown version, or the compiler fails."""
    checked(f"{scene.name}.fmu", fmi_version, overwrite=True)
    if scene.of_map:  # as its runs have it, so that it is built once
        from fmu_models.lowering.iterated import iterated_alone

        return built_of(iterated_alone(cast("Map", declared(scene))), fmi_version)
    if not kept_by_name(scene.model, scene.laws):
        return built_of(reduced(scene), fmi_version)
    return kept_as(scene.name, ("scene", _content(scene), fmi_version), lambda: reduced(scene), fmi_version)


def export_scene(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    packaging: Packaging = PLAIN,
    fmi_version: str = "3.0",
    overwrite: bool = False,
) -> Path:
    """Write the FMU of a scene to ``path``; the rest is as for ``fmu_models.codegen.package.export``. StickslipError:
    as for ``built_scene``, or ``path`` exists or cannot be written."""
    path = checked(path, fmi_version, overwrite)
    if scene.of_map or not packaging.plain:
        return write(reduced(scene), path, packaging=packaging, fmi_version=fmi_version, overwrite=overwrite)
    cached = built_scene(scene, fmi_version)
    with write_whole(path, overwrite=overwrite) as temporary:
        shutil.copyfile(cached, temporary)
    return path


def unfolded(scene: Scene) -> Scene:
    """The scene with the inputs that it holds as drives again: for whoever lets them vary."""
    inputs = {u.name for u in _variant(scene).inputs}
    constant_drives = {name: Drive(times=(0.0,), values=(scene.fixed[name],)) for name in inputs if name in scene.fixed}
    fixed = {name: value for name, value in scene.fixed.items() if name not in constant_drives}
    return dataclasses.replace(scene, fixed=fixed, drives={**scene.drives, **constant_drives})


def _content(scene: Scene) -> str:
    """All that the FMU depends on, as text; when the run ends and what is computed does not matter."""
    drives = {name: drive.values[0] for name, drive in scene.drives.items()}
    content = (
        *(scene.name, scene.title, scene.source, scene.model, scene.contacts, dict(scene.laws)),
        *(dict(scene.fixed), dict(scene.free), drives, dict(scene.start), scene.outputs),
    )
    return json.dumps(content, sort_keys=True)
