"""Commands that fit friction laws, compare the fitted model with measurements, and show the whole road once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models import console
from fmu_models.console import Json, Overwrite, Settings
from fmu_models.errors import StickslipError, nearest
from fmu_models.files import refuse_existing, write_whole

if TYPE_CHECKING:
    from rich.console import Console

    from identification.free_decay import FreeDecay
    from identification.pooling import Pool
    from identification.portraits import PortraitComparison
    from identification.result import FrictionFit
    from rig_io.log import RigLog

app = console.app("Friction: fit laws, compare with measurements.")

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOGS...", help="CSV logs, or the folder of a data package with its logs.")
]
FigurePath = Annotated[Path | None, typer.Option("--figure", help="Draw the figure (png, svg, pdf).")]


@app.command()
def fit(
    logs: Logs,
    estimator: Annotated[
        str, typer.Option(help="shooting, whole-cycle, lugre, weak-form or savitzky-golay.")
    ] = "shooting",
    law: Annotated[str, typer.Option(help="Friction law.")] = "Conti",
    settings: Settings = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            "--free", metavar="NAME", help="Constant estimated beside the law: J, k/J, c/J, R, r, N, zero; repeat."
        ),
    ] = None,
    covariance: Annotated[str, typer.Option(help="jackknife, hac or bootstrap.")] = "jackknife",
    bootstrap: Annotated[int, typer.Option(help="Draws of --covariance bootstrap.")] = 200,
    seed: Annotated[int, typer.Option(help="Of the bootstrap.")] = 0,
    profile: Annotated[bool, typer.Option("--profile", help="Intervals by profile likelihood.")] = False,
    allow_no_stick: Annotated[bool, typer.Option("--allow-no-stick", help="Take logs that never stick.")] = False,
    result: Annotated[Path | None, typer.Option("--result", "-o", help="Write the fit as JSON.")] = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Fit a friction law to stick-slip logs, all pooled; a free decay among them gives k/J and c/J.

    Example: stickslip fit data/rigs/paper_rubber --result fit.json --figure friction.png
    """
    from identification.conclusion import Options
    from identification.inference import Inference

    refuse_existing(result, figure, overwrite=overwrite)
    inference = Inference(covariance, bootstrap, seed, profile)
    with console.progress("fitting") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"))
        advance(0.1)
        decay, ready, found = fit_logs(
            read,
            estimator=estimator,
            law=law,
            options=Options(tuple(free or ()), lambda count, _: advance(0.1 + 0.1 * count / (count + 10))),
            inference=inference,
            progress=lambda done: advance(0.2 + 0.7 * done),
            allow_no_stick=allow_no_stick,
        )
        advance(0.9)
        if figure:
            _draw_friction(found, ready, figure, overwrite)
    if result:
        _write_text(result, found.to_json(), overwrite)
    files = [str(path) for path in (result, figure) if path]
    content = {**found.to_dict(), "free_decay": decay.to_dict() if decay else None, "files": files}
    console.say(json, content, lambda out: _print_fit(decay, found, files, out))


