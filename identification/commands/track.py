"""Command that follows states and slowly changing parameters of any model along a log."""

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.commands.bundles import bundled
from identification.commands.calibrations import ModelLogs, ModelName
from identification.commands.recipes import Log, ResultFiles


@console.trusting
@bundled
def track(
    model: ModelName,
    log: Log,
    drift: Annotated[
        str | None, typer.Option("--drift", metavar="NAMES", help="Parameters that may change, between commas.")
    ] = None,
    states: Annotated[
        str | None, typer.Option("--state", metavar="NAMES", help="States and outputs to follow (default: all states).")
    ] = None,
    *,
    known: ModelLogs,
    files: ResultFiles,
) -> None:
    """Follow states, and parameters that change slowly, along a log, each with its standard deviation.

    A smoother over segments: all samples are used at all times. --set holds parameters, or says where one that drifts
    begins. A parameter whose drift gains less likelihood than chance does is said to stay.

    Example: stickslip track forced_stick_slip run.csv --drift a0 --figure a0.png

    Example: stickslip track pump.fmu run.csv --drift c --state x,flow --json
    """
    files.check()
    with console.warnings_said(), console.output_of_libraries(), console.progress("tracking") as advance:
        from identification.calibration.track import track as follow
        from identification.report.course_summary import course_report

        course = follow(
            model,
            log,
            drift=console.names_of(drift),
            states=None if states is None else console.names_of(states),
            progress=advance,
            **known.arguments(),
        )
        if files.figure:
            course.figure(files.figure, overwrite=files.overwrite)
    files.say(course.to_dict(), lambda: course_report(course))
