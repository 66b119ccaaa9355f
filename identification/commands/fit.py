"""Commands that fit friction laws, compare the fitted model with measurements, and show the whole road once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import refuse_existing, write_whole

if TYPE_CHECKING:
    from rich.console import Console

    from identification.fit.result import FrictionFit
    from identification.measurement.free_decay import FreeDecay
    from identification.measurement.pooling import Pool
    from identification.model_check.families import FamilyComparison
    from rig_io.logs.log import RigLog

app = console.app("Friction: fit laws.")

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOGS...", help="CSV logs, or the folder of a data package with its logs.")
]
Repairs = Annotated[
    str | None,
    typer.Option("--repair", metavar="NAME,...", help="Mend logs: sort (rows by time), duplicates (keep the first)."),
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
    repair: Repairs = None,
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
    from identification.estimators.base import Options
    from identification.inference.choice import Inference

    refuse_existing(result, figure, overwrite=overwrite)
    inference = Inference(covariance, bootstrap, seed, profile)
    with console.progress("fitting") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"), repair)
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
        files, interrupted = _kept(found, ready, result, figure, overwrite)
    content = {**found.to_dict(), "free_decay": decay.to_dict() if decay else None, "files": files}
    console.say(json, content, lambda out: _print_fit(decay, found, files, out))
    if interrupted:
        raise typer.Exit(console.INTERRUPTED)


def _kept(
    found: FrictionFit, ready: Pool, result: Path | None, figure: Path | None, overwrite: bool
) -> tuple[list[str], bool]:
    """Write what is asked for, the numbers first, so that an interrupt leaves what is finished; the files written, and
    whether there was one."""
    files = []
    if result:
        write_text(result, found.to_json(), overwrite)
        files.append(str(result))
    # as the estimators and the bootstrap say it of themselves
    interrupted = any(warning.startswith(("Interrupted", "The bootstrap was stopped")) for warning in found.warnings)
    if figure and not interrupted:
        try:
            draw_friction(found, ready, figure, overwrite)
            files.append(str(figure))
        except KeyboardInterrupt:
            interrupted = True
    return files, interrupted


@app.command()
def demo(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="New folder for everything made.")],
    seed: Annotated[int, typer.Option(help="Of the emulated bench.", min=0)] = 1,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """The whole road once: emulate a rig, fit its friction, compare with it, report, export the fitted model.

    Example: stickslip demo first_look
    """
    from fmu_models.codegen.package import export
    from identification.fit.samples import samples_by_disc
    from identification.fitted_model.model import fmu_parameters
    from identification.model_check.families import compare_families
    from identification.report.page import Findings, write_report
    from rig_io.bench.emulator import emulate_set, standard_set
    from rig_io.packages.datapackage import read_package

    refuse_existing(folder, overwrite=overwrite)
    targets = {
        "logs": folder / "logs",
        "fit": folder / "fit.json",
        "friction": folder / "friction.png",
        "family": folder / "family.png",
        "report": folder / "report.html",
        "fmu": folder / "disc_rig_fitted.fmu",
    }
    with console.progress("demo") as advance:
        emulate_set(targets["logs"], standard_set(), seed, overwrite=overwrite)
        advance(0.3)
        logs = read_package(targets["logs"])
        decay, ready, found = fit_logs(logs)
        write_text(targets["fit"], found.to_json(), overwrite)
        advance(0.5)
        draw_friction(found, ready, targets["friction"], overwrite)
        families = compare_families(found, logs)
        draw_families(families, targets["family"], overwrite)
        advance(0.7)
        findings = Findings(found, logs, families, decay, samples_by_disc(found, ready))
        write_report(findings, targets["report"], overwrite=overwrite)
        advance(0.9)
        values = fmu_parameters(found)
        export("disc_rig", targets["fmu"], contacts=found.contacts, values=values, overwrite=overwrite)
    truth = next(log for log in logs if log.kind != "free-decay").experiment.emulation
    content = {
        "files": {name: str(path) for name, path in targets.items()},
        "fit": found.to_dict(),
        "truth": dict(truth),
        "families": [one.to_dict() for one in families],
    }

    def show(out: Console) -> None:
        _print_fit(decay, found, [], out)
        print_comparison(families, [], out)
        out.print("\nLook at")
        out.print(f"  {targets['friction']}   friction against slip speed, with the fitted law")
        out.print(f"  {targets['family']}     measured and modelled phase portraits, stick, and where it ends")
        out.print(f"  {targets['report']}    all of it on one page, for a browser")
        out.print(f"  {targets['fmu']}  the fitted rig for other tools")
        out.print(f"  {targets['logs']}/datapackage.json  what the logs hold, and the truth behind them")

    console.say(json, content, show)


def read_logs(paths: Sequence[Path], constants: dict[str, float], repair: str | None = None) -> list[RigLog]:
    """Logs from files and folders; ``constants`` of the rig replace those stated with the logs.

    repair: names of `rig_io.logs.log.read_log` between commas. What was mended is said on standard error.

    Raises:
        StickslipError: as in `rig_io.logs.log.read_log`, or an unknown constant.
    """
    import warnings
    from dataclasses import replace

    from rig_io.logs.log import RIG_UNITS, Quantity, RigConstants
    from rig_io.packages.datapackage import read_log, read_package

    for name in constants:
        if name not in RIG_UNITS:
            raise StickslipError(f"The rig has no constant '{name}'.{nearest(name, RIG_UNITS)}")
    given = {name: Quantity(value, RIG_UNITS[name], 0.0) for name, value in constants.items()}
    mend = [name.strip() for name in (repair or "").split(",") if name.strip()]
    logs: list[RigLog] = []
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for path in paths:
            if path.is_dir() or path.suffix == ".json":
                logs += read_package(path, repair=mend)
            elif given and not (path.parent / "datapackage.json").exists():
                logs.append(read_log(path, rig=RigConstants(**given), repair=mend))
            else:
                logs.append(read_log(path, repair=mend))
    for warning in said:
        console.warn(str(warning.message))
    return [replace(log, rig=replace(log.rig, **given)) for log in logs] if given else logs


def fit_logs(
    logs: Sequence[RigLog], *, allow_no_stick: bool = False, **options: Any
) -> tuple[FreeDecay | None, Pool, FrictionFit]:
    """Free decay (if there is one among the logs), what was made ready for the fit, and the fit.

    options: of `identification.fit.fit_friction`.
    """
    from identification.fit.fit import fit_friction
    from identification.measurement.free_decay import fit_free_decay
    from identification.measurement.pooling import pool

    decays = [log for log in logs if log.kind == "free-decay"]
    decay = fit_free_decay(decays[0]) if decays else None
    ready = pool(logs, free_decay=decay, allow_no_stick=allow_no_stick)
    return decay, ready, fit_friction(ready, **options)


def draw_friction(found: FrictionFit, ready: Pool, path: Path, overwrite: bool) -> None:
    """Write the figure of a fit."""
    from fmu_models.report.figures import save_figure
    from identification.fit.samples import samples_by_disc
    from identification.report.friction_figure import friction_figure

    save_figure(friction_figure(found, samples_by_disc(found, ready)), path, overwrite=overwrite)


def draw_families(families: Sequence[FamilyComparison], path: Path, overwrite: bool) -> tuple[Path, ...]:
    """Write a figure for each family; those after the first have the names of their discs added to theirs."""
    from fmu_models.report.figures import save_figure
    from identification.report.family_figure import family_figure

    written = family_paths(path, families)
    for family, target in zip(families, written, strict=True):
        save_figure(family_figure(family), target, overwrite=overwrite)
    return written


def family_paths(path: Path, families: Sequence[FamilyComparison]) -> tuple[Path, ...]:
    """The file of each family's figure."""
    discs = ("-".join(family.members[0].drive_speeds) for family in families)
    return tuple(path.with_stem(f"{path.stem}-{names}") if i else path for i, names in enumerate(discs))


def write_text(path: Path, text: str, overwrite: bool) -> None:
    """Write a text file whole."""
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def _print_fit(decay: FreeDecay | None, found: FrictionFit, files: Sequence[str], out: Console) -> None:
    from identification.report.terminal_tables import decay_table, fit_report

    if decay:
        out.print(decay_table(decay))
    out.print(fit_report(found))
    print_files(files, out)


def print_comparison(families: Sequence[FamilyComparison], files: Sequence[str], out: Console) -> None:
    """Families, and the files written."""
    from identification.model_check.table import comparison_report

    out.print(comparison_report(families))
    print_files(files, out)


def print_files(files: Sequence[str], out: Console) -> None:
    """The files written."""
    for path in files:
        out.print(f"written: {path}")