@app.command()
def compare(
    fitted: Annotated[Path, typer.Argument(metavar="FIT", help="Result of 'stickslip fit --result'.")],
    logs: Logs,
    settings: Settings = None,
    scene: Annotated[
        str | None, typer.Option(metavar="SCENE", help="Scene (.toml) whose FMU is run with the fitted values.")
    ] = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Compare the phase portraits of the fitted model with measured ones, at the measured drive speeds.

    Example: stickslip compare fit.json data/rigs/paper_rubber --figure portraits.png
    """
    from identification.model import compare as compare_model
    from identification.model import scene_simulator
    from identification.result import FrictionFit

    refuse_existing(figure, overwrite=overwrite)
    found = FrictionFit.from_json(read_text(fitted))
    simulate = None
    if scene:
        from fmu_models.scene.read import read_scene

        simulate = scene_simulator(found, read_scene(scene))
    with console.progress("comparing") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"))
        comparisons = compare_model(found, read, simulate=simulate)
        advance(0.7)
        if figure:
            _draw_portraits(comparisons, figure, overwrite)
    content = {
        "passed": all(one.passed for one in comparisons),
        "comparisons": [one.to_dict() for one in comparisons],
        "files": [str(figure)] if figure else [],
    }
    console.say(json, content, lambda out: _print_comparison(comparisons, content["files"], out))


@app.command()
def demo(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="New folder for everything made.")],
    seed: Annotated[int, typer.Option(help="Of the emulated bench.", min=0)] = 1,
    json: Json = False,
) -> None:
    """The whole road once: emulate a rig, fit its friction, compare portraits, export the fitted model.

    Example: stickslip demo first_look
    """
    from fmu_models.codegen.package import export_built
    from identification.model import compare as compare_model
    from identification.model import fmu_parameters
    from rig_io.emulator import emulate_set, standard_set
    from rig_io.log import read_package

    refuse_existing(folder)
    targets = {
        "logs": folder / "logs",
        "fit": folder / "fit.json",
        "friction": folder / "friction.png",
        "portraits": folder / "portraits.png",
        "fmu": folder / "disc_rig_fitted.fmu",
    }
    with console.progress("demo") as advance:
        emulate_set(targets["logs"], standard_set(), seed)
        advance(0.3)
        logs = read_package(targets["logs"])
        decay, ready, found = fit_logs(logs)
        _write_text(targets["fit"], found.to_json(), False)
        advance(0.5)
        _draw_friction(found, ready, targets["friction"], False)
        comparisons = compare_model(found, logs)
        _draw_portraits(comparisons, targets["portraits"], False)
        advance(0.8)
        export_built("disc_rig", targets["fmu"], contacts=(found.contact,), values=fmu_parameters(found))
    truth = next(log for log in logs if log.kind != "free-decay").experiment.emulation
    content = {
        "files": {name: str(path) for name, path in targets.items()},
        "fit": found.to_dict(),
        "truth": dict(truth),
        "comparisons": [one.to_dict() for one in comparisons],
    }

    def show(out: Console) -> None:
        _print_fit(decay, found, [], out)
        _print_comparison(comparisons, [], out)
        out.print("\nLook at")
        out.print(f"  {targets['friction']}   friction against slip speed, with the fitted law")
        out.print(f"  {targets['portraits']}  measured and modelled phase portraits")
        out.print(f"  {targets['fmu']}  the fitted rig for other tools")
        out.print(f"  {targets['logs']}/datapackage.json  what the logs hold, and the truth behind them")

    console.say(json, content, show)


def read_logs(paths: Sequence[Path], constants: dict[str, float]) -> list[RigLog]:
    """Logs from files and folders; ``constants`` of the rig replace those stated with the logs.

    Raises:
        StickslipError: as in `rig_io.log.read_log`, or an unknown constant.
    """
    from dataclasses import replace

    from rig_io.log import RIG_UNITS, Quantity, RigConstants, read_log, read_package

    for name in constants:
        if name not in RIG_UNITS:
            raise StickslipError(f"The rig has no constant '{name}'.{nearest(name, RIG_UNITS)}")
    given = {name: Quantity(value, RIG_UNITS[name], 0.0) for name, value in constants.items()}
    logs: list[RigLog] = []
    for path in paths:
        if path.is_dir() or path.suffix == ".json":
            logs += read_package(path)
        elif given and not (path.parent / "datapackage.json").exists():
            logs.append(read_log(path, rig=RigConstants(**given)))
        else:
            logs.append(read_log(path))
    return [replace(log, rig=replace(log.rig, **given)) for log in logs] if given else logs


def fit_logs(
    logs: Sequence[RigLog], *, allow_no_stick: bool = False, **options: Any
) -> tuple[FreeDecay | None, Pool, FrictionFit]:
    """Free decay (if there is one among the logs), what was made ready for the fit, and the fit.

    options: of `identification.estimators.fit_friction`.
    """
    from identification.estimators import fit_friction
    from identification.free_decay import fit_free_decay
    from identification.pooling import pool

    decays = [log for log in logs if log.kind == "free-decay"]
    decay = fit_free_decay(decays[0]) if decays else None
    ready = pool(logs, free_decay=decay, allow_no_stick=allow_no_stick)
    return decay, ready, fit_friction(ready, **options)


def _draw_friction(found: FrictionFit, ready: Pool, path: Path, overwrite: bool) -> None:
    from fmu_models.report.figures import save_figure
    from identification.inverse_dynamics import friction_samples
    from identification.report import friction_figure

    save_figure(friction_figure(found, friction_samples(ready)), path, overwrite=overwrite)


def _draw_portraits(comparisons: Sequence[PortraitComparison], path: Path, overwrite: bool) -> None:
    from fmu_models.report.figures import save_figure
    from identification.report import portrait_figure

    save_figure(portrait_figure(comparisons), path, overwrite=overwrite)


def _write_text(path: Path, text: str, overwrite: bool) -> None:
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def read_text(path: Path) -> str:
    """A result of `stickslip fit`.

    Raises:
        StickslipError: it cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise StickslipError(
            f"'{path}' cannot be read ({error}). Give a result of 'stickslip fit --result'."
        ) from error


def _print_fit(decay: FreeDecay | None, found: FrictionFit, files: Sequence[str], out: Console) -> None:
    from identification.tables import decay_table, fit_report

    if decay:
        out.print(decay_table(decay))
    out.print(fit_report(found))
    _print_files(files, out)


def _print_comparison(comparisons: Sequence[PortraitComparison], files: Sequence[str], out: Console) -> None:
    from identification.tables import comparison_report

    out.print(comparison_report(comparisons))
    _print_files(files, out)


def _print_files(files: Sequence[str], out: Console) -> None:
    for path in files:
        out.print(f"written: {path}")
