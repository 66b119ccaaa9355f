"""Command that finds parameters of any model from measured series."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import check_files, save_figure
from fmu_models.commands.bundles import bundled
from identification.commands.calibrations import ModelLogs, ModelName
from identification.commands.fits import sampled
from identification.commands.logs import stated
from identification.commands.recipes import ResultFiles


@console.trusting
@bundled
def calibrate(
    model: ModelName,
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs with columns named after states, outputs and inputs.")
    ],
    free: Annotated[str, typer.Option("--free", metavar="NAMES", help="Parameters that are sought, between commas.")],
    *,
    known: ModelLogs,
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
    seed: Annotated[int, typer.Option(help="Of the guesses.")] = 0,
    profile: Annotated[bool, typer.Option("--profile", help="Intervals by profile likelihood.")] = False,
    posterior: Annotated[bool, typer.Option("--posterior", help="Sample what the logs leave open (MCMC).")] = False,
    corner: Annotated[
        Path | None, typer.Option("--corner", metavar="FILE", help="Draw the posterior, .png, .svg or .pdf.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes that search.", min=1)] = 1,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Instead: a Dask cluster, tcp://host:8786.")
    ] = None,
    store: Annotated[
        Path | None, typer.Option(metavar="FOLDER.zarr", help="Keep guesses and descents here as they come.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an unfinished store.")] = False,
    files: ResultFiles,
) -> None:
    """Find parameters of any model, and the start states of its logs, from measured series.

    --set holds parameters and start states, or gives a free one its first value. Logs are parted into segments, guesses
    about the first values are scored, the best are searched from, and the segments are joined. What the logs do not
    tell is said. Ctrl-C keeps the best so far, and a --store from which --resume goes on.

    Example: stickslip calibrate tanks.py train.csv --free k1,k2,k3,k4 --held-out test.csv -o tanks.json

    Example: stickslip calibrate bouncing_ball impacts.csv --events table=t_hit --free e,A,phi0 --set e=0.6

    Example: stickslip calibrate pump.fmu a.csv b.csv --free k,c --each k --sensor y:gain,delay --prior "c=2+-0.1"
    """
    files.check()
    check_files(figures=[corner], overwrite=files.overwrite)
    if resume and store is None:
        raise StickslipError("--resume goes on with a store: name it, --store search.zarr.")
    how: dict[str, Any] = {
        "bounds": console.spans(bounds, "--bound"),
        "priors": _priors(priors),
        "starts": None if starts is None else console.names_of(starts),
        "events": dict(console.pairs(events, "--events", "CONTACT=COLUMN, such as table=t_hit")),
        "each": console.names_of(each),
        "held_out": held_out or [],
        "seed": seed,
        "sensed": _sensed(sensors),
        **known.arguments(),
    }
    how |= {key: value for key, value in (("guesses", guesses), ("attempts", attempts)) if value is not None}
    with console.warnings_said(), console.output_of_libraries(), console.progress("calibrating") as advance:
        from fmu_models.families.execution import Execution
        from identification.calibration.calibrate import calibrate as find
        from identification.inference.posterior import load_emcee
        from identification.report.calibration_summary import calibration_report
        from identification.report.posterior_figure import posterior_figure

        if posterior or corner:
            load_emcee()
        how |= {"execution": Execution(workers, scheduler, store, resume, files.overwrite), "progress": advance}
        calibration = find(model, list(logs), free=console.names_of(free), **how)
        if profile and not calibration.interrupted:
            calibration = replace(calibration, intervals=calibration.profiles())
        if posterior or corner:
            calibration = sampled(calibration, lambda: calibration.sample(seed=seed))
        if files.figure:
            calibration.figure(files.figure, overwrite=files.overwrite)
        if corner and calibration.posterior is not None:
            values = {one.name: one.value for one in calibration.all_values}
            drawn = posterior_figure(calibration.posterior, calibration.title, values, list(calibration.values))
            save_figure(drawn, corner, overwrite=files.overwrite)
    figures = [path for path in (files.figure, corner) if path]
    files.say(calibration.to_dict(), lambda: calibration_report(calibration), figures)


def _priors(given: Sequence[str] | None) -> dict[str, tuple[float, float]]:
    said = stated(given)
    for name in said.values:
        if name not in said.deviations:
            raise StickslipError(f"--prior takes a value and its standard deviation, {name}=2+-0.1.")
    return {name: (value, said.deviation(name, value) or 0.0) for name, value in said.values.items()}


def _sensed(given: Sequence[str] | None) -> list[tuple[str, str]]:
    pairs = console.pairs(given, "--sensor", "NAME:gain,offset,delay", ":")
    return [(name, key) for name, keys in pairs for key in re.split(r"\s*,\s*", keys)]
