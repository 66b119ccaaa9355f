"""What commands do with calibrations: their logs, comparing, reporting."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from identification.commands.fits import print_files, say_report

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from identification.calibration.log import ModelLog
    from identification.calibration.result import Calibration


def read_calibrated(
    path: Path, declaration: str | None, logs: Sequence[Path]
) -> tuple[Calibration, Fmu, list[ModelLog]]:
    """A calibration, its model, and logs that are read as its own were."""
    from identification.calibration.result import calibrated_fmu, read_calibration

    calibration = read_calibration(path)
    fmu = calibrated_fmu(calibration, declaration)
    return calibration, fmu, [calibration.reading.read(log, fmu) for log in logs]


def compare_calibration(
    path: Path, logs: Sequence[Path], declaration: str | None, figure: Path | None, overwrite: bool, json: bool
) -> None:
    """Run a calibrated model beside logs and tell how far they come apart."""
    from identification.calibration.follow import follow
    from identification.report.calibration_summary import followed_report, followed_sentences

    with console.warnings_said(), console.progress("comparing") as advance:
        calibration, fmu, read = read_calibrated(path, declaration, logs)
        followed = []
        for number, log in enumerate(read):
            followed.append(follow(calibration, fmu, log))
            advance(0.9 * (number + 1) / len(read))
        if figure:
            from fmu_models.base.figures import save_figure
            from identification.report.calibration_figures import followed_figure

            save_figure(followed_figure(followed), figure, overwrite=overwrite)
    content = {
        "model": calibration.model,
        "logs": [one.to_dict() for one in followed],
        "sentences": followed_sentences(calibration, followed),
        "files": [str(figure)] if figure else [],
    }

    def show(out: Any) -> None:
        out.print(followed_report(calibration, followed))
        print_files(content["files"], out)

    console.say(json, content, show)


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
    from identification.report.calibration_page import calibration_findings

    with console.warnings_said(), console.progress("reporting") as advance:
        calibration, fmu, read = read_calibrated(path, declaration, logs)
        findings = calibration_findings(
            calibration, fmu, read, interactive=interactive, progress=lambda done: advance(0.9 * done)
        )
    say_report(findings, output, overwrite, json)
