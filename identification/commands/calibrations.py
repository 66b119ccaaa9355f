"""What commands of calibrations share: options, and what is done with results: reading, comparing, reporting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from identification.commands.fits import say_report
from identification.commands.recipes import ResultFiles

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from identification.calibration.log import ModelLog
    from identification.calibration.result import Calibration

ModelName = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="A model or a map by its name, its file my_model.py or .fmu, or a system of FMUs: .toml, .ssd, .ssp.",
    ),
]


@dataclass(frozen=True)
class ModelLogs:
    """What is known of a model and of the logs that it is held against."""

    settings: console.Settings = None
    noise: Annotated[
        list[str] | None,
        typer.Option("--noise", metavar="NAME=SD", help="Noise of a measured variable (default: by the residuals)."),
    ] = None
    clips: Annotated[
        list[str] | None, typer.Option("--clip", metavar="NAME=LOW:HIGH", help="Range of a sensor; repeat.")
    ] = None
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="NAME=COLUMN", help="Column of a variable or an input; repeat."),
    ] = None
    inputs: console.Inputs = None
    hold: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Inputs that keep their value between samples (default: straight lines)."),
    ] = None
    segments: Annotated[int | None, typer.Option(help="Segments of a log (default: by its swings).", min=1)] = None

    def arguments(self) -> dict[str, Any]:
        """Arguments of ``calibrate`` and ``track``."""
        from identification.calibration.segments import Sensor

        return {
            "parameters": console.assignments(self.settings, "parameter"),
            "noise": console.assignments(self.noise, "noise"),
            "sensors": {name: Sensor(clip=ends) for name, ends in console.spans(self.clips, "--clip").items()},
            "columns": columns_of(self.columns),
            "inputs": console.settings(self.inputs, "input", columns=True),
            "hold": console.names_of(self.hold),
            "segments": self.segments,
        }


def columns_of(given: Sequence[str] | None) -> dict[str, str]:
    return dict(console.pairs(given, "--column", "NAME=COLUMN, such as y=level"))


def read_calibrated(
    path: Path, declaration: str | None, logs: Sequence[Path]
) -> tuple[Calibration, Fmu, list[ModelLog]]:
    """A calibration, its model, and logs that are read as its own were."""
    from identification.calibration.result import calibrated_fmu, read_calibration

    calibration = read_calibration(path)
    fmu = calibrated_fmu(calibration, declaration)
    if not calibration.reading.roles:
        return calibration, fmu, [calibration.reading.read(log, fmu) for log in logs]
    from identification.hysteresis.again import read_again

    return calibration, fmu, [one for log in logs for one in read_again(calibration, log)]


def compare_calibration(path: Path, logs: Sequence[Path], declaration: str | None, files: ResultFiles) -> None:
    """Run a calibrated model beside logs and tell how far they come apart."""
    from identification.calibration.follow import follow
    from identification.report.calibration_figures import followed_figure
    from identification.report.calibration_summary import followed_report, followed_sentences

    with console.warnings_said(), console.progress("comparing") as advance:
        calibration, fmu, read = read_calibrated(path, declaration, logs)
        followed = []
        for number, log in enumerate(read):
            followed.append(follow(calibration, fmu, log))
            advance(0.9 * (number + 1) / len(read))
        files.draw(lambda: followed_figure(followed))
    content = {
        "model": calibration.model,
        "logs": [one.to_dict() for one in followed],
        "sentences": followed_sentences(calibration, followed),
    }
    files.say(content, lambda: followed_report(calibration, followed))


def report_calibration(
    path: Path,
    logs: Sequence[Path],
    output: Path,
    declaration: str | None,
    interactive: bool,
    overwrite: bool,
    json: bool,
) -> None:
    """Write the page of a calibration."""
    from identification.calibration.result import loops_of
    from identification.report.calibration_page import calibration_findings

    with console.warnings_said(), console.progress("reporting") as advance:
        calibration, fmu, read = read_calibrated(path, declaration, logs)
        findings = calibration_findings(
            calibration, fmu, read, interactive=interactive, progress=lambda done: advance(0.9 * done)
        )
    say_report(replace(findings, loops=loops_of(path)), output, overwrite, json)
