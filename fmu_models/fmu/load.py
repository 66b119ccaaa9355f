"""From what names a model to an FMU that is ready to run."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built, export
from fmu_models.fmu.fmu import Fmu

if TYPE_CHECKING:
    from fmu_models.language.automaton import Automaton
    from fmu_models.language.mechanism import Mechanism


def load(
    model: str | os.PathLike[str] | Mechanism | Automaton,
    *,
    contacts: Sequence[str] | None = None,
    laws: Mapping[str, str] | None = None,
    fmi_version: str = "3.0",
) -> Fmu:
    """A model, ready to run.

    Args:
        model: name of an oscillator of the suite, a declaration of your own, or the .fmu file of anybody.
        contacts, laws, fmi_version: as for ``export``; an FMU has them already.

    Raises:
        StickslipError: unknown model, contact or law, no such file, or contacts or laws for an FMU.
    """
    if not isinstance(model, str | os.PathLike):
        return _declared(model, contacts, laws, fmi_version)
    if Path(model).suffix.lower() != ".fmu":
        return Fmu.open(built(os.fspath(model), contacts=contacts, laws=laws, fmi_version=fmi_version))
    if contacts is not None or laws:
        raise StickslipError(f"'{model}' is an FMU as it is; contacts are chosen when a model is exported.")
    return Fmu.open(model)


def _declared(
    model: Mechanism | Automaton, contacts: Sequence[str] | None, laws: Mapping[str, str] | None, fmi_version: str
) -> Fmu:
    """The FMU of a declaration, in a folder that lives as long as it."""
    folder = tempfile.mkdtemp(prefix="stickslip-own-")
    try:
        path = Path(folder) / f"{model.name}.fmu"
        fmu = Fmu.open(export(model, path, contacts=contacts, laws=laws, fmi_version=fmi_version))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(fmu, shutil.rmtree, folder, ignore_errors=True)
    return fmu
