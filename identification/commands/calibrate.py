"""Command that finds parameters of any model from measured series."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Inputs, Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError
from identification.commands.calibrations import (
    Clips,
    Columns,
    Hold,
    ModelName,
    Noise,
    Segments,
    columns_of,
    names_of,
    pairs_of,
    ranges_of,
    sensors_of,
)
from identification.commands.fits import FigurePath, print_files
from identification.commands.logs import stated
from identification.commands.recipes import ResultPath, check_targets, finish


@console.trusting
def calibrate(
    model: ModelName,
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs with columns named after states, outputs and inputs.")
    ],
    free: Annotated[str, typer.Option("--free", metavar="NAMES", help="Parameters that are sought, between commas.")],
    settings: Settings = None,
    bounds: Annotated[
        list[str] | None, typer.Option("--bound", metavar="NAME=LOW:HIGH", help="Bounds of the search; repeat.")
    ] = None,
    priors: Annotated[
        list[str] | None,
        typer.Option("--prior", metavar="NAME=VALUE+-SD", help="What is known of a free parameter; repeat."),
    ] = None,
    starts: Annotated[
        str | None,
        typer.Option(
            "--start", metavar="NAMES", help="States whose start is sought (default: all that --set does not hold)."
        ),
    ] = None,
    sensors: Annotated[
        list[str] | None,
        typer.Option(
            "--sensor", metavar="NAME:gain,offset,delay", help="What is sought of the sensor of a variable; repeat."
        ),
    ] = None,
    clips: Clips = None,
    noise: Noise = None,
    columns: Columns = None,
    inputs: Inputs = None,
    hold: Hold = None,
    events: Annotated[
        list[str] | None,
        typer.Option("--events", metavar="CONTACT=COLUMN", help="Times at which a contact began to touch or to slip."),
    ] = None,
    each: Annotated[
        str | None, typer.Option("--each", metavar="NAMES", help="Parameters that differ from log to log.")
    ] = None,
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", metavar="LOG", help="Follow this log too; repeat for several.")
    ] = None,
    guesses: Annotated[int | None, typer.Option(help="Guesses that are scored (default: 24).", min=1)] = None,
    attempts: Annotated[int | None, typer.Option(help="Searches from the best of them (default: 3).", min=1)] = None,
    segments: Segments = None,
    seed: Annotated[int, typer.Option(help="Of the guesses.")] = 0,
    workers: Annotated[int, typer.Option(help="Processes that search.", min=1)] = 1,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Instead: a Dask cluster, tcp://host:8786.")
    ] = None,
    store: Annotated[
        Path | None, typer.Option(metavar="FOLDER.zarr", help="Keep guesses and descents here as they come.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an unfinished store.")] = False,
    result: ResultPath = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Find parameters of any model, and the start states of its logs, from measured series.

    --set holds parameters and start states, or gives a free one its first value. Logs are parted into segments, guesses
    about the first values are scored, the best are searched from, and the segments are joined. What the logs do not
    tell is said. Ctrl-C keeps the best so far, and a --store from which --resume goes on.

    Example: stickslip calibrate tanks.py train.csv --free k1,k2,k3,k4 --held-out test.csv -o tanks.json

    Example: stickslip calibrate bouncing_ball impacts.csv --events table=t_hit --free e,A,phi0 --set e=0.6

    Example: stickslip calibrate pump.fmu a.csv b.csv --free k,c --each k --sensor y:gain,delay --prior "c=2+-0.1"
    """
    check_targets(result, figure, overwrite)
    if resume and store is None:
        raise StickslipError("--resume goes on with a store: name it, --store search.zarr.")
    names = names_of(free)
    how: dict[str, Any] = {
        "parameters": console.assignments(settings, "parameter"),
        "bounds": ranges_of(bounds, "--bound"),
        "priors": _priors(priors),
        "starts": None if starts is None else names_of(starts),
        "noise": console.assignments(noise, "noise"),
        "columns": columns_of(columns),
        "inputs": console.settings(inputs, "input", columns=True),
        "hold": names_of(hold),
        "events": dict(pairs_of(events, "--events", "CONTACT=COLUMN, such as table=t_hit")),
        "each": names_of(each),
        "held_out": held_out or [],
        "segments": segments,
        "seed": seed,
    }
    how |= {key: value for key, value in (("guesses", guesses), ("attempts", attempts)) if value is not None}
    sensed = _sensed(sensors)
    with console.warnings_said(), console.output_of_libraries(), console.progress("calibrating") as advance:
        from fmu_models.families.execution import Execution
        from identification.calibration.calibrate import calibrate as find

        how |= {"execution": Execution(workers, scheduler, store, resume, overwrite), "progress": advance}
        found = find(model, list(logs), free=names, sensors=sensors_of(clips), sensed=sensed, **how)
        if figure:
            found.figure(figure, overwrite=overwrite)
    content = finish(found.to_dict(), result, figure, overwrite)

    def show(out: Any) -> None:
        from identification.report.calibration_summary import calibration_report

        out.print(calibration_report(found))
        print_files(content["files"], out)

    console.say(json, content, show)


def _priors(given: Sequence[str] | None) -> dict[str, tuple[float, float]]:
    said = stated(given)
    for name in said.values:
        if name not in said.deviations:
            raise StickslipError(f"--prior takes a value and its standard deviation, {name}=2+-0.1.")
    return {name: (value, said.deviation(name, value) or 0.0) for name, value in said.values.items()}


def _sensed(given: Sequence[str] | None) -> list[tuple[str, str]]:
    pairs = pairs_of(given, "--sensor", "NAME:gain,offset,delay", ":")
    return [(name, key) for name, keys in pairs for key in re.split(r"\s*,\s*", keys)]
