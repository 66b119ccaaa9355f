"""What commands about models take and leave: a model, or a scene; files of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.child_process import MEMORY, TIME, Limits
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import check_files, save_figure

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.scene import Scene
    from fmu_models.simulation.beside import Beside
    from fmu_models.simulation.results import Recording


def no_fmu(model: str) -> str:
    """The model, unless it is an FMU. StickslipError: it is one."""
    if model.lower().endswith(".fmu"):
        raise StickslipError(
            f"'{model}' is an FMU, where a declared model is needed. What it holds: stickslip inspect {model}"
        )
    return model


NAMED = "its name in 'stickslip models', my_model.py, my_model.py:NAME or package.module:NAME"
Model = Annotated[str, typer.Argument(metavar="MODEL", help=f"A model: {NAMED}.", callback=no_fmu)]
ModelOrScene = Annotated[str, typer.Argument(metavar="MODEL", help=f"A scene (.toml), or a model: {NAMED}.")]


def scene_of(path: str, contacts: str | None) -> Scene:
    """The scene of a path. StickslipError: it cannot be read, or contacts are to be chosen beside it."""
    from fmu_models.scene.read import read_scene

    if contacts is not None:
        raise StickslipError("A scene says itself which contacts are in use: change 'contacts' there.")
    return read_scene(path)


@dataclass(frozen=True)
class Isolation:
    """A process of its own for a run."""

    isolate: Annotated[bool, typer.Option("--isolate", help="Run in a process of its own.")] = False
    time_limit: Annotated[
        float | None,
        typer.Option(help=f"With --isolate: wall time after which the run is stopped, s (default: {TIME:g})."),
    ] = None
    memory_limit: Annotated[
        float | None,
        typer.Option(help=f"With --isolate: memory that the run may use, MB (Linux; default: {MEMORY:g})."),
    ] = None

    def limits(self) -> Limits | None:
        """Those of the process; None without one. StickslipError: a limit where there is none."""
        if not self.isolate and not (self.time_limit is None and self.memory_limit is None):
            raise StickslipError("A limit of time or memory holds for a process of its own. Add --isolate.")
        if not self.isolate:
            return None
        default, time, memory = Limits.default(), self.time_limit, self.memory_limit
        return Limits(default.time if time is None else time, default.memory if memory is None else memory)


@dataclass(frozen=True)
class RunFiles:
    """What a run leaves, and what it is held against."""

    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write the trajectory as .csv, or with its origin as .h5.")
    ] = None
    figure: Annotated[
        Path | None, typer.Option(help="Draw phase portrait and time series of each coordinate (png, svg, pdf).")
    ] = None
    plot: Annotated[
        list[str] | None,
        typer.Option(metavar="X,V|X:V", help="Draw these over time (x,v), or one over another (x:v); repeat for more."),
    ] = None
    beside: Annotated[
        list[str] | None,
        typer.Option(
            "--beside",
            metavar="LOG|NAME=LOG:COLUMN",
            help="Measurements to set beside the run: columns named like variables, or one for a variable; repeat.",
        ),
    ] = None
    within: Annotated[
        float | None,
        typer.Option(
            help="With --beside: exit with 1 if a column's rms deviation is more than this share of its measured span.",
            min=0.0,
        ),
    ] = None
    overwrite: console.Overwrite = False

    def check(self) -> None:
        """Refuse before the run what could not be done after it. StickslipError: a file that exists, of an unknown
        kind, or an option without the one that it belongs to."""
        from fmu_models.simulation.results import check_suffix

        check_files(self.output, figures=[self.figure], overwrite=self.overwrite)
        check_suffix(self.output)
        if self.plot and not self.figure:
            raise StickslipError("--plot says what is drawn; say also where: --figure FILE.png")
        if self.within is not None and not self.beside:
            raise StickslipError("--within is a bound on what a run differs by; say also from what: --beside LOG")

    def logs(self) -> list[Beside]:
        """The logs beside the run."""
        from fmu_models.simulation.beside import Beside

        return [Beside.read(text) for text in self.beside or ()]

    def write(
        self, recording: Recording, logs: list[Beside], model: Fmu | Mapping[str, Fmu], title: str = ""
    ) -> dict[str, Any]:
        """Write what was asked for; the names of the files, and by how much the run differs from logs."""
        from fmu_models.report import beside_summary
        from fmu_models.simulation.beside import deviations

        trajectory, drawn = recording.trajectory, None
        measured = [deviation for log in logs for deviation in log.match(trajectory)]
        if self.figure:
            from fmu_models.report.trajectory_figure import trajectory_figure

            drawn = trajectory_figure(trajectory, model, self.plot or (), measured, title)
        if self.output:
            recording.write(self.output, overwrite=self.overwrite)
            if trajectory.texts and self.output.suffix.lower() == ".csv":
                console.warn(f"CSV takes numbers; {', '.join(trajectory.texts)} are kept by -o run.h5 alone.")
        if self.figure and drawn:
            save_figure(drawn, self.figure, overwrite=self.overwrite)
        content: dict[str, Any] = {"files": [str(path) for path in (self.output, self.figure) if path]}
        if logs:
            content["beside"] = beside_summary.summary(deviations(trajectory, measured), self.within)
        return content
