"""Command that compares the fitted model with measurements."""

from __future__ import annotations

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite, Settings
from fmu_models.base.files import refuse_existing
from identification.commands.calibrations import compare_calibration
from identification.commands.fits import FigurePath, FitFile, draw_families, print_comparison
from identification.commands.logs import Logs, ReaderOption, Repairs, read_logs, stated
from identification.commands.machines import (
    MachinePlace,
    Window,
    compare_machine,
    refuse,
    refuse_of_machines,
    refuse_of_rigs,
)

SceneOption = Annotated[
    str | None, typer.Option(metavar="SCENE", help="Scene (.toml) whose FMU is run with the fitted values.")
]


@console.trusting
def compare(
    fitted: FitFile,
    logs: Logs,
    settings: Settings = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    scene: SceneOption = None,
    uncertainty: Annotated[
        bool, typer.Option(help="Carry the uncertainty of the fit on to the predicted bifurcation speeds.")
    ] = True,
    machine: MachinePlace = None,
    window: Window = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Compare the fitted model with a family of logs: portraits, stick by disc, and where stick appears or disappears.

    Logs above the bifurcation, where the disc slides steadily, belong to the family.

    A fitted machine is run beside its logs, from the measured state by the measured efforts. A calibrated model is run
    along each log, those held out among them, from start states that are found anew; what is left is tested.

    Example: stickslip compare fit.json data/rigs/paper_rubber --figure family.png

    Example: stickslip compare tanks.json test.csv
    """
    from identification.calibration.result import is_calibration
    from identification.fit.result import read_fit
    from identification.machines.machine_fit import is_machine_fit
    from identification.model_check.families import compare_families

    refuse_existing(figure, overwrite=overwrite)
    if figure:
        from fmu_models.base.figures import check_format

        check_format(figure)
    if is_calibration(fitted):
        given = {"set": settings, "scene": scene, "window": window, "repair": repair, "reader": reader}
        refuse("any model", "a rig or a machine", given)
        compare_calibration(fitted, logs, machine, figure, overwrite, json)
        return
    if is_machine_fit(fitted):
        refuse_of_machines(set=settings, scene=scene)
        compare_machine(fitted, logs, machine, window, (reader, repair), figure, overwrite, json)
        return
    refuse_of_rigs(machine=machine, window=window)
    found = read_fit(fitted)
    chosen = None
    if scene:
        from fmu_models.scene.read import read_scene

        chosen = read_scene(scene)
    with console.progress("comparing") as advance:
        read = read_logs(logs, stated(settings), repair, reader)
        families = compare_families(
            found, read, scene=chosen, uncertainty=uncertainty, progress=lambda share: advance(0.9 * share)
        )
        files = [str(path) for path in draw_families(families, figure, overwrite)] if figure else []
    content = {
        "passed": all(family.passed for family in families),
        "families": [family.to_dict() for family in families],
        "files": files,
    }
    console.say(json, content, lambda out: print_comparison(families, files, out))
