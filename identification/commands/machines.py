"""What commands do with declared machines and their fits: options, reading, comparing, reporting."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from identification.commands.fits import say_report
from identification.commands.logs import ReaderOption, Repairs
from identification.commands.recipes import ResultFiles

if TYPE_CHECKING:
    from identification.machines.by_recipe import Machine
    from identification.machines.machine_fit import MachineFit

Gravity = Annotated[
    str | None,
    typer.Option(metavar="X,Y,Z", help="m/s2 in the frame of the base of a URDF, on a wall say (default: 0,0,-9.81)."),
]
MachinePlace = Annotated[
    str | None,
    typer.Option("--machine", metavar="FILE", help="Where the machine of the fit is declared, if it moved since."),
]
Window = Annotated[
    float | None, typer.Option(help="s, of the runs of a machine from its measured state (default: 1).", min=0)
]


def gravity_of(text: str | None) -> tuple[float, ...]:
    """Three numbers, m/s^2; none if nothing was said."""
    if text is None:
        return ()
    gravity = tuple(console.numbers(text, "--gravity"))
    if len(gravity) != 3:
        raise StickslipError(f"--gravity takes three numbers in m/s2, such as 0,-9.81,0; found '{text}'.")
    return gravity


def refuse(one: str, other: str, given: dict[str, Any]) -> None:
    """Refuse options of one kind of fit for another."""
    flags = [f"--{name.replace('_', '-')}" for name, value in given.items() if value]
    if flags:
        raise StickslipError(f"The fit is that of {one}; {', '.join(flags)}: for that of {other}. Leave it out.")


def read_machine(path: Path, declaration: str | None) -> tuple[MachineFit, Machine]:
    """A fit and its machine."""
    from identification.machines.machine_fit import read_machine_fit
    from identification.machines.read import machine_of

    fit = read_machine_fit(path)
    try:
        return fit, machine_of(fit, declaration)
    except StickslipError as error:
        raise StickslipError(f"'{path}': {error}") from error


def compare_machine(
    fitted: Path,
    logs: Sequence[Path],
    declaration: str | None,
    window: float | None,
    how: tuple[ReaderOption, Repairs],
    files: ResultFiles,
) -> None:
    """Run a machine beside logs and tell how far they come apart. how: the logs are read."""
    from identification.machines.scores import FREE_RUN
    from identification.model_check.machine_runs import machine_runs
    from identification.report.machine_figures import machine_runs_figure
    from identification.report.machine_tables import runs_report

    with console.progress("comparing") as advance:
        fit, machine = read_machine(fitted, declaration)
        read = machine.logs(logs, reader=how[0], repair=console.names_of(how[1]))
        runs = machine_runs(
            machine.mechanism, fit, read, window=window or FREE_RUN, progress=lambda done: advance(0.9 * done)
        )
        files.draw(lambda: machine_runs_figure(fit, runs))
    files.say({"machine": fit.machine, "logs": [run.to_dict() for run in runs]}, lambda: runs_report(fit, runs))


def report_machine(
    fitted: Path,
    logs: Sequence[Path],
    output: Path,
    declaration: str | None,
    how: tuple[ReaderOption, Repairs],
    overwrite: bool,
    json: bool,
) -> None:
    """Write the page of a machine. how: its logs are read."""
    from identification.report.machine_page import machine_findings

    with console.progress("reporting") as advance:
        fit, machine = read_machine(fitted, declaration)
        read = machine.logs(logs, reader=how[0], repair=console.names_of(how[1]))
        made = machine_findings(fit, machine.mechanism, read, progress=lambda done: advance(0.9 * done))
    say_report(made, output, overwrite, json)
