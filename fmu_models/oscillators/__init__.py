"""The oscillators of the suite: one file each, named like its model, with the declaration as ``MODEL``."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError, nearest

if TYPE_CHECKING:
    from fmu_models.language.mechanism import Mechanism


def names() -> list[str]:
    """Names of all oscillators."""
    return sorted(path.stem for path in Path(__file__).parent.glob("*.py") if path.stem != "__init__")


def load(name: str) -> Mechanism:
    """The oscillator of that name.

    Raises:
        StickslipError: there is none; names the nearest.
    """
    if name not in names():
        raise StickslipError(f"No oscillator is called '{name}'.{nearest(name, names())}")
    return importlib.import_module(f"{__name__}.{name}").MODEL
