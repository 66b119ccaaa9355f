"""What commands about families of motions take and give: a system at its section, ranges, files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import refuse_existing, write_whole
from fmu_models.commands.arguments import NAMED, is_scene, scene_of
from fmu_models.maps import MAPS

if TYPE_CHECKING:
    import numpy as np
    from rich.console import Console

    from fmu_models.analyses.section_system import SectionSystem
    from fmu_models.base.shown import Pictured
    from fmu_models.fmu.fmu import Fmu

System = Annotated[
    str,
    typer.Argument(metavar="MODEL", help=f"A map, an .fmu file, of others too, a scene (.toml), or a model: {NAMED}."),
]
Start = Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Start value of a state.")]
Forcing = Annotated[
    str | None, typer.Option(metavar="NAME", help="The parameter that is the frequency of the forcing: a strobe.")
]
Period = Annotated[float | None, typer.Option(help="Instead: period of the forcing, s.")]
Every = Annotated[int, typer.Option(help="Periods of the forcing in one step of the strobe.", min=1)]
Autonomous = Annotated[bool, typer.Option("--autonomous", help="Nothing forces the motion; look at it every --period.")]
Level = Annotated[
    str | None, typer.Option(metavar="STATE=VALUE", help="The section is where a state crosses a level, upward.")
]
Down = Annotated[bool, typer.Option("--down", help="With --level: downward.")]
Impacts = Annotated[str | None, typer.Option(metavar="CONTACT", help="The section is where a contact begins.")]
Workers = Annotated[int | None, typer.Option(help="Threads (default: as many as there are cores).", min=1)]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="Write the table as .csv, or the arrays as .nc.")]
Drawn = Annotated[Path | None, typer.Option("--figure", help="Draw it (png, svg, pdf).")]
Ranges = Annotated[list[str], typer.Option("--over", metavar="NAME=FROM:TO:COUNT", help="Values, evenly spaced.")]

SUFFIXES = (".csv", ".nc")


def check_files(output: Path | None, figure: Path | None, overwrite: bool) -> None:
    """Refuse before the work what could not be written after it."""
    refuse_existing(output, figure, overwrite=overwrite)
    if output is not None and output.suffix.lower() not in SUFFIXES:
        raise StickslipError(f"'{output}' must end in one of {', '.join(SUFFIXES)}, by which the format is chosen.")
    if figure is not None:
        from fmu_models.report.figures import check_format

        check_format(figure)


def system_of(
    model: str,
    *,
    settings: Sequence[str] | None = None,
    contacts: str | None = None,
    forcing: str | None = None,
    period: float | None = None,
    every: int = 1,
    autonomous: bool = False,
    level: str | None = None,
    down: bool = False,
    impacts: str | None = None,
) -> SectionSystem:
    """The system that arguments describe.

    Raises:
        StickslipError: arguments that contradict one another, or as the section does.
    """
    from fmu_models.analyses import fmu_sections
    from fmu_models.analyses.iteration import Iteration
    from fmu_models.fmu.load import load

    values = console.assignments(settings, "parameter")
    if not is_scene(model) and model in MAPS.members():
        if forcing or period or level or impacts or contacts:
            raise StickslipError(f"'{model}' is a map: every step of it is the section. Leave the section out.")
        return Iteration.of(MAPS.load(model), values)
    if level and impacts:
        raise StickslipError("The section is a level of a state, or where a contact begins: name one of them.")
    if is_scene(model):
        fmu, values, said = _of_scene(model, contacts, values)
        forcing, period = forcing or (None if period else said[0]), period or (None if forcing else said[1])
        every, autonomous = max(every, said[2]), autonomous or said[3]
    else:
        fmu = load(model, contacts=console.chosen(contacts))
    common: dict[str, Any] = {"forcing": forcing, "period": period, "parameters": values}
    if impacts:
        return fmu_sections.Impacts(fmu, impacts, **common)
    if level:
        ((state, value),) = console.assignments([level], "level").items()
        return fmu_sections.Crossing(fmu, state, value, -1 if down else 1, **common)
    return fmu_sections.Strobe(fmu, every=every, autonomous=autonomous, **common)


def start_of(model: str, start: Sequence[str] | None) -> dict[str, float]:
    """Start values from arguments, and what a scene says beside them."""
    given = console.assignments(start, "start value")
    return {**scene_of(model, None).start, **given} if is_scene(model) else given


def _of_scene(
    path: str, contacts: str | None, values: Mapping[str, float]
) -> tuple[Fmu, dict[str, float], tuple[str | None, float | None, int, bool]]:
    """The FMU of a scene, its values, and what it says of the forcing."""
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.compute import arguments
    from fmu_models.scene.reduce import built_scene

    scene = scene_of(path, contacts)
    how = scene.compute
    given = arguments(scene, None, parameters=values)
    moving = [name for name, value in given["inputs"].items() if not isinstance(value, int | float)]
    if moving:
        raise StickslipError(f"'{moving[0]}' of scene '{scene.name}' moves; a family of motions takes constant drives.")
    fmu = Fmu.open(built_scene(scene))
    forcing = how.forcing if how.forcing in fmu.parameters else None
    period = None if forcing else how.period
    if how.forcing is not None and forcing is None:
        period = (2.0 * math.pi if how.angular else 1.0) / scene.parameters[how.forcing]
    return fmu, {**given["parameters"], **given["inputs"]}, (forcing, period, how.periods, how.autonomous)


def ranges(given: Sequence[str], count: int) -> dict[str, np.ndarray]:
    """Values by name from arguments NAME=FROM:TO:COUNT.

    Raises:
        StickslipError: another number of them than ``count``, or not of that form.
    """
    import numpy as np

    found: dict[str, np.ndarray] = {}
    for text in given:
        name, _, values = text.partition("=")
        parts = values.split(":")
        try:
            low, high, number = float(parts[0]), float(parts[1]), int(parts[2])
            found[name.strip()] = np.linspace(low, high, number)
        except (IndexError, ValueError):
            raise StickslipError(
                f"A range is given as NAME=FROM:TO:COUNT, as omega=0.8:1:200; found '{text}'."
            ) from None
        if number < 1 or len(parts) != 3:
            raise StickslipError(f"A range has three parts, and one value at least; found '{text}'.")
    if len(found) != count:
        raise StickslipError(
            f"{count} range{'s are' if count > 1 else ' is'} needed, found {len(found)}: --over NAME=..."
        )
    return found


def tell(
    found: Pictured, content: dict[str, Any], output: Path | None, figure: Path | None, overwrite: bool, json: bool
) -> None:
    """Write what was found, and say it."""
    if output is not None:
        with write_whole(output, overwrite=overwrite) as temporary:
            if output.suffix.lower() == ".csv":
                found.frame.to_csv(temporary, float_format="%.17g")
            else:
                found.to_xarray().to_netcdf(temporary, engine="scipy")
    if figure is not None:
        found.figure(figure, overwrite=overwrite)
    content["how"] = getattr(found, "how", "")
    content["files"] = [str(path) for path in (output, figure) if path]

    def show(out: Console) -> None:
        out.print(found.summary(), markup=False, highlight=False)
        for row in content.get("failures", [])[:10]:
            out.print(f"failed: {row}", markup=False)
        for path in content["files"]:
            out.print(f"written: {path}")

    console.say(json, content, show)


def finite(value: float) -> float | None:
    """JSON has neither infinity nor nan: null."""
    return value if math.isfinite(value) else None
