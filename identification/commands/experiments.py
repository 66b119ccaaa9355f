"""What `design` asks and does for any calibrated model: experiments to rank, or limits to search within."""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import refuse_existing, write_whole
from identification.commands.calibrations import read_calibrated
from identification.commands.machines import MachinePlace

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.fmu.fmu import Fmu
    from identification.calibration.result import Calibration
    from identification.next_step.experiments import Experiments


@dataclass(frozen=True)
class OfCalibration:
    """Options of a calibration alone."""

    tried: Annotated[
        list[str] | None,
        typer.Option(
            "--try", metavar="NAME=V1,V2,...", help="Of a calibration: values of an input or drive; all combinations."
        ),
    ] = None
    within: Annotated[
        list[str] | None,
        typer.Option("--within", metavar="NAME=LOW:HIGH", help="Instead: limits of such a value; repeat."),
    ] = None
    inputs: Annotated[
        list[str] | None, typer.Option("--input", metavar="NAME=LOW:HIGH", help="Limits of an input over time; repeat.")
    ] = None
    harmonics: Annotated[int | None, typer.Option(help="Of an input over time.", min=1)] = None
    period: Annotated[float | None, typer.Option(help="Of these, s (default: the duration).")] = None
    levels: Annotated[int | None, typer.Option(help="Instead: values that hold one after the other.", min=1)] = None
    seed: Annotated[int | None, typer.Option(help="Of the search within limits.", min=0)] = None
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write inputs over time as CSV.")] = None
    only: Annotated[
        str | None, typer.Option("--for", metavar="NAMES", help="Of a calibration: parameters that count.")
    ] = None
    samples: Annotated[int | None, typer.Option(help="Of the log to come.", min=1)] = None
    machine: MachinePlace = None

    def given(self) -> dict[str, Any]:
        """Values of the options that were given, by name."""
        names = {"tried": "try", "inputs": "input", "only": "for"}
        values = {names.get(one.name, one.name): getattr(self, one.name) for one in fields(self)}
        return {name: value for name, value in values.items() if value is not None}


def design_calibration(path: Path, asked: OfCalibration, duration: float, overwrite: bool, json: bool) -> None:
    """Rank experiments on a calibrated model, or design one."""
    limited = bool(asked.within or asked.inputs)
    if limited == bool(asked.tried):
        raise StickslipError(
            "Say what could be set in the next experiment: values, --try w=10,20,40, or limits, --within w=10:40 or "
            "--input u=-1:1."
        )
    if asked.output and not asked.inputs:
        raise StickslipError("-o writes inputs over time. Say which there are: --input u=-1:1.")
    refuse_existing(asked.output, overwrite=overwrite)
    with console.progress("simulating experiments") as advance:
        calibration, fmu, _ = read_calibrated(path, asked.machine, [])
        more = {"duration": duration, "only": console.names_of(asked.only), "progress": advance}
        more |= {"samples": asked.samples} if asked.samples else {}
        ranking = (_designed if limited else _ranked)(calibration, fmu, asked, more)
    files = []
    if asked.output:
        from identification.next_step.signals import signal_frame

        with write_whole(asked.output, overwrite=overwrite) as temporary:
            signal_frame(next(one for one in ranking.candidates if one.signals), fmu).to_csv(temporary, index=False)
        files.append(str(asked.output))

    def show(out: Console) -> None:
        from identification.report.calibration_summary import experiments_table

        out.print(experiments_table(ranking))
        for one in ranking.candidates:
            if one.refused is not None:
                out.print(console.plain(f"Refused ({one.refused}): {one.words}."))
        for sentence in ranking.sentences:
            out.print(console.plain(f"- {sentence}"))
        console.print_files(files, out)

    console.say(json, {**ranking.to_dict(), "files": files}, show)


def _ranked(calibration: Calibration, fmu: Fmu, asked: OfCalibration, more: dict[str, Any]) -> Experiments:
    from identification.next_step.experiments import rank_experiments

    values = {
        name: console.numbers(text, "--try")
        for name, text in console.pairs(asked.tried, "--try", "NAME=V1,V2, such as w=10,20")
    }
    candidates = [dict(zip(values, combination, strict=True)) for combination in product(*values.values())]
    return rank_experiments(calibration, fmu, candidates, **more)


def _designed(calibration: Calibration, fmu: Fmu, asked: OfCalibration, more: dict[str, Any]) -> Experiments:
    from identification.next_step.signals import SignalShape, design_experiment

    shape = {key: value for key, value in asked.given().items() if key in ("harmonics", "period", "levels")}
    limits = {"inputs": console.spans(asked.inputs, "--input"), "within": console.spans(asked.within, "--within")}
    return design_experiment(calibration, fmu, **limits, shape=SignalShape(**shape), seed=asked.seed or 0, **more)
