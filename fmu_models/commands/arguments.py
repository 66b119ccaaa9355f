"""What commands about models take: a model, or a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base.errors import StickslipError

if TYPE_CHECKING:
    from fmu_models.scene.scene import Scene


def no_fmu(model: str) -> str:
    """The model, unless it is an FMU.

    Raises:
        StickslipError: it is one.
    """
    if model.lower().endswith(".fmu"):
        raise StickslipError(
            f"'{model}' is an FMU, where a declared model is needed. What it holds: stickslip inspect {model}"
        )
    return model


NAMED = "its name in 'stickslip models', my_model.py, my_model.py:NAME or package.module:NAME"
Model = Annotated[str, typer.Argument(metavar="MODEL", help=f"A model: {NAMED}.", callback=no_fmu)]
ModelOrScene = Annotated[str, typer.Argument(metavar="MODEL", help=f"A scene (.toml), or a model: {NAMED}.")]


def scene_of(path: str, contacts: str | None) -> Scene:
    """The scene of a path.

    Raises:
        StickslipError: it cannot be read, or contacts are to be chosen beside it.
    """
    from fmu_models.scene.read import read_scene

    if contacts is not None:
        raise StickslipError("A scene says itself which contacts are in use: change 'contacts' there.")
    return read_scene(path)
