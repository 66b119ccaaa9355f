"""From what names a model to an FMU that is ready to run."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import prepared
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.unbuilt import UnbuiltFmu
from fmu_models.maps import MAPS
from fmu_models.oscillators import MODELS

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model
    from fmu_models.language.maps import Map


def load(
    model: Model,
    *,
    contacts: Sequence[str] | None = None,
    laws: Mapping[str, str] | None = None,
    fmi_version: str = "3.0",
) -> Fmu:
    """A model, ready to run.

    Args:
        model: what ``fmu_models.oscillators.load`` takes (a name, a file, a module), a declaration, or the .fmu file of
            anybody.
        contacts, laws, fmi_version: as for ``export``; an FMU has them already.

    Raises:
        StickslipError: unknown model, contact or law, no such file, or contacts or laws for an FMU.
    """
    if not (isinstance(model, str | os.PathLike) and Path(model).suffix.lower() == ".fmu"):
        file, complete = prepared(model, contacts=contacts, laws=laws, fmi_version=fmi_version)
        return UnbuiltFmu(file, complete) if complete else Fmu.open(file)
    if contacts is not None or laws:
        raise StickslipError(f"'{model}' is an FMU as it is; contacts are chosen when a model is exported.")
    return Fmu.open(model)


def named_map(name: str, beside: Path | None = None) -> Map | None:
    """The map of a name or a file; None if it is none. beside: folder that relative paths start from."""
    if name in MODELS.members() or (name not in MAPS.members() and not name.partition(":")[0].endswith(".py")):
        return None
    try:
        return MAPS.load(name, beside)
    except StickslipError:
        return None  # a file without one: what it lacks is said of models
