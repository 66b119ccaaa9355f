"""Figures as files, whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".svg", ".png", ".pdf")


def check_format(path: str | os.PathLike[str]) -> Path:
    """The path, if it is one of a figure.

    Raises:
        StickslipError: unknown suffix.
    """
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise StickslipError(f"'{target.name}' has no known format; end it in one of {', '.join(FORMATS)}.")
    return target


def save_figure(figure: Figure, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a figure whole; the format follows the suffix (.svg, .png, .pdf).

    Raises:
        StickslipError: unknown suffix, the file exists, or its folder cannot be written.
    """
    target = check_format(path)
    with write_whole(target, overwrite=overwrite) as temporary:
        figure.savefig(temporary, format=target.suffix.lower()[1:], dpi=150)
    return target
