"""Command that finds the parameters of a machine from efforts and motion: of one joint by a recipe, of several by a
declaration."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError
from fmu_models.base.registry import is_place
from identification.commands.fits import FigurePath, print_files
from identification.commands.logs import ReaderOption, Repairs, repairs
from identification.commands.machines import Gravity, gravity_of
from identification.commands.recipes import ResultPath, check_targets, finish

CUTOFF = 10.0  # Hz


def inverse(
    recipe: Annotated[
        str,
        typer.Argument(
            metavar="RECIPE|MACHINE",
            help="A TOML file, or a name of 'stickslip data'; or a machine: its declaration, my_robot.py, or a URDF.",
            show_default=False,
        ),
    ],
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="A log of any kind; of a machine several.")],
    gravity: Gravity = None,
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", metavar="LOG", help="Score this log too; repeat for several.")
    ] = None,
    settings: Settings = None,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="NAME=COLUMN", help="Column of a coordinate, effort or time; repeat."),
    ] = None,
    cutoff: Annotated[
        float | None, typer.Option(help="Hz, of the low-pass of a machine's positions (default: 10).", min=0)
    ] = None,
    parallel_cutoff: Annotated[
        float | None, typer.Option(help="Hz, of that over its efforts and columns (default: the same).", min=0)
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(help="instruments (default of a machine) or 'least squares'; of a recipe: as a machine."),
    ] = None,
    laws: Annotated[bool, typer.Option("--laws", help="Compare friction laws, joint by joint of a machine.")] = False,
    repair: Repairs = None,
    reader: ReaderOption = None,
    result: ResultPath = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Fit inertia, friction and other terms to measured effort and motion, judge them, and compare friction laws.

    A machine of any number of joints is declared in Python (my_robot.py, MODEL = Mechanism(...), an input as the effort
    of each joint) or read from a URDF (joints q1, q2, ..., efforts tau1, tau2, ...); --set gives what is known of it.
    With --method the terms of a recipe are identified as such a machine, from its columns without its filters.

    Example: stickslip inverse axis data/machines/axis.csv --figure axis.png
    """
    check_targets(result, figure, overwrite)
    declared = is_machine(recipe)
    if declared or method:
        if declared and repair:
            raise StickslipError("--repair is for recipes: mend the logs of a declared machine before.")
        if not declared:
            _refuse(recipe, settings or columns or gravity)
        chosen = {"cutoff": cutoff or CUTOFF, "parallel_cutoff": parallel_cutoff, "method": method or "instruments"}
        paths = (logs, held_out or ())
        machine = _Machine(recipe, gravity_of(gravity), _named(columns)) if declared else _Machine("", (), {})

        def read() -> tuple[Any, Any, Any]:
            return _declared(machine, paths, reader) if declared else _of_recipe(recipe, paths, reader, repair)

        found, compared = _machine(machine, read, settings, figure, overwrite, laws, **chosen)
        said = {"laws": {joint: one.to_dict() for joint, one in compared.items()}} if laws else {}
        content = finish({**found.to_dict(), **said}, result, figure, overwrite)

        def show(out: Any) -> None:
            from identification.report.machine_fit_tables import joint_laws, machine_report

            out.print(machine_report(found))
            if compared:
                out.print(joint_laws(compared))
            print_files(content["files"], out)

        console.say(json, content, show)
        return
    _refuse(recipe, settings or columns or cutoff or parallel_cutoff or laws or gravity)
    if len(logs) != 1:
        raise StickslipError(f"A recipe is fitted to one log, found {len(logs)}. Score the others: --held-out LOG.")
    _by_recipe(recipe, logs[0], held_out or (), repair, reader, result, figure, overwrite, json)


def is_machine(reference: str) -> bool:
    """Whether what is named is a declaration, in a file or a module, or a URDF rather than a recipe."""
    return reference.endswith(".urdf") or (is_place(reference) and not reference.endswith(".toml"))


