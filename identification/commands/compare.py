"""Command that compares the fitted model with measurements."""

from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.shipped import is_scene
from fmu_models.commands.bundles import Without, bundled
from identification.commands.calibrations import compare_calibration
from identification.commands.fits import ANY_MODEL, MACHINE, RIG, FitFile, draw_families, fitted_kind
from identification.commands.logs import Logs, ReaderOption, Repairs, read_logs, stated
from identification.commands.machines import MachinePlace, Window, compare_machine, refuse
from identification.commands.recipes import ResultFiles

SceneOption = Annotated[
    str | None, typer.Option(metavar="SCENE", help="Scene (.toml) whose FMU is run with the fitted values.")
]


@console.trusting
@bundled
def compare(
    fitted: FitFile,
    logs: Logs,
    settings: console.Settings = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    scene: SceneOption = None,
    uncertainty: Annotated[
        bool, typer.Option(help="Carry the uncertainty of the fit on to the predicted bifurcation speeds.")
    ] = True,
    machine: MachinePlace = None,
    window: Window = None,
    *,
    files: Annotated[ResultFiles, Without("result")],
) -> None:
    """Compare the fitted model with a family of logs: portraits, stick by disc, and where stick appears or disappears.

    Logs above the bifurcation, where the disc slides steadily, belong to the family.

    A scene in place of the fit is held against them with its own values: points of the logs beside its motions.

    A fitted machine is run beside its logs, from the measured state by the measured efforts. A calibrated model is run
    along each log, those held out among them, from start states that are found anew; what is left is tested.

    Example: stickslip compare fit.json data/rigs/paper_rubber --figure family.png

    Example: stickslip compare tanks.json test.csv

    Example: stickslip compare disc_rig_figure_9 bench_9 --figure figure_9.png
    """
    from identification.fit.result import read_fit
    from identification.model_check.families import compare_families
    from identification.model_check.table import comparison_report

    files.check()
    if is_scene(str(fitted)):
        refuse("a scene", "a fit", {"scene": scene, "machine": machine, "window": window})
        _compare_scene(str(fitted), logs, stated(settings), (repair, reader), files)
        return
    kind = fitted_kind(fitted)
    if kind == ANY_MODEL:
        given = {"set": settings, "scene": scene, "window": window, "repair": repair, "reader": reader}
        refuse(ANY_MODEL, "a rig or a machine", given)
        compare_calibration(fitted, logs, machine, files)
        return
    if kind == MACHINE:
        refuse(MACHINE, RIG, {"set": settings, "scene": scene})
        compare_machine(fitted, logs, machine, window, (reader, repair), files)
        return
    refuse(RIG, MACHINE, {"machine": machine, "window": window})
    fit = read_fit(fitted)
    chosen = None
    if scene:
        from fmu_models.scene.read import read_scene

        chosen = read_scene(scene)
    with console.progress("comparing") as advance:
        read = read_logs(logs, stated(settings), repair, reader)
        families = compare_families(
            fit, read, scene=chosen, uncertainty=uncertainty, progress=lambda share: advance(0.9 * share)
        )
        figures = draw_families(families, files.figure, files.overwrite) if files.figure else ()
    content = {
        "passed": all(family.passed for family in families),
        "families": [family.to_dict() for family in families],
    }
    files.say(content, lambda: comparison_report(families), figures)


def _compare_scene(place: str, logs: Logs, settings: Any, how: tuple[Any, Any], files: ResultFiles) -> None:
    """Points of logs beside the motions of a scene."""
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.report.scene_figure import draw_scene
    from fmu_models.scene.compute import compute
    from fmu_models.scene.read import read_scene
    from fmu_models.scene.reduce import built_scene
    from identification.model_check.bench_points import bench_points

    scene = read_scene(place)
    with console.progress("comparing") as advance:
        fmu = Fmu.open(built_scene(scene))
        rows = compute(scene, fmu, advance)
        points = bench_points(scene, rows, read_logs(logs, settings, *how))
    if files.figure:
        beside = [one and (one.angle, one.speed) for one in points]
        draw_scene(scene, fmu, rows, files.figure, beside=beside, overwrite=files.overwrite)
    distances = [{"at": one.at, "log": one.log, "distance": one.distance} for one in points if one]
    columns = (f">{scene.compute.over}, rad/s", "log", ">rms distance, half ranges")
    told = [[f"{one['at']:g}", one["log"], f"{one['distance']:.3g}"] for one in distances]
    files.say({"scene": scene.name, "points": distances}, lambda: console.table(scene.title, columns, told))
