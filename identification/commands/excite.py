"""Command that designs a motion which shows the parameters of a declared machine."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.files import refuse_existing, write_whole
from identification.commands.machines import Gravity, gravity_of

if TYPE_CHECKING:
    from rich.console import Console


def excite(
    machine: Annotated[
        str, typer.Argument(metavar="MACHINE", help="Its declaration, my_robot.py, or a URDF.", show_default=False)
    ],
    limits: Annotated[
        list[str] | None,
        typer.Option("--limit", metavar="NAME=LOW:HIGH", help="Of a coordinate (all), velocity or effort; repeat."),
    ] = None,
    settings: console.Settings = None,
    gravity: Gravity = None,
    period: Annotated[float, typer.Option(help="Of the motion, s.")] = 10.0,
    harmonics: Annotated[int, typer.Option(help="Of the period.", min=1)] = 5,
    rate: Annotated[float, typer.Option(help="Of the samples, Hz.")] = 250.0,
    seed: Annotated[int, typer.Option(help="Of the search.", min=0)] = 0,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the motion as CSV.")] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Design a periodic motion that shows the parameters of a machine best, within limits.

    Example: stickslip excite my_robot.py --limit q1=-1:1 --limit q2=-2:2 --limit w1=-3:3 -o motion.csv
    """
    from identification.machines.excite import excite as designed
    from identification.machines.read import machine_at

    refuse_existing(output, overwrite=overwrite)
    asked = console.spans(limits, "--limit")
    constants = console.assignments(settings, "constant")
    with console.progress("searching") as advance:
        found = designed(
            machine_at(machine, gravity_of(gravity)).mechanism,
            asked,
            known=constants,
            period=period,
            harmonics=harmonics,
            rate=rate,
            seed=seed,
            progress=advance,
        )
    if output:
        with write_whole(output, overwrite=overwrite) as temporary:
            found.frame.to_csv(temporary, index=False)
    files = [str(output)] if output else []

    def show(out: "Console") -> None:
        from identification.report.machine_tables import excitation_table

        out.print(excitation_table(found))
        out.print(
            f"Deviations foretold for {100 * found.noise:g} % noise of the efforts, sampled at {rate:g} Hz; ln det of "
            f"the information {found.gain:+.2f} over the best of random motions."
        )
        console.print_files(files, out)

    console.say(json, {**found.to_dict(), "files": files}, show)
