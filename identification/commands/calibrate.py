"""Command that finds parameters of any model from measured series."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Inputs, Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError
from identification.commands.fits import FigurePath, print_files
from identification.commands.logs import stated
from identification.commands.recipes import ResultPath, check_targets, finish

if TYPE_CHECKING:
    from identification.calibration.problem import Sensor


@console.trusting
def calibrate(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="A model or a map by its name, its file my_model.py or .fmu, or a system of FMUs: .toml, .ssd, .ssp.",
        ),
    ],
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
    clips: Annotated[
        list[str] | None, typer.Option("--clip", metavar="NAME=LOW:HIGH", help="Range of a sensor; repeat.")
    ] = None,
    noise: Annotated[
        list[str] | None,
        typer.Option("--noise", metavar="NAME=SD", help="Noise of a measured variable (default: by the residuals)."),
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="NAME=COLUMN", help="Column of a variable or an input; repeat."),
    ] = None,
    inputs: Inputs = None,
    hold: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Inputs that keep their value between samples (default: straight lines)."),
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
    segments: Annotated[int | None, typer.Option(help="Segments of a log (default: by its swings).", min=1)] = None,
    seed: Annotated[int, typer.Option(help="Of the guesses.")] = 0,
    result: ResultPath = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Find parameters of any model, and the start states of its logs, from measured series.

    --set holds parameters and start states, or gives a free one its first value. Logs are parted into segments, guesses
    about the first values are scored, the best are searched from, and the segments are joined. What the logs do not
    tell is said. Ctrl-C keeps the best so far.

    Example: stickslip calibrate tanks.py train.csv --free k1,k2,k3,k4 --held-out test.csv -o tanks.json

    Example: stickslip calibrate bouncing_ball impacts.csv --events table=t_hit --free e,A,phi0 --set e=0.6

    Example: stickslip calibrate pump.fmu a.csv b.csv --free k,c --each k --sensor y:gain,delay --prior "c=2+-0.1"
    """
    check_targets(result, figure, overwrite)
    names = _names(free)
    how: dict[str, Any] = {
        "parameters": console.assignments(settings, "parameter"),
        "bounds": _ranges(bounds, "--bound"),
        "priors": _priors(priors),
        "starts": None if starts is None else _names(starts),
        "noise": console.assignments(noise, "noise"),
        "columns": _columns(columns),
        "inputs": console.settings(inputs, "input", columns=True),
        "hold": _names(hold),
        "events": dict(_pairs(events, "--events", "CONTACT=COLUMN, such as table=t_hit")),
        "each": _names(each),
        "held_out": held_out or [],
        "segments": segments,
        "seed": seed,
    }
    how |= {key: value for key, value in (("guesses", guesses), ("attempts", attempts)) if value is not None}
    sensed = _sensed(sensors)
    with console.warnings_said(), console.output_of_libraries(), console.progress("calibrating") as advance:
        from identification.calibration.calibrate import calibrate as find

        found = find(model, list(logs), free=names, sensors=_sensors(clips), sensed=sensed, progress=advance, **how)
        if figure:
            found.figure(figure, overwrite=overwrite)
    content = finish(found.to_dict(), result, figure, overwrite)

    def show(out: Any) -> None:
        from identification.report.calibration_summary import calibration_report

        out.print(calibration_report(found))
        print_files(content["files"], out)

    console.say(json, content, show)


def _names(text: str | None) -> list[str]:
    return [name.strip() for name in (text or "").split(",") if name.strip()]


def _pairs(given: Sequence[str] | None, option: str, form: str, between: str = "=") -> list[tuple[str, str]]:
    parted = [text.partition(between) for text in given or ()]
    for name, sign, value in parted:
        if not (name.strip() and sign and value.strip()):
            raise StickslipError(f"{option} takes {form}; found '{name}{sign}{value}'.")
    return [(name.strip(), value.strip()) for name, _, value in parted]


def _ranges(given: Sequence[str] | None, option: str) -> dict[str, tuple[float, float]]:
    ranges = {}
    for name, text in _pairs(given, option, "NAME=LOW:HIGH, such as y=0:10"):
        try:
            low, high = (float(end) for end in text.split(":"))
        except ValueError:
            low, high = 0.0, 0.0
        if not low < high:
            raise StickslipError(f"{option} takes NAME=LOW:HIGH with two ascending numbers; found '{name}={text}'.")
        ranges[name] = low, high
    return ranges


def _priors(given: Sequence[str] | None) -> dict[str, tuple[float, float]]:
    said = stated(given)
    for name in said.values:
        if name not in said.deviations:
            raise StickslipError(f"--prior takes a value and its standard deviation, {name}=2+-0.1.")
    return {name: (value, said.deviation(name, value) or 0.0) for name, value in said.values.items()}


def _columns(given: Sequence[str] | None) -> dict[str, str]:
    return dict(_pairs(given, "--column", "NAME=COLUMN, such as y=level"))


def _sensed(given: Sequence[str] | None) -> list[tuple[str, str]]:
    pairs = _pairs(given, "--sensor", "NAME:gain,offset,delay", ":")
    return [(name, key) for name, keys in pairs for key in re.split(r"\s*,\s*", keys)]


def _sensors(clips: Sequence[str] | None) -> dict[str, Sensor]:
    from identification.calibration.problem import Sensor

    return {name: Sensor(clip=ends) for name, ends in _ranges(clips, "--clip").items()}
