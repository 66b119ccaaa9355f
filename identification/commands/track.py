"""Command that follows states and slowly changing parameters of any model along a log."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Inputs, Json, Overwrite, Settings
from identification.commands.calibrations import (
    Clips,
    Columns,
    Hold,
    ModelName,
    Noise,
    Segments,
    columns_of,
    names_of,
    sensors_of,
)
from identification.commands.fits import FigurePath, print_files
from identification.commands.recipes import Log, ResultPath, check_targets, finish


@console.trusting
def track(
    model: ModelName,
    log: Log,
    drift: Annotated[
        str | None, typer.Option("--drift", metavar="NAMES", help="Parameters that may change, between commas.")
    ] = None,
    states: Annotated[
        str | None, typer.Option("--state", metavar="NAMES", help="States and outputs to follow (default: all states).")
    ] = None,
    settings: Settings = None,
    noise: Noise = None,
    clips: Clips = None,
    columns: Columns = None,
    inputs: Inputs = None,
    hold: Hold = None,
    segments: Segments = None,
    result: ResultPath = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Follow states, and parameters that change slowly, along a log, each with its standard deviation.

    A smoother over segments: all samples are used at all times. --set holds parameters, or says where one that drifts
    begins. A parameter whose drift gains less likelihood than chance does is said to stay.

    Example: stickslip track forced_stick_slip run.csv --drift a0 --figure a0.png

    Example: stickslip track pump.fmu run.csv --drift c --state x,flow --json
    """
    check_targets(result, figure, overwrite)
    with console.warnings_said(), console.output_of_libraries(), console.progress("tracking") as advance:
        from identification.calibration.track import track as follow

        course = follow(
            model,
            log,
            drift=names_of(drift),
            states=None if states is None else names_of(states),
            progress=advance,
            parameters=console.assignments(settings, "parameter"),
            noise=console.assignments(noise, "noise"),
            sensors=sensors_of(clips),
            columns=columns_of(columns),
            inputs=console.settings(inputs, "input", columns=True),
            hold=names_of(hold),
            segments=segments,
        )
        if figure:
            course.figure(figure, overwrite=overwrite)
    content = finish(course.to_dict(), result, figure, overwrite)

    def show(out: Any) -> None:
        from identification.report.course_summary import course_report

        out.print(course_report(course))
        print_files(content["files"], out)

    console.say(json, content, show)
