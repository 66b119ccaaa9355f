"""What is to be explored: an FMU of ours, the values that it starts from, and how a command line names it."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from fmu_models.base.shipped import is_scene
from fmu_models.explorer.module import check
from fmu_models.fmu.fmu import Fmu

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model
    from fmu_models.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class ExplorerSubject:
    """The subject of a page.

    Attributes:
        fmu: with all parameters free.
        model: as a command line and a scene name it; empty where only Python has it.
        arguments: of a command line after the model, quoted.
        values: by name of parameter, input, state or memory, in place of its default; in its unit.
        until: s, end of the run; None to choose it by the motion.
        contacts, laws: as in a scene; None, all of the model.
        notes: what the page leaves out of what was asked for.
        ranges: of sliders, by name, in place of those about the value.
    """

    fmu: Fmu
    model: str
    arguments: str
    values: Mapping[str, float]
    until: float | None
    contacts: tuple[str, ...] | None
    laws: Mapping[str, str]
    notes: tuple[str, ...] = ()
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def subject_of(model: Model, contacts: Sequence[str] | None = None, *, trust: bool = False) -> ExplorerSubject:
    """A declaration, the name, file or module of a model, a scene (trust: as in `read_scene`), or an FMU of this suite.
    StickslipError: there is none of that name, contacts are to be chosen of a scene or an FMU, or as ``check``."""
    from fmu_models.fmu.load import load

    if isinstance(model, str | os.PathLike) and is_scene(os.fspath(model)):
        if contacts is not None:
            raise StickslipError("A scene says itself which contacts are in use: change 'contacts' there.")
        from fmu_models.scene.read import read_scene

        return _of_scene(read_scene(os.fspath(model), trust=trust))
    chosen = None if contacts is None else tuple(contacts)
    fmu = load(model, contacts=chosen)
    check(fmu)
    return ExplorerSubject(
        fmu=fmu,
        model=os.fspath(model) if isinstance(model, str | os.PathLike) else "",
        arguments="" if chosen is None else shlex.join(["--contacts", ",".join(chosen) or "none"]),
        values={},
        until=None,
        contacts=chosen,
        laws={},
    )


def _of_scene(scene: Scene) -> ExplorerSubject:
    """Its model with its contacts and laws; what it makes constants can be moved here."""
    from fmu_models.codegen.package import built

    if scene.of_map:
        raise StickslipError(f"Scene '{scene.name}' is of a map, which has no live page. Look for its motions: map.")
    beside = scene.folder / scene.model
    model = str(beside) if Path(scene.model).suffix == ".py" and beside.is_file() else scene.model
    fmu = Fmu.open(built(scene.model, contacts=scene.contacts, laws=scene.laws, beside=scene.folder))
    moving = [name for name, drive in scene.drives.items() if drive.constant is None]
    drives = {name: drive.values[0] for name, drive in scene.drives.items()}
    names = {*fmu.parameters, *fmu.inputs, *fmu.states, *fmu.memories}
    settings = {**scene.fixed, **scene.free, **drives, **scene.start}
    return ExplorerSubject(
        fmu=fmu,
        model=model,
        arguments="" if scene.contacts is None else shlex.join(["--contacts", ",".join(scene.contacts) or "none"]),
        values={name: value for name, value in settings.items() if name in names},
        until=scene.stop_time,
        contacts=scene.contacts,
        laws=scene.laws,
        notes=tuple(f"{name} varies over time in the scene; here it is held at its first value" for name in moving),
    )
