"""Command that finds the parameters of a machine from efforts and motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.commands.bundles import bundled
from identification.commands.calibrations import columns_of
from identification.commands.logs import ReaderOption, Repairs
from identification.commands.machines import Gravity, gravity_of
from identification.commands.recipes import ResultFiles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fmu_models.language.mechanism import Mechanism
    from identification.machines.machine_fit import MachineFit
    from identification.machines.motion import MachineLog

CUTOFF = 10.0  # Hz


@bundled
def inverse(
    recipe: Annotated[
        str,
        typer.Argument(
            metavar="RECIPE|MACHINE",
            help="A TOML file, or a name of 'stickslip data'; or a machine: its declaration, my_robot.py, or a URDF.",
            show_default=False,
        ),
    ],
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs of any kind, better several.")],
    gravity: Gravity = None,
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", metavar="LOG", help="Score this log too; repeat for several.")
    ] = None,
    settings: console.Settings = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            "--column",
            metavar="NAME=COLUMN",
            help="Column of a coordinate, effort or time, of normal_force or temperature; repeat.",
        ),
    ] = None,
    cutoff: Annotated[
        float | None, typer.Option(help=f"Hz, of the low-pass of a machine's positions (default: {CUTOFF:g}).", min=0)
    ] = None,
    parallel_cutoff: Annotated[
        float | None, typer.Option(help="Hz, of that over its efforts and columns (default: the same).", min=0)
    ] = None,
    still: Annotated[
        float,
        typer.Option(
            help="Share of its usual speed below which samples of a joint are left out, 0.1 say: it may stick there "
            "(default: none).",
            min=0,
            max=1,
            show_default=False,
        ),
    ] = 0.0,
    method: Annotated[
        str | None,
        typer.Option(help="instruments (default) or 'least squares' (default of a recipe with its own filters)."),
    ] = None,
    laws: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="Compare friction laws, joint by joint: 'usual', or names such as Coulomb,Conti,Dahl,LuGre+viscous "
            "(default: none, or those of the recipe).",
            show_default=False,
        ),
    ] = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    *,
    files: ResultFiles,
) -> None:
    """Fit inertia, friction and other terms to measured effort and motion, judge them, and compare friction laws.

    A machine of any number of joints is declared in Python (my_robot.py, MODEL = Mechanism(...), an input as the effort
    of each joint), read from a URDF (joints q1, q2, ..., efforts tau1, tau2, ...), or is one axis by a recipe, which
    names columns and filters; with --method, --cutoff or --still its filters are left out. --set gives what is known.

    Example: stickslip inverse axis data/machines/axis.csv --figure axis.png
    """
    files.check()
    with console.warnings_said(), console.progress("fitting") as advance:
        from identification.machines.identify import METHODS
        from identification.machines.inverse import identify_machine
        from identification.machines.joint_laws import LAWS, check_laws
        from identification.machines.read import is_recipe, machine_at
        from identification.report.machine_tables import machine_report

        names = LAWS if laws == "usual" else console.names_of(laws)
        check_laws(names)
        own = is_recipe(recipe) and not (cutoff or parallel_cutoff or method or still)
        machine = machine_at(recipe, gravity_of(gravity), columns_of(columns))
        seen, others = (
            machine.logs(part, reader=reader, repair=console.names_of(repair)) for part in (logs, held_out or ())
        )
        advance(0.2)
        how: dict[str, Any] = {
            "cutoff": None if own else cutoff or CUTOFF,
            "parallel_cutoff": parallel_cutoff,
            "still": still,
            "method": method or METHODS[own],
            "known": machine.known(None if own else CUTOFF) | console.assignments(settings, "constant"),
        }
        fit = identify_machine(
            machine.mechanism, seen, held_out=others, progress=lambda done: advance(0.2 + 0.7 * done), **how
        )
        fit = replace(
            machine.compared(fit, seen, names),
            declaration=recipe,
            gravity=gravity_of(gravity),
            columns=columns_of(columns),
        )
        files.draw(lambda: _figure(machine.mechanism, fit, others))
    files.say(fit.to_dict(), lambda: machine_report(fit))


def _figure(mechanism: Mechanism, fit: MachineFit, others: Sequence[MachineLog]) -> Figure:
    from identification.machines.predicted import fitted_efforts, predict_efforts
    from identification.report.machine_figures import machine_fit_figure

    held_out = predict_efforts(mechanism, fit, others) if others else []
    return machine_fit_figure(mechanism, fit, fitted_efforts(fit), held_out)
