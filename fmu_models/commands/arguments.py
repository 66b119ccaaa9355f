"""What commands about models take: a model, or a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import check_format
from fmu_models.base.files import refuse_existing

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

Figure = Annotated[
    Path | None, typer.Option(help="Draw phase portrait and time series of each coordinate (png, svg, pdf).")
]
Plots = Annotated[
    list[str] | None,
    typer.Option(metavar="X,V|X:V", help="Draw these over time (x,v), or one over another (x:v); repeat for more."),
]
Besides = Annotated[
    list[str] | None,
    typer.Option(
        "--beside",
        metavar="LOG|NAME=LOG:COLUMN",
        help="Measurements to set beside the run: columns named like variables, or one for a variable; repeat.",
    ),
]
Within = Annotated[
    float | None,
    typer.Option(
        help="With --beside: exit with 1 if a column's rms deviation is more than this share of its measured span.",
        min=0.0,
    ),
]


def scene_of(path: str, contacts: str | None) -> Scene:
    """The scene of a path.

    Raises:
        StickslipError: it cannot be read, or contacts are to be chosen beside it.
    """
    from fmu_models.scene.read import read_scene

    if contacts is not None:
        raise StickslipError("A scene says itself which contacts are in use: change 'contacts' there.")
    return read_scene(path)


def check_asked(
    output: Path | None,
    figure: Path | None,
    plot: list[str] | None,
    beside: list[str] | None,
    within: float | None,
    overwrite: bool,
) -> None:
    """Refuse before the run what could not be done after it.

    Raises:
        StickslipError: a file that exists, of an unknown kind, or an option without the one that it belongs to.
    """
    from fmu_models.simulation.results import check_suffix

    refuse_existing(output, figure, overwrite=overwrite)
    check_suffix(output)
    if figure:
        check_format(figure)
    if plot and not figure:
        raise StickslipError("--plot says what is drawn; say also where: --figure FILE.png")
    if within is not None and not beside:
        raise StickslipError("--within is a bound on what a run differs by; say also from what: --beside LOG")