def _refuse(recipe: str, given: Any) -> None:
    if given:
        raise StickslipError(
            f"'{recipe}' is a recipe, which says its columns, filters and constants itself: --set, --column, "
            "--gravity and, without --method, --cutoff, --parallel-cutoff and --laws are for declared machines, "
            "my_robot.py."
        )


def _declared(machine: _Machine, paths: tuple[Sequence[Path], Sequence[Path]], reader: ReaderOption) -> Any:
    """A declared machine, logs to fit and logs to score."""
    from identification.machines.read import declared_machine, read_machine_log

    mechanism = declared_machine(machine.declaration, machine.gravity)
    seen, others = (
        [read_machine_log(one, mechanism, machine.columns, reader=reader) for one in part] for part in paths
    )
    return mechanism, seen, others


def _of_recipe(recipe: str, paths: tuple[Sequence[Path], Sequence[Path]], reader: ReaderOption, repair: Repairs) -> Any:
    """The same of the machine that a recipe's terms declare."""
    from identification.machines.axis_log import axis_with_logs
    from identification.measurement.recipe import read_recipe

    seen, others = paths
    mechanism, logs = axis_with_logs(read_recipe(recipe), [*seen, *others], reader=reader, repair=repairs(repair))
    return mechanism, logs[: len(seen)], logs[len(seen) :]


def _machine(
    machine: _Machine,
    read: Callable[[], tuple[Any, Any, Any]],
    settings: list[str] | None,
    figure: Path | None,
    overwrite: bool,
    laws: bool,
    **how: Any,
) -> tuple[Any, dict[str, Any]]:
    """The fit, and laws compared by joint."""
    from identification.fit.machine_laws import compare_joint_laws
    from identification.machines.machine_fit import identify_machine

    with console.warnings_said(), console.progress("fitting") as advance:
        known = console.assignments(settings, "constant")
        mechanism, seen, others = read()
        advance(0.2)
        fit = identify_machine(
            mechanism, seen, known=known, held_out=others, progress=lambda done: advance(0.2 + 0.7 * done), **how
        )
        fit = replace(fit, **vars(machine))
        if figure:
            from fmu_models.report.figures import save_figure
            from identification.machines.predicted import predict_efforts
            from identification.report.machine_fit_figure import machine_fit_figure

            predicted = (predict_efforts(mechanism, fit, part) if part else [] for part in (seen, others))
            save_figure(machine_fit_figure(fit, *predicted), figure, overwrite=overwrite)
        return fit, compare_joint_laws(mechanism, fit, seen) if laws else {}


@dataclass(frozen=True)
class _Machine:
    """What the command line says of a machine: its declaration, gravity (m/s^2; empty: its own), columns of logs."""

    declaration: str
    gravity: tuple[float, ...]
    columns: Mapping[str, str]


def _named(columns: list[str] | None) -> dict[str, str]:
    found = {}
    for text in columns or ():
        name, equals, column = text.partition("=")
        if not equals or not name or not column:
            raise StickslipError(f"--column takes NAME=COLUMN, such as tau1=torque_1; found '{text}'.")
        found[name] = column
    return found


def _by_recipe(
    recipe: str,
    log: Path,
    held_out: Any,
    repair: Repairs,
    reader: ReaderOption,
    result: Path | None,
    figure: Path | None,
    overwrite: bool,
    json: bool,
) -> None:
    from identification.fit.inverse import inverse_dynamics
    from identification.measurement.recipe import read_recipe

    with console.warnings_said(), console.progress("fitting") as advance:
        run = inverse_dynamics(read_recipe(recipe), log, held_out, reader=reader, repair=repairs(repair))
        advance(0.8)
        if figure:
            from fmu_models.report.figures import save_figure
            from identification.report.machine_figures import inverse_figure

            save_figure(inverse_figure(run), figure, overwrite=overwrite)
    content = finish(run.result.to_dict(), result, figure, overwrite)

    def show(out: Any) -> None:
        from identification.report.machine_tables import inverse_report

        out.print(inverse_report(run.result))
        print_files(content["files"], out)

    console.say(json, content, show)
