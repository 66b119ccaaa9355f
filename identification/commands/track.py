"""Command that follows states and slowly changing parameters of any model along a log."""

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
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
    online: Annotated[
        bool, typer.Option("--online", help="A filter: each estimate knows the samples until then alone.")
    ] = False,
    rates: Annotated[
        list[str] | None,
        typer.Option(
            "--rate", metavar="NAME=SD", help="Of a filter: walk of a parameter or state, per root of a second; repeat."
        ),
    ] = None,
    *,
    known: ModelLogs,
    files: ResultFiles,
) -> None:
    """Follow states, and parameters that change slowly, along a log, each with its standard deviation.

    A smoother over segments: all samples are used at all times. --set holds parameters, or says where one that drifts
    begins. A parameter whose drift gains less likelihood than chance does is said to stay. With --online by a filter
    instead, as a log would be followed while it is made.

    Example: stickslip track forced_stick_slip run.csv --drift a0 --figure a0.png

    Example: stickslip track pump.fmu run.csv --drift c --state x,flow --json

    Example: stickslip track pump.fmu run.csv --online --drift c --rate c=0.01 --noise x=0.002
    """
    if rates and not online:
        raise StickslipError("--rate is of a filter, --online; a smoother finds how fast a parameter drifts.")
    files.check()
    with console.warnings_said(), console.output_of_libraries(), console.progress("tracking") as advance:
        from identification.calibration.online import track_online
        from identification.calibration.track import track as smooth
        from identification.report.course_summary import course_report

        walks = {"rates": console.assignments(rates, "rate")} if online else {}
        course = (track_online if online else smooth)(
            model,
            log,
            drift=console.names_of(drift),
            states=None if states is None else console.names_of(states),
            progress=advance,
            **walks,
            **known.arguments(),
        )
        if files.figure:
            course.figure(files.figure, overwrite=files.overwrite)
    files.say(course.to_dict(), lambda: course_report(course))
